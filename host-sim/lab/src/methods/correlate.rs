//! One-dimensional phase correlation, and where between two samples its peak lies.

use super::fourier::C;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// How the peak is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeakFit {
    /// Foroosh, Zerubia and Berthod 2002: the correlation of a shifted band-limited signal is a sampled sinc.
    Foroosh,
    /// A Gaussian through three samples.
    Gaussian,
}

/// Phase correlation of signals of one length.
pub struct PhaseCorrelation {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl std::fmt::Debug for PhaseCorrelation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "PhaseCorrelation({})", self.forward.len())
    }
}

impl PhaseCorrelation {
    /// For signals of `size` samples.
    pub fn new(size: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(size),
            inverse: planner.plan_fft_inverse(size),
        }
    }

    /// Spectrum of a signal.
    pub fn spectrum(&self, signal: &[C]) -> Vec<C> {
        let mut data = signal.to_vec();
        self.forward.process(&mut data);
        data
    }

    /// By how many samples `signal` is shifted to the right against `reference` (both as spectra).
    pub fn shift(&self, signal: &[C], reference: &[C], fit: PeakFit) -> f64 {
        let mut cross: Vec<C> = signal
            .iter()
            .zip(reference)
            .map(|(s, r)| {
                let product = s * r.conj();
                let size = product.norm();
                if size > 1e-12 {
                    product / size
                } else {
                    C::new(0.0, 0.0)
                }
            })
            .collect();
        self.inverse.process(&mut cross);
        peak(&cross, fit)
    }
}

/// Position of the largest value of a circular correlation, −size/2 to size/2.
fn peak(correlation: &[C], fit: PeakFit) -> f64 {
    let size = correlation.len();
    let Some(top) = (0..size).max_by(|&a, &b| correlation[a].re.total_cmp(&correlation[b].re))
    else {
        return f64::NAN;
    };
    let at = |k: isize| correlation[(top as isize + k).rem_euclid(size as isize) as usize].re;
    let (left, centre, right) = (at(-1), at(0), at(1));
    let offset = match fit {
        PeakFit::Foroosh => {
            // Of the two quotients with the larger neighbour the one between 0 and 1 is right.
            let (side, sign) = if right >= left {
                (right, 1.0)
            } else {
                (left, -1.0)
            };
            let both = [side / (side + centre), side / (side - centre)];
            sign * both
                .into_iter()
                .find(|d| (0.0..1.0).contains(d))
                .unwrap_or(0.0)
        }
        PeakFit::Gaussian => {
            let [l, c, r] = [left, centre, right].map(|v| v.max(1e-9).ln());
            let bend = l - 2.0 * c + r;
            if bend < 0.0 {
                (0.5 * (l - r) / bend).clamp(-1.0, 1.0)
            } else {
                0.0
            }
        }
    };
    let whole = if 2 * top > size {
        top as f64 - size as f64
    } else {
        top as f64
    };
    whole + offset
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(size: usize) -> Vec<f64> {
        let mut chance = rowtone_chance::Quick(5);
        (0..size).map(|_| chance.unit() - 0.5).collect()
    }

    /// The shift of Fig. 5.8.
    #[test]
    fn fifteen_pixels() {
        let size = 256;
        let signal = noise(size);
        let correlation = PhaseCorrelation::new(size);
        let row = |shift: usize| -> Vec<C> {
            (0..size)
                .map(|x| C::new(signal[(x + size - shift) % size], 0.0))
                .collect()
        };
        let (moved, reference) = (
            correlation.spectrum(&row(15)),
            correlation.spectrum(&row(0)),
        );
        assert!((correlation.shift(&moved, &reference, PeakFit::Foroosh) - 15.0).abs() < 1e-6);
        assert!((correlation.shift(&reference, &moved, PeakFit::Foroosh) + 15.0).abs() < 1e-6);
    }

    #[test]
    fn parts_of_a_pixel() {
        let size = 256;
        let correlation = PhaseCorrelation::new(size);
        let reference = correlation.spectrum(
            &noise(size)
                .iter()
                .map(|&v| C::new(v, 0.0))
                .collect::<Vec<_>>(),
        );
        for shift in [-3.7, -0.3, 0.1, 0.45] {
            let moved: Vec<C> = reference
                .iter()
                .enumerate()
                .map(|(k, v)| {
                    let k = if 2 * k > size {
                        k as f64 - size as f64
                    } else {
                        k as f64
                    };
                    v * C::from_polar(1.0, -std::f64::consts::TAU * k * shift / size as f64)
                })
                .collect();
            let found = correlation.shift(&moved, &reference, PeakFit::Foroosh);
            assert!((found - shift).abs() < 0.02, "{found} for {shift}");
        }
    }
}
