//! `rowtone calibrate`: the camera's timing, from the stripes that a flashing light makes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::calibrate::file::RollingName;
use crate::calibrate::rows::{Collector, Recording};
use crate::calibrate::{Calibration, Light, calibrate_with_stripes, plot, vibration};
use crate::failure::Failure;
use crate::input::y4m::{Next, Reader};
use crate::input::{Rect, pts};

/// Standard deviation of the mains frequency, relative: ±0.03 Hz of 50, what large grids keep.
const MAINS_RELATIVE_SD: f64 = 6e-4;

/// Options of `rowtone calibrate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  rowtone calibrate led.y4m --led-hz 1000 -o calibration.toml\n  rowtone calibrate picture.png --led-hz 1000 --fps 29.97 --plot stripes.svg\n  rowtone calibrate lamp.y4m --mains 50"
)]
#[command(group(clap::ArgGroup::new("light").required(true).args(["led_hz", "mains", "unknown_light", "from_vibration"])))]
pub struct Args {
    /// A Y4M video (`-` for standard input), or a PNG or JPEG picture
    pub input: String,
    /// An LED flashes at this frequency, Hz
    #[arg(long, value_name = "F")]
    pub led_hz: Option<f64>,
    /// A lamp on mains of this frequency, Hz: it flickers at twice that
    #[arg(long, value_name = "50|60", value_parser = mains)]
    pub mains: Option<u32>,
    /// A steady light of unknown frequency: needs frames at two rates (with --pts), or --about-hz
    #[arg(long)]
    pub unknown_light: bool,
    /// No light but a steady machine tone; its frequency with --about-hz, exact with --tone-hz
    #[arg(long)]
    pub from_vibration: bool,
    /// About the frequency of the unknown light or tone, to a fraction of the frame rate
    #[arg(long, value_name = "F")]
    pub about_hz: Option<f64>,
    /// The exact frequency of the machine tone, Hz
    #[arg(
        long,
        value_name = "F",
        requires = "from_vibration",
        conflicts_with = "about_hz"
    )]
    pub tone_hz: Option<f64>,
    /// Frame rate, Hz [default: the file's]
    #[arg(long, value_name = "F")]
    pub fps: Option<f64>,
    /// Start of exposure of every frame: timecode format v2, ms
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Part of the picture to use, px; the line time does not depend on it
    #[arg(long, value_name = "X,Y,W,H")]
    pub roi: Option<Rect>,
    /// Most frames to use, from the start
    #[arg(long, value_name = "N", default_value_t = 120)]
    pub frames: usize,
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Writes the calibration as TOML, for --calibration of other commands
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draws the stripes and the fit (SVG)
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
    for (name, value) in [
        ("--led-hz", args.led_hz),
        ("--about-hz", args.about_hz),
        ("--tone-hz", args.tone_hz),
        ("--fps", args.fps),
    ] {
        if value.is_some_and(|v| !v.is_finite() || v <= 0.0) {
            return Err(Failure::usage(format!("{name}: want a number above 0")));
        }
    }
    let recording = if args.from_vibration {
        let mut pictures = Vec::new();
        let info = each_picture(args, |picture, width| {
            pictures.push((picture.to_vec(), width))
        })?;
        let rows = vibration::displacements(&pictures)
            .map_err(|why| Failure::input(format!("{}: {why}", args.input)))?;
        Recording {
            rows,
            times_s: info.times_s,
            fps: info.fps,
            saturated_share: 0.0,
        }
    } else {
        let mut collector = None;
        let info = each_picture(args, |picture, width| {
            collector
                .get_or_insert_with(|| Collector::new(width, full_scale(picture)))
                .push(picture.chunks_exact(width));
        })?;
        let Some(collector) = collector else {
            return Err(Failure::input(format!("{}: no frame in it", args.input)));
        };
        collector.finish(info.times_s, info.fps)
    };
    let (calibration, stripes) = calibrate_with_stripes(&recording, light(args))
        .map_err(|refusal| Failure::input(format!("{}: {refusal}", args.input)))?;
    if let Some(path) = &args.output {
        write_file(path, &calibration.to_toml())?;
    }
    if let Some(path) = &args.plot {
        write_file(path, &plot::stripes(&recording.rows, &stripes.fit))?;
    }
    let text = match args.format {
        Format::Text => text(&calibration),
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

/// What the options say of the light.
fn light(args: &Args) -> Light {
    match (args.led_hz, args.mains, args.tone_hz) {
        (Some(hz), _, _) => Light::Known {
            hz,
            hz_sd: 0.0,
            switched: true,
        },
        (_, Some(mains), _) => {
            let hz = 2.0 * f64::from(mains);
            Light::Known {
                hz,
                hz_sd: MAINS_RELATIVE_SD * hz,
                switched: false,
            }
        }
        (_, _, Some(hz)) => Light::Known {
            hz,
            hz_sd: 0.0,
            switched: false,
        },
        _ => Light::Unknown {
            about_hz: args.about_hz,
        },
    }
}

/// The value of white: 255, or all ones of the depth that the values need.
fn full_scale(picture: &[u16]) -> u16 {
    let top = picture.iter().copied().max().unwrap_or(0).max(255);
    ((u32::from(top) + 1).next_power_of_two() - 1) as u16
}

/// When the pictures were taken.
struct Info {
    times_s: Option<Vec<f64>>,
    fps: Option<f64>,
}

/// Hands out each picture (the part to use) with its width.
fn each_picture(args: &Args, mut sink: impl FnMut(&[u16], usize)) -> Result<Info, Failure> {
    let name = args.input.as_str();
    let extension = Path::new(name)
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_lowercase();
    if ["png", "jpg", "jpeg"].contains(&extension.as_str()) {
        let picture = image::open(name)
            .map_err(|e| Failure::input(format!("{name}: cannot be read as a picture: {e}")))?
            .to_luma16();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        // Back to 8 bit, so that saturation is at 255 as in a video.
        let values: Vec<u16> = picture
            .into_raw()
            .into_iter()
            .map(|v| (f32::from(v) / 257.0).round() as u16)
            .collect();
        hand_out(args, &values, width, height, &mut sink)?;
        return Ok(Info {
            times_s: None,
            fps: args.fps,
        });
    }
    if name == "-" {
        return each_frame(args, "standard input", io::stdin().lock(), sink);
    }
    let file =
        File::open(name).map_err(|e| Failure::input(format!("{name}: cannot be opened: {e}")))?;
    each_frame(args, name, io::BufReader::new(file), sink)
}

/// The frames of a Y4M stream.
fn each_frame(
    args: &Args,
    name: &str,
    from: impl Read,
    mut sink: impl FnMut(&[u16], usize),
) -> Result<Info, Failure> {
    let mut reader = Reader::open(from, name)?;
    let (width, height, bits) = (
        reader.header().width,
        reader.header().height,
        reader.header().format.bits,
    );
    let fps = args.fps.or(reader.header().fps);
    let given: Option<Vec<i64>> = args.pts.as_deref().map(pts::read).transpose()?;
    let mut buffer = Vec::new();
    let mut values = vec![0u16; width * height];
    let mut count = 0;
    while count < args.frames {
        match reader.read_frame(&mut buffer)? {
            Next::Frame { luma } => {
                let bytes = &buffer[luma..];
                if bits > 8 {
                    for (value, pair) in values.iter_mut().zip(bytes.chunks_exact(2)) {
                        *value = u16::from_le_bytes([pair[0], pair[1]]);
                    }
                } else {
                    for (value, &byte) in values.iter_mut().zip(bytes) {
                        *value = u16::from(byte);
                    }
                }
                hand_out(args, &values, width, height, &mut sink)?;
                count += 1;
            }
            Next::End => break,
            Next::Truncated { have, need } => {
                eprintln!(
                    "rowtone: warning: {name}: ends inside frame {count} ({have} of {need} bytes)"
                );
                break;
            }
        }
    }
    let times_s = match (given, fps) {
        (Some(times), _) if times.len() < count => {
            return Err(Failure::input(format!(
                "{name}: {count} frames, but only {} times in --pts",
                times.len()
            )));
        }
        (Some(times), _) => Some(
            times[..count]
                .iter()
                .map(|&t| (t - times[0]) as f64 * 1e-9)
                .collect(),
        ),
        (None, Some(fps)) => Some((0..count).map(|n| n as f64 / fps).collect()),
        (None, None) => None,
    };
    Ok(Info {
        times_s: times_s.filter(|t: &Vec<f64>| t.len() > 1),
        fps,
    })
}

/// Cuts the part to use out of a picture.
fn hand_out(
    args: &Args,
    values: &[u16],
    width: usize,
    height: usize,
    sink: &mut impl FnMut(&[u16], usize),
) -> Result<(), Failure> {
    let Some(part) = args.roi else {
        sink(values, width);
        return Ok(());
    };
    if !part.fits(width, height) {
        return Err(Failure::usage(format!(
            "--roi is not inside the picture of {width}x{height}"
        )));
    }
    let rows = values.chunks_exact(width).skip(part.y).take(part.height);
    let cut: Vec<u16> = rows
        .flat_map(|row| row[part.x..part.x + part.width].iter().copied())
        .collect();
    sink(&cut, part.width);
    Ok(())
}

fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|e| Failure::writing(&path.display().to_string(), &e))
}

/// The calibration for people.
fn text(c: &Calibration) -> String {
    let mut lines = vec![
        format!("rows               {}", c.rows),
        format!("frames used        {}", c.frames),
        format!(
            "light              {} Hz",
            with_sd(c.light_hz, c.light_hz_sd, 1.0)
        ),
        format!(
            "periods a frame    {}",
            with_sd(c.periods_per_frame, c.periods_per_frame_sd, 1.0)
        ),
        format!(
            "read-out           {} ms",
            with_sd(c.readout_s, c.readout_s_sd, 1e3)
        ),
        format!(
            "line time          {} µs",
            with_sd(c.line_time_s, c.line_time_s_sd, 1e6)
        ),
    ];
    for (name, value, sd, scale, unit) in [
        (
            "frame period    ",
            c.frame_period_s,
            c.frame_period_s_sd,
            1e3,
            "ms",
        ),
        ("blank time      ", c.blank_s, c.blank_s_sd, 1e3, "ms"),
        ("exposure        ", c.exposure_s, c.exposure_s_sd, 1e6, "µs"),
    ] {
        lines.push(match value {
            Some(value) => format!(
                "{name}   {} {unit}",
                with_sd(value, sd.unwrap_or(0.0), scale)
            ),
            None => format!("{name}   not told"),
        });
    }
    let rolling = match c.rolling {
        Some(RollingName::Down) => "down (row 0 first)",
        Some(RollingName::Up) => "up (last row first)",
        None => "not told",
    };
    lines.push(format!("rolling            {rolling}"));
    lines.push(format!("stripe contrast    {:.1} %", 100.0 * c.contrast));
    lines.join("\n") + "\n"
}

/// `value ± sd` with as many digits as the standard deviation calls for (two of it).
fn with_sd(value: f64, sd: f64, scale: f64) -> String {
    let (value, sd) = (value * scale, sd * scale);
    if sd <= 0.0 || !sd.is_finite() {
        return format!("{value}");
    }
    let digits = (1.0 - sd.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.digits$} ± {sd:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_standard_deviation() {
        assert_eq!(with_sd(15.730_123, 0.004_2, 1.0), "15.7301 ± 0.0042");
        assert_eq!(with_sd(1000.0, 0.0, 1.0), "1000");
    }

    #[test]
    fn white_is_all_ones() {
        assert_eq!(full_scale(&[3, 200]), 255);
        assert_eq!(full_scale(&[3, 1000]), 1023);
        assert_eq!(full_scale(&[65535]), 65535);
    }
}
