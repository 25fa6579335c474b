//! A gap-free signal from one with gaps: the time between two frames, and lost frames.
//!
//! Contract: [`fill`] takes evenly spaced samples, of which those that are `None` are missing, and returns as many
//! samples with none missing. What was measured is passed through unchanged; what is filled in is an estimate, good
//! to look at and to listen to, and no measurement: peaks are never taken from it (the spectrum engine works on the
//! samples that exist).
//!
//! | file | method |
//! | --- | --- |
//! | [`simple`] | zero, straight line, median of the neighbours |
//! | [`ar`] | autoregressive model of the signal itself (Janssen, Veldhuis and Vries 1986) |
//! | [`tones`] | tones fitted to the samples that exist |
//! | [`butterworth`] | the low-pass that follows |
//! | [`long`] | both on a signal of any length, as `displacement --format wav` does |

use std::fmt;
use std::str::FromStr;

pub mod ar;
pub mod butterworth;
pub mod long;
pub mod simple;
pub mod tones;

/// How to fill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Zero: what the gap sounds like when nothing is done.
    Zero,
    /// A straight line from the last sample before to the first one after.
    Linear,
    /// The median of the eight nearest samples on both sides.
    Median,
    /// Autoregressive (Janssen), the strongest tones taken out first: the thesis's Algorithm 3.
    Ar,
    /// The autoregressive model alone: better for music, worse for the steady tones of machines.
    ArAlone,
    /// Tones alone.
    JointTones,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Zero,
        Self::Linear,
        Self::Median,
        Self::Ar,
        Self::ArAlone,
        Self::JointTones,
    ];

    /// Its name on the command line and in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Linear => "linear",
            Self::Median => "median",
            Self::Ar => "ar",
            Self::ArAlone => "ar-alone",
            Self::JointTones => "tones",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|m| m.name() == text)
            .ok_or_else(|| "want zero, linear, median, ar, ar-alone or tones".to_owned())
    }
}

/// Fills the missing samples. Where nothing at all is known, the result is zeros.
///
/// ```
/// use rowtone_measure::restore::{Method, fill};
/// let filled = fill(&[Some(1.0), None, Some(3.0)], Method::Linear);
/// assert_eq!(filled, [1.0, 2.0, 3.0]);
/// ```
pub fn fill(samples: &[Option<f64>], method: Method) -> Vec<f64> {
    match method {
        Method::Zero => simple::zero(samples),
        Method::Linear => simple::linear(samples),
        Method::Median => simple::median(samples),
        Method::ArAlone => {
            let filled = ar::fill(samples);
            pass_through(samples, |i| filled[i])
        }
        Method::Ar => {
            // The tones last longer than a gap; the model then only has to explain what they leave.
            let base = tones::model(samples, tones::FEW);
            let rest: Vec<Option<f64>> = samples
                .iter()
                .zip(&base)
                .map(|(s, b)| s.map(|s| s - b))
                .collect();
            let filled = ar::fill(&rest);
            pass_through(samples, |i| base[i] + filled[i])
        }
        Method::JointTones => {
            let model = tones::model(samples, tones::MANY);
            pass_through(samples, |i| model[i])
        }
    }
}

/// What is known, and `other` for the rest.
fn pass_through(samples: &[Option<f64>], other: impl Fn(usize) -> f64) -> Vec<f64> {
    samples
        .iter()
        .enumerate()
        .map(|(i, s)| s.unwrap_or_else(|| other(i)))
        .collect()
}

/// 10·log₁₀(Σ I² / Σ (Î − I)²), dB, after the gain of `recovered` is fitted.
pub fn snr_db(truth: &[f64], recovered: &[f64]) -> f64 {
    let gain = rowtone_linear::dot(truth, recovered)
        / rowtone_linear::dot(recovered, recovered).max(f64::MIN_POSITIVE);
    let signal = rowtone_linear::dot(truth, truth);
    let error: f64 = truth
        .iter()
        .zip(recovered)
        .map(|(t, r)| (gain * r - t).powi(2))
        .sum();
    10.0 * (signal / error.max(1e-12 * signal)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tones and a decaying one, `gap` of every 100 samples missing.
    fn scene(gap: usize) -> (Vec<f64>, Vec<Option<f64>>) {
        let truth: Vec<f64> = (0..2000)
            .map(|i| {
                let t = f64::from(i);
                (0.11 * t).sin() + 0.5 * (0.317 * t + 1.0).sin() + 0.3 * (0.05 * t).cos()
            })
            .collect();
        let samples = truth
            .iter()
            .enumerate()
            .map(|(i, &v)| (i % 100 >= gap).then_some(v))
            .collect();
        (truth, samples)
    }

    #[test]
    fn what_is_known_stays() {
        let (_, samples) = scene(30);
        for method in Method::ALL {
            let filled = fill(&samples, method);
            for (value, sample) in filled.iter().zip(&samples) {
                assert!(value.is_finite());
                if let Some(sample) = sample {
                    assert_eq!(value, sample, "{method}");
                }
            }
        }
    }

    #[test]
    fn the_models_beat_the_line_on_tones() {
        let (truth, samples) = scene(30);
        let snr = |m| snr_db(&truth, &fill(&samples, m));
        assert!(
            snr(Method::Ar) > snr(Method::Linear) + 20.0,
            "{} {}",
            snr(Method::Ar),
            snr(Method::Linear)
        );
        assert!(
            snr(Method::JointTones) > snr(Method::Linear) + 20.0,
            "{}",
            snr(Method::JointTones)
        );
    }

    #[test]
    fn odd_inputs() {
        for method in Method::ALL {
            assert!(fill(&[], method).is_empty());
            assert_eq!(fill(&[None; 20], method), vec![0.0; 20]);
            assert_eq!(fill(&[Some(2.0)], method), [2.0]);
            assert!(
                fill(&[None, Some(1.0), None], method)
                    .iter()
                    .all(|v| v.is_finite())
            );
        }
    }
}
