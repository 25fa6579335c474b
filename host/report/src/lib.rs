//! Reports as JSON Lines and as text, and what stands in neither and follows from both: velocities,
//! zones, the names of warnings.

pub mod alarms;
mod broad;
mod example;
pub mod json;
pub mod machine;
mod motion;
pub mod summary;
pub mod text;
pub mod zone;

use rowtone::report::{Report, Warning};

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

/// What a warning says to a person: a sentence without a stop.
pub const fn sentence(warning: Warning) -> &'static str {
    match warning {
        Warning::HiddenNearFrameRate => {
            "a vibration near a multiple of the frame rate could hide: change the frame rate to look again"
        }
        Warning::LostFrames => "frames were lost",
        Warning::ShortWindow => "the window is shorter than asked for",
        Warning::Occluded => "something passed through the picture: its rows were left out",
        Warning::Relearned => "the scene changed: the reference was learned again",
        Warning::LittleTexture => "less than half of the rows have texture to measure",
        Warning::MoreTones => "there were more tones than the report holds",
        Warning::BadLight => "the picture is too dark or saturated in most rows",
        Warning::WatchdogReset => "the board has started again: its watchdog reset it",
        Warning::PanicReset => "the board has started again: its firmware failed",
        Warning::CommandReset => "the board has started again: it was told to",
        Warning::ThinGroups => {
            "groups of rows lacked rows that they have as a rule, and were left out"
        }
        Warning::DroppedSamples => "samples were dropped: they came late or found no room",
        Warning::DroppedWindows => {
            "a window before this one was not computed: the spectrum was busy"
        }
        Warning::CameraMoves => "the camera itself moves: give --background, or fix it better",
        Warning::TimingContradiction => {
            "the motion contradicts frame rate times line time: one of the two is wrong"
        }
        Warning::Compressed => {
            "the video codec took small motions away: amplitudes are lower bounds (record with more key frames, \
             as MJPEG, ProRes or raw)"
        }
        Warning::RepeatedFrames => "frames came more than once",
        Warning::ExposureUnknown => {
            "the exposure is unknown: amplitudes are as filmed, those of fast tones too small (--exposure-us)"
        }
        Warning::CoarseTimes => {
            "the frames' times are rounded and follow no even rate: fast tones are too small and may show twice"
        }
    }
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
        let set: Vec<_> = example(None).warnings.names().collect();
        assert_eq!(set, ["lost_frames", "occluded"]);
    }
    #[test]
    fn every_warning_has_a_sentence_of_its_own() {
        for &warning in &Warning::ALL {
            let same = |other: &&Warning| sentence(**other) == sentence(warning);
            assert_eq!(Warning::ALL.iter().filter(same).count(), 1, "{warning:?}");
        }
    }
}
