//! Whether settings make sense together, and on this board.

use core::fmt;

use crate::report::MAX_PEAKS;

use super::{Region, Settings};
use crate::wire::Format;

/// What the board's camera and memory allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Columns of the picture.
    pub width: u16,
    /// Rows of the picture.
    pub height: u16,
    /// Narrowest region that can be measured, px.
    pub min_width: u16,
    /// Longest window that the memory holds, s.
    pub max_window_s: f32,
}

/// A setting that cannot be, and its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingsError {
    /// The window is shorter than 0.05 s or longer than the board allows.
    Window {
        /// What was asked for, s.
        window_s: f32,
        /// What is possible at most, s.
        max_s: f32,
    },
    /// The hop is shorter than 0.01 s or longer than the window.
    Hop {
        /// What was asked for, s.
        hop_s: f32,
        /// Length of the window, s.
        window_s: f32,
    },
    /// Not from 1 to [`MAX_PEAKS`].
    MaxPeaks(u8),
    /// Not from 1e-9 to 0.5.
    FalseAlarm(f32),
    /// Not from 0.001 to 100000 µm a pixel.
    Scale(f32),
    /// Outside the picture, without rows, or too narrow to measure.
    Roi(Region, Limits),
    /// Not from 0 to 1 MHz.
    Frequency(f32),
    /// The lowest frequency is not below the highest.
    Band {
        /// Lowest, Hz.
        min_hz: f32,
        /// Highest, Hz.
        max_hz: f32,
    },
    /// This firmware was built without it.
    Wire(Format),
    /// Not from 1 to 247.
    Unit(u8),
    /// They are locked.
    Locked,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window { window_s, max_s } => {
                write!(f, "window is {window_s} s; give 0.05 to {max_s}")
            }
            Self::Hop { hop_s, window_s } => write!(
                f,
                "hop is {} s; give 0.01 to the window's length, {}",
                hop_s, window_s
            ),
            Self::MaxPeaks(n) => write!(f, "max-peaks is {n}; give 1 to {MAX_PEAKS}"),
            Self::FalseAlarm(p) => write!(f, "false-alarm is {}; give 1e-9 to 0.5", p),
            Self::Scale(s) => write!(f, "um-per-px is {}; give 0.001 to 100000, or none", s),
            Self::Roi(r, limits) => write!(
                f,
                "roi is {},{},{},{}; keep it inside {}x{} px, at least {} wide and 1 high",
                r.x, r.y, r.width, r.height, limits.width, limits.height, limits.min_width
            ),
            Self::Frequency(hz) => write!(f, "frequency is {} Hz; give 0 to 1000000, or none", hz),
            Self::Band { min_hz, max_hz } => write!(
                f,
                "min-hz is {}, max-hz is {}; keep min-hz below max-hz",
                min_hz, max_hz
            ),
            Self::Wire(wire) => write!(
                f,
                "wire is {}; this firmware was built without it",
                wire.name()
            ),
            Self::Unit(unit) => write!(f, "unit is {unit}; give 1 to 247"),
            Self::Locked => f.write_str("settings are locked; unlock them first"),
        }
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Whether all settings are possible, alone, together, and on a board with these limits.
    ///
    /// # Errors
    /// The first setting that is not.
    pub fn check(&self, limits: &Limits) -> Result<(), SettingsError> {
        // `contains` is false for NaN, so it needs no case of its own.
        let (window_s, max_s) = (self.window_s, limits.max_window_s);
        if !(0.05..=max_s).contains(&window_s) {
            return Err(SettingsError::Window { window_s, max_s });
        }
        let hop_s = self.hop_s;
        if !(0.01..=window_s).contains(&hop_s) {
            return Err(SettingsError::Hop { hop_s, window_s });
        }
        if !(1..=MAX_PEAKS).contains(&usize::from(self.max_peaks)) {
            return Err(SettingsError::MaxPeaks(self.max_peaks));
        }
        if !(1e-9..=0.5).contains(&self.false_alarm) {
            return Err(SettingsError::FalseAlarm(self.false_alarm));
        }
        if let Some(scale) = self.um_per_px
            && !(0.001..=100_000.0).contains(&scale)
        {
            return Err(SettingsError::Scale(scale));
        }
        self.check_roi(limits)?;
        self.check_band()?;
        if !self.wire.is_built_in() {
            return Err(SettingsError::Wire(self.wire));
        }
        if !(1..=247).contains(&self.unit) {
            return Err(SettingsError::Unit(self.unit));
        }
        Ok(())
    }

    fn check_roi(&self, limits: &Limits) -> Result<(), SettingsError> {
        let Some(roi) = self.roi else { return Ok(()) };
        let inside =
            |from: u16, size: u16, end: u16| from.checked_add(size).is_some_and(|last| last <= end);
        let fits =
            inside(roi.x, roi.width, limits.width) && inside(roi.y, roi.height, limits.height);
        if fits && roi.width >= limits.min_width.max(1) && roi.height >= 1 {
            Ok(())
        } else {
            Err(SettingsError::Roi(roi, *limits))
        }
    }

    fn check_band(&self) -> Result<(), SettingsError> {
        for hz in [self.min_hz, self.max_hz].into_iter().flatten() {
            if !(0.0..=1e6).contains(&hz) {
                return Err(SettingsError::Frequency(hz));
            }
        }
        match (self.min_hz, self.max_hz) {
            (Some(min_hz), Some(max_hz)) if min_hz >= max_hz => {
                Err(SettingsError::Band { min_hz, max_hz })
            }
            _ => Ok(()),
        }
    }
}
