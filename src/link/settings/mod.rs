//! What a board can be told: settings, checked as a whole, changed over the line, and kept.
//!
//! [`Settings`] is plain data. Nothing uses it before [`Settings::check`] has passed all of it, so
//! a change that fits only together with another is made in one command (`set window 0.5 hop
//! 0.25`). [`command`] reads the commands, [`Console`] carries them out, [`store`] keeps what was
//! saved in flash in a way that no cut of the power can harm.

mod check;
pub mod command;
mod console;
mod key;
mod lock;
mod real;
pub mod store;

use serde::{Deserialize, Serialize};

use crate::math::ns_of_s;
use crate::spectrum;
use crate::wire::Format;

pub use check::{Limits, SettingsError};
pub use console::{Board, Console};
pub use key::{Key, ValueError};
pub use lock::LockError;

/// A part of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// Left column, px.
    pub x: u16,
    /// Top row, px.
    pub y: u16,
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
}

/// All that can be set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Length of a window, s.
    pub window_s: f32,
    /// Time from one window to the next, s.
    pub hop_s: f32,
    /// Most peaks in a report.
    pub max_peaks: u8,
    /// Chance that a window without any vibration reports a peak.
    pub false_alarm: f32,
    /// Scale of the picture, µm a pixel, where it is known.
    pub um_per_px: Option<f32>,
    /// Part of the picture to use; the whole where there is none.
    pub roi: Option<Region>,
    /// Lowest frequency to report, Hz; as low as the window allows where there is none.
    pub min_hz: Option<f32>,
    /// Highest frequency to report, Hz; as high as the rows allow where there is none.
    pub max_hz: Option<f32>,
    /// How reports are written.
    pub wire: Format,
    /// Address as a Modbus server, 1 to 247.
    pub unit: u8,
    /// The number that unlocks the settings, where they are locked ([`Console::lock`]).
    pub lock: Option<u32>,
}

impl Settings {
    /// [`Settings::default`], as a constant.
    pub const DEFAULT: Self = Self {
        window_s: 1.0,
        hop_s: 0.5,
        max_peaks: 8,
        false_alarm: 1e-3,
        um_per_px: None,
        roi: None,
        min_hz: None,
        max_hz: None,
        wire: Format::Text,
        unit: 1,
        lock: None,
    };
}

impl Settings {
    /// What the settings mean for the spectrum, the same on every board; what they do not say is the default.
    pub fn spectrum(&self) -> spectrum::Config {
        spectrum::Config {
            window_ns: ns_of_s(self.window_s),
            hop_ns: ns_of_s(self.hop_s),
            min_hz: self.min_hz,
            max_hz: self.max_hz,
            max_peaks: self.max_peaks.into(),
            false_alarm: self.false_alarm,
            um_per_px: self.um_per_px,
            ..spectrum::Config::default()
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::DEFAULT
    }
}
