//! Noise of one pixel.

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
    #[inline]
    pub fn variance(&self, value: f32) -> f32 {
        let value = if value > 0.0 { value } else { 0.0 };
        let variance = self.dark + self.per_value * value;
        if variance > LEAST_VARIANCE {
            variance
        } else {
            LEAST_VARIANCE
        }
    }
}
