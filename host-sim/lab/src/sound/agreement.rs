//! How well a recovered sound agrees with the true one, after gain and delay are fitted.

use rustfft::{FftPlanner, num_complex::Complex};

use crate::methods::fourier::wrapped;
use rowtone_linear::dot;

/// Gain, delay and what is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// What the recovered sound was multiplied by.
    pub gain: f64,
    /// By how much the recovered sound is later, s.
    pub delay_s: f64,
    /// Mean of (Î − I)², in the truth's unit squared.
    pub mse: f64,
    /// 10·log₁₀(Σ I² / Σ (Î − I)²), dB.
    pub snr_db: f64,
}

/// Fits `recovered` to `truth`: both at `rate_hz`, means removed, a delay of at most `reach_s` either way (to any part
/// of a sample, by the phase of the spectrum), the gain by least squares. Compared where both exist after the shift.
/// Without a common part, or of silence, the signal-to-noise ratio is negative infinity.
pub fn agree(truth: &[f64], recovered: &[f64], rate_hz: f64, reach_s: f64) -> Agreement {
    let (truth, recovered) = (without_mean(truth), without_mean(recovered));
    let reach = (reach_s * rate_hz).ceil().max(1.0) as usize;
    let size = (truth.len().max(recovered.len()) + reach + 1).next_power_of_two();
    let mut planner = FftPlanner::new();
    let forward = planner.plan_fft_forward(size);
    let spectrum = |signal: &[f64]| {
        let mut data: Vec<Complex<f64>> = signal.iter().map(|&v| Complex::new(v, 0.0)).collect();
        data.resize(size, Complex::new(0.0, 0.0));
        forward.process(&mut data);
        data
    };
    let (of_truth, of_recovered) = (spectrum(&truth), spectrum(&recovered));
    let cross: Vec<Complex<f64>> = of_recovered
        .iter()
        .zip(&of_truth)
        .map(|(r, t)| r * t.conj())
        .collect();
    let inverse = planner.plan_fft_inverse(size);
    let mut lags = cross.clone();
    inverse.process(&mut lags);
    let at = |lag: isize| lags[lag.rem_euclid(size as isize) as usize].re;
    let reach = reach as isize;
    let whole = (-reach..=reach)
        .max_by(|&a, &b| at(a).total_cmp(&at(b)))
        .unwrap_or(0);
    let delay = finest(&cross, whole as f64);
    let mut shifted: Vec<Complex<f64>> = of_recovered
        .iter()
        .enumerate()
        .map(|(k, v)| v * Complex::from_polar(1.0, wrapped(k, size) * delay))
        .collect();
    inverse.process(&mut shifted);
    let from = (-delay).max(0.0).ceil() as usize;
    let to = truth
        .len()
        .min((recovered.len() as f64 - delay).max(0.0).floor() as usize);
    let shifted: Vec<f64> = shifted.iter().map(|v| v.re / size as f64).collect();
    let (truth, shifted) = match from < to {
        true => (&truth[from..to], &shifted[from..to]),
        false => (&truth[..0], &shifted[..0]),
    };
    let gain = dot(truth, shifted) / dot(shifted, shifted).max(f64::MIN_POSITIVE);
    let error: f64 = truth
        .iter()
        .zip(shifted)
        .map(|(t, s)| (gain * s - t).powi(2))
        .sum();
    let energy = dot(truth, truth);
    Agreement {
        gain,
        delay_s: delay / rate_hz,
        mse: error / truth.len().max(1) as f64,
        snr_db: if energy > 0.0 {
            10.0 * (energy / error.max(1e-12 * energy)).log10()
        } else {
            f64::NEG_INFINITY
        },
    }
}

fn without_mean(signal: &[f64]) -> Vec<f64> {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    signal.iter().map(|v| v - mean).collect()
}

/// The lag within a sample of `start` at which the correlation is largest (golden section).
fn finest(cross: &[Complex<f64>], start: f64) -> f64 {
    let size = cross.len();
    let value = |lag: f64| -> f64 {
        cross
            .iter()
            .enumerate()
            .map(|(k, c)| {
                let (s, co) = (wrapped(k, size) * lag).sin_cos();
                c.re * co - c.im * s
            })
            .sum()
    };
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (start - 1.0, start + 1.0);
    let (mut a, mut b) = (high - golden * 2.0, low + golden * 2.0);
    let (mut at_a, mut at_b) = (value(a), value(b));
    for _ in 0..24 {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sound(t: f64) -> f64 {
        (0.11 * t).sin() + 0.6 * (0.0413 * t + 1.0).sin() + 0.2 * (0.3 * t).cos()
    }

    #[test]
    fn gain_and_delay_are_found_and_what_is_left_is_measured() {
        let truth: Vec<f64> = (0..6000).map(|i| sound(f64::from(i))).collect();
        for delay in [-7.3, 0.0, 0.25, 12.6] {
            // A known error: a tone of 0.05 that nothing else correlates with.
            let recovered: Vec<f64> = (0..6000)
                .map(f64::from)
                .map(|i| 4.0 + 0.5 * (sound(i - delay) + 0.05 * (0.77 * i).sin()))
                .collect();
            let found = agree(&truth, &recovered, 1000.0, 0.05);
            assert!((found.delay_s - 1e-3 * delay).abs() < 2e-5, "{found:?}");
            assert!((found.gain - 2.0).abs() < 0.01, "{found:?}");
            let expected = 10.0 * ((0.5 * (1.0 + 0.36 + 0.04)) / (0.5 * 0.0025_f64)).log10();
            assert!(
                (found.snr_db - expected).abs() < 0.3,
                "{found:?} {expected}"
            );
            assert!((found.mse / 0.00125 - 1.0).abs() < 0.1, "{found:?}");
        }
    }

    #[test]
    fn odd_inputs() {
        for (a, b) in [(0, 0), (10, 0), (0, 10), (1, 1)] {
            let found = agree(&vec![1.0; a], &vec![1.0; b], 8000.0, 0.01);
            assert_eq!(found.snr_db, f64::NEG_INFINITY);
        }
    }
}
