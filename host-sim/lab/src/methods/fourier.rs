//! Two-dimensional Fourier transforms of pictures of any size.

pub use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A complex number.
pub type C = Complex<f64>;

/// Plans for one picture size.
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Across and down, forwards, then inverse.
    plans: [[Arc<dyn Fft<f64>>; 2]; 2],
}

impl std::fmt::Debug for Plane {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Plane({}x{})", self.width, self.height)
    }
}

impl Plane {
    /// For pictures of this size.
    pub fn new(width: usize, height: usize) -> Self {
        let mut planner = FftPlanner::new();
        let mut plans = |direction| [width, height].map(|size| planner.plan_fft(size, direction));
        let plans = [FftDirection::Forward, FftDirection::Inverse].map(&mut plans);
        Self {
            width,
            height,
            plans,
        }
    }

    /// Spectrum of a real picture, not scaled.
    pub fn forward(&self, picture: &[f64]) -> Vec<C> {
        self.forward_complex(picture.iter().map(|&v| C::new(v, 0.0)).collect())
    }

    /// Spectrum of a complex picture, not scaled.
    pub fn forward_complex(&self, mut picture: Vec<C>) -> Vec<C> {
        self.run(&mut picture, true);
        picture
    }

    /// The complex picture of a spectrum, scaled so that it undoes [`Self::forward`].
    pub fn inverse(&self, mut spectrum: Vec<C>) -> Vec<C> {
        self.run(&mut spectrum, false);
        let scale = 1.0 / spectrum.len().max(1) as f64;
        spectrum.iter_mut().for_each(|v| *v *= scale);
        spectrum
    }

    /// The same for a spectrum under a window that is zero outside of some columns: those alone are transformed downwards.
    pub fn inverse_within(&self, spectrum: &[C], window: &[f64], columns: &[usize]) -> Vec<C> {
        let [across, down] = &self.plans[1];
        let scale = 1.0 / spectrum.len().max(1) as f64;
        let mut narrow = Vec::with_capacity(self.height * columns.len());
        for (row, window) in spectrum
            .chunks_exact(self.width)
            .zip(window.chunks_exact(self.width))
        {
            narrow.extend(columns.iter().map(|&x| row[x] * (window[x] * scale)));
        }
        let mut turned = transposed(&narrow, columns.len(), self.height);
        down.process(&mut turned);
        narrow = transposed(&turned, self.height, columns.len());
        let mut picture = vec![C::new(0.0, 0.0); self.width * self.height];
        for (row, values) in picture
            .chunks_exact_mut(self.width)
            .zip(narrow.chunks_exact(columns.len().max(1)))
        {
            columns.iter().zip(values).for_each(|(&x, v)| row[x] = *v);
        }
        across.process(&mut picture);
        picture
    }

    fn run(&self, data: &mut Vec<C>, forward: bool) {
        let [across, down] = &self.plans[usize::from(!forward)];
        across.process(data);
        let mut turned = transposed(data, self.width, self.height);
        down.process(&mut turned);
        *data = transposed(&turned, self.height, self.width);
    }

    /// The bin of the opposite frequency.
    pub fn mirror(&self, bin: usize) -> usize {
        let (x, y) = (bin % self.width, bin / self.width);
        (self.height - y) % self.height * self.width + (self.width - x) % self.width
    }

    /// Frequencies (across, down) of a bin, radians a pixel, −π to π.
    pub fn frequency(&self, bin: usize) -> (f64, f64) {
        (
            wrapped(bin % self.width, self.width),
            wrapped(bin / self.width, self.height),
        )
    }
}

/// Frequency of bin `k` of `size`, radians a sample, −π to π.
pub fn wrapped(k: usize, size: usize) -> f64 {
    let k = if 2 * k > size {
        k as f64 - size as f64
    } else {
        k as f64
    };
    TAU * k / size as f64
}

fn transposed(data: &[C], width: usize, height: usize) -> Vec<C> {
    // In tiles, so that both pictures stay in the cache.
    const TILE: usize = 32;
    let mut out = vec![C::new(0.0, 0.0); data.len()];
    for top in (0..height).step_by(TILE) {
        for left in (0..width).step_by(TILE) {
            for y in top..(top + TILE).min(height) {
                for x in left..(left + TILE).min(width) {
                    out[x * height + y] = data[y * width + x];
                }
            }
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
        let spectrum = plane.forward(&picture);
        let window: Vec<f64> = (0..84)
            .map(|bin| {
                if [2, 3, 11].contains(&(bin % 12)) {
                    0.1 * f64::from(bin)
                } else {
                    0.0
                }
            })
            .collect();
        let narrow = plane.inverse_within(&spectrum, &window, &[2, 3, 11]);
        let all = plane.inverse(spectrum.iter().zip(&window).map(|(s, w)| s * w).collect());
        assert!(all.iter().zip(&narrow).all(|(a, b)| (a - b).norm() < 1e-12));
        assert_eq!(plane.frequency(0), (0.0, 0.0));
        assert!((plane.frequency(11).0 + TAU / 12.0).abs() < 1e-12);
    }
}
