//! `rowtone displacement`: the motion itself, over time.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use rowtone::timeline::{Displacement, Vertical};

use crate::camera_args::CameraArgs;
use crate::failure::Failure;
use crate::output::progress::Progress;
use crate::output::series::{Measured, Series, Shift};
use crate::output::wav;
use rowtone_clip::{Camera, Feed};
use rowtone_files::WholeFile;
use rowtone_measure::restore::Method;
use rowtone_measure::restore::long::{Restoration, USUAL_CORNER_HZ};
use rowtone_measure::tracking::{FrameShifts, Shifts};

/// Where less is known along the edges than this share of what is known across them, nothing is.
const LEAST_CONDITIONED: f64 = 3e-3;

/// Samples a second that `--rows-per-sample` aims at when it is not given.
const USUAL_RATE_HZ: f64 = 8000.0;

/// Longest time without a frame that a sound bridges, s.
const MOST_GAP_S: f64 = 60.0;

/// Options of `rowtone displacement`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  rowtone displacement clip.mp4 --line-time-us 18.9 -o motion.csv\n\n\
    CSV: t_s,row,x_px,x_sd_px,y_px,y_sd_px; with --axes x: t_s,row,d_px,sd_px. t_s is the middle of the \
    sample's exposure, row its first row in the (turned) picture; x is to the right, y downwards; what could \
    not be measured is empty. Each row's mean over \
    the recording is removed. NPY: the same columns as 64-bit floats. Both hold what was measured and \
    nothing else.\n\n\
    WAV: a sound without gaps, 32-bit floats in px at a constant rate: blank time, lost frames and rows \
    that could not be measured are filled by tones and an autoregressive model (Janssen; an estimate, \
    good for the ear, no measurement), the mean is removed, and a Butterworth low-pass of order 6 run \
    both ways. All samples are kept until the end: some 16 bytes each, 460 MB an hour at 8000 a \
    second; a WAV file ends at 4 GiB, 37 hours at that rate."
)]
pub struct Args {
    #[command(flatten)]
    camera: CameraArgs,
    /// Rows combined into one sample [default: some 8000 samples a second; all rows of a global
    /// shutter]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    rows_per_sample: Option<u16>,
    /// Format of the output [default: by the ending of -o, else csv]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// WAV: how gaps are filled: ar, ar-alone, tones, median, linear or zero [default: ar]
    #[arg(long, value_name = "HOW")]
    fill: Option<Method>,
    /// WAV: corner of the low-pass, Hz; 0 for none [default: 1000]
    #[arg(long, value_name = "F", value_parser = corner, allow_negative_numbers = true)]
    low_pass_hz: Option<f64>,
    /// Where to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Formats of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
    Wav,
    Npy,
}

/// A corner frequency, or 0.
fn corner(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    number
        .filter(|hz| *hz == 0.0 || (1.0..=1e6).contains(hz))
        .ok_or_else(|| "want a number from 1 to 1000000 Hz, or 0 for none".to_owned())
}

impl Args {
    fn restoration(&self) -> Restoration {
        Restoration {
            method: self.fill.unwrap_or(Method::Ar),
            low_pass_hz: Some(self.low_pass_hz.unwrap_or(USUAL_CORNER_HZ)).filter(|hz| *hz > 0.0),
        }
    }

    /// What was asked for, or what the ending of -o says.
    fn format(&self) -> Result<Format, Failure> {
        let (None, Some(path)) = (self.format, &self.output) else {
            return Ok(self.format.unwrap_or(Format::Csv));
        };
        let ending = path
            .extension()
            .map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("wav") => Ok(Format::Wav),
            Some("npy") => Ok(Format::Npy),
            Some("csv" | "txt") | None => Ok(Format::Csv),
            // A device or a pipe has no ending to speak of.
            Some(_) if path.metadata().is_ok_and(|meta| !meta.is_file()) => Ok(Format::Csv),
            Some(other) => Err(Failure::usage(format!(
                "-o {}: .{other} is none of csv, wav and npy: give such an ending, or --format",
                path.display()
            ))),
        }
    }
}

/// Measures the recording and writes its displacement.
///
/// # Errors
/// [`Failure`] as every command; what was measured before an input became unusable is still written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let format = args.format()?;
    if let Some(path) = &args.output {
        Failure::unless_writable(path)?;
    }
    if args.output.is_none() && format != Format::Csv && io::stdout().is_terminal() {
        return Err(Failure::usage(
            "this format is not for a terminal: give -o FILE",
        ));
    }
    if format != Format::Wav && (args.low_pass_hz.is_some() || args.fill.is_some()) {
        return Err(Failure::usage(
            "--fill and --low-pass-hz are for WAV: CSV and NPY hold what was measured",
        ));
    }
    let mut feed = Feed::open(&args.camera.options())?;
    feed.stop_when(crate::stop::on_signals());
    let mut shifts = Shifts::start(feed, None)?;
    let rows_per_sample = rows_per_sample(args.rows_per_sample, &shifts);
    let slots = shifts.part.height.div_ceil(rows_per_sample);
    if format == Format::Wav && slots > 1 && shifts.camera.timing.is_global_shutter() {
        return Err(Failure::usage(
            "--rows-per-sample: a global shutter exposes all rows at once, and a sound has one value a time: \
             leave it out",
        ));
    }
    let mut series = Series::new(shifts.part.y, rows_per_sample, slots, shifts.axes);
    let outcome = collect(&mut shifts, &mut series);
    if let Some(warning) = shifts.warning() {
        eprintln!("rowtone: {warning}");
    }
    if series.frames() > 0 {
        series.remove_means();
        write(
            args,
            format,
            &series,
            rate_hz(rows_per_sample, slots, &shifts.camera),
        )?;
        if series.conditioned() < LEAST_CONDITIONED {
            let note = "nearly all edges lean one way: only the motion across them can be told (--axes x reads it \
                along the rows)";
            eprintln!("rowtone: {}: {note}", shifts.name);
        }
        if series.measured() == 0 {
            return outcome.and(Err(shifts.nothing_measured().into()));
        }
    }
    outcome
}

/// How many rows to combine: what was asked for, or what makes some 8000 samples a second.
fn rows_per_sample(asked: Option<u16>, shifts: &Shifts) -> usize {
    let timing = &shifts.camera.timing;
    let rows = shifts.part.height;
    let wanted = match asked {
        Some(rows) => usize::from(rows),
        None if timing.is_global_shutter() => rows,
        None => (1e12 / (USUAL_RATE_HZ * f64::from(timing.line_time_ps()))) as usize,
    };
    wanted.clamp(1, rows)
}

/// Samples a second, as a WAV file states it.
fn rate_hz(rows_per_sample: usize, slots: usize, camera: &Camera) -> u32 {
    let rate = if slots == 1 {
        camera.fps
    } else {
        1e12 / (rows_per_sample as f64 * f64::from(camera.timing.line_time_ps()))
    };
    rate.round().clamp(1.0, f64::from(u32::MAX)) as u32
}

fn collect(shifts: &mut Shifts, series: &mut Series) -> Result<(), Failure> {
    let progress = Progress::new(shifts.frames);
    let mut samples = Vec::new();
    while let Some(frame) = shifts.next_frame()? {
        for note in &frame.notes {
            progress.note(&format!("{}: {note}", shifts.name));
        }
        combine(&frame, shifts, series.rows_per_sample(), &mut samples);
        series.push_frame(frame.start_ns, &samples);
        shifts.recycle(frame);
        progress.step();
    }
    Ok(())
}

/// Combines each group of rows by information: time and shift are weighted means.
fn combine(frame: &FrameShifts, shifts: &Shifts, rows_per_sample: usize, to: &mut Vec<Measured>) {
    let (part, timing) = (&shifts.part, &shifts.camera.timing);
    let group_of = |row: &Displacement| usize::from(row.row) / rows_per_sample;
    to.clear();
    let mut rest = &frame.rows[..];
    for slot in 0..part.height.div_ceil(rows_per_sample) {
        let count = rest.iter().take_while(|row| group_of(row) <= slot).count();
        let (rows, after) = rest.split_at(count);
        rest = after;
        to.push(if let Some(measured) = sum(rows, frame.start_ns) {
            measured
        } else {
            let first = slot * rows_per_sample;
            let last = (first + rows_per_sample).min(part.height) - 1;
            let middle = |row: usize| timing.middle_ns((part.y + row) as u16) as f64;
            Measured {
                after_s: (0.5e-9 * (middle(first) + middle(last))) as f32,
                shift: None,
            }
        });
    }
}

/// Scores and informations of rows added up; `None` where nothing is known.
fn sum(rows: &[Displacement], start_ns: i64) -> Option<Measured> {
    let (mut px, mut ns, mut weight) = (0.0, 0.0, 0.0);
    let (mut cross, mut along, mut score, mut along_ns) = (0.0, 0.0, 0.0, 0.0);
    for row in rows {
        let w = f64::from(row.information_per_px2);
        let after_ns = (row.time_ns - start_ns) as f64;
        px += w * f64::from(row.shift_px);
        ns += w * after_ns;
        weight += w;
        if let Some(v) = &row.vertical {
            let (k, own) = (f64::from(v.coupling), f64::from(v.information_per_px2));
            cross += k * w;
            along += k * k * w + own;
            along_ns += own * after_ns;
            score += k * w * f64::from(row.shift_px) + own * f64::from(v.shift_px);
        }
    }
    let coupling = if weight > 0.0 { cross / weight } else { 0.0 };
    let own = along - coupling * cross;
    let known = own > 1e-6 * along;
    let vertical = Vertical {
        shift_px: if known {
            ((score - coupling * px) / own) as f32
        } else {
            0.0
        },
        information_per_px2: if known { own as f32 } else { 0.0 },
        coupling: coupling as f32,
        ..Vertical::default()
    };
    let after_ns = match weight > 0.0 {
        true => ns / weight,
        false if known => along_ns / along,
        false => return None,
    };
    Some(Measured {
        after_s: (after_ns * 1e-9) as f32,
        shift: Some(Shift {
            px: if weight > 0.0 {
                (px / weight) as f32
            } else {
                0.0
            },
            information_per_px2: weight as f32,
            vertical: rows
                .iter()
                .any(|row| row.vertical.is_some())
                .then_some(vertical),
        }),
    })
}

fn write(args: &Args, format: Format, series: &Series, rate_hz: u32) -> Result<(), Failure> {
    let um_per_px = args.camera.um_per_px();
    let place = args.output.as_deref();
    let name = place.map_or("standard output".to_owned(), |p| p.display().to_string());
    let written = match format {
        Format::Csv => write_to(place, |mut to| series.write_csv(&mut to, um_per_px)),
        Format::Npy => write_to(place, |mut to| series.write_npy(&mut to)),
        Format::Wav => {
            check_sound(&name, series, rate_hz)?;
            let sound = sound(series, rate_hz, &args.restoration());
            write_to(place, |mut to| wav::write(&mut to, rate_hz, &sound))
        }
    };
    written.map_err(|e| Failure::writing(&name, &e))
}

/// Whether the recording makes a sound of a sensible length.
fn check_sound(name: &str, series: &Series, rate_hz: u32) -> Result<(), Failure> {
    if let Some((at_s, gap_s)) = series
        .longest_gap()
        .filter(|(_, gap_s)| *gap_s > MOST_GAP_S)
    {
        return Err(Failure::input(format!(
            "{name}: there is no frame for {gap_s:.0} s after {at_s:.3} s, and a sound would fill that with \
             what was never measured: write CSV or NPY, or cut the recording there"
        )));
    }
    let samples = series.duration_s() * f64::from(rate_hz);
    if samples < wav::MOST_SAMPLES as f64 {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{name}: {}",
        wav::too_long(rate_hz)
    )))
}

/// The motion as a sound: at a constant rate, filled, filtered and without its mean.
fn sound(series: &Series, rate_hz: u32, how: &Restoration) -> Vec<f32> {
    let progress = Progress::new(Some(series.frames() as u64));
    let mut sound: Vec<f32> = Vec::new();
    let rate = f64::from(rate_hz);
    let samples_per_frame = (series.duration_s() * rate / series.frames() as f64).max(1.0) as usize;
    how.run(series.evenly(rate), rate, |value| {
        sound.push(value as f32);
        if sound.len().is_multiple_of(samples_per_frame) {
            progress.step();
        }
    });
    let mean = sound.iter().map(|&v| f64::from(v)).sum::<f64>() / sound.len().max(1) as f64;
    sound.iter_mut().for_each(|v| *v -= mean as f32);
    sound
}

/// Lets `fill` write to a file, which appears whole, or to standard output.
fn write_to(
    place: Option<&Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if let Some(path) = place {
        let mut file = WholeFile::create(path)?;
        fill(&mut file)?;
        return file.finish();
    }
    let mut to = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    fill(&mut to)?;
    to.flush()
}
