//! Reading the light pattern at places that differ from pixel to pixel, along both axes.
//!
//! Along a row the pattern is kept eight times finer than the pixels ([`FINENESS`]) and read by
//! four-point Lagrange interpolation; from row to row, where lens and pixel have blurred it, by
//! six-point interpolation. The error is below 10⁻³ of a component at a quarter of a cycle per row,
//! of which the blur of a lens leaves 4 % at the default.

use super::texture::{FINENESS, Texture, lagrange6};

/// Rows of the pattern above and below the picture that a place may reach into, besides its motion.
pub(super) const SPARE_ROWS: usize = 4;

impl Texture {
    /// The pattern at the place (`x`, `y`) of its own pixels, fractions of white. Rows beyond its
    /// first or last read as these.
    pub(super) fn at(&self, x: f64, y: f64) -> f64 {
        let whole = libm::floor(y);
        let weights = lagrange6(y - whole);
        let last = self.rows() as i64 - 1;
        let mut sum = 0.0;
        for (k, weight) in (-2..).zip(weights) {
            let row = (whole as i64 + k).clamp(0, last) as usize;
            sum += weight * self.along(row, x);
        }
        sum
    }

    /// One row of it at `x`.
    fn along(&self, row: usize, x: f64) -> f64 {
        let fine = x * FINENESS as f64;
        let whole = libm::floor(fine);
        let (t, first) = (fine - whole, whole as i64 - 1);
        let weights = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ];
        (0..)
            .zip(weights)
            .map(|(k, weight)| weight * f64::from(self.fine_value(row, first + k)))
            .sum()
    }

    /// Slopes along the columns of the pixels `cols` of `row`, per px: of the interpolation in use.
    pub(super) fn slope_down(&self, row: usize, cols: core::ops::Range<usize>) -> Vec<f32> {
        let c = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0];
        let last = self.rows() as i64 - 1;
        let at = |k: i64| (row as i64 + k).clamp(0, last) as usize;
        cols.map(|x| {
            let fine = (x * FINENESS) as i64;
            (1..)
                .zip(c)
                .map(|(k, c)| {
                    let below = f64::from(self.fine_value(at(k), fine));
                    c * (below - f64::from(self.fine_value(at(-k), fine)))
                })
                .sum::<f64>() as f32
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::texture::Strip;
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_plane_wave_is_read_between_pixels_and_rows() {
        let (period, rows) = (64, 48);
        let (fx, fy) = (5.0 / 64.0, 0.11);
        let value = |x: f64, y: f64| 0.5 + 0.4 * (TAU * (fx * x + fy * y)).cos();
        let values = (0..rows * period * 2)
            .map(|i| value((i % (2 * period)) as f64 * 0.5, (i / (2 * period)) as f64) as f32)
            .collect();
        let strip = Strip {
            period_px: period,
            fineness: 2,
            values,
        };
        let texture = Texture::new(&strip, 0.0, 0.0, 1.0);
        // The pixel's own area blurs along the row.
        let area = (std::f64::consts::PI * fx).sin() / (std::f64::consts::PI * fx);
        for (x, y) in [(10.0, 20.0), (10.3, 20.7), (-3.2, 8.25), (70.9, 30.5)] {
            let want = 0.5 + area * (value(x, y) - 0.5);
            assert!((texture.at(x, y) - want).abs() < 1e-3, "{x} {y}");
        }
        let slopes = texture.slope_down(20, 10..30);
        for (x, slope) in (10..30).zip(slopes) {
            let want = -0.4 * area * TAU * fy * (TAU * (fx * f64::from(x) + fy * 20.0)).sin();
            assert!(
                (f64::from(slope) - want).abs() < 2e-3,
                "{x}: {slope} {want}"
            );
        }
    }
}
