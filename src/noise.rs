//! Noise of one pixel.

use crate::{pixel::Pixel, reference::Recipe};

/// Variance of a pixel: read noise and quantisation, plus shot noise in proportion to its value (the
/// photon transfer of EMVA 1288, section 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelNoise {
    /// Variance of a black pixel, in squared pixel values.
    pub dark: f32,
    /// Variance gained per pixel value.
    pub per_value: f32,
}

/// That of quantisation: no pixel's variance is below it.
pub(crate) const LEAST_VARIANCE: f32 = 1.0 / 12.0;

impl PixelNoise {
    /// Before it was measured: 1/128 of the range of `values`.
    pub(crate) fn guess(values: f32) -> Self {
        Self {
            dark: (values / 128.0) * (values / 128.0),
            per_value: 0.0,
        }
    }

    /// Variance of a pixel of this value; never below that of quantisation, 1/12.
    pub fn variance(&self, value: f32) -> f32 {
        (self.dark + self.per_value * value.max(0.0)).max(LEAST_VARIANCE)
    }
}

/// Measures the noise of pixels against their brightness, from what lines leave over when their
/// reference, shifted, is taken off.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoiseMeter {
    /// Σ residual² and count, in [`BINS`] steps of brightness.
    bins: [(f32, f32); BINS],
}

const BINS: usize = 8;

impl NoiseMeter {
    /// Adds what one line leaves over. `shift_px`: of the line against `mean`; `gain`: its brightness
    /// against it; `frames`: how many frames `mean` is the mean of.
    pub(crate) fn add_line<P: Pixel>(
        &mut self,
        mean: &[u16],
        pixels: &[P],
        shift_px: f32,
        gain: f32,
        recipe: &Recipe,
        frames: f32,
    ) {
        let value = 1.0 / recipe.counts_per_value;
        let stride = recipe.stride;
        let steps = libm::roundf(shift_px / stride as f32) * stride as f32;
        let (whole, near) = (steps as isize, shift_px - steps);
        let per_bin = BINS as f32 / recipe.saturation;
        let own = 1.0 + 1.0 / frames.max(1.0);
        for x in (2 * stride..mean.len().saturating_sub(2 * stride)).step_by(3) {
            let Some(&p) = (x as isize)
                .checked_add(whole)
                .and_then(|at| pixels.get(usize::try_from(at).ok()?))
            else {
                continue;
            };
            let (Some(&left), Some(&here), Some(&right)) =
                (mean.get(x - stride), mean.get(x), mean.get(x + stride))
            else {
                continue;
            };
            let (left, here, right) = (
                f32::from(left) * value,
                f32::from(here) * value,
                f32::from(right) * value,
            );
            let slope = (right - left) / (2.0 * stride as f32);
            // On a steep edge what is left over is the shift's error, not the pixel's noise.
            let noise = recipe.noise.variance(here);
            if slope * slope > noise * 16.0 || here >= recipe.saturation {
                continue;
            }
            let residual = f32::from(p.value()) - gain * (here - near * slope);
            let square = residual * residual / own;
            if let Some(bin) = self.bins.get_mut((here * per_bin) as usize) {
                bin.0 += square;
                bin.1 += 1.0;
            }
        }
    }

    /// The straight line through what was measured; `None` until there is enough of it.
    pub fn noise(&self, saturation: f32) -> Option<PixelNoise> {
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for (k, &(sum, count)) in self.bins.iter().enumerate() {
            if count < 50.0 {
                continue;
            }
            let x = (k as f32 + 0.5) / BINS as f32;
            let y = sum / count;
            // A variance's own standard deviation is in proportion to it: relative weights.
            let w = count / (y * y).max(1e-6);
            n += w;
            sx += w * x;
            sy += w * y;
            sxx += w * x * x;
            sxy += w * x * y;
        }
        if n == 0.0 {
            return None;
        }
        let determinant = n * sxx - sx * sx;
        let slope = if determinant > 1e-4 * n * sxx {
            ((n * sxy - sx * sy) / determinant).max(0.0)
        } else {
            0.0
        };
        let mut dark = (sy - slope * sx) / n;
        let mut slope = slope;
        if dark < 0.0 {
            // Through the origin instead.
            slope = if sxx > 0.0 { (sxy / sxx).max(0.0) } else { 0.0 };
            dark = 0.0;
        }
        Some(PixelNoise {
            dark,
            per_value: slope / saturation.max(1.0),
        })
    }
}
