//! Slopes of a mean picture, pixel by pixel.

use crate::reference::band::{DERIVATIVE as SMOOTH_SLOPE, SLOPE as ACCURATE_SLOPE};

/// Rows and columns at the picture's edge whose slopes are not known.
pub(super) const MARGIN: usize = 2;

/// Right halves of the central differences of fourth to eighth order (Fornberg 1988, table 1): for pixels that have so few
/// others between them and the picture's edge.
const NEAR_THE_EDGE: [&[f32]; 3] = [
    &[2.0 / 3.0, -1.0 / 12.0],
    &[3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0],
    &[4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0],
];

/// The filters for a pixel that has this many others between it and the edge: for the coefficients and for the answer; `None`
/// within [`MARGIN`].
fn filters(inside: usize) -> Option<[&'static [f32]; 2]> {
    if inside >= ACCURATE_SLOPE.len() {
        return Some([&SMOOTH_SLOPE, &ACCURATE_SLOPE]);
    }
    if inside >= SMOOTH_SLOPE.len() {
        return Some([&SMOOTH_SLOPE; 2]);
    }
    let few = NEAR_THE_EDGE.get(inside.checked_sub(MARGIN)?)?;
    Some([few, few])
}

/// What the noise of a pixel of the mean picture adds to Σ h·∂r along the same axis: the filters' inner product.
pub(super) fn noise_gain() -> f32 {
    let both = SMOOTH_SLOPE.iter().zip(ACCURATE_SLOPE);
    2.0 * both.map(|(a, b)| a * b).sum::<f32>()
}

/// A mean picture, grey values, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mean<'a> {
    pub(super) pixels: &'a [f32],
    pub(super) width: usize,
    pub(super) height: usize,
}

/// The picture around a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slopes {
    /// Its grey value.
    pub(super) grey: f32,
    /// Slopes to the right and downwards, grey values a px: smoothed at what no lens passes, for the coefficients.
    pub(super) smooth: [f32; 2],
    /// The same to 0.02 % up to 0.3 cycles/px, for the answer to a shift.
    pub(super) accurate: [f32; 2],
}

impl Mean<'_> {
    /// At column `x` of row `y`; `None` too near the picture's edge.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<Slopes> {
        let inside = |at: usize, all: usize| Some(at.min(all.checked_sub(at + 1)?));
        let [smooth_x, accurate_x] = filters(inside(x, self.width)?)?;
        let [smooth_y, accurate_y] = filters(inside(y, self.height)?)?;
        let at = y * self.width + x;
        Some(Slopes {
            grey: *self.pixels.get(at)?,
            smooth: [
                self.along(at, 1, smooth_x),
                self.along(at, self.width, smooth_y),
            ],
            accurate: [
                self.along(at, 1, accurate_x),
                self.along(at, self.width, accurate_y),
            ],
        })
    }

    /// An antisymmetric filter's right half, `stride` values from one tap to the next.
    fn along(&self, at: usize, stride: usize, half: &[f32]) -> f32 {
        let value = |at: usize| self.pixels.get(at).copied().unwrap_or(0.0);
        let taps = half.iter().enumerate();
        taps.map(|(k, weight)| {
            let away = (k + 1) * stride;
            weight * (value(at + away) - value(at - away))
        })
        .sum()
    }
}
