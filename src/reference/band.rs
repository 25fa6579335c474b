//! The reduced horizontal shearlet band.
//!
//! A cone-adapted shearlet of the horizontal cone with zero shear is a band-pass along the line times a
//! short low-pass across rows. For a horizontal vibration only this one band is needed. The band-pass is
//! a convolution along the line, used where it fits inside the line; the low-pass across rows is the
//! information-weighted sum of neighbouring rows in [`crate::timeline`], which comes after the
//! correlation because both are linear.
//!
//! What is kept here is the band's *derivative* filter: an antisymmetric FIR filter that is d/dx times a
//! smoothing. Convolved with the reference it gives the coefficients h of the line's inner product
//! (docs/line-engine.md; Guo & Labate 2007 for the shearlet's cone).

/// How coarse the band is. A finer level keeps more of a sharp picture's information, a coarser one
/// leaves out noise where the lens passes nothing anyway.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// d/dx exact to 1.4 % up to 0.25 cycles/px, nothing at 0.5: for pictures sharp to the pixel.
    Sharp,
    /// d/dx exact to 0.4 % up to 0.15 cycles/px, nothing at 0.5: for what a good lens leaves.
    Fine,
    /// The same, smoothed by (1 2 1)/4: half the gain at 0.24 cycles/px.
    Medium,
    /// Smoothed twice: half the gain at 0.18 cycles/px.
    Coarse,
}

/// Half length of the longest filter.
pub const MAX_HALF: usize = 5;

/// The central difference of tenth order, right half.
pub(crate) const DERIVATIVE: [f32; 5] = [
    5.0 / 6.0,
    -5.0 / 21.0,
    5.0 / 84.0,
    -5.0 / 504.0,
    1.0 / 1260.0,
];

/// Slope and value half-way of a row's phase-correlation function, from its values at whole shifts: right halves. Largest
/// error up to 0.3 cycles/px as small as six can make it, 0.02 % (minimax, the lowest frequencies exact): what is
/// missing of the slope would be missing of the scale of every shift. Differences of tenth order lose 4 % there.
pub(crate) const SLOPE: [f32; 6] = [
    0.914_754, -0.348_036, 0.143_975, -0.052_355, 0.014_455, -0.002_243,
];
pub(crate) const HALFWAY: [f32; 6] = [
    0.622_101, -0.171_956, 0.069_952, -0.026_704, 0.008_104, -0.001_497,
];

impl Level {
    /// All levels, finest first.
    pub const ALL: [Self; 4] = [Self::Sharp, Self::Fine, Self::Medium, Self::Coarse];

    /// Right half f\[1\], f\[2\], … of the antisymmetric filter, 1/px: the band-passed derivative is
    /// Σₖ f\[k\]·(r(x + k) − r(x − k)).
    pub(crate) const fn half_filter(self) -> &'static [f32] {
        // Central differences of tenth and of sixth order (Fornberg 1988, table 1); the others are the
        // latter convolved with (1 2 1)/4 once and twice.
        match self {
            Self::Sharp => &DERIVATIVE,
            Self::Fine => &[45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0],
            Self::Medium => &[81.0 / 240.0, 28.0 / 240.0, -7.0 / 240.0, 1.0 / 240.0],
            Self::Coarse => &[
                190.0 / 960.0,
                130.0 / 960.0,
                15.0 / 960.0,
                -5.0 / 960.0,
                1.0 / 960.0,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain against the ideal derivative at `cycles_per_px`.
    fn gain(level: Level, cycles_per_px: f32) -> f32 {
        let w = 2.0 * core::f32::consts::PI * cycles_per_px;
        let sum: f32 = (1u8..)
            .zip(level.half_filter())
            .map(|(k, f)| 2.0 * f * libm::sinf(f32::from(k) * w))
            .sum();
        sum / w
    }

    #[test]
    fn a_level_is_a_derivative_where_the_lens_passes_most() {
        assert!((gain(Level::Sharp, 0.25) - 0.986).abs() < 0.001);
        assert!((gain(Level::Fine, 0.1) - 1.0).abs() < 0.001);
        assert!((gain(Level::Fine, 0.15) - 0.996).abs() < 0.001);
        for level in Level::ALL {
            assert!((gain(level, 0.001) - 1.0).abs() < 1e-4);
            assert!(gain(level, 0.5).abs() < 1e-6);
            assert!(level.half_filter().len() <= MAX_HALF);
        }
    }

    #[test]
    fn smoothing_is_binomial() {
        for f in [0.05, 0.1, 0.2, 0.3] {
            let smooth = libm::powf(libm::cosf(core::f32::consts::PI * f), 2.0);
            assert!((gain(Level::Medium, f) - gain(Level::Fine, f) * smooth).abs() < 1e-6);
            assert!((gain(Level::Coarse, f) - gain(Level::Medium, f) * smooth).abs() < 1e-6);
        }
    }
}
