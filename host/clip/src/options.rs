//! What is known of a camera beforehand, and what it comes to with a recording.

use std::path::{Path, PathBuf};

use rowtone::camera::Timing;
use rowtone::report::{Warning, Warnings};
use rowtone::tracker::Axes;

use super::clock::{Clock, Stamped, Times};
use super::error::InputError;
use super::ffmpeg::Probe;
use super::pts::PtsError;
use super::{
    About, Camera, ClipError, Header, OptionError, Rect, Roi, Turn, calibration, decoded, ffmpeg,
    pts,
};

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

/// What is known of a camera, and which part of its picture to use.
#[derive(Clone, Debug)]
pub struct CameraOptions {
    /// A video file, or `-` for Y4M on standard input.
    pub input: String,
    /// Frame rate, Hz, whatever the file says: slow motion states the rate it is played at.
    pub fps: Option<f64>,
    /// A file with the start of exposure of every frame: timecode format v2, ms.
    pub pts: Option<PathBuf>,
    /// Time from one row to the next, µs.
    pub line_time_us: Option<f64>,
    /// A file that `rowtone calibrate` wrote, which has the line time.
    pub calibration: Option<PathBuf>,
    /// Exposure of a row, µs; where it is not known, amplitudes are as filmed.
    pub exposure_us: Option<f64>,
    /// Part of the picture to use, before it is turned.
    pub roi: Roi,
    /// Part that does not vibrate, before the picture is turned: its motion is the camera's own.
    pub background: Option<Rect>,
    /// How the picture is turned before it is measured, so that its rows are the sensor's.
    pub rotate: Turn,
    /// The axes along which motion is measured.
    pub axes: Axes,
    /// All rows are exposed at once: one sample a frame.
    pub global_shutter: bool,
    /// Scale of the picture, µm a pixel.
    pub um_per_px: Option<f64>,
}

impl CameraOptions {
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
    /// [`OptionError`] when no line time is given, or one beyond what a camera can have.
    pub fn check(&self) -> Result<(), OptionError> {
        if self.line_time_us.is_none() && self.calibration.is_none() && !self.global_shutter {
            return Err(OptionError::NoLineTime);
        }
        if let Some(us) = self.line_time_us.filter(|&us| us < SHORTEST_LINE_TIME_US) {
            return Err(OptionError::ShortLineTime(us));
        }
        let longest = [
            ("--line-time-us", self.line_time_us, LONGEST_LINE_TIME_US),
            ("--exposure-us", self.exposure_us, LONGEST_EXPOSURE_US),
        ];
        for (option, us, most_us) in longest {
            if let Some(us) = us.filter(|&us| us > most_us) {
                return Err(OptionError::TooLong {
                    option,
                    us,
                    most_us,
                });
            }
        }
        Ok(())
    }

    /// The times of the frames.
    ///
    /// # Errors
    /// [`ClipError`] for a file of times that cannot be used, or when nothing gives a frame rate.
    pub fn clock(&self, header: &Header, about: &About) -> Result<Clock, ClipError> {
        let fps = self.fps.or(header.fps);
        let no_rate = || {
            let unusable = header.unusable_rate.clone();
            ClipError::input(self.name(), InputError::NoRate { unusable })
        };
        if let Some(path) = &self.pts {
            let times = read_times(path, fps)?;
            return Times::new(times, fps).map(Clock::Times).ok_or_else(no_rate);
        }
        let Some(probe) = &about.probe else {
            return fps.map(Clock::Rate).ok_or_else(no_rate);
        };
        if !probe.has_times() {
            let nothing =
                || decoded::refused(self.name(), ffmpeg::Error::NoTimes(probe.format.clone()));
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
    /// [`ClipError::Options`] for a part outside the picture and for times that contradict each other,
    /// [`ClipError::Calibration`] for a calibration file that cannot be used.
    pub fn camera(&self, header: &Header, clock: &Clock) -> Result<Camera, ClipError> {
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
            return Err(OptionError::LongExposure { exposure_us, fps }.into());
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
        .map_err(|error| ClipError::input(self.name(), InputError::Timing(error)))?;
        let readout_s = timing.readout_ns() as f64 * 1e-9;
        let doubt = (readout_s * fps > READOUT_SLACK).then_some(OptionError::LongReadout {
            rows: size.1,
            line_time_us,
            readout_s,
            fps,
        });
        let turned = |option, part: Rect| {
            if part.fits(width, height) {
                Ok(turn.part(part, width, height))
            } else {
                Err(OptionError::Outside {
                    option,
                    part,
                    width,
                    height,
                })
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

/// The times in a file, ns, if they can be those of a recording of this frame rate, Hz.
fn read_times(path: &Path, fps: Option<f64>) -> Result<Vec<i64>, ClipError> {
    let refuse = |why| ClipError::Times {
        path: path.display().to_string(),
        why,
    };
    let times = pts::read(path).map_err(refuse)?;
    match pts::wrong_unit(&times, fps) {
        None => Ok(times),
        Some(unit) => Err(refuse(PtsError::Unit {
            unit,
            period_ms: pts::period_ns(&times).unwrap_or(0) as f64 * 1e-6,
            fps,
        })),
    }
}
