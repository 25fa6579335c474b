//! A calibration as a small TOML file, and as JSON.
//!
//! The file is what `rowtone calibrate -o` writes and what every command that reads a video takes with
//! `--calibration FILE`. Only `rows` and `line_time_s` are needed; a file may be written by hand.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// What is known of a camera's timing. Times in seconds; `_sd` is a standard deviation.
///
/// ```
/// use rowtone_calibrate::Calibration;
/// let calibration: Calibration = Calibration::from_toml("rows = 1080\nline_time_s = 1.89e-5\n")?;
/// assert_eq!(calibration.timing()?.line_time_ps(), 18_900_000);
/// # Ok::<(), rowtone_calibrate::file::FileError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Rows of the picture.
    pub rows: u32,
    /// Frames used.
    #[serde(default)]
    pub frames: u32,
    /// Frequency of the light, Hz.
    #[serde(default)]
    pub light_hz: f64,
    /// Its standard deviation, Hz; 0 where it was given.
    #[serde(default)]
    pub light_hz_sd: f64,
    /// Periods of the light in the read-out of one frame.
    #[serde(default)]
    pub periods_per_frame: f64,
    /// Standard deviation.
    #[serde(default)]
    pub periods_per_frame_sd: f64,
    /// `rows` line times.
    #[serde(default)]
    pub readout_s: f64,
    /// Standard deviation.
    #[serde(default)]
    pub readout_s_sd: f64,
    /// Time from one row to the next.
    pub line_time_s: f64,
    /// Standard deviation.
    #[serde(default)]
    pub line_time_s_sd: f64,
    /// Time from one frame to the next, by the light's clock.
    #[serde(default)]
    pub frame_period_s: Option<f64>,
    /// Standard deviation.
    #[serde(default)]
    pub frame_period_s_sd: Option<f64>,
    /// Frame period less read-out: the time in which no row is sampled.
    #[serde(default)]
    pub blank_s: Option<f64>,
    /// Standard deviation.
    #[serde(default)]
    pub blank_s_sd: Option<f64>,
    /// Exposure of a row.
    #[serde(default)]
    pub exposure_s: Option<f64>,
    /// Standard deviation.
    #[serde(default)]
    pub exposure_s_sd: Option<f64>,
    /// Which row is read first.
    #[serde(default)]
    pub rolling: Option<RollingName>,
    /// Amplitude of the stripes over the mean brightness.
    #[serde(default)]
    pub contrast: f64,
    /// What the user should know.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Which row is read first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RollingName {
    /// Row 0.
    Down,
    /// The last row.
    Up,
}

/// Why a calibration file was refused.
#[derive(Debug)]
pub enum FileError {
    /// It cannot be read.
    Read(std::io::Error),
    /// It is not TOML, or not this TOML.
    Parse {
        /// Which line; `None` where something is missing.
        line: Option<usize>,
        /// What is wrong.
        what: String,
    },
    /// A figure is impossible.
    Value {
        /// Which line, where a file says so.
        line: Option<usize>,
        /// Which.
        name: &'static str,
        /// What it was.
        value: f64,
    },
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(error) => write!(f, "cannot be read: {error}"),
            Self::Parse { line, what } => write!(
                f,
                "{}{what}: correct it, or make the file with `rowtone calibrate -o FILE`",
                Line(*line)
            ),
            Self::Value { line, name, value } => write!(
                f,
                "{}{name} = {value} is impossible: correct it, or measure again with `rowtone calibrate -o FILE`",
                Line(*line)
            ),
        }
    }
}

/// `line N: `, or nothing.
struct Line(Option<usize>);

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |line| write!(f, "line {line}: "))
    }
}

/// The line that begins with `key`, from 1.
fn line_of(text: &str, key: &str) -> Option<usize> {
    let is_it = |line: &str| line.split('=').next().is_some_and(|k| k.trim() == key);
    text.lines().position(is_it).map(|n| n + 1)
}

impl std::error::Error for FileError {}

impl Calibration {
    /// Reads what [`Self::to_toml`] wrote.
    ///
    /// # Errors
    /// [`FileError::Parse`], or [`FileError::Value`] for figures that no camera has.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let calibration: Self = toml::from_str(text).map_err(|e| {
            let missing = e.message().starts_with("missing field");
            let at = e.span().filter(|_| !missing);
            FileError::Parse {
                line: at.map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1),
                // Without the list of all keys there are.
                what: e
                    .message()
                    .replace('\n', " ")
                    .split(", expected one of")
                    .next()
                    .unwrap_or_default()
                    .to_owned(),
            }
        })?;
        calibration.timing().map_err(|error| match error {
            FileError::Value { name, value, .. } => FileError::Value {
                line: line_of(text, name),
                name,
                value,
            },
            other => other,
        })?;
        Ok(calibration)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`Self::from_toml`], and [`FileError::Read`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::from_toml(&std::fs::read_to_string(path).map_err(FileError::Read)?)
    }

    /// The file's text.
    pub fn to_toml(&self) -> String {
        // Only a map with keys that are not strings can fail, and there is none.
        toml::to_string(self).unwrap_or_default()
    }

    /// The core's own [`rowtone::camera::Timing`]. A missing exposure counts as 0.
    ///
    /// # Errors
    /// [`FileError::Value`] where a figure does not fit: line time above 0 and up to 4.29 ms, exposure up to 4.29 s, rows
    /// 1 to 65 535.
    pub fn timing(&self) -> Result<rowtone::camera::Timing, FileError> {
        let checked = |name, value: f64, scale: f64| {
            let scaled = (value * scale).round();
            if (0.0..=f64::from(u32::MAX)).contains(&scaled) {
                Ok(scaled as u32)
            } else {
                Err(FileError::Value {
                    line: None,
                    name,
                    value,
                })
            }
        };
        let line_time_ps = checked("line_time_s", self.line_time_s, 1e12)?;
        let exposure_ns = checked("exposure_s", self.exposure_s.unwrap_or(0.0), 1e9)?;
        if line_time_ps == 0 {
            return Err(FileError::Value {
                line: None,
                name: "line_time_s",
                value: self.line_time_s,
            });
        }
        let impossible_rows = || FileError::Value {
            line: None,
            name: "rows",
            value: f64::from(self.rows),
        };
        let rows = u16::try_from(self.rows).map_err(|_| impossible_rows())?;
        rowtone::camera::Timing::new(line_time_ps, exposure_ns, rows).map_err(|_| impossible_rows())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let calibration = Calibration {
            rows: 1080,
            line_time_s: 1.4565e-5,
            blank_s: Some(1e-3),
            rolling: Some(RollingName::Down),
            warnings: vec!["one".into()],
            ..Calibration::default()
        };
        let text = calibration.to_toml();
        assert_eq!(
            Calibration::from_toml(&text).unwrap(),
            calibration,
            "{text}"
        );
    }

    /// One line each, which names the key, the line, and what to do.
    #[test]
    fn nonsense_is_refused() {
        for (text, key, line) in [
            ("", "rows", None),
            ("rows = 100", "line_time_s", None),
            ("rows = 0\nline_time_s = 1e-5", "rows", Some(1)),
            ("rows = 70000\nline_time_s = 1e-5", "rows", Some(1)),
            ("rows = \"many\"\nline_time_s = 1e-5", "", Some(1)),
            ("rows = 100\nline_time_s = -1e-5", "line_time_s", Some(2)),
            ("rows = 100\nline_time_s = 0.0", "line_time_s", Some(2)),
            ("rows = 100\nline_time_s = nan", "line_time_s", Some(2)),
            ("rows = 100\n\nline_time_s = 1.0", "line_time_s", Some(3)),
            (
                "rows = 100\nline_time_s = 1e-5\nspeed = 3",
                "speed",
                Some(3),
            ),
            (
                "rows = 100\nline_time_s = 1e-5\nexposure_s = -1.0",
                "exposure_s",
                Some(3),
            ),
            ("rows = 100\nline_time_s 1e-5", "", Some(2)),
        ] {
            let says = Calibration::from_toml(text).unwrap_err().to_string();
            assert!(says.contains(key), "{text:?}: {says}");
            assert!(
                !says.contains('\n') && says.contains("rowtone calibrate"),
                "{says}"
            );
            let named = line.map_or(!says.contains("line "), |n| {
                says.contains(&format!("line {n}: "))
            });
            assert!(
                named || line.is_none() && says.contains("line_time_s"),
                "{text:?}: {says}"
            );
        }
    }
}
