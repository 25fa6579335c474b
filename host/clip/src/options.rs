//! The camera options: the same for every command that reads a video.

use std::path::PathBuf;

use rowtone::camera::Timing;

use super::clock::{Clock, Times};
use super::{Header, Rect, Roi, Turn, calibration, pts};
use rowtone_failure::Failure;

/// Longest line time and exposure that [`Timing`] holds, µs.
const LONGEST_LINE_TIME_US: f64 = 4294.0;
const LONGEST_EXPOSURE_US: f64 = 4_294_000.0;
/// A read-out may be this much longer than the frame period before it is refused: a calibration is not
/// exact.
const READOUT_SLACK: f64 = 1.02;

/// Options that describe the camera and which part of its picture to use.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// A Y4M file, or `-` for standard input
    #[arg(value_name = "INPUT", help_heading = None)]
    pub input: String,
    /// Frame rate, Hz [default: the file's]
    #[arg(long, value_name = "F", value_parser = positive, allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Start of exposure of every frame: timecode format v2, ms [default: frame number / fps]
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Time from one row to the next, µs
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true, conflicts_with = "global_shutter")]
    pub line_time_us: Option<f64>,
    /// Takes the line time from a file that `rowtone calibrate` wrote
    #[arg(long, value_name = "FILE", conflicts_with_all = ["line_time_us", "global_shutter"])]
    pub calibration: Option<PathBuf>,
    /// Exposure of a row, µs [default: the calibration's, else 0]
    #[arg(long, value_name = "T", value_parser = not_negative, allow_negative_numbers = true)]
    pub exposure_us: Option<f64>,
    /// Part of the picture to use, px; also `full` or `auto` [default: auto]
    #[arg(
        long,
        value_name = "X,Y,W,H",
        hide_default_value = true,
        default_value = "auto"
    )]
    pub roi: Roi,
    /// Part that does not vibrate, px: its motion is the camera's own and is subtracted
    #[arg(long, value_name = "X,Y,W,H")]
    pub background: Option<Rect>,
    /// Turns the picture clockwise first, for vertical motion: what moves up then moves right, and
    /// columns are rows. Parts are given in the picture as it was
    #[arg(
        long,
        value_name = "90",
        default_value = "0",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub rotate: Turn,
    /// All rows are exposed at once (high-speed cameras): one sample a frame
    #[arg(long)]
    pub global_shutter: bool,
    /// Scale: adds µm and mm/s to the output
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub um_per_px: Option<f64>,
}

/// A finite number above 0.
fn positive(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0).ok_or_else(|| "want a number above 0".to_owned())
}

/// A finite number, at least 0.
fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |x| x >= 0.0).ok_or_else(|| "want a number, at least 0".to_owned())
}

fn number(text: &str, good: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse()
        .ok()
        .filter(|x: &f64| x.is_finite() && good(*x))
}

/// The camera of one recording: its options, checked against the file's header.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Times of the rows of a (turned) frame.
    pub timing: Timing,
    /// Usual frame rate, Hz.
    pub fps: f64,
    /// Bits of a pixel.
    pub bits: u8,
    /// Columns and rows of the turned picture.
    pub size: (usize, usize),
    /// The part to measure, in the turned picture; `None` leaves the choice to the program.
    pub part: Option<Rect>,
    /// The part that stands still, in the turned picture.
    pub background: Option<Rect>,
    /// How the picture is turned.
    pub turn: Turn,
    /// Scale, µm a pixel.
    pub um_per_px: Option<f64>,
    /// What is wrong with the options if the header is right about the picture's size, which shows only
    /// with the second frame.
    pub doubt: Option<Failure>,
}

impl Camera {
    /// The part to measure. Where none was given, the whole picture, or with a background the largest
    /// part beside it.
    ///
    /// # Errors
    /// [`Failure::Usage`] when the background leaves nothing to measure.
    pub fn part_or_rest(&self) -> Result<Rect, Failure> {
        let (width, height) = self.size;
        match (self.part, self.background) {
            (Some(part), _) => Ok(part),
            (None, None) => Ok(Rect::whole(width, height)),
            (None, Some(background)) => background.largest_beside(width, height).ok_or_else(|| {
                Failure::usage("--background is the whole picture: leave a part that vibrates")
            }),
        }
    }
}

impl CameraArgs {
    /// The options of an input about which nothing else is known.
    pub fn of(input: &str) -> Self {
        Self {
            input: input.to_owned(),
            fps: None,
            pts: None,
            line_time_us: None,
            calibration: None,
            exposure_us: None,
            roi: Roi::Auto,
            background: None,
            rotate: Turn::No,
            global_shutter: false,
            um_per_px: None,
        }
    }

    /// What to call the input in messages.
    pub fn name(&self) -> &str {
        if self.input == "-" {
            "standard input"
        } else {
            &self.input
        }
    }

    /// Whether it comes through a pipe, which may be live.
    pub fn is_pipe(&self) -> bool {
        self.input == "-"
    }

    /// What can be checked without the file.
    ///
    /// # Errors
    /// [`Failure::Usage`] when no line time is given, or one beyond what a camera can have.
    pub fn check(&self) -> Result<(), Failure> {
        if self.line_time_us.is_none() && self.calibration.is_none() && !self.global_shutter {
            return Err(Failure::usage(
                "the line time is missing: give --line-time-us T (the sensor's data sheet has it), \
                 --calibration FILE (from `rowtone calibrate`), or --global-shutter",
            ));
        }
        let limit = |name: &str, value: f64, most: f64| {
            if value > most {
                return Err(Failure::usage(format!(
                    "{name} {value} is too long: at most {most} µs"
                )));
            }
            Ok(())
        };
        limit(
            "--line-time-us",
            self.line_time_us.unwrap_or(0.0),
            LONGEST_LINE_TIME_US,
        )?;
        limit(
            "--exposure-us",
            self.exposure_us.unwrap_or(0.0),
            LONGEST_EXPOSURE_US,
        )
    }

    /// The times of the frames.
    ///
    /// # Errors
    /// [`Failure::Input`] for a file of times that cannot be used, or when nothing gives a frame rate.
    pub fn clock(&self, header: &Header) -> Result<Clock, Failure> {
        let fps = self.fps.or(header.fps);
        let no_rate = || {
            Failure::input(format!(
                "{}: the header gives no frame rate: give --fps F",
                self.name()
            ))
        };
        match &self.pts {
            None => fps.map(Clock::Rate).ok_or_else(no_rate),
            Some(path) => Times::new(pts::read(path)?, fps)
                .map(Clock::Times)
                .ok_or_else(no_rate),
        }
    }

    /// The camera, once the header is known.
    ///
    /// # Errors
    /// [`Failure::Usage`] for a part outside the picture; [`Failure::Input`] for a calibration file that cannot be used.
    pub fn camera(&self, header: &Header, fps: f64) -> Result<Camera, Failure> {
        self.check()?;
        let (width, height) = (header.width, header.height);
        let calibrated = self
            .calibration
            .as_deref()
            .map(calibration::read)
            .transpose()?;
        let line_time_us = match (calibrated, self.line_time_us) {
            (Some(calibrated), _) => calibrated.line_time_s * 1e6,
            (None, given) => given.unwrap_or(0.0),
        };
        let measured = calibrated.and_then(|calibrated| calibrated.exposure_s);
        let exposure_us = self
            .exposure_us
            .or(measured.map(|s| s * 1e6))
            .unwrap_or(0.0);
        // A sensor that reads its last row first: turned upside down, rows are in order of time again.
        let turn = match calibrated {
            Some(calibrated) if calibrated.upward => self.rotate.upside_down(),
            _ => self.rotate,
        };
        let size = turn.size(width, height);
        let timing = Timing::new(
            (line_time_us.min(LONGEST_LINE_TIME_US) * 1e6).round() as u32,
            (exposure_us.min(LONGEST_EXPOSURE_US) * 1e3).round() as u32,
            size.1 as u16,
        )
        .map_err(|error| Failure::input(format!("{}: {error}", self.name())))?;
        let readout_s = timing.readout_ns() as f64 * 1e-9;
        let doubt = (readout_s * fps > READOUT_SLACK).then(|| {
            Failure::usage(format!(
                "{} rows of {line_time_us} µs take {:.2} ms, longer than a frame at {fps:.3} fps \
                 ({:.2} ms): check --line-time-us and --fps",
                size.1,
                readout_s * 1e3,
                1e3 / fps
            ))
        });
        let turned = |name: &str, part: Rect| {
            if part.fits(width, height) {
                Ok(turn.part(part, width, height))
            } else {
                Err(Failure::usage(format!(
                    "{name} {},{},{},{} is not inside the picture of {width}x{height}",
                    part.x, part.y, part.width, part.height
                )))
            }
        };
        let part = match self.roi {
            Roi::Auto => None,
            Roi::Full => Some(Rect::whole(size.0, size.1)),
            Roi::Part(part) => Some(turned("--roi", part)?),
        };
        let background = self
            .background
            .map(|part| turned("--background", part))
            .transpose()?;
        Ok(Camera {
            timing,
            fps,
            bits: header.format.bits,
            size,
            part,
            background,
            turn,
            um_per_px: self.um_per_px,
            doubt,
        })
    }
}
