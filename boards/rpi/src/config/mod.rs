//! The one configuration file: TOML, read once, checked whole.
//!
//! An error names file, line and key. What a host changes over the line ([`rowtone::link::settings`]) starts
//! from here.

mod file;
mod wish;

use std::fmt;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use rowtone::alarm::Level;
use rowtone::link::settings::{Key, Settings};
use rowtone_page::password::Hash;

pub use wish::Wish;

/// All of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Where lines come from.
    pub camera: CameraConfig,
    /// What is measured, and what a host may change.
    pub settings: Settings,
    /// Where reports go.
    pub output: OutputConfig,
    /// How the program runs.
    pub service: ServiceConfig,
    /// The page.
    pub page: PageConfig,
    /// The alarms.
    pub alarms: AlarmsConfig,
    /// The settings that the file names: there it has the last word.
    pub given: Vec<Key>,
}

/// The alarms of the machine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AlarmsConfig {
    /// The file with their rules; no alarms where there is none.
    pub rules: Option<PathBuf>,
    /// The contact that shows them.
    pub contact: Option<ContactConfig>,
}

/// A line of a GPIO chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContactConfig {
    /// The chip's device.
    pub chip: PathBuf,
    /// The line's number on it.
    pub line: u32,
    /// The level from which on it shows an alarm.
    pub at: Level,
    /// High while all is seen to be well, instead of high in alarm.
    pub fail_safe: bool,
}

/// The page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageConfig {
    /// Address and port; no page where there is none.
    pub listen: Option<SocketAddr>,
    /// What is kept of the password for changes; set on the page where there is none.
    pub password: Option<Hash>,
    /// Further names by which the device is called in its network.
    pub names: Vec<String>,
    /// Most bytes of the last pictures.
    pub clip_bytes: usize,
}

/// Where lines come from.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraConfig {
    /// Part of the camera's id; the first camera where there is none.
    pub id: Option<String>,
    /// Sensor mode.
    pub mode: Wish,
    /// Rows as the sensor gives them, or luma of the image processor.
    pub stream: StreamWish,
    /// Of pixels of more than 8 bits all bits, not only the upper 8.
    pub full_depth: bool,
    /// Frame rate, Hz; the fastest where there is none.
    pub frame_rate_hz: Option<f64>,
    /// Alternate between two frame rates, so that no frequency hides at a multiple of one.
    pub two_frame_rates: bool,
    /// Exposure of a row, µs; by the highest frequency where there is none.
    pub exposure_us: Option<u32>,
    /// Analogue gain.
    pub gain: f32,
    /// Where a lens with a motor is set to, dioptres (one over the distance in m); left alone where there is none.
    pub focus_dioptres: Option<f32>,
    /// From one row to the next, s.
    pub line_time_s: Option<f64>,
    /// A calibration file that says so.
    pub calibration: Option<PathBuf>,
    /// Frames in each round of learning.
    pub learn_frames: u16,
    /// For pictures that are shown several times each and unpaced, as libcamera's virtual camera does.
    pub replay: Option<Replay>,
}

/// Every `take_every`-th frame counts, and is so long after the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replay {
    /// How often each picture is shown.
    pub take_every: u32,
    /// From one picture to the next, ns.
    pub frame_period_ns: i64,
}

/// What kind of pictures to take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StreamWish {
    /// Raw rows of the sensor.
    #[default]
    Raw,
    /// Luma from the image processor.
    Luma,
}

/// Where reports go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputConfig {
    /// A serial device, or `-`.
    pub port: String,
    /// Bits a second.
    pub baud: u32,
}

/// How the program runs.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceConfig {
    /// Real-time priority of the line thread; never where there is none.
    pub realtime_priority: Option<u8>,
    /// A camera silent for so long is opened anew, s.
    pub silence_s: f64,
    /// Where settings are kept.
    pub state: PathBuf,
    /// Where the trend is kept; nowhere where there is none.
    pub trend: Option<PathBuf>,
}

/// Highest frequency where none is given, Hz.
pub const USUAL_HIGHEST_HZ: f32 = 1000.0;

impl Config {
    /// What holds without a file.
    pub fn defaults() -> Self {
        Self {
            camera: CameraConfig {
                id: None,
                mode: Wish::Auto,
                stream: StreamWish::Raw,
                full_depth: false,
                frame_rate_hz: None,
                two_frame_rates: false,
                exposure_us: None,
                gain: 4.0,
                focus_dioptres: None,
                line_time_s: None,
                calibration: None,
                learn_frames: 30,
                replay: None,
            },
            settings: Settings::default(),
            output: OutputConfig {
                port: "/dev/serial0".to_owned(),
                baud: 115_200,
            },
            service: ServiceConfig {
                realtime_priority: Some(50),
                silence_s: 2.0,
                state: PathBuf::from("/var/lib/rowtone-rpi/settings"),
                trend: None,
            },
            page: PageConfig {
                listen: Some((Ipv4Addr::UNSPECIFIED, 7357).into()),
                password: None,
                names: Vec::new(),
                clip_bytes: 64 << 20,
            },
            alarms: AlarmsConfig::default(),
            given: Vec::new(),
        }
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`ConfigError`], with the line and key that is wrong.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| ConfigError {
            file: name.clone(),
            line: None,
            what: format!("cannot be read: {e}"),
        })?;
        Self::parse(&text, &name)
    }

    /// As [`Config::load`], from text; `name` is what errors call it.
    ///
    /// ```
    /// use rowtone_rpi::config::Config;
    /// let error = Config::parse("[measure]\nwindow_s = -1", "a.toml").unwrap_err();
    /// assert_eq!(error.to_string(), "a.toml:2: measure.window_s is -1: give 0.05 to 60");
    /// ```
    ///
    /// # Errors
    /// [`ConfigError`], with the line and key that is wrong.
    pub fn parse(text: &str, name: &str) -> Result<Self, ConfigError> {
        file::read(text, name)
    }

    /// The settings to start with, where some were saved: those, but for what the file names. And what is to be said of
    /// that, a line each.
    pub fn with_saved(&self, saved: Settings) -> (Settings, Vec<String>) {
        let (mut settings, mut said) = (saved, Vec::new());
        let text = |key: Key, settings: &Settings| {
            let mut text = String::new();
            // Writing to a string cannot fail.
            let _ = key.write(settings, &mut text);
            text.split_once('=')
                .map_or(String::new(), |(_, value)| value.to_owned())
        };
        for &key in &self.given {
            let (ours, theirs) = (text(key, &self.settings), text(key, &saved));
            if ours != theirs && key.set(&mut settings, &ours).is_ok() {
                let name = key.name();
                said.push(format!(
                    "{name} is {ours}, as the file says, and not {theirs}, as was saved"
                ));
            }
        }
        settings.hop_s = settings.hop_s.min(settings.window_s);
        let defaults = Self::defaults().settings;
        for key in Key::ALL {
            let value = text(key, &settings);
            if !self.given.contains(&key) && value != text(key, &defaults) {
                said.push(format!(
                    "{} is {value}, as was saved; the file does not name it",
                    key.name()
                ));
            }
        }
        (settings, said)
    }

    /// Highest frequency to measure, Hz.
    pub fn highest_hz(&self) -> f32 {
        self.settings.max_hz.unwrap_or(USUAL_HIGHEST_HZ)
    }

    /// Exposure of a row, µs: as configured, or a quarter of the shortest period, which costs 10 % of its
    /// amplitude (and is undone in the report).
    pub fn exposure_us(&self) -> u32 {
        let by_period = 0.25e6 / self.highest_hz();
        self.camera
            .exposure_us
            .unwrap_or(by_period.clamp(20.0, 20_000.0) as u32)
    }
}

/// What is wrong with the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Key, value, and what to give instead.
    pub what: String,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file, self.what),
            None => write!(f, "{}: {}", self.file, self.what),
        }
    }
}

impl std::error::Error for ConfigError {}
