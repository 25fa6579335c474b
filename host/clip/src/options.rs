//! The camera options: the same for every command that reads a video.

use std::path::PathBuf;

use rowtone::camera::Timing;
use rowtone::report::{Warning, Warnings};
use rowtone::tracker::Axes;

use super::clock::{Clock, Stamped, Times};
use super::ffmpeg::Probe;
use super::header::FPS;
use super::{About, Header, Rect, Roi, Turn, calibration, decoded, ffmpeg, pts};
use rowtone_failure::Failure;

/// Longest line time and exposure that [`Timing`] holds, µs.
const LONGEST_LINE_TIME_US: f64 = 4294.0;
const LONGEST_EXPOSURE_US: f64 = 4_294_000.0;
/// Shorter is no rolling shutter's: the fastest sensors take half a µs.
const SHORTEST_LINE_TIME_US: f64 = 0.3;
/// A frame rate that differs from the file's by less than this share is the same.
const SAME_RATE: f64 = 1e-3;
/// A read-out may be this much longer than the frame period before it is refused: a calibration is not
/// exact.
const READOUT_SLACK: f64 = 1.02;

/// Options that describe the camera and which part of its picture to use.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// A video file (mp4, mov, mkv, avi, ...: read through ffmpeg; or Y4M), or `-` for Y4M on standard input
    #[arg(value_name = "INPUT", help_heading = None)]
    pub input: String,
    /// Frame rate, Hz, whatever the file says: slow motion states the rate it is played at [default: the file's]
    #[arg(long, value_name = "F", value_parser = frame_rate, allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Start of exposure of every frame: timecode format v2, ms [default: the file's times, else frame number / fps]
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Time from one row to the next, µs
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true, conflicts_with = "global_shutter")]
    pub line_time_us: Option<f64>,
    /// Takes the line time from a file that `rowtone calibrate` wrote
    #[arg(long, value_name = "FILE", conflicts_with_all = ["line_time_us", "global_shutter"])]
    pub calibration: Option<PathBuf>,
    /// Exposure of a row, µs [default: the calibration's; else not known, and amplitudes are as filmed]
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
    /// Turns the given picture clockwise by so many degrees before measuring, so that its rows are the
    /// sensor's: for files whose pixels were turned. The rotation that a phone writes into a file needs
    /// none: it is for players, and the stored rows are the sensor's. --roi and --background are given in
    /// the picture before it is turned
    #[arg(
        long,
        value_name = "0|90|180|270",
        default_value = "0",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub rotate: Turn,
    /// Motion along the rows alone (x), or along rows and columns (xy)
    #[arg(long, value_name = "x|xy", default_value = "xy", value_parser = axes)]
    pub axes: Axes,
    /// All rows are exposed at once (high-speed cameras): one sample a frame
    #[arg(long)]
    pub global_shutter: bool,
    /// Scale: adds µm and mm/s to the output
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub um_per_px: Option<f64>,
}

fn axes(text: &str) -> Result<Axes, String> {
    match text {
        "x" => Ok(Axes::X),
        "xy" => Ok(Axes::Xy),
        _ => Err("want x or xy".to_owned()),
    }
}

/// A frame rate, Hz.
fn frame_rate(text: &str) -> Result<f64, String> {
    number(text, |fps| FPS.contains(&fps))
        .ok_or_else(|| format!("want a frame rate from {} to {} Hz", FPS.start(), FPS.end()))
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
    /// Along which axes of the turned picture motion is measured.
    pub axes: Axes,
    /// What every report on the recording warns of.
    pub warnings: Warnings,
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
            axes: Axes::X,
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
        if let Some(us) = self.line_time_us.filter(|&us| us < SHORTEST_LINE_TIME_US) {
            return Err(Failure::usage(format!(
                "--line-time-us {us} is shorter than any sensor's: it is in µs, so 18.9 for 18.9e-6 s"
            )));
        }
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
    pub fn clock(&self, header: &Header, about: &About) -> Result<Clock, Failure> {
        let fps = self.fps.or(header.fps);
        let no_rate = || {
            let why = match &header.unusable_rate {
                Some(rate) => format!("the header's frame rate F{rate} is none of a camera"),
                None => "the header gives no frame rate".to_owned(),
            };
            Failure::input(format!("{}: {why}: give --fps F", self.name()))
        };
        if let Some(path) = &self.pts {
            let times = pts::read(path)?;
            if let Some(unit) = pts::wrong_unit(&times, fps) {
                return Err(Failure::input(wrong_unit(path, unit, &times, fps)));
            }
            return Times::new(times, fps).map(Clock::Times).ok_or_else(no_rate);
        }
        let Some(probe) = &about.probe else {
            return fps.map(Clock::Rate).ok_or_else(no_rate);
        };
        if !probe.has_times() {
            let nothing =
                || decoded::failure(self.name(), &ffmpeg::Error::NoTimes(probe.format.clone()));
            return self.fps.map(Clock::Rate).ok_or_else(nothing);
        }
        Stamped::new(probe.times_ns.clone(), probe.fps, self.fps)
            .map(Clock::Stamped)
            .ok_or_else(no_rate)
    }

    /// What to tell the user of an input before it is measured, without its name.
    pub fn notes(&self, header: &Header, about: &About) -> Vec<String> {
        let mut notes = Vec::new();
        let probe = about.probe.as_ref();
        if let (Some(given), Some(said)) = (self.fps, header.fps)
            && probe.is_none_or(Probe::has_times)
            && (given / said - 1.0).abs() > SAME_RATE
        {
            notes.push(format!(
                "--fps {given} is used; the file says {said:.3} fps"
            ));
        }
        let has_parts = matches!(self.roi, Roi::Part(_)) || self.background.is_some();
        if let Some(probe) = probe
            && probe.rotation_deg != 0
            && has_parts
        {
            notes.push(format!(
                "players turn this file by {} degrees; parts are given in the picture as it is stored, {}x{}",
                probe.rotation_deg, probe.width, probe.height
            ));
        }
        notes
    }

    /// The camera, once the header is known.
    ///
    /// # Errors
    /// [`Failure::Usage`] for a part outside the picture; [`Failure::Input`] for a calibration file that cannot be used.
    pub fn camera(&self, header: &Header, clock: &Clock) -> Result<Camera, Failure> {
        self.check()?;
        let fps = clock.fps();
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
        let known_us = self.exposure_us.or(measured.map(|s| s * 1e6));
        let exposure_us = known_us.unwrap_or(0.0);
        if exposure_us * 1e-6 * fps > READOUT_SLACK {
            return Err(Failure::usage(format!(
                "an exposure of {exposure_us} µs is longer than a frame at {fps:.3} fps ({:.0} µs): check \
                 --exposure-us and --fps",
                1e6 / fps
            )));
        }
        let mut warnings = Warnings::NONE;
        warnings.insert_if(known_us.is_none(), Warning::ExposureUnknown);
        warnings.insert_if(clock.coarse_ns().is_some(), Warning::CoarseTimes);
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
            axes: self.axes,
            warnings,
            um_per_px: self.um_per_px,
            doubt,
        })
    }
}

/// What is said of times in another unit.
fn wrong_unit(path: &std::path::Path, unit: &str, times: &[i64], fps: Option<f64>) -> String {
    let period = pts::period_ns(times).unwrap_or(0) as f64 * 1e-6;
    let expected = fps.map_or(String::new(), |fps| {
        format!(", where a frame at {fps:.3} fps takes {:.3} ms", 1e3 / fps)
    });
    format!(
        "{}: its times look like {unit} ({period} from frame to frame{expected}): timecode format v2 holds \
         milliseconds",
        path.display()
    )
}
