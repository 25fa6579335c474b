//! Measures the noise of a pixel while the reference is learned.

use core::hint::select_unpredictable;

use super::noise::PixelNoise;
use super::{Beside, Recipe};
use crate::camera::pixel::Pixel;

/// Measures the noise of pixels against their brightness, from what lines leave over when their
/// reference, shifted, is taken off.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoiseMeter {
    /// Σ residual² and count, in [`BINS`] steps of brightness, and of what does not count.
    bins: [(f32, f32); BINS + 1],
}

const BINS: usize = 8;

/// Parts of a line, each of which has a brightness of its own where that differs by more than this share: under a shadow.
const PARTS: usize = 4;
const SHADED: f32 = 0.08;

impl NoiseMeter {
    /// Adds what one line leaves over. `beside`: the rows next to `mean`, where the line is displaced along the columns;
    /// `shift_px`: of the line against `mean`; `gain`: its brightness against it; `frames`: how many frames `mean` is the mean of.
    #[expect(clippy::too_many_arguments)]
    pub(crate) fn add_line<P: Pixel>(
        &mut self,
        mean: &[u16],
        beside: Option<Beside<'_>>,
        pixels: &[P],
        shift_px: f32,
        gain: f32,
        recipe: &Recipe,
        frames: f32,
    ) {
        let value = 1.0 / recipe.counts_per_value;
        let stride = recipe.stride;
        let steps = libm::roundf(shift_px / stride as f32) * stride as f32;
        // The cast saturates: such a line meets nothing of its reference.
        let (whole, near) = (steps as i32 as isize, shift_px - steps);
        let per_bin = BINS as f32 / recipe.saturation;
        let per_px = 0.5 / stride as f32;
        let own = 1.0 + 1.0 / frames.max(1.0);
        // Every third column, from the first that has a neighbour and meets a pixel of the line.
        let mut first = 2 * stride;
        if whole.saturating_add_unsigned(first) < 0 {
            first += (whole.unsigned_abs() - first).next_multiple_of(3);
        }
        let (Some(mean), Some(pixels)) = (
            mean.get(first - stride..mean.len().saturating_sub(stride)),
            pixels.get(first.wrapping_add_signed(whole)..),
        ) else {
            return;
        };
        // A reference pixel and its slope, and the line's pixel.
        let columns = || {
            let columns = mean.windows(2 * stride + 1).step_by(3);
            let pairs = columns.zip(pixels.iter().step_by(3));
            pairs.map_while(|(around, p)| {
                let &[left, .., right] = around else {
                    return None;
                };
                let here = around.get(stride).copied().unwrap_or(0);
                let slope = (f32::from(right) * value - f32::from(left) * value) * per_px;
                Some((f32::from(here) * value, slope, f32::from(p.value())))
            })
        };
        let part = mean.len().div_ceil(3 * PARTS).max(1);
        let gain_of = |from: usize| {
            let some = columns().skip(from).take(part);
            let (line, model) = some.fold((0.0, 0.0), |(line, model), (here, slope, p)| {
                (line + p, model + (here - near * slope))
            });
            let own = line / model;
            // Neither is true of what is no number.
            let shaded = (own - gain).abs() > SHADED * gain && own.is_finite();
            if shaded { own } else { gain }
        };
        let (mut own_gain, mut next_part) = (gain_of(0), part);
        for (k, (here, slope, p)) in columns().enumerate() {
            if k == next_part {
                own_gain = gain_of(k);
                next_part += part;
            }
            // On a steep edge what is left over is the shift's error, not the pixel's noise.
            let steep = slope * slope > recipe.noise.variance(here) * 16.0;
            let mut model = here - near * slope;
            if let Some(beside) = &beside {
                model -= beside.less(first + 3 * k, here / value) * value;
            }
            let residual = p - own_gain * model;
            // What does not count goes to a bin of its own: a branch would be foreseen half of the time.
            let bin = select_unpredictable(
                steep | (here >= recipe.saturation),
                BINS,
                ((here * per_bin) as i32 as usize).min(BINS),
            );
            if let Some(bin) = self.bins.get_mut(bin) {
                bin.0 += residual * residual / own;
                bin.1 += 1.0;
            }
        }
    }

    /// The straight line through what was measured; `None` until there is enough of it.
    pub fn noise(&self, saturation: f32) -> Option<PixelNoise> {
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for (k, &(sum, count)) in self.bins.iter().take(BINS).enumerate() {
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
