//! How rows become coefficients.

use super::band::Level;
use super::noise::PixelNoise;
use crate::kernel::Kernel;

/// How rows become coefficients: the same for all rows of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// How coarse the band is.
    pub level: Level,
    /// Pixels from one to the next of the same colour: 1, or 2 for raw Bayer.
    pub stride: usize,
    /// Columns at either edge that the motion may carry out of the picture, px.
    pub margin_px: usize,
    /// Noise of one pixel.
    pub noise: PixelNoise,
    /// Fixed pattern of the sensor: its variance as a share of that noise. It stands in the reference however many
    /// frames that is the mean of. 0 where it is not known.
    pub pattern: f32,
    /// Reference counts in one pixel value.
    pub counts_per_value: f32,
    /// Pixel value from which on a pixel is saturated.
    pub saturation: f32,
    /// Which implementation of the inner product.
    pub kernel: Kernel,
}

impl Recipe {
    /// How many frames' mean would have as much noise as the reference has of its own, which is the mean of so many and
    /// bears the fixed pattern as well.
    // Not inlined: a Pico 2's flash is nearly full, and this takes 840 bytes of it in three places.
    #[inline(never)]
    pub(super) fn noise_frames(&self, frames: f32) -> f32 {
        frames / (1.0 + self.pattern * frames)
    }
}
