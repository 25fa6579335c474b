//! `rowtone analyze`: the tones of a recording, window by window.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::ValueEnum;
use rowtone::report::{PeakShape, Report, Warnings};
use rowtone::tracker::Axes;
use rowtone::wire::{Message, text as wire_text};

use super::window::WindowArgs;
use crate::alarm_args::{self, AlarmArgs};
use crate::camera_args::CameraArgs;
use crate::failure::Failure;
use crate::output::Out;
use crate::output::first_frame::FirstFrame;
use crate::output::page::StillPage;
use crate::output::progress::Progress;
use crate::output::spectrum_csv::SpectrumFile;
use crate::reference::{Against, Reference};
use rowtone_clip::{Feed, Rect, Turn};
use rowtone_measure::analysis::{Analysis, Event, Plan};
use rowtone_measure::tracking::Shifts;
use rowtone_plot::Picture;
use rowtone_report::alarms::Book;
use rowtone_report::json::{self, Place};
use rowtone_report::summary::Summary;
use rowtone_report::text;
use rowtone_report::zone::ZoneLimits;
use rowtone_serial::port::PortName;
use rowtone_serial::sender::Sender;

/// Options of `rowtone analyze`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    rowtone analyze clip.mp4 --line-time-us 18.9 --exposure-us 500\n  \
    rowtone analyze clip.mov --fps 240 --line-time-us 7.6 --format json\n\n\
    Videos other than Y4M are read through ffmpeg (sudo apt install ffmpeg).")]
pub struct Args {
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    window: WindowArgs,
    #[command(flatten)]
    alarms: AlarmArgs,
    /// Where the zones B, C and D of ISO 20816 begin for this machine, mm/s RMS: adds its zone
    #[arg(long, value_name = "B,C,D", requires = "scale")]
    zone_limits: Option<ZoneLimits>,
    /// Kind of machine whose zones those are, as `iso20816-3:group2:flexible`
    #[arg(long, value_name = "NAME", requires = "scale", conflicts_with = "zone_limits",
          value_parser = ZoneLimits::of_machine)]
    machine: Option<ZoneLimits>,
    /// Another part of the picture: adds each tone's phase and amplitude against it. The recording is read twice
    #[arg(long, value_name = "X,Y,W,H")]
    reference: Option<Rect>,
    /// Format of the reports on standard output
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// Closes with the whole recording: the tones that persist over its windows first, how often and how steady
    #[arg(long)]
    summary: bool,
    /// Also sends every report to a serial port, as a board would
    #[arg(long, value_name = "PORT[:BAUD]")]
    serial: Option<PortName>,
    /// Also draws spectrum, displacement and spectrogram
    #[arg(long, value_name = "FILE.svg|.png")]
    plot: Option<PathBuf>,
    /// Also writes the spectrum of the whole recording and its noise floor
    #[arg(long, value_name = "FILE.csv")]
    spectrum: Option<PathBuf>,
    /// Also writes the page of `rowtone serve` as one still file to hand on
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// Formats of the reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
    Wire,
}

/// Measures the recording and says what vibrates.
///
/// # Errors
/// [`Failure`] as every command; reports of what was measured before come out all the same.
pub fn run(args: &Args) -> Result<(), Failure> {
    args.window.check()?;
    let alarms = args.alarms.book()?;
    // What cannot be written is said before anything is measured.
    if let Some(path) = &args.plot {
        rowtone_plot::check_ending(path)?;
        Failure::unless_writable(path)?;
    }
    args.report.as_deref().map_or(Ok(()), StillPage::check)?;
    args.spectrum
        .as_deref()
        .map_or(Ok(()), SpectrumFile::check)?;
    if args.summary && args.format == Format::Wire {
        let why =
            "--summary: a wire has no sentence for a whole recording: use --format text or json";
        return Err(Failure::usage(why));
    }
    let options = args.camera.options();
    let session = session();
    let scale = args.camera.um_per_px();
    let reference = args.reference.map(|part| {
        let settings = args.window.settings(scale);
        Reference::measure(&options, part, &settings)
    });
    let reference = reference.transpose()?;
    let serial = args.serial.as_ref().map(|port| {
        // What comes through a pipe may be live, and does not wait.
        let may_wait = !options.is_pipe();
        Sender::open(
            port,
            session,
            &args.window.as_a_board_says(args.camera.um_per_px()),
            may_wait,
        )
    });
    let serial = serial.transpose()?;
    let mut feed = Feed::open(&options)?;
    feed.stop_when(crate::stop::on_signals());
    let settings = args.window.as_a_board_says(args.camera.um_per_px());
    let report = args.report.clone();
    let page = report.map(|path| StillPage::new(path, &mut feed, settings));
    let first_frame = args.plot.is_some().then(|| FirstFrame::of(&mut feed));
    let plan = Plan::new(&feed.camera, &args.window.settings(args.camera.um_per_px()))?;
    let shifts = Shifts::start(feed, Some(plan.groups()))?;
    let picture = args.plot.clone().map(|path| {
        Picture::new(rowtone_plot::Settings {
            path,
            title: title(&shifts),
            band_hz: (args.window.min_hz.unwrap_or(0.0), plan.max_hz()),
            exposure_s: f64::from(shifts.camera.timing.exposure_ns()) * 1e-9,
            one_a_frame: args.camera.global_shutter,
        })
    });
    let spectrum = args.spectrum.clone();
    let spectrum = spectrum.map(|path| SpectrumFile::new(path, &plan, shifts.axes, scale));
    let part = shifts.part;
    let (width, height) = shifts.camera.size;
    let given = shifts.camera.turn.back().part(part, width, height);
    let mut outlets = Outlets {
        place: Place {
            roi: [given.x, given.y, given.width, given.height],
            axes: axes_name(shifts.axes),
        },
        format: args.format,
        name: shifts.name.clone(),
        zone_limits: args.zone_limits.or(args.machine),
        alarms,
        reference,
        warnings: shifts.camera.warnings,
        progress: Progress::new(shifts.frames),
        out: Out::default(),
        serial,
        picture,
        first_frame,
        turn: shifts.camera.turn,
        given: shifts.camera.turn.back().size(width, height),
        spectrum,
        page,
        session,
        reports: 0,
        summary: args.summary.then(Summary::default),
    };
    if let Some(gap) = args.window.gap() {
        outlets.progress.note(&gap);
    }
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let outcome = analysis.run(|event| outlets.hear(event));
    if outcome == Err(Failure::OutputClosed) {
        return outcome;
    }
    if let Some(warning) = analysis.warning() {
        outlets.progress.note(warning);
    }
    let nothing = outlets.reports == 0;
    let closed = outlets.close();
    outcome.and(closed)?;
    if nothing {
        return Err(analysis.nothing_measured().into());
    }
    Ok(())
}

/// What the reports call the axes.
pub(super) fn axes_name(axes: Axes) -> &'static str {
    match axes {
        Axes::X => "x",
        Axes::Xy => "xy",
    }
}

fn title(shifts: &Shifts) -> String {
    let (part, fps) = (shifts.part, shifts.camera.fps);
    let (width, height) = (part.width, part.height);
    format!("{}: {width} x {height} px at {fps:.2} fps", shifts.name)
}

/// A number that differs from run to run, so that a receiver knows a new run from lost reports.
fn session() -> u32 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_secs() as u32)
}

/// Where reports go.
struct Outlets {
    place: Place,
    format: Format,
    /// What the recording is called in messages.
    name: String,
    zone_limits: Option<ZoneLimits>,
    alarms: Option<Book>,
    reference: Option<Reference>,
    /// What the recording itself warns of.
    warnings: Warnings,
    progress: Progress,
    out: Out,
    serial: Option<Sender>,
    picture: Option<Picture>,
    first_frame: Option<FirstFrame>,
    /// What turns the given picture, and its size, px.
    turn: Turn,
    given: (usize, usize),
    spectrum: Option<SpectrumFile>,
    page: Option<StillPage>,
    session: u32,
    reports: u64,
    summary: Option<Summary>,
}

impl Outlets {
    fn hear(&mut self, event: Event<'_>) -> Result<(), Failure> {
        if let Some(page) = &mut self.page {
            page.shown().hear(&event);
        }
        if let Some(spectrum) = &mut self.spectrum {
            spectrum.hear(&event);
        }
        match event {
            Event::Part(part) => self.place.roi = [part.x, part.y, part.width, part.height],
            Event::Note(note) => self.progress.note(&format!("{}: {note}", self.name)),
            Event::Frame(start_ns) => {
                self.progress.step();
                if let Some(picture) = &mut self.picture {
                    picture.start(start_ns);
                }
            }
            Event::Sample(sample) => {
                if let Some(picture) = &mut self.picture {
                    picture.sample(sample);
                }
            }
            Event::Report(report, shapes) => self.report(report, shapes)?,
        }
        Ok(())
    }

    /// Hands a report on, as soon as it is known.
    fn report(&mut self, report: &Report, shapes: &[PeakShape]) -> Result<(), Failure> {
        self.reports += 1;
        let said = alarm_args::judge(&mut self.alarms, report);
        let against = self.reference.as_ref().map(|r| r.against(report));
        if let Some(summary) = &mut self.summary {
            summary.take(report);
        }
        if let Some(picture) = &mut self.picture {
            picture.report(report);
        }
        if let Some(page) = &mut self.page {
            let limits = self.zone_limits.as_ref();
            let json = json::measured(report, shapes, self.place, limits);
            let json = alarm_args::added(said.as_ref(), json);
            page.shown().report(report, json);
        }
        let sentence = if self.serial.is_some() || self.format == Format::Wire {
            self.sentence(report)
        } else {
            None
        };
        if let (Some(serial), Some(_)) = (&mut self.serial, &sentence)
            && let Some(complaint) = serial.send(report)
        {
            self.progress.note(&complaint);
        }
        // They are the same in every report: a person hears them once.
        let mut brief = report.clone();
        if self.reports > 1 {
            brief.warnings = brief.warnings.without(self.warnings);
        }
        let out = &mut self.out;
        let limits = self.zone_limits.as_ref();
        self.progress.aside(|| match self.format {
            Format::Text => {
                out.line(&text::zoned(&brief, limits))?;
                let phases = against.iter().flat_map(Against::lines);
                let mut lines = phases.chain(said.iter().flat_map(|said| said.lines()));
                lines.try_for_each(|line| out.line(&format!("            {line}")))
            }
            Format::Json => {
                let mut object = json::measured(report, shapes, self.place, limits);
                if let Some(against) = &against {
                    object = json::extended(object, against);
                }
                out.line(&alarm_args::added(said.as_ref(), object))
            }
            Format::Wire => sentence.map_or(Ok(()), |s| out.line(s.trim_end_matches('\n'))),
        })
    }

    fn sum_up(&mut self) -> Result<(), Failure> {
        let Some(summary) = self.summary.as_ref().filter(|_| self.reports > 0) else {
            return Ok(());
        };
        let limits = self.zone_limits.as_ref();
        let said = match self.format {
            Format::Json => summary.json(limits),
            Format::Text | Format::Wire => summary.text(limits),
        };
        let out = &mut self.out;
        self.progress.aside(|| out.line(&said))
    }

    /// The report as a board would send it; `None` with a note when it has a number that no wire takes.
    fn sentence(&self, report: &Report) -> Option<String> {
        let mut sentence = String::new();
        let message = Message::Report {
            session: self.session,
            report: report.clone(),
        };
        match wire_text::encode(&message, &mut sentence) {
            Ok(()) => Some(sentence),
            Err(error) => {
                self.progress
                    .note(&format!("report {} is not sent: {error}", report.seq));
                None
            }
        }
    }

    /// Says what the whole recording is, writes the picture and the page, and waits for the serial port.
    fn close(mut self) -> Result<(), Failure> {
        let summed = self.sum_up();
        let [x, y, width, height] = self.place.roi;
        let given = Rect {
            x,
            y,
            width,
            height,
        };
        let measured = self.turn.part(given, self.given.0, self.given.1);
        let frame = self.first_frame.and_then(|first| first.with(measured));
        let drawn = self.picture.map_or(Ok(()), |mut picture| {
            if let Some(frame) = frame {
                picture.photo(frame);
            }
            picture.save()
        });
        let told = self.spectrum.map_or(Ok(()), SpectrumFile::save);
        let written = self.page.map_or(Ok(()), StillPage::save);
        let sent = self.serial.map_or(Ok(None), Sender::finish);
        summed?;
        drawn?;
        told?;
        written?;
        if let Some(note) = sent? {
            self.progress.note(&note);
        }
        Ok(())
    }
}
