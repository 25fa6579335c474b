//! Reports as JSON Lines and as text, and what stands in neither and follows from both: velocities,
//! zones, the names of warnings.

mod example;
pub mod json;
pub mod text;
pub mod zone;

use rowtone::report::{Report, Warning, Warnings};

pub use example::example;

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
mod tests {
    use super::*;

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
