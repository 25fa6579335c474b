//! Why camera options cannot be used.

use std::fmt;

use super::Rect;

/// Why camera options cannot be right. Displayed with the names that the command gives them.
#[derive(Clone, Debug, PartialEq)]
pub enum OptionError {
    /// Neither a line time nor a calibration nor a global shutter.
    NoLineTime,
    /// A line time shorter than any sensor's, µs.
    ShortLineTime(f64),
    /// A time that is longer than can be held.
    TooLong {
        /// The option's name.
        option: &'static str,
        /// Its value, µs.
        us: f64,
        /// The most there can be, µs.
        most_us: f64,
    },
    /// An exposure that is longer than a frame.
    LongExposure {
        /// The exposure, µs.
        exposure_us: f64,
        /// The frame rate, Hz.
        fps: f64,
    },
    /// The rows of a frame take longer than the frame.
    LongReadout {
        /// Rows of a frame.
        rows: usize,
        /// The line time, µs.
        line_time_us: f64,
        /// All rows together, s.
        readout_s: f64,
        /// The frame rate, Hz.
        fps: f64,
    },
    /// A part that is not inside the picture.
    Outside {
        /// The option's name.
        option: &'static str,
        /// The part.
        part: Rect,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// The background leaves nothing to measure.
    AllBackground,
}

impl fmt::Display for OptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoLineTime => f.write_str(
                "the line time is missing: give --line-time-us T (the sensor's data sheet has it), \
                 --calibration FILE (from `rowtone calibrate`), or --global-shutter",
            ),
            Self::ShortLineTime(us) => write!(
                f,
                "--line-time-us {us} is shorter than any sensor's: it is in µs, so 18.9 for \
                 18.9e-6 s"
            ),
            Self::TooLong {
                option,
                us,
                most_us,
            } => write!(f, "{option} {us} is too long: at most {most_us} µs"),
            Self::LongExposure { exposure_us, fps } => write!(
                f,
                "an exposure of {exposure_us} µs is longer than a frame at {fps:.3} fps \
                 ({:.0} µs): check --exposure-us and --fps",
                1e6 / fps
            ),
            Self::LongReadout {
                rows,
                line_time_us,
                readout_s,
                fps,
            } => write!(
                f,
                "{rows} rows of {line_time_us} µs take {:.2} ms, longer than a frame at \
                 {fps:.3} fps ({:.2} ms): check --line-time-us and --fps",
                readout_s * 1e3,
                1e3 / fps
            ),
            Self::Outside {
                option,
                part,
                width,
                height,
            } => write!(
                f,
                "{option} {},{},{},{} is not inside the picture of {width}x{height}",
                part.x, part.y, part.width, part.height
            ),
            Self::AllBackground => {
                f.write_str("--background is the whole picture: leave a part that vibrates")
            }
        }
    }
}

impl std::error::Error for OptionError {}
