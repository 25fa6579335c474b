//! The options that say what is looked for in a window: the same for every command that reports tones.

use crate::failure::Failure;
use crate::quantity::{Unit, number};
use rowtone::report::MAX_PEAKS;
use rowtone_measure::analysis::Settings;

/// Windows follow each other no faster, s.
const LEAST_HOP_S: f64 = 0.001;

/// What is looked for, and in how long a window.
#[derive(Clone, Debug, clap::Args)]
pub struct WindowArgs {
    /// Length of a window, s
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = seconds, allow_negative_numbers = true)]
    pub window: f64,
    /// From one window to the next, s [default: half a window]
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub hop: Option<f64>,
    /// Most peaks reported
    #[arg(long, value_name = "N", default_value_t = 8,
          value_parser = clap::value_parser!(u8).range(1..=MAX_PEAKS as i64))]
    pub max_peaks: u8,
    /// Lowest frequency looked for, Hz [default: one period a window]
    #[arg(long, value_name = "F", value_parser = hertz, allow_negative_numbers = true)]
    pub min_hz: Option<f64>,
    /// Highest frequency looked for, Hz [default: 2000; half the frame rate with --global-shutter]
    #[arg(long, value_name = "F", value_parser = hertz, allow_negative_numbers = true)]
    pub max_hz: Option<f64>,
}

impl WindowArgs {
    /// From one window to the next, s.
    pub fn hop_s(&self) -> f64 {
        self.hop.unwrap_or(self.window / 2.0)
    }

    /// What can be checked without the input.
    ///
    /// # Errors
    /// [`Failure::Usage`] where the lowest frequency is not below the highest, or windows follow each other too
    /// fast.
    pub fn check(&self) -> Result<(), Failure> {
        if self.hop_s() < LEAST_HOP_S {
            let (option, value, least) = match self.hop {
                Some(hop) => ("--hop", hop, LEAST_HOP_S),
                None => ("--window", self.window, 2.0 * LEAST_HOP_S),
            };
            return Err(Failure::usage(format!(
                "{option} {value} is too short: give {least} s or more"
            )));
        }
        if let (Some(min), Some(max)) = (self.min_hz, self.max_hz)
            && min >= max
        {
            return Err(Failure::usage(format!(
                "--min-hz {min} must be below --max-hz {max}"
            )));
        }
        Ok(())
    }

    /// What lies between two windows is not measured, which nobody may have meant.
    pub fn gap(&self) -> Option<String> {
        let hop = self.hop.filter(|hop| *hop > self.window)?;
        let window = self.window;
        Some(format!(
            "--hop {hop} is longer than --window {window}: what lies between two windows is not measured"
        ))
    }

    /// The analysis's settings, with this scale in µm a pixel.
    pub fn settings(&self, um_per_px: Option<f64>) -> Settings {
        Settings {
            window_s: self.window,
            hop_s: self.hop_s(),
            max_peaks: self.max_peaks.into(),
            min_hz: self.min_hz,
            max_hz: self.max_hz,
            um_per_px,
        }
    }

    /// The same as a board's settings, with this scale in µm a pixel.
    pub fn as_a_board_says(&self, um_per_px: Option<f64>) -> rowtone::link::settings::Settings {
        rowtone::link::settings::Settings {
            window_s: self.window as f32,
            hop_s: self.hop_s() as f32,
            max_peaks: self.max_peaks,
            um_per_px: um_per_px.map(|scale| scale as f32),
            min_hz: self.min_hz.map(|hz| hz as f32),
            max_hz: self.max_hz.map(|hz| hz as f32),
            ..rowtone::link::settings::Settings::default()
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    in_range(text, 0.001, 3600.0, Unit::Seconds, "s")
}

pub(super) fn hertz(text: &str) -> Result<f64, String> {
    in_range(text, 1e-3, 1e6, Unit::Hertz, "Hz")
}

fn in_range(text: &str, low: f64, high: f64, unit: Unit, name: &str) -> Result<f64, String> {
    number(text, unit, low..=high, || {
        format!("want a number from {low} to {high} {name}")
    })
}
