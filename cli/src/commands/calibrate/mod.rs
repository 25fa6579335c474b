//! `rowtone calibrate`: the camera's timing, from the stripes that a flashing light makes.

mod pictures;
mod report;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::quantity::hertz;
use pictures::{each_picture, full_scale};
use rowtone_calibrate::file::RollingName;
use rowtone_calibrate::rows::{Collector, Recording};
use rowtone_calibrate::stripes::Stripes;
use rowtone_calibrate::tone::motion::Watcher;
use rowtone_calibrate::tone::{self, About};
use rowtone_calibrate::{Calibration, Light, calibrate_with_stripes, plot};
use rowtone_clip::{Rect, Turn};

/// Standard deviation of the mains frequency, relative: ±0.03 Hz of 50, what large grids keep.
const MAINS_RELATIVE_SD: f64 = 6e-4;

/// Frames used unless said otherwise, of a light and of a vibration.
const FRAMES: usize = 120;
const VIBRATION_FRAMES: usize = 2000;

/// What was looked at, and what it gave.
type Found = (Recording, (Calibration, Stripes));

/// Options of `rowtone calibrate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "How precise on simulated cameras (one second of 480 rows): LED 1e-6; mains 6e-4,\nthe mains' own; unknown light 2e-5 by the camera's clock; a tone of 0.4 px 1e-4, of 0.05 px 1e-3,\nwhere it passes through two periods in a frame; below that about 1e-2.\ndocs/results.md says what makes each ambiguous.\n\nExamples:\n  rowtone calibrate led.mp4 --led-hz 1000 -o calibration.toml\n  rowtone calibrate picture.png --led-hz 1000 --fps 29.97 --plot stripes.svg\n  rowtone calibrate one.jpg two.jpg three.jpg --led-hz 1000\n  rowtone calibrate lamp.mp4 --mains 50\n  rowtone calibrate pump.mp4 --from-vibration"
)]
#[command(group(clap::ArgGroup::new("light").required(true).args(["led_hz", "mains", "unknown_light", "from_vibration"])))]
pub struct Args {
    /// A video (mp4, mov, ... through ffmpeg; or Y4M; `-` for Y4M on standard input), or PNG or JPEG pictures of one scene
    #[arg(required = true)]
    pub input: Vec<String>,
    /// An LED flashes at this frequency, Hz
    #[arg(long, value_name = "F", value_parser = hertz, allow_negative_numbers = true)]
    pub led_hz: Option<f64>,
    /// Share of its period that the LED is on: only so are exposure and on-time told apart
    #[arg(long, value_name = "D", default_value_t = 0.5, requires = "led_hz")]
    pub led_duty: f64,
    /// A lamp on mains of this frequency, Hz: it flickers at twice that
    #[arg(long, value_name = "50|60", value_parser = mains)]
    pub mains: Option<u32>,
    /// A steady light of unknown frequency: needs frames at two rates (with --pts), or --about-hz
    #[arg(long)]
    pub unknown_light: bool,
    /// No light but a steady machine tone in the motion; where several line times explain it, --about-hz or
    /// --tone-hz decides
    #[arg(long)]
    pub from_vibration: bool,
    /// About the frequency of the unknown light or tone, to a fraction of the frame rate
    #[arg(long, value_name = "F", value_parser = hertz, allow_negative_numbers = true)]
    pub about_hz: Option<f64>,
    /// The exact frequency of the machine tone, Hz
    #[arg(
        long,
        value_name = "F",
        value_parser = hertz,
        allow_negative_numbers = true,
        requires = "from_vibration",
        conflicts_with = "about_hz"
    )]
    pub tone_hz: Option<f64>,
    /// Frame rate, Hz [default: the file's]
    #[arg(long, value_name = "F", value_parser = hertz, allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Start of exposure of every frame: timecode format v2, ms
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Part of the picture to use, px; read-out and blank time are told of the whole picture all the same
    #[arg(long, value_name = "X,Y,W,H")]
    pub roi: Option<Rect>,
    /// Turns the given picture clockwise by so many degrees first, so that its rows are the sensor's: for pictures
    /// that were turned, whose stripes run from top to bottom. The rotation that a phone writes into a video needs
    /// none. --roi is given in the picture before it is turned
    #[arg(
        long,
        value_name = "0|90|180|270",
        default_value = "0",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub rotate: Turn,
    /// Most frames to use, from the start [default: 120; of a vibration 2000]
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Writes the calibration as TOML, for --calibration of other commands
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draws the stripes, the fit over them and what it leaves (SVG)
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
}

/// What to print.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// For people.
    Text,
    /// One object.
    Json,
}

fn mains(text: &str) -> Result<u32, String> {
    match text {
        "50" => Ok(50),
        "60" => Ok(60),
        _ => Err("want 50 or 60".to_owned()),
    }
}

/// Runs the command.
///
/// # Errors
/// [`Failure`] for an input that cannot be read and for stripes that give no calibration to rely on.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.fps.is_some_and(|fps| !(1e-3..=1e7).contains(&fps)) {
        return Err(Failure::usage(
            "--fps: want a frame rate from 0.001 to 10000000 Hz",
        ));
    }
    if !(args.led_duty > 0.0 && args.led_duty < 1.0) {
        return Err(Failure::usage(
            "--led-duty: want a number between 0 and 1, such as 0.5".to_owned(),
        ));
    }
    for path in [&args.output, &args.plot].into_iter().flatten() {
        Failure::unless_writable(path)?;
    }
    let name = args.input.join(" ");
    let (recording, (calibration, stripes)) = if args.from_vibration {
        from_vibration(args, &name)?
    } else {
        from_light(args, &name)?
    };
    if let Some(path) = &args.output {
        write_file(path, &calibration.to_toml())?;
    }
    if let Some(path) = &args.plot {
        write_file(
            path,
            &plot::stripes(&recording.rows, &stripes.fit, calibration.light_hz),
        )?;
    }
    let text = match args.format {
        Format::Text => report::text(&calibration, args.from_vibration),
        Format::Json => {
            serde_json::to_string(&calibration)
                .map_err(|e| Failure::input(format!("calibration: {e}")))?
                + "\n"
        }
    };
    if args.format == Format::Text {
        for warning in &calibration.warnings {
            eprintln!("rowtone: warning: {warning}");
        }
    }
    io::stdout()
        .write_all(text.as_bytes())
        .map_err(|e| Failure::writing("standard output", &e))
}

/// Calibrates by the stripes of a light.
fn from_light(args: &Args, name: &str) -> Result<Found, Failure> {
    let mut collector = None;
    let mut columns = Vec::new();
    let info = each_picture(args, |picture, width| {
        columns.push(column_means(picture, width));
        collector
            .get_or_insert_with(|| Collector::new(width, full_scale(picture)))
            .push(picture.chunks_exact(width));
        true
    })?;
    let Some(collector) = collector else {
        return Err(Failure::input(format!("{name}: no frame in it")));
    };
    let recording = Recording {
        picture_rows: info.picture_rows,
        ..collector.finish(info.times_s, info.fps)
    };
    let turned = Recording {
        rows: columns,
        picture_rows: None,
        ..recording.clone()
    };
    let (recording, bad) = recording.without_bad_frames();
    let mut found = calibrate_with_stripes(&recording, light(args)).map_err(|refusal| {
        let hint = turned_hint(args, turned);
        Failure::input(format!("{name}: {refusal}{hint}"))
    })?;
    if bad > 0 {
        let warning = format!("frames unlike all others were left out: {bad}");
        found.0.warnings.push(warning);
    }
    Ok((recording, found))
}

fn column_means(picture: &[u16], width: usize) -> Vec<f64> {
    let mut sums = vec![0.0; width];
    for row in picture.chunks_exact(width) {
        let values = sums.iter_mut().zip(row);
        values.for_each(|(sum, &value)| *sum += f64::from(value));
    }
    let rows = (picture.len() / width).max(1) as f64;
    sums.iter().map(|sum| sum / rows).collect()
}

/// What to do where stripes run along the columns: the picture was turned.
fn turned_hint(args: &Args, turned: Recording) -> String {
    let (turned, _) = turned.without_bad_frames();
    let Ok((found, _)) = calibrate_with_stripes(&turned, light(args)) else {
        return String::new();
    };
    // By a quarter clockwise the left column becomes the top row.
    let [one, other] = match args.rotate {
        Turn::No => ["90", "270"],
        Turn::Half => ["270", "90"],
        Turn::Quarter => ["180", "0"],
        Turn::ThreeQuarters => ["0", "180"],
    };
    let rotate = match found.rolling {
        Some(RollingName::Down) => format!("--rotate {one}"),
        Some(RollingName::Up) => format!("--rotate {other}"),
        None => format!("--rotate {one} or {other}"),
    };
    format!("; the stripes run from top to bottom here: the picture was turned, give {rotate}")
}

/// Calibrates by a tone in the motion: as stripes where it passes through periods in a frame, else by its slant.
fn from_vibration(args: &Args, name: &str) -> Result<Found, Failure> {
    let mut watcher = None;
    let info = each_picture(args, |picture, width| {
        let watcher = watcher.get_or_insert_with(|| Watcher::new(width, picture.len() / width));
        watcher.push(picture);
        !watcher.is_full()
    })?;
    let Some(watcher) = watcher else {
        return Err(Failure::input(format!("{name}: no frame in it")));
    };
    let motion = watcher.finish();
    let all = Recording {
        times_s: info.times_s,
        fps: info.fps,
        picture_rows: info.picture_rows,
        rows: motion.whole_rows(motion.frames.len()),
        ..Recording::default()
    };
    let few = all.first(args.frames.unwrap_or(FRAMES));
    if let Ok(found) = calibrate_with_stripes(&few, light(args)) {
        return Ok((few, found));
    }
    let about = match (args.tone_hz, args.about_hz) {
        (Some(hz), _) => About::Exactly(hz),
        (_, Some(hz)) => About::Near(hz),
        _ => About::Nothing,
    };
    let found = tone::calibrate(&motion, &all, about)
        .map_err(|refusal| Failure::input(format!("{name}: {refusal}")))?;
    Ok((all, found))
}

/// What the options say of the light.
fn light(args: &Args) -> Light {
    match (args.led_hz, args.mains, args.tone_hz) {
        (Some(hz), _, _) => Light::Known {
            hz,
            hz_sd: 0.0,
            duty: Some(args.led_duty),
        },
        (_, Some(mains), _) => {
            let hz = 2.0 * f64::from(mains);
            Light::Known {
                hz,
                hz_sd: MAINS_RELATIVE_SD * hz,
                duty: None,
            }
        }
        (_, _, Some(hz)) => Light::Known {
            hz,
            hz_sd: 0.0,
            duty: None,
        },
        _ => Light::Unknown {
            about_hz: args.about_hz,
        },
    }
}

fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    rowtone_files::write(path, text).map_err(|e| Failure::writing(&path.display().to_string(), &e))
}
