//! Two-dimensional Fourier transforms of pictures of any size.

use rustfft::FftPlanner;
pub use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// A complex number.
pub type C = Complex<f64>;

/// Plans for one picture size.
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    planner: std::cell::RefCell<FftPlanner<f64>>,
}

impl std::fmt::Debug for Plane {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Plane({}x{})", self.width, self.height)
    }
}

impl Plane {
    /// For pictures of this size.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            planner: FftPlanner::new().into(),
        }
    }

    /// Spectrum of a real picture, not scaled.
    pub fn forward(&self, picture: &[f64]) -> Vec<C> {
        let mut data: Vec<C> = picture.iter().map(|&v| C::new(v, 0.0)).collect();
        self.run(&mut data, true);
        data
    }

    /// The picture of a spectrum, scaled so that it undoes [`Self::forward`].
    pub fn inverse(&self, mut spectrum: Vec<C>) -> Vec<C> {
        self.run(&mut spectrum, false);
        let scale = 1.0 / spectrum.len().max(1) as f64;
        spectrum.iter_mut().for_each(|v| *v *= scale);
        spectrum
    }

    fn run(&self, data: &mut Vec<C>, forward: bool) {
        let mut planner = self.planner.borrow_mut();
        let mut plan = |size| {
            if forward {
                planner.plan_fft_forward(size)
            } else {
                planner.plan_fft_inverse(size)
            }
        };
        let (across, down) = (plan(self.width), plan(self.height));
        across.process(data);
        let mut turned = transposed(data, self.width, self.height);
        down.process(&mut turned);
        *data = transposed(&turned, self.height, self.width);
    }

    /// Frequencies (across, down) of a bin, radians a pixel, −π to π.
    pub fn frequency(&self, bin: usize) -> (f64, f64) {
        (
            wrapped(bin % self.width, self.width),
            wrapped(bin / self.width, self.height),
        )
    }
}

/// Frequency of bin `k` of `size`, radians.
fn wrapped(k: usize, size: usize) -> f64 {
    let k = if 2 * k > size {
        k as f64 - size as f64
    } else {
        k as f64
    };
    TAU * k / size as f64
}

fn transposed(data: &[C], width: usize, height: usize) -> Vec<C> {
    let mut out = vec![C::new(0.0, 0.0); data.len()];
    for y in 0..height {
        for x in 0..width {
            out[x * height + y] = data[y * width + x];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let plane = Plane::new(12, 7);
        let picture: Vec<f64> = (0..84).map(|i| f64::from(i % 13) - 3.0).collect();
        let back = plane.inverse(plane.forward(&picture));
        assert!(
            back.iter()
                .zip(&picture)
                .all(|(a, b)| (a.re - b).abs() < 1e-12 && a.im.abs() < 1e-12)
        );
        assert_eq!(plane.frequency(0), (0.0, 0.0));
        assert!((plane.frequency(11).0 + TAU / 12.0).abs() < 1e-12);
    }
}
