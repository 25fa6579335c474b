//! The one Fourier transform of the host's crates: `rustfft` behind a type without parameters.
//!
//! `rustfft` is generic, so each crate that plans a transform by itself compiles thousands of its
//! functions again: half of the first build's time for `measure` and `calibrate` before this crate
//! was there. The plain planner is used, not the ones for one processor's vectors, so that all
//! machines give the same bits.

use std::fmt;
use std::sync::Arc;

pub use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftDirection, FftPlannerScalar};

/// A planned transform of a fixed number of points, not scaled: forward and back multiplies all
/// values by that number.
#[derive(Clone)]
pub struct Fourier {
    plan: Arc<dyn Fft<f64>>,
    scratch: Vec<Complex64>,
}

impl Fourier {
    /// The transform Σ x(n)·exp(−2πi·k·n/`points`). Any number of points; fastest are products of
    /// small primes.
    pub fn forward(points: usize) -> Self {
        Self::new(points, FftDirection::Forward)
    }

    /// The transform Σ x(n)·exp(+2πi·k·n/`points`).
    pub fn inverse(points: usize) -> Self {
        Self::new(points, FftDirection::Inverse)
    }

    fn new(points: usize, direction: FftDirection) -> Self {
        let plan = FftPlannerScalar::new().plan_fft(points, direction);
        let scratch = vec![Complex64::default(); plan.get_inplace_scratch_len()];
        Self { plan, scratch }
    }

    /// How many points are transformed at once.
    pub fn points(&self) -> usize {
        self.plan.len()
    }

    /// Transforms each `points()` values in place.
    ///
    /// # Panics
    /// When the number of values is no multiple of `points()`.
    pub fn transform(&mut self, values: &mut [Complex64]) {
        self.plan.process_with_scratch(values, &mut self.scratch);
    }
}

impl fmt::Debug for Fourier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = self.plan.fft_direction();
        write!(f, "Fourier({direction} of {} points)", self.points())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_one_line_and_comes_back_times_the_number_of_points() {
        for points in [8, 12, 480] {
            let turn = std::f64::consts::TAU / points as f64;
            let wave: Vec<_> = (0..points)
                .map(|n| Complex64::cis(3.0 * turn * n as f64))
                .collect();
            let mut values = wave.clone();
            Fourier::forward(points).transform(&mut values);
            for (k, value) in values.iter().enumerate() {
                let expected = if k == 3 { points as f64 } else { 0.0 };
                assert!((value - expected).norm() < 1e-9, "{points}: {k}: {value}");
            }
            Fourier::inverse(points).transform(&mut values);
            for (value, wave) in values.iter().zip(&wave) {
                assert!((value / points as f64 - wave).norm() < 1e-12);
            }
        }
    }
}
