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

/// What that noise adds to −Σ h·∂³r: the smooth filter's inner product with second differences of the accurate one.
pub(super) fn bend_noise_gain() -> f32 {
    let smooth = |k: i32| signed(SMOOTH_SLOPE.as_slice(), k);
    let accurate = |k: i32| signed(ACCURATE_SLOPE.as_slice(), k);
    let reach = SMOOTH_SLOPE.len() as i32;
    let taps = (-reach..=reach)
        .map(|k| smooth(k) * (2.0 * accurate(k) - accurate(k - 1) - accurate(k + 1)));
    taps.sum()
}

/// Tap `k` of the antisymmetric filter that has this right half.
fn signed(half: &[f32], k: i32) -> f32 {
    let at = (k.unsigned_abs() as usize).checked_sub(1);
    let tap = at.and_then(|at| half.get(at)).copied().unwrap_or(0.0);
    if k < 0 { -tap } else { tap }
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

    /// Third derivatives along x and along y at column `x` of row `y`, as second differences of the accurate slopes; 0 too
    /// near the picture's edge.
    pub(super) fn bend(&self, x: usize, y: usize) -> [f32; 2] {
        let at =
            |x: Option<usize>, y: Option<usize>, axis: usize| Some(self.at(x?, y?)?.accurate[axis]);
        let second = |before: Option<f32>, here: Option<f32>, behind: Option<f32>| {
            Some(before? - 2.0 * here? + behind?)
        };
        let (here_x, here_y) = (at(Some(x), Some(y), 0), at(Some(x), Some(y), 1));
        let left = at(x.checked_sub(1), Some(y), 0);
        let above = at(Some(x), y.checked_sub(1), 1);
        [
            second(left, here_x, at(Some(x + 1), Some(y), 0)).unwrap_or(0.0),
            second(above, here_y, at(Some(x), Some(y + 1), 1)).unwrap_or(0.0),
        ]
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
