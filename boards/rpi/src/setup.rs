//! From what the camera does and what is wanted to what the core is told.

use std::fmt;
use std::path::{Path, PathBuf};

use rowtone::camera::{Timing, TimingError};
use rowtone::link::settings::{Region, Settings};
use rowtone::spectrum;
use rowtone::timeline::{BinnerError, Group, rows_per_sample};
use rowtone::tracker;

use crate::capture::{Facts, Shape};
use crate::config::{CameraConfig, Config, USUAL_HIGHEST_HZ};
use crate::sensor;

/// Samples of a window that are aimed at, at most: memory and spectrum work grow with them.
const WINDOW_SAMPLES: usize = 65_536;

/// All that measuring needs to know.
#[derive(Clone, Debug)]
pub struct Setup {
    /// How frames lie in memory.
    pub shape: Shape,
    /// Part of the picture that is measured.
    pub part: Region,
    /// Start of exposure of the part's first row after that of the picture's, ns.
    pub part_start_ns: i64,
    /// For the tracker.
    pub tracker: tracker::Config,
    /// For binner and collector.
    pub group: Group,
    /// For the spectrum.
    pub spectrum: spectrum::Config,
    /// Frames of a window, some spare.
    pub window_frames: usize,
    /// What the user should know: where the line time comes from, what was rounded.
    pub remarks: Vec<String>,
}

/// Why measuring cannot begin.
#[derive(Clone, Debug, PartialEq)]
pub enum SetupError {
    /// Nobody knows the line time.
    NoLineTime {
        /// The camera.
        camera: String,
    },
    /// A calibration file without a usable `line_time_s`.
    Calibration {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The region is not in the picture.
    Region {
        /// What was asked for.
        region: Region,
        /// Size of the picture.
        picture: (u16, u16),
    },
    /// The line time cannot be.
    Timing(TimingError),
    /// Too few rows.
    Group(BinnerError),
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLineTime { camera } => write!(
                f,
                "the line time of {camera} is not known: measure it with `rowtone calibrate` and give \
                 camera.calibration or camera.line_time_us"
            ),
            Self::Calibration { file, why } => write!(f, "{}: {why}", file.display()),
            Self::Region { region, picture } => write!(
                f,
                "roi {},{} {}x{} does not lie in the picture of {}x{}",
                region.x, region.y, region.width, region.height, picture.0, picture.1
            ),
            Self::Timing(e) => e.fmt(f),
            Self::Group(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for SetupError {}

impl Setup {
    /// Joins camera, file and settings.
    ///
    /// # Errors
    /// [`SetupError`] when they do not fit together.
    pub fn new(facts: &Facts, config: &Config, settings: &Settings) -> Result<Self, SetupError> {
        let shape = facts.shape;
        let mut remarks = Vec::new();
        let line_time_s = line_time_s(facts, &config.camera, &mut remarks)?;
        let part = part(&shape, settings.roi, &mut remarks)?;
        let line_time_ps = (line_time_s * 1e12).round() as u32;
        let timing = Timing::new(line_time_ps, config.exposure_us() * 1000, part.height)
            .map_err(SetupError::Timing)?;
        let whole = Timing::new(line_time_ps, 0, shape.height).map_err(SetupError::Timing)?;
        let highest_hz = settings.max_hz.unwrap_or(USUAL_HIGHEST_HZ);
        let period_ns = facts.frame_period_ns.unwrap_or(whole.readout_ns()).max(1);
        let frames = f64::from(settings.window_s) * 1e9 / period_ns as f64;
        let rows = rows_per_sample(timing, highest_hz, frames as u32, WINDOW_SAMPLES);
        let group = Group::new(timing, rows).map_err(SetupError::Group)?;
        let tracker = tracker::Config {
            bits: match config.camera.full_depth {
                true => shape.format.bits(),
                false => 8,
            },
            stride: if shape.bayer { 2 } else { 1 },
            learn_frames: config.camera.learn_frames,
            ..tracker::Config::new(timing, part.width)
        };
        Ok(Self {
            shape,
            part,
            part_start_ns: whole.start_ns(part.y),
            tracker,
            group,
            spectrum: settings.spectrum(),
            window_frames: (frames * 1.25) as usize + 2,
            remarks,
        })
    }
}

/// In this order: file, calibration, driver, table.
fn line_time_s(
    facts: &Facts,
    camera: &CameraConfig,
    remarks: &mut Vec<String>,
) -> Result<f64, SetupError> {
    let (seconds, from) = if let Some(seconds) = camera.line_time_s {
        (seconds, "the configuration".to_owned())
    } else if let Some(file) = &camera.calibration {
        let seconds = calibrated(file, facts.shape.height)?;
        (seconds, file.display().to_string())
    } else if let Some((seconds, who)) = facts.line_time {
        (seconds, who.to_owned())
    } else if let Some(mode) = sensor::lookup(&facts.id, facts.shape.width, facts.shape.height) {
        let (seconds, certain) = mode.line_time_s(facts.shortest_frame_s);
        let why = match certain {
            true => "which fits the camera's shortest frame",
            false => "and nothing confirms it",
        };
        let from = format!("the sensor table, {why}: calibrate to be sure");
        (seconds, from)
    } else {
        let camera = facts.id.clone();
        return Err(SetupError::NoLineTime { camera });
    };
    remarks.push(format!("line time {:.4} us, from {from}", seconds * 1e6));
    Ok(seconds)
}

/// `line_time_s` of a calibration file, which must be of a picture of so many rows: another mode's is another. Which way
/// its picture rolled does not matter: a sensor's lines come here as they are read.
fn calibrated(file: &Path, rows: u16) -> Result<f64, SetupError> {
    let refuse = |why: String| SetupError::Calibration {
        file: file.to_owned(),
        why,
    };
    let text = std::fs::read_to_string(file).map_err(|e| refuse(format!("cannot be read: {e}")))?;
    let line = |at: usize| text.bytes().take(at).filter(|&b| b == b'\n').count() + 1;
    let line_of = |key: &str| {
        let begins = |l: &str| l.split('=').next().is_some_and(|k| k.trim() == key);
        let line = text.lines().position(begins);
        line.map_or(String::new(), |line| format!("line {}: ", line + 1))
    };
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(1, |span| line(span.start));
        let what = e.message().lines().next().unwrap_or_default();
        refuse(format!(
            "line {line}: {what}: make it with `rowtone calibrate -o FILE`"
        ))
    })?;
    let its_rows = table.get("rows").and_then(toml::Value::as_integer);
    if let Some(its_rows) = its_rows.filter(|&its_rows| its_rows != i64::from(rows)) {
        let why = format!(
            "{}it was made with pictures of {its_rows} rows, and these have {rows}: calibrate in this mode, or give \
             camera.mode",
            line_of("rows")
        );
        return Err(refuse(why));
    }
    table
        .get("line_time_s")
        .and_then(toml::Value::as_float)
        .filter(|s| (1e-7..4e-3).contains(s))
        .ok_or_else(|| {
            let line = line_of("line_time_s");
            refuse(format!(
                "{line}no usable line_time_s in it: make it with `rowtone calibrate -o FILE`"
            ))
        })
}

/// The part to measure, its left edge moved to where a group of packed pixels begins.
fn part(
    shape: &Shape,
    roi: Option<Region>,
    remarks: &mut Vec<String>,
) -> Result<Region, SetupError> {
    let Some(roi) = roi else {
        return Ok(Region {
            x: 0,
            y: 0,
            width: shape.width,
            height: shape.height,
        });
    };
    let inside =
        |from: u16, length: u16, all: u16| u32::from(from) + u32::from(length) <= all.into();
    if !inside(roi.x, roi.width, shape.width) || !inside(roi.y, roi.height, shape.height) {
        return Err(SetupError::Region {
            region: roi,
            picture: (shape.width, shape.height),
        });
    }
    let x = roi.x - roi.x % shape.format.group() as u16;
    if x != roi.x {
        remarks.push(format!(
            "roi begins at x = {x}: packed pixels come in groups"
        ));
    }
    Ok(Region { x, ..roi })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::camera::RawFormat;

    fn facts(id: &str, line_time: Option<(f64, &'static str)>) -> Facts {
        Facts {
            id: id.to_owned(),
            shape: Shape {
                width: 1332,
                height: 990,
                stride: 1728,
                format: RawFormat::Packed10,
                bayer: true,
            },
            line_time,
            frame_period_ns: Some(8_330_000),
            shortest_frame_s: Some(8_330e-6),
            reasons: String::new(),
        }
    }

    #[test]
    fn the_nearest_source_of_the_line_time_counts() {
        let config = Config::defaults();
        let setup = |facts: &Facts, config: &Config| Setup::new(facts, config, &config.settings);
        let table = setup(&facts("imx477", None), &config).unwrap();
        assert_eq!(table.tracker.timing.line_time_ps(), 7_933_333);
        assert!(table.remarks[0].contains("fits the camera's shortest frame: calibrate"));
        let driver = setup(&facts("imx477", Some((8e-6, "the driver"))), &config).unwrap();
        assert_eq!(driver.tracker.timing.line_time_ps(), 8_000_000);
        assert!(matches!(
            setup(&facts("virtual", None), &config),
            Err(SetupError::NoLineTime { .. })
        ));
        let given = Config::parse("[camera]\nline_time_us = 9.5", "f").unwrap();
        let setup = setup(&facts("virtual", None), &given).unwrap();
        assert_eq!(setup.tracker.timing.line_time_ps(), 9_500_000);
        assert_eq!((setup.tracker.bits, setup.tracker.stride), (8, 2));
        let deep = Config::parse("[camera]\nfull_depth = true", "f").unwrap();
        let setup = Setup::new(&facts("imx477", None), &deep, &deep.settings).unwrap();
        assert_eq!(setup.tracker.bits, 10);
    }

    #[test]
    fn a_calibration_is_of_one_mode() {
        let path = std::env::temp_dir().join(format!("rowtone-cal-{}.toml", std::process::id()));
        let text = format!("[camera]\ncalibration = {path:?}");
        let config = Config::parse(&text, "f").unwrap();
        let setup = || Setup::new(&facts("imx477", None), &config, &config.settings);
        std::fs::write(&path, "rows = 990\nline_time_s = 7.94e-6\n").unwrap();
        assert_eq!(setup().unwrap().tracker.timing.line_time_ps(), 7_940_000);
        for (text, why) in [
            (
                "rows = 1080\nline_time_s = 7.94e-6\n",
                "line 1: it was made with pictures of 1080 rows",
            ),
            ("rows = 990\n", ": no usable line_time_s"),
            (
                "rows = 990\nline_time_s = nan\n",
                "line 2: no usable line_time_s",
            ),
            ("rows = 990\n\nline_time_s = oops\n", "line 3: "),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = setup().unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
        std::fs::remove_file(&path).unwrap();
        let error = setup().unwrap_err().to_string();
        assert!(error.contains("cannot be read"), "{error}");
    }

    #[test]
    fn a_region_is_cut_where_pixels_can_be() {
        let config = Config::parse("[camera]\nroi = [6, 100, 640, 200]", "f").unwrap();
        let setup = Setup::new(&facts("imx477", None), &config, &config.settings).unwrap();
        assert_eq!((setup.part.x, setup.part.width), (4, 640));
        assert_eq!(setup.part_start_ns, 793_333);
        assert_eq!(setup.group.timing().rows(), 200);
        let config = Config::parse("[camera]\nroi = [1000, 0, 640, 200]", "f").unwrap();
        let error = Setup::new(&facts("imx477", None), &config, &config.settings).unwrap_err();
        assert!(error.to_string().contains("1332x990"), "{error}");
    }
}
