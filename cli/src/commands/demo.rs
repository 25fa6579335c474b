//! `rowtone demo`: the whole chain on a simulated camera, its peaks beside the truth.
//!
//! The simulated camera's frames go through a pipe as a Y4M stream, are read, tracked and analysed as
//! any recording is. Every window is a table for people; at the end stands the line that a board
//! would send of the last one.

use std::io::{self, BufWriter, PipeWriter, Write};

use rowtone::report::Report;
use rowtone::wire::{Message, text as wire_text};

use crate::failure::Failure;
use crate::output::Out;
use crate::output::progress::Progress;
use host_sim::{Config, Tone, y4m};
use rowtone_clip::{CameraOptions, Feed};
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings};
use rowtone_measure::tracking::Shifts;
use rowtone_report::text::digits;

/// Options of `rowtone demo`.
#[derive(Debug, Default, clap::Args)]
#[command(after_help = "Example:\n  rowtone demo")]
pub struct Args {}

/// Length of the recording, s.
const SECONDS: u32 = 3;
/// A peak this near a tone is that tone, Hz.
const SAME_HZ: f64 = 0.5;

/// The machine: running speed, its second harmonic, and a bearing.
const TONES: [Tone; 3] = [
    Tone {
        hz: 24.7,
        amplitude_px: 0.3,
        phase_rad: 0.3,
    },
    Tone {
        hz: 49.4,
        amplitude_px: 0.08,
        phase_rad: 1.0,
    },
    Tone {
        // Far from all that the other two could be taken for at 60 fps.
        hz: 317.6,
        amplitude_px: 0.015,
        phase_rad: 2.0,
    },
];

/// Runs the demo.
///
/// # Errors
/// [`Failure::OutputClosed`] when nobody reads standard output any more.
pub fn run(_args: &Args) -> Result<(), Failure> {
    let broken = |error: &dyn std::fmt::Display| Failure::input(format!("demo: {error}"));
    let mut config = Config::default();
    config.sensor.cols = 160;
    config.frames = SECONDS * 60;
    config.motion.tones.extend(TONES);
    let sensor = config.sensor.clone();
    let camera = host_sim::Camera::new(config).map_err(|error| broken(&error))?;
    let (from, to) = io::pipe().map_err(|error| broken(&error))?;
    std::thread::spawn(move || {
        // The reader hung up: the demo has ended.
        let _ = film(&camera, to);
    });

    let mut out = Out::default();
    out.line(&format!(
        "A simulated camera looks at a simulated machine for {SECONDS} s: {} x {} px, {} fps, \
         {} us a row.\nIt sees the machine only while it reads a picture out, yet each row \
         is a look of its own.",
        sensor.cols,
        sensor.rows,
        sensor.fps,
        sensor.line_time_ps / 1_000_000,
    ))?;
    let options = CameraOptions {
        line_time_us: Some(f64::from(sensor.line_time_ps) * 1e-6),
        exposure_us: Some(f64::from(sensor.exposure_ns) * 1e-3),
        ..CameraOptions::of("the simulated camera")
    };
    let feed = Feed::read(&options, from)?;
    let settings = Settings {
        max_hz: Some(1000.0),
        ..Settings::default()
    };
    let plan = Plan::new(&feed.camera, &settings)?;
    let shifts = Shifts::start(feed, Some(plan.groups()))?;
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let progress = Progress::new(Some(u64::from(SECONDS * 60)));
    let mut last = None;
    analysis.run(|event| {
        match event {
            Event::Part(_) => {}
            Event::Note(note) => progress.note(note),
            Event::Frame(_) => progress.step(),
            Event::Sample(_) => {}
            Event::Report(report, _) => {
                last = Some(report.clone());
                progress.aside(|| show(report, &mut out))?;
            }
        }
        Ok::<_, Failure>(())
    })?;
    last.map_or(Ok(()), |report| close(report, &mut out))
}

/// Writes the recording, frame by frame.
fn film(camera: &host_sim::Camera, to: PipeWriter) -> io::Result<()> {
    let mut to = BufWriter::with_capacity(1 << 16, to);
    y4m::write_header(&mut to, &camera.config().sensor)?;
    for frame in camera.frames() {
        y4m::write_frame(&mut to, &frame)?;
    }
    to.flush()
}

/// Prints a report as a table beside the truth.
fn show(report: &Report, out: &mut Out) -> Result<(), Failure> {
    let end_s = report.time_ms as f64 * 1e-3;
    let window_s = f64::from(report.window_s);
    out.line("")?;
    out.line(&format!(
        "Second {:.1} to {end_s:.1}: {} rows, a row's noise {:.4} px",
        end_s - window_s,
        report.lines,
        report.noise_px,
    ))?;
    out.line(
        "    measured, Hz        true, Hz  error, mHz | measured, px        true, px  error, %",
    )?;
    for tone in &TONES {
        out.line(&row(tone, report))?;
    }
    let known = |hz: f32| {
        TONES
            .iter()
            .any(|tone| (tone.hz - f64::from(hz)).abs() < SAME_HZ)
    };
    for peak in report.peaks.iter().filter(|peak| !known(peak.hz)) {
        out.line(&format!(
            "    {:.4} Hz is not one of the machine's",
            peak.hz
        ))?;
    }
    Ok(())
}

/// Prints the last report as the line that a board sends.
fn close(report: Report, out: &mut Out) -> Result<(), Failure> {
    let mut sentence = String::new();
    let message = Message::Report { session: 1, report };
    wire_text::encode(&message, &mut sentence)
        .map_err(|error| Failure::input(format!("demo: {error}")))?;
    out.line("\nA board sends the last window over its serial line like this:\n")?;
    out.line(sentence.trim_end())
}

/// One tone of the machine beside the peak that shows it.
fn row(tone: &Tone, report: &Report) -> String {
    let distance = |hz: f32| (f64::from(hz) - tone.hz).abs();
    let nearest = report
        .peaks
        .iter()
        .min_by(|a, b| distance(a.hz).total_cmp(&distance(b.hz)))
        .filter(|peak| distance(peak.hz) < SAME_HZ);
    let Some(peak) = nearest else {
        return format!("    not found          {:9.4}", tone.hz);
    };
    let (hz, px) = (f64::from(peak.hz), f64::from(peak.amplitude_px));
    format!(
        "  {hz:9.4} ± {:<8} {:9.4} {:+11.2} | {px:8.5} ± {:<8} {:8.5} {:+9.2}",
        digits(peak.hz_sd.into(), 2),
        tone.hz,
        (hz - tone.hz) * 1e3,
        digits(peak.amplitude_px_sd.into(), 2),
        tone.amplitude_px,
        (px / tone.amplitude_px - 1.0) * 100.0,
    )
}
