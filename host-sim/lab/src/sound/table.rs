//! How well each way of filling recovers a sound: signal-to-noise ratio against the length of the gaps.

use std::fmt::Write;

use super::sounds::{self, RATE_HZ, Sound};
use rowtone_measure::restore::butterworth::LowPass;
use rowtone_measure::restore::{Method, fill, snr_db};

/// Share of each frame's time that is missing.
pub const GAPS: [f64; 6] = [0.01, 0.05, 0.10, 0.20, 0.30, 0.45];
/// Frame rate, Hz.
pub const FPS: f64 = 60.0;

/// The sound with its gaps, `share` of every frame.
pub fn with_gaps(sound: &[f64], share: f64) -> Vec<Option<f64>> {
    sound
        .iter()
        .enumerate()
        .map(|(i, &v)| ((i as f64 * FPS / RATE_HZ).fract() < 1.0 - share).then_some(v))
        .collect()
}

/// Fills and filters as `displacement --format wav` is to: everything below 1000 Hz.
pub fn recover(samples: &[Option<f64>], method: Method) -> Vec<f64> {
    let mut filled = fill(samples, method);
    LowPass::new(6, 1000.0, RATE_HZ).run_both_ways(&mut filled);
    filled
}

/// SNR in dB of every method and gap, against the sound itself filtered alike.
pub fn snrs(sound: &Sound) -> Vec<(Method, Vec<f64>)> {
    let mut truth = sound.samples.clone();
    LowPass::new(6, 1000.0, RATE_HZ).run_both_ways(&mut truth);
    Method::ALL
        .into_iter()
        .map(|method| {
            let snr =
                |share: &f64| snr_db(&truth, &recover(&with_gaps(&sound.samples, *share), method));
            (method, GAPS.iter().map(snr).collect())
        })
        .collect()
}

/// All sounds, as Markdown.
pub fn markdown() -> String {
    let mut text = String::new();
    for sound in [
        sounds::speech(),
        sounds::formants(),
        sounds::music(),
        sounds::ramp(),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "SNR in dB, {}, below 1000 Hz, gaps in every frame at {FPS} fps\n",
            sound.name
        );
        text.push_str("| gap |");
        GAPS.iter().for_each(|g| {
            let _ = write!(text, " {:.0} % |", 100.0 * g);
        });
        text.push_str("\n| --- |");
        GAPS.iter().for_each(|_| text.push_str(" --: |"));
        text.push('\n');
        for (method, snrs) in snrs(&sound) {
            let _ = write!(text, "| {method} |");
            snrs.iter().for_each(|snr| {
                let _ = write!(text, " {snr:.1} |");
            });
            text.push('\n');
        }
        text.push('\n');
    }
    text
}
