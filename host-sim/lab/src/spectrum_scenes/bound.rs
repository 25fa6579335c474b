//! The Cramér–Rao bound of tones in samples with unknown offsets a slot and a slow drift.

use std::f64::consts::TAU;

use rowtone::timeline::Sample;

/// What can at best be known of a tone of amplitude 1 px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Standard deviation of the frequency times the amplitude, Hz·px.
    pub hz: f64,
    /// Standard deviation of the amplitude, px.
    pub amplitude_px: f64,
}

impl Bound {
    /// Bounds of tones (frequency Hz, phase rad) beside each other and a slow drift, t and t²; `claim`: the samples'
    /// information over the true one.
    pub fn of(samples: &[Sample], claim: f64, tones: &[(f64, f64)]) -> Vec<Self> {
        Self::beside(samples, claim, tones, 2)
    }

    /// The same with `drift` powers of time in the drift, 0 to 2.
    pub fn beside(samples: &[Sample], claim: f64, tones: &[(f64, f64)], drift: usize) -> Vec<Self> {
        let middle = samples.iter().map(|s| s.time_ns as f64).sum::<f64>() / samples.len() as f64;
        let drift = drift.min(2);
        let unknowns = 3 * tones.len() + drift;
        let slots = samples
            .iter()
            .map(|s| usize::from(s.slot) + 1)
            .max()
            .unwrap_or(0);
        let mut fisher = vec![vec![0.0; unknowns]; unknowns];
        let mut sums = vec![vec![0.0; unknowns]; slots];
        let mut weights = vec![0.0; slots];
        let mut row = vec![0.0; unknowns];
        for sample in samples {
            let w = f64::from(sample.information_per_px2) / claim;
            let t = (sample.time_ns as f64 - middle) * 1e-9;
            let absolute = sample.time_ns as f64 * 1e-9;
            for (i, &(hz, phase)) in tones.iter().enumerate() {
                let (sin, cos) = (TAU * hz * absolute + phase).sin_cos();
                row[3 * i] = cos;
                row[3 * i + 1] = -sin;
                row[3 * i + 2] = -sin * TAU * t;
            }
            row[3 * tones.len()..].copy_from_slice(&[t, t * t][..drift]);
            for i in 0..unknowns {
                for j in 0..=i {
                    fisher[i][j] += w * row[i] * row[j];
                }
                sums[usize::from(sample.slot)][i] += w * row[i];
            }
            weights[usize::from(sample.slot)] += w;
        }
        for (sum, weight) in sums.iter().zip(&weights).filter(|(_, w)| **w > 0.0) {
            for i in 0..unknowns {
                for j in 0..=i {
                    fisher[i][j] -= sum[i] * sum[j] / weight;
                }
            }
        }
        let inverse = inverse_diagonal(&mut fisher);
        (0..tones.len())
            .map(|i| Self {
                amplitude_px: inverse[3 * i].sqrt(),
                hz: inverse[3 * i + 2].sqrt(),
            })
            .collect()
    }
}

/// Diagonal of the inverse of a symmetric positive definite matrix whose lower triangle is given.
fn inverse_diagonal(a: &mut [Vec<f64>]) -> Vec<f64> {
    let n = a.len();
    for j in 0..n {
        for k in 0..j {
            let l = a[j][k];
            a[j][j] -= l * l;
        }
        a[j][j] = a[j][j].max(1e-300).sqrt();
        for i in j + 1..n {
            for k in 0..j {
                a[i][j] -= a[i][k] * a[j][k];
            }
            a[i][j] /= a[j][j];
        }
    }
    (0..n)
        .map(|c| {
            let mut y = vec![0.0; n];
            for i in c..n {
                let mut sum = if i == c { 1.0 } else { 0.0 };
                for k in c..i {
                    sum -= a[i][k] * y[k];
                }
                y[i] = sum / a[i][i];
            }
            y.iter().map(|v| v * v).sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_closed_form_without_gaps() {
        // docs/line-engine.md: σ_f = 0.78·σ/(A·T·√N), σ_A = σ·√(2/N).
        let samples: Vec<Sample> = (0..2000)
            .map(|i| Sample {
                curvature: Default::default(),
                frame: i,
                slot: 0,
                time_ns: i64::from(i) * 500_000,
                shift_px: 0.0,
                information_per_px2: 100.0,
                spread: Default::default(),
                vertical: None,
            })
            .collect();
        let bound = Bound::of(&samples, 1.0, &[(123.4, 0.3)])[0];
        let root = 2000_f64.sqrt();
        assert!((bound.amplitude_px / (0.1 * 2_f64.sqrt() / root) - 1.0).abs() < 0.01);
        assert!((bound.hz / (0.78 * 0.1 / root) - 1.0).abs() < 0.01);
    }
}
