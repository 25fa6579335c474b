//! The page of a recording or a live pipe: measured here, and again when something is changed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::{ASKED_EVERY, Args, open};
use crate::commands::analyze::axes_name;
use crate::failure::Failure;
use crate::output::progress::Progress;
use rowtone::camera::RawFormat;
use rowtone::link::settings::{Key, Limits, Region, Settings};
use rowtone_clip::{Camera, CameraOptions, Feed, Frame, Rect, Roi};
use rowtone_measure::MeasureError;
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings as Wanted};
use rowtone_measure::tracking::Shifts;
use rowtone_page::control::Control;
use rowtone_page::frames::Layout;
use rowtone_page::live::{About, Live, Phase};
use rowtone_page::motion::MotionWriter;
use rowtone_report::json::{self, Place};

/// Narrowest part that can be measured, px, and the longest window, s.
const MIN_WIDTH: u16 = 16;
const LONGEST_WINDOW_S: f32 = 3600.0;
/// What can be changed of a recording.
const KEYS: [Key; 7] = [
    Key::Roi,
    Key::UmPerPx,
    Key::Window,
    Key::Hop,
    Key::MaxPeaks,
    Key::MinHz,
    Key::MaxHz,
];

/// The settings of the page, and the wish to measure again.
struct Desk {
    options: CameraOptions,
    limits: Limits,
    settings: Mutex<Settings>,
    /// Ends what is measured now.
    interrupt: Arc<AtomicBool>,
    /// It is to be measured again.
    again: AtomicBool,
}

impl Desk {
    fn lock(&self) -> std::sync::MutexGuard<'_, Settings> {
        self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The options with these settings in place of what was given.
    fn options(&self, settings: &Settings) -> CameraOptions {
        let mut options = self.options.clone();
        if let Some(Region {
            x,
            y,
            width,
            height,
        }) = settings.roi
        {
            options.roi = Roi::Part(Rect {
                x: x.into(),
                y: y.into(),
                width: width.into(),
                height: height.into(),
            });
        } else if matches!(options.roi, Roi::Part(_)) {
            options.roi = Roi::Auto;
        }
        options.um_per_px = settings.um_per_px.map(f64::from);
        options
    }
}

/// What the analysis is told.
fn wanted(settings: &Settings) -> Wanted {
    // As it was written: 0.1 is not 0.10000000149.
    let exact = |value: f32| value.to_string().parse::<f64>().unwrap_or(value.into());
    Wanted {
        window_s: exact(settings.window_s),
        hop_s: exact(settings.hop_s),
        max_peaks: settings.max_peaks.into(),
        min_hz: settings.min_hz.map(exact),
        max_hz: settings.max_hz.map(exact),
        um_per_px: settings.um_per_px.map(exact),
    }
}

impl Control for Desk {
    fn settings(&self) -> Settings {
        *self.lock()
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn keys(&self) -> &[Key] {
        // What has gone through a pipe is gone.
        if self.options.is_pipe() { &[] } else { &KEYS }
    }

    fn is_live(&self) -> bool {
        self.options.is_pipe()
    }

    /// Tries the settings on the recording before they are taken.
    fn change(&self, settings: Settings) -> Result<(), String> {
        let feed = Feed::open(&self.options(&settings)).map_err(|e| e.to_string())?;
        let plan = Plan::new(&feed.camera, &wanted(&settings)).map_err(|e| e.to_string())?;
        Shifts::start(feed, Some(plan.groups())).map_err(|e| e.to_string())?;
        *self.lock() = settings;
        self.again.store(true, Ordering::Release);
        self.interrupt.store(true, Ordering::Release);
        Ok(())
    }
}

/// Measures the recording, and serves what came of it until asked to end.
pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let stop = crate::stop::on_signals();
    let interrupt = Arc::new(AtomicBool::new(false));
    crate::stop::also_in(&interrupt);
    let live = Arc::new(Live::default());
    let mut feed = Some(Feed::open(&args.camera.options())?);
    let desk = Arc::new(desk(
        args,
        feed.as_ref().map(|feed| &feed.camera),
        &interrupt,
    ));
    let server = open(args, &live, Arc::clone(&desk) as Arc<dyn Control>)?;
    let mut first = true;
    while !stop.load(Ordering::Relaxed) {
        let outcome = measure(&desk, &live, feed.take());
        let measured = live.reports.last().is_some();
        match outcome {
            // Whoever started it for nothing is to know.
            Err(failure) if first && !measured => return Err(failure),
            Err(failure) => live.set_phase(Phase::Failed, &failure.to_string()),
            Ok(()) if desk.again.load(Ordering::Acquire) => {}
            Ok(()) => live.set_phase(Phase::Ended, ""),
        }
        first = false;
        while !desk.again.load(Ordering::Acquire) && !stop.load(Ordering::Relaxed) {
            std::thread::sleep(ASKED_EVERY);
        }
        interrupt.store(stop.load(Ordering::Relaxed), Ordering::Release);
        if desk.again.swap(false, Ordering::AcqRel) {
            live.restart();
        }
    }
    live.reports.close();
    drop(server);
    Ok(())
}

fn desk(args: &Args, camera: Option<&Camera>, interrupt: &Arc<AtomicBool>) -> Desk {
    let (width, height) = camera.map_or((0, 0), given_size);
    let mut settings = args.window.as_a_board_says(args.camera.um_per_px);
    if let Roi::Part(Rect {
        x,
        y,
        width,
        height,
    }) = args.camera.roi
    {
        // Sizes beyond u16 were refused with the header.
        settings.roi = Some(Region {
            x: x as u16,
            y: y as u16,
            width: width as u16,
            height: height as u16,
        });
    }
    Desk {
        options: args.camera.options(),
        limits: Limits {
            width: width as u16,
            height: height as u16,
            min_width: MIN_WIDTH,
            max_window_s: LONGEST_WINDOW_S,
        },
        settings: Mutex::new(settings),
        interrupt: Arc::clone(interrupt),
        again: AtomicBool::new(false),
    }
}

/// Columns and rows of the picture as it was given, before it is turned.
fn given_size(camera: &Camera) -> (usize, usize) {
    camera.turn.back().size(camera.size.0, camera.size.1)
}

/// Measures it once, from its first frame to its last or until it is interrupted. `feed`: where it is open already.
fn measure(desk: &Desk, live: &Arc<Live>, feed: Option<Feed>) -> Result<(), Failure> {
    let settings = *desk.lock();
    let mut feed = match feed {
        Some(feed) => feed,
        None => Feed::open(&desk.options(&settings))?,
    };
    feed.stop_when(Arc::clone(&desk.interrupt));
    let camera = feed.camera.clone();
    let (width, height) = given_size(&camera);
    live.describe(About {
        name: feed.name.clone(),
        picture: Some([width, height]),
        part: None,
        line_time_us: Some(camera.timing.line_time_ps() as f64 * 1e-6),
        exposure_us: Some(f64::from(camera.timing.exposure_ns()) * 1e-3).filter(|&us| us > 0.0),
        fps: Some(camera.fps),
    });
    let show = pictures(live, width, height, camera.bits);
    feed.show_to(show);
    let plan = Plan::new(&camera, &wanted(&settings))?;
    let shifts = Shifts::start(feed, Some(plan.groups()))?;
    let given = camera
        .turn
        .back()
        .part(shifts.part, camera.size.0, camera.size.1);
    let mut place = Place {
        roi: [given.x, given.y, given.width, given.height],
        axes: axes_name(shifts.axes),
    };
    let progress = Progress::new(shifts.frames);
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let mut motion = MotionWriter::default();
    live.set_phase(Phase::Measuring, "");
    let outcome = analysis.run(|event| {
        match event {
            Event::Part(part) => {
                place.roi = [part.x, part.y, part.width, part.height];
                live.set_part(place.roi);
            }
            Event::Frame(_) => {
                progress.step();
                motion.hand_over(&live.motion);
            }
            // The page shows which part was chosen, and warnings with each report.
            Event::Note(_) => {}
            Event::Sample(sample) => motion.sample(sample),
            // What is interrupted by other settings is of no more use.
            Event::Report(..) if desk.again.load(Ordering::Acquire) => {}
            Event::Report(report, shapes) => {
                let json = json::measured(report, shapes, place, None);
                live.report(report, json);
            }
        }
        Ok::<(), MeasureError>(())
    });
    motion.hand_over(&live.motion);
    drop(progress);
    outcome?;
    if live.reports.last().is_none() && !desk.again.load(Ordering::Acquire) {
        return Err(analysis.nothing_measured().into());
    }
    if let Some(warning) = analysis.warning() {
        eprintln!("rowtone: {warning}");
    }
    Ok(())
}

/// Hands every frame to the page.
fn pictures(
    live: &Arc<Live>,
    width: usize,
    height: usize,
    bits: u8,
) -> impl FnMut(&Frame) + Send + use<> {
    let live = Arc::clone(live);
    let format = match bits {
        ..=8 => RawFormat::Raw8,
        10 => RawFormat::Raw10,
        12 => RawFormat::Raw12,
        _ => RawFormat::Raw16,
    };
    let layout = Layout {
        width: width as u16,
        height: height as u16,
        stride: format.bytes(width),
        format,
        bayer: false,
    };
    // Words of other depths are brought to the upper end of theirs.
    let shift = if format == RawFormat::Raw16 {
        16 - bits.min(16)
    } else {
        0
    };
    let mut shifted = Vec::new();
    move |frame| {
        let mut bytes = frame.given();
        if shift > 0 {
            shifted.clear();
            let words = bytes.as_chunks::<2>().0.iter().take(width * height);
            shifted
                .extend(words.flat_map(|&word| (u16::from_le_bytes(word) << shift).to_le_bytes()));
            bytes = &shifted;
        }
        live.frames
            .keep(frame.number, frame.start_ns, layout, bytes);
    }
}
