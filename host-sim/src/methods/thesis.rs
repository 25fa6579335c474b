//! The thesis's pipeline: shearlet phases, phase correlation of phase rows, sub-bands aligned and summed.
//!
//! 1. Every frame is split by [`super::shearlet`]; of each sub-band of the horizontal cone only the phase is kept.
//! 2. Algorithm 1: the reference phase is the mean phase of all frames (of unit vectors, as phases wrap).
//! 3. Each row's phase is correlated with the reference's row; the peak is interpolated after Foroosh.
//! 4. Algorithm 2: the signals of all sub-bands are shifted to where their inner product with the strongest one is
//!    largest, and averaged.
//!
//! Algorithm 3 (gaps by an autoregressive model) and the Butterworth filter are in [`crate::restore`].

use super::correlate::{PeakFit, PhaseCorrelation};
use super::fourier::C;
use super::shearlet::{Cone, DIRECTIONS, Pyramid};
use super::{Clip, Method, Shifts, remove_row_means};
use crate::linear::dot;

/// Furthest that one sub-band is shifted against another, rows.
const FURTHEST: isize = 8;

/// The thesis's method.
#[derive(Clone, Debug)]
pub struct Thesis {
    /// Directions of each scale, finest first.
    pub directions: Vec<usize>,
    /// Scales that are used; all of the pyramid's are split off all the same.
    pub scales: std::ops::Range<usize>,
}

impl Default for Thesis {
    fn default() -> Self {
        Self {
            directions: DIRECTIONS.to_vec(),
            scales: 0..DIRECTIONS.len(),
        }
    }
}

impl Thesis {
    /// Only the two coarse scales: a lens leaves little but noise in the fine ones, and a phase without its amplitude
    /// counts for as much there as anywhere.
    pub fn coarse() -> Self {
        Self {
            scales: 2..DIRECTIONS.len(),
            ..Self::default()
        }
    }
}

impl Method for Thesis {
    fn name(&self) -> &'static str {
        if self.scales.start == 0 {
            "thesis, all sub-bands"
        } else {
            "thesis, coarse sub-bands"
        }
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let pyramid = Pyramid::new(clip.width, clip.height, &self.directions);
        let spectra: Vec<Vec<C>> = clip.frames.iter().map(|f| pyramid.spectrum(f)).collect();
        let used: Vec<usize> = (0..pyramid.bands.len())
            .filter(|&b| {
                pyramid.bands[b].cone == Cone::Horizontal
                    && self.scales.contains(&pyramid.bands[b].scale)
            })
            .collect();
        let signals: Vec<Shifts> = used
            .iter()
            .map(|&band| {
                let phases: Vec<Vec<C>> = spectra
                    .iter()
                    .map(|s| unit(pyramid.band(s, band)))
                    .collect();
                correlate_rows(&phases, clip.width, clip.height)
            })
            .collect();
        align_and_sum(signals)
    }
}

/// Only the phase, as unit vectors.
fn unit(coefficients: Vec<C>) -> Vec<C> {
    coefficients
        .into_iter()
        .map(|c| {
            let size = c.norm();
            if size > 0.0 {
                c / size
            } else {
                C::new(1.0, 0.0)
            }
        })
        .collect()
}

/// Algorithm 1 and the correlation: shift of every row against the mean phase.
fn correlate_rows(phases: &[Vec<C>], width: usize, height: usize) -> Shifts {
    let mut reference = vec![C::new(0.0, 0.0); width * height];
    for frame in phases {
        reference.iter_mut().zip(frame).for_each(|(r, p)| *r += p);
    }
    let reference = unit(reference);
    let correlation = PhaseCorrelation::new(width);
    let rows = |frame: &[C]| -> Vec<Vec<C>> {
        frame
            .chunks_exact(width)
            .map(|r| correlation.spectrum(r))
            .collect()
    };
    let references = rows(&reference);
    phases
        .iter()
        .map(|frame| {
            rows(frame)
                .iter()
                .zip(&references)
                .map(|(row, reference)| correlation.shift(row, reference, PeakFit::Foroosh))
                .collect()
        })
        .collect()
}

/// Algorithm 2: all signals moved to their largest inner product with the strongest, and averaged.
pub fn align_and_sum(mut signals: Vec<Shifts>) -> Shifts {
    signals.iter_mut().for_each(remove_row_means);
    let flat: Vec<Vec<f64>> = signals
        .iter()
        .map(|s| {
            s.iter()
                .flatten()
                .map(|v| if v.is_finite() { *v } else { 0.0 })
                .collect()
        })
        .collect();
    let Some(first) = flat.first() else {
        return Vec::new();
    };
    let height = signals[0].first().map_or(1, Vec::len).max(1);
    let mut sum = vec![0.0; first.len()];
    // The strongest among those that are not mere noise: the one that agrees best with the sum of all.
    let total: Vec<f64> = (0..first.len())
        .map(|i| flat.iter().map(|s| s[i]).sum())
        .collect();
    let agreement = |s: &[f64]| dot(s, &total) / dot(s, s).sqrt().max(f64::MIN_POSITIVE);
    let lead = (0..flat.len())
        .max_by(|&a, &b| agreement(&flat[a]).total_cmp(&agreement(&flat[b])))
        .unwrap_or(0);
    for signal in &flat {
        let best = (-FURTHEST..=FURTHEST)
            .max_by(|&a, &b| {
                shifted_product(&flat[lead], signal, a).total_cmp(&shifted_product(
                    &flat[lead],
                    signal,
                    b,
                ))
            })
            .unwrap_or(0);
        for (i, slot) in sum.iter_mut().enumerate() {
            let from = (i as isize + best).clamp(0, signal.len() as isize - 1) as usize;
            *slot += signal[from] / flat.len() as f64;
        }
    }
    sum.chunks(height).map(<[f64]>::to_vec).collect()
}

/// Inner product of `a` with `b` moved by `lag`.
fn shifted_product(a: &[f64], b: &[f64], lag: isize) -> f64 {
    let (from_a, from_b) = ((-lag).max(0) as usize, lag.max(0) as usize);
    let count = a.len().saturating_sub(from_a.max(from_b));
    dot(&a[from_a..from_a + count], &b[from_b..from_b + count])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sub_bands_are_moved_together() {
        let wave = |lag: usize| -> Shifts {
            vec![(0..200).map(|y| (0.2 * (y + lag) as f64).sin()).collect(); 3]
        };
        let joined = align_and_sum(vec![wave(0), wave(0), wave(3)]);
        // Means over the three equal frames are removed, so nothing is left here...
        assert!(joined.iter().flatten().all(|v| v.abs() < 1e-9));
        // ...and with three different ones the late one falls into step.
        let mut signals = vec![wave(0), wave(0), wave(3)];
        for signal in &mut signals {
            for (n, frame) in signal.iter_mut().enumerate() {
                frame.iter_mut().for_each(|v| *v *= n as f64 - 1.0);
            }
        }
        let truth = signals[0].clone();
        let joined = align_and_sum(signals);
        let middle = 20..180;
        let error: f64 = middle
            .clone()
            .map(|y| (joined[2][y] - truth[2][y]).abs())
            .fold(0.0, f64::max);
        assert!(error < 0.02, "{error}");
    }
}
