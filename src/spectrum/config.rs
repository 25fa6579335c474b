//! What is looked for, in which windows.

use core::fmt;

use crate::report::MAX_PEAKS;

/// What is looked for, in which windows. Plain data; [`Config::check`] says what is wrong with it.
///
/// ```
/// use rowtone::spectrum::Config;
/// let config = Config { window_ns: 2_000_000_000, min_hz: Some(10.0), ..Config::default() };
/// assert!(config.check().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Length of a window, ns. Default 1 s.
    pub window_ns: i64,
    /// From the end of a window to the end of the next, ns. Default 0.5 s.
    pub hop_ns: i64,
    /// Lowest frequency reported, Hz; `None`: the lowest the window can tell from drift, one period a window.
    pub min_hz: Option<f32>,
    /// Highest frequency reported, Hz; `None`: the highest the samples can tell, 0.49 a sample spacing.
    pub max_hz: Option<f32>,
    /// Most peaks reported, 1 to [`MAX_PEAKS`]. Default 8.
    pub max_peaks: usize,
    /// Share of windows of pure noise that report a peak. Default 1 in 1000.
    pub false_alarm: f32,
    /// Most passes over a window's samples, at least 20: bounds the time a window takes. A tone costs about 10, near a
    /// multiple of the frame rate or with changing frequency up to 80. Where the noise is not white, half as many again.
    /// Default 1000.
    pub max_passes: u32,
    /// Scale of the picture, µm a pixel.
    pub um_per_px: Option<f32>,
    /// Broad-band measures are made: a fifth more of a microcontroller's time a window. Default true.
    pub broad_band: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            window_ns: 1_000_000_000,
            hop_ns: 500_000_000,
            min_hz: None,
            max_hz: None,
            max_peaks: 8,
            false_alarm: 1e-3,
            max_passes: 1000,
            um_per_px: None,
            broad_band: true,
        }
    }
}

impl Config {
    /// # Errors
    /// [`ConfigError`], the first field that cannot be used.
    pub fn check(&self) -> Result<(), ConfigError> {
        let hour_ns = 3_600_000_000_000;
        if !(1_000_000..=hour_ns).contains(&self.window_ns) {
            return Err(ConfigError::WindowNs(self.window_ns));
        }
        if !(1_000_000..=hour_ns).contains(&self.hop_ns) {
            return Err(ConfigError::HopNs(self.hop_ns));
        }
        for (value, error) in [
            (self.min_hz, ConfigError::MinHz as fn(f32) -> _),
            (self.max_hz, ConfigError::MaxHz as fn(f32) -> _),
            (self.um_per_px, ConfigError::UmPerPx as fn(f32) -> _),
        ] {
            match value {
                Some(v) if !(v > 0.0 && v.is_finite()) => return Err(error(v)),
                _ => {}
            }
        }
        if let (Some(min), Some(max)) = (self.min_hz, self.max_hz)
            && min >= max
        {
            return Err(ConfigError::MinHz(min));
        }
        if !(1..=MAX_PEAKS).contains(&self.max_peaks) {
            return Err(ConfigError::MaxPeaks(self.max_peaks));
        }
        if !(1e-9..=0.5).contains(&self.false_alarm) {
            return Err(ConfigError::FalseAlarm(self.false_alarm));
        }
        if self.max_passes < 20 {
            return Err(ConfigError::MaxPasses(self.max_passes));
        }
        Ok(())
    }
}

/// Why a [`Config`] or its storage was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConfigError {
    /// `window_ns` must be from 1 ms to 1 h.
    WindowNs(i64),
    /// `hop_ns` must be from 1 ms to 1 h.
    HopNs(i64),
    /// `min_hz` must be above 0 and below `max_hz`.
    MinHz(f32),
    /// `max_hz` must be above 0.
    MaxHz(f32),
    /// `um_per_px` must be above 0.
    UmPerPx(f32),
    /// `max_peaks` must be from 1 to [`MAX_PEAKS`].
    MaxPeaks(usize),
    /// `false_alarm` must be from 1e-9 to 0.5.
    FalseAlarm(f32),
    /// `max_passes` must be at least 20.
    MaxPasses(u32),
    /// The lent memory does not hold one window.
    Storage {
        /// Which part is too small.
        part: &'static str,
        /// What it must hold at least.
        needs: usize,
        /// What it holds.
        holds: usize,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::WindowNs(v) => write!(f, "window_ns must be from 1 ms to 1 h, not {v} ns"),
            Self::HopNs(v) => write!(f, "hop_ns must be from 1 ms to 1 h, not {v} ns"),
            Self::MinHz(v) => write!(f, "min_hz must be above 0 and below max_hz, not {v}"),
            Self::MaxHz(v) => write!(f, "max_hz must be above 0, not {v}"),
            Self::UmPerPx(v) => write!(f, "um_per_px must be above 0, not {v}"),
            Self::MaxPeaks(v) => write!(f, "max_peaks must be from 1 to {MAX_PEAKS}, not {v}"),
            Self::FalseAlarm(v) => write!(f, "false_alarm must be from 1e-9 to 0.5, not {v}"),
            Self::MaxPasses(v) => write!(f, "max_passes must be at least 20, not {v}"),
            Self::Storage { part, needs, holds } => {
                write!(
                    f,
                    "the storage's {part} must hold at least {needs}, not {holds}: lend more or combine more rows"
                )
            }
        }
    }
}

impl core::error::Error for ConfigError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_is_checked() {
        let good = Config::default();
        let bad = [
            Config {
                window_ns: 0,
                ..good
            },
            Config { hop_ns: -1, ..good },
            Config {
                min_hz: Some(f32::NAN),
                ..good
            },
            Config {
                min_hz: Some(20.0),
                max_hz: Some(10.0),
                ..good
            },
            Config {
                max_hz: Some(-1.0),
                ..good
            },
            Config {
                max_peaks: 0,
                ..good
            },
            Config {
                max_peaks: 99,
                ..good
            },
            Config {
                false_alarm: f32::NAN,
                ..good
            },
            Config {
                max_passes: 0,
                ..good
            },
            Config {
                um_per_px: Some(0.0),
                ..good
            },
        ];
        assert!(good.check().is_ok());
        assert!(bad.iter().all(|c| c.check().is_err()));
    }
}
