//! Results out: reports as JSON Lines and text, displacements as CSV, NPY and WAV, pictures as SVG and
//! PNG.
//!
//! Standard output carries results and nothing else. [`Out`] writes lines to it (or to a file), each
//! flushed as it is complete, and turns a closed pipe into [`Failure::OutputClosed`].

pub mod json;
pub mod plot;
pub mod progress;
pub mod series;
pub mod text;
pub mod wav;
pub mod zone;

use std::io::{self, Write};

use rowtone::report::{Report, Warning, Warnings};

use crate::failure::Failure;

/// Standard output, line by line.
#[derive(Debug)]
pub struct Out {
    to: io::Stdout,
}

impl Default for Out {
    fn default() -> Self {
        Self { to: io::stdout() }
    }
}

impl Out {
    /// Writes `text` and a line feed, and flushes: whoever reads has each line as soon as it is known.
    ///
    /// # Errors
    /// [`Failure::OutputClosed`] when the reader is gone, [`Failure::Input`] when writing fails.
    pub fn line(&mut self, text: &str) -> Result<(), Failure> {
        let mut to = self.to.lock();
        to.write_all(text.as_bytes())
            .and_then(|()| to.write_all(b"\n"))
            .and_then(|()| to.flush())
            .map_err(|e| Failure::writing("standard output", &e))
    }
}

/// Velocity of a tone, mm/s RMS: 2π·f·A/√2, from its amplitude in µm.
pub fn velocity_mm_s_rms(hz: f64, amplitude_um: f64) -> f64 {
    std::f64::consts::TAU * hz * amplitude_um * 1e-3 / std::f64::consts::SQRT_2
}

/// The velocity of a whole report over 10–1000 Hz, mm/s RMS, where it has a scale.
pub fn band_velocity(report: &Report) -> Option<f64> {
    let scale = f64::from(report.um_per_px?);
    if let Some(velocity) = report.velocity_mm_s_rms {
        return Some(f64::from(velocity));
    }
    let squares: f64 = report
        .peaks
        .iter()
        .filter(|peak| (10.0..=1000.0).contains(&peak.hz))
        .map(|peak| velocity_mm_s_rms(peak.hz.into(), f64::from(peak.amplitude_px) * scale).powi(2))
        .sum();
    Some(squares.sqrt())
}

/// Every warning, its name in JSON, and what it says to a person.
const WARNINGS: [(Warning, &str, &str); 11] = [
    (
        Warning::HiddenNearFrameRate,
        "hidden_near_frame_rate",
        "a vibration near a multiple of the frame rate could hide: change the frame rate to look again",
    ),
    (Warning::LostFrames, "lost_frames", "frames were lost"),
    (
        Warning::ShortWindow,
        "short_window",
        "the window is shorter than asked for",
    ),
    (
        Warning::Disturbed,
        "disturbed",
        "something passed through the picture: its rows were left out",
    ),
    (
        Warning::Relearned,
        "relearned",
        "the scene changed: the reference was learned anew",
    ),
    (
        Warning::LittleTexture,
        "little_texture",
        "less than half of the rows have texture to measure",
    ),
    (
        Warning::MoreTones,
        "more_tones",
        "there were more tones than the report holds",
    ),
    (
        Warning::BadLight,
        "bad_light",
        "the picture is too dark or saturated in most rows",
    ),
    (
        Warning::WatchdogReset,
        "watchdog_reset",
        "the board has started anew: its watchdog reset it",
    ),
    (
        Warning::PanicReset,
        "panic_reset",
        "the board has started anew: its firmware failed",
    ),
    (
        Warning::CommandReset,
        "command_reset",
        "the board has started anew: it was told to",
    ),
];

/// The warnings that are set, as (name, sentence).
pub fn warnings(set: Warnings) -> impl Iterator<Item = (&'static str, &'static str)> {
    WARNINGS
        .into_iter()
        .filter(move |(warning, ..)| set.0 & *warning as u16 != 0)
        .map(|(_, name, sentence)| (name, sentence))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use rowtone::report::Peak;

    /// A report with two peaks and two warnings.
    pub(crate) fn example(um_per_px: Option<f32>) -> Report {
        let peak = |hz, amplitude_px| Peak {
            hz,
            hz_sd: 0.0004,
            amplitude_px,
            amplitude_px_sd: 0.0002,
            snr_db: 61.2,
            ambiguous: false,
            track: 1,
            harmonic: None,
        };
        Report {
            seq: 3,
            time_ms: 2500,
            window_s: 1.0,
            fps: 60.0,
            lines: 18000,
            lost_frames: 2,
            noise_px: 0.0131,
            peaks: [peak(49.2003, 0.3998), peak(1500.0, 0.02)]
                .into_iter()
                .collect(),
            warnings: Warnings(Warning::LostFrames as u16 | Warning::Disturbed as u16),
            um_per_px,
            velocity_mm_s_rms: None,
        }
    }

    #[test]
    fn the_band_velocity_leaves_out_what_is_above_1_khz() {
        assert_eq!(band_velocity(&example(None)), None);
        let velocity = band_velocity(&example(Some(100.0))).unwrap();
        // 2π · 49.2003 Hz · 39.98 µm / √2
        assert!((velocity - 8.7395).abs() < 0.001, "{velocity}");
    }

    #[test]
    fn warnings_have_their_names() {
        let set: Vec<_> = warnings(example(None).warnings).map(|w| w.0).collect();
        assert_eq!(set, ["lost_frames", "disturbed"]);
    }
}
