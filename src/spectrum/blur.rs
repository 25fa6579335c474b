//! What the averaging of a slot's rows does to a fast tone.
//!
//! A sample is a weighted mean of rows, so a tone in it is multiplied by the mean of e^(iω(t − t̄)) over its rows. In
//! cumulants that is a size, from the variance, and a turn of phase, −ω³·κ₃/6. The size is that of an even
//! distribution of the same variance, sin(x)/x with x² = 3ω²·variance: exact where all rows know the same, and else
//! off by the fourth cumulant only.

use num_complex::Complex32 as Complex;

use crate::timeline::Spread;

/// Furthest that the series of the size reaches, (ω·deviation)²: an amplitude down to a twentieth.
const FURTHEST: f32 = 3.0;

/// Longest turn of phase that the third moment is believed, rad.
const LONGEST_TURN: f32 = 0.5;

/// A tone at `hz` in samples whose rows lie like `spread`, over the same in samples whose rows lie like `even`.
pub(crate) fn blur(hz: f32, spread: &Spread, even: &Spread) -> Complex {
    if spread == even {
        return Complex::new(1.0, 0.0);
    }
    let w = core::f32::consts::TAU * 1e-9 * hz;
    let size = left(w * w * spread.variance_ns2) / left(w * w * even.variance_ns2);
    let turn = (-w * w * w / 6.0 * spread.third_ns3).clamp(-LONGEST_TURN, LONGEST_TURN);
    Complex::new(size * (1.0 - 0.5 * turn * turn), size * turn)
}

/// sin(x)/x for x² = 3y.
fn left(y: f32) -> f32 {
    let y = y.min(FURTHEST);
    let rest = 0.5 - y * (0.075 - y * (0.005_357_143 - y * 2.232_143e-4));
    (1.0 - y * rest).max(0.05)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// The mean of e^(iω(t − t̄)) over rows of these weights, 10 µs apart, their spread, and how far off the fourth
    /// cumulant, which an even distribution's stands for, puts it.
    fn exact(weights: &[f64], hz: f64) -> (f64, f64, Spread, f64) {
        let total: f64 = weights.iter().sum();
        let at: Vec<(f64, f64)> = weights
            .iter()
            .enumerate()
            .map(|(i, w)| (i as f64 * 1e4, w / total))
            .collect();
        let mean: f64 = at.iter().map(|(t, w)| t * w).sum();
        let moment = |k: i32| at.iter().map(|(t, w)| w * (t - mean).powi(k)).sum::<f64>();
        let w = core::f64::consts::TAU * hz * 1e-9;
        let re = at.iter().map(|(t, p)| p * (w * (t - mean)).cos()).sum();
        let im = at.iter().map(|(t, p)| p * (w * (t - mean)).sin()).sum();
        let spread = Spread {
            variance_ns2: moment(2) as f32,
            third_ns3: moment(3) as f32,
        };
        let fourth = moment(4) - 1.8 * moment(2).powi(2);
        (re, im, spread, (w.powi(4) * fourth / 24.0).abs())
    }

    #[test]
    fn uneven_rows_are_as_their_moments_say() {
        // 22 rows of 10 µs: what 2 kHz asks for.
        let even: Vec<f64> = (0..22).map(|_| 1.0).collect();
        let ramp: Vec<f64> = (0..22).map(f64::from).collect();
        let step: Vec<f64> = (0..22).map(|i| if i < 15 { 0.1 } else { 1.0 }).collect();
        for hz in [300.0, 1000.0, 1800.0] {
            let (flat, _, level, _) = exact(&even, hz);
            for weights in [&ramp, &step] {
                let (re, im, spread, off) = exact(weights, hz);
                let got = blur(hz as f32, &spread, &level);
                let wrong = (f64::from(got.re) - re / flat).hypot(f64::from(got.im) - im / flat);
                assert!(wrong < 1.5 * off + 1e-5, "{hz} Hz: {wrong} for {off}");
                // Left alone it would be much more.
                assert!((re / flat - 1.0).hypot(im / flat) > 5.0 * wrong);
            }
        }
    }

    #[test]
    fn nonsense_stays_finite() {
        for variance_ns2 in [0.0, 1e30, f32::MAX] {
            for third_ns3 in [0.0, f32::MAX, f32::MIN] {
                let spread = Spread {
                    variance_ns2,
                    third_ns3,
                };
                let got = blur(1e5, &spread, &Spread::default());
                assert!(got.re.is_finite() && got.im.is_finite());
            }
        }
    }
}
