//! A line shifted back by its own displacement, averaged into its reference.

use crate::{pixel::Pixel, reference::Recipe};

/// Shifts smaller than this blur nothing: the line is averaged in as it is, px.
const STILL_PX: f32 = 0.08;

/// mean(x) ← mean(x)·(1 − keep) + p(x + shift)·share: `keep` = 1/n, `share` = keep / brightness. Between
/// pixels by Lagrange's cubic; where the line does not reach, the mean stays.
pub(crate) fn average_in<P: Pixel>(
    mean: &mut [u16],
    pixels: &[P],
    shift_px: f32,
    share: f32,
    keep: f32,
    recipe: &Recipe,
) {
    let counts = recipe.counts_per_value;
    let mix = |mean: &mut u16, value: f32| {
        let old = f32::from(*mean);
        let new = old - old * keep + value * counts * share;
        *mean = (new + 0.5).clamp(0.0, 65535.0) as u16;
    };
    if shift_px.abs() < STILL_PX {
        for (m, p) in mean.iter_mut().zip(pixels) {
            mix(m, f32::from(p.value()));
        }
        return;
    }
    let stride = recipe.stride;
    let steps = shift_px / stride as f32;
    let whole = libm::floorf(steps);
    let [a, b, c, d] = cubic(steps - whole);
    let offset = whole as isize * stride as isize;
    for (x, m) in mean.iter_mut().enumerate() {
        let tap = |k: isize| {
            let at = (x as isize)
                .checked_add(offset)?
                .checked_add(k * stride as isize)?;
            pixels
                .get(usize::try_from(at).ok()?)
                .map(|p| f32::from(p.value()))
        };
        let (Some(p0), Some(p1), Some(p2), Some(p3)) = (tap(-1), tap(0), tap(1), tap(2)) else {
            continue;
        };
        mix(m, a * p0 + b * p1 + c * p2 + d * p3);
    }
}

/// Lagrange's weights of the pixels at −1, 0, 1, 2 for a position `t` in 0..1.
pub(crate) fn cubic(t: f32) -> [f32; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}
