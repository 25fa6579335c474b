//! The page of a recording or a live pipe: measured here, and again when something is changed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::{ASKED_EVERY, Args, open};
use crate::alarm_args::{added, judge};
use crate::commands::analyze::axes_name;
use crate::failure::Failure;
use crate::output::page::{Shown, given_size};
use crate::output::progress::Progress;
use rowtone::link::settings::{Key, Limits, Region, Settings};
use rowtone_clip::{Camera, CameraOptions, Feed, Rect, Roi};
use rowtone_measure::MeasureError;
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings as Wanted};
use rowtone_measure::tracking::Shifts;
use rowtone_page::control::Control;
use rowtone_page::live::{Live, Phase};
use rowtone_report::alarms::Book;
use rowtone_report::json::{self, Place};
use rowtone_report::zone::ZoneLimits;

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
    /// Where the zones of the kind of machine that was named begin.
    zones: Option<ZoneLimits>,
    /// Its alarms, before anything was seen.
    alarms: Option<Book>,
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
        args.alarms.book()?,
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

fn desk(
    args: &Args,
    alarms: Option<Book>,
    camera: Option<&Camera>,
    interrupt: &Arc<AtomicBool>,
) -> Desk {
    let (width, height) = camera.map_or((0, 0), given_size);
    let mut settings = args.window.as_a_board_says(args.camera.um_per_px());
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
        zones: args.machine,
        alarms,
        settings: Mutex::new(settings),
        interrupt: Arc::clone(interrupt),
        again: AtomicBool::new(false),
    }
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
    let mut shown = Shown::new(&mut feed, live);
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
    let mut alarms = desk.alarms.clone();
    let progress = Progress::new(shifts.frames);
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let outcome = analysis.run(|event| {
        shown.hear(&event);
        match event {
            Event::Part(part) => place.roi = [part.x, part.y, part.width, part.height],
            Event::Frame(_) => progress.step(),
            // What is interrupted by other settings is of no more use.
            Event::Report(report, shapes) if !desk.again.load(Ordering::Acquire) => {
                let object = json::measured(report, shapes, place, desk.zones.as_ref());
                let said = judge(&mut alarms, report);
                shown.report(report, added(said.as_ref(), object));
            }
            // The page shows which part was chosen, and warnings with each report.
            Event::Report(..) | Event::Sample(_) | Event::Note(_) => {}
        }
        Ok::<(), MeasureError>(())
    });
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
