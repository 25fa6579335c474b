//! A line shifted back by its own displacement, averaged into its reference.

use super::Recipe;
use crate::camera::pixel::Pixel;
use crate::kernel::{self, Kernel, Wide};
use core::ops::Range;

/// Shifts smaller than this blur nothing: the line is averaged in as it is, px.
const STILL_PX: f32 = 0.03;

/// Pixels that make one between them, and how many of them lie before it; a row's mean is unknown so near its ends.
const TAPS: usize = 8;
const BEFORE: usize = TAPS / 2 - 1;
pub(crate) const UNKNOWN_STEPS: usize = TAPS / 2;

/// mean(x) ← mean(x)·(1 − keep) + p(x + shift)·share: `keep` = 1/n, `share` = keep / brightness. Between
/// pixels by [`between`]; where the line does not reach, the mean stays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Averaging {
    share: f32,
    keep: f32,
    counts_per_value: f32,
    stride: usize,
    /// From a column to the first of its pixels; `None` where each column takes its own pixel.
    taps: Option<(isize, [f32; TAPS])>,
    /// The columns that the line reaches.
    from: usize,
    to: usize,
}

impl Averaging {
    /// For a line of `width` pixels that is shifted by `shift_px`.
    pub(crate) fn new(shift_px: f32, share: f32, keep: f32, recipe: &Recipe, width: usize) -> Self {
        let mut averaging = Self {
            share,
            keep,
            counts_per_value: recipe.counts_per_value,
            stride: recipe.stride,
            taps: None,
            from: 0,
            to: width,
        };
        if shift_px.is_nan() || shift_px.abs() >= STILL_PX {
            let stride = recipe.stride as isize;
            let steps = shift_px / recipe.stride as f32;
            let whole = libm::floorf(steps);
            // As far as that, and where nothing is known, no pixel of the line is of use.
            if whole.is_nan() || whole.abs() > width as f32 {
                averaging.to = 0;
                return averaging;
            }
            let offset = whole as isize * stride;
            // Where all taps are inside the line.
            let (before, after) = (
                BEFORE as isize * stride,
                (TAPS - 1 - BEFORE) as isize * stride,
            );
            let first = offset - before;
            let end = width as isize - after - offset;
            averaging.from = (-first).max(0) as usize;
            averaging.to = end.clamp(0, width as isize) as usize;
            averaging.taps = Some((first, between(steps - whole)));
        }
        averaging
    }

    #[inline(always)]
    fn mix(&self, mean: &mut u16, value: f32) {
        let old = f32::from(*mean);
        let new = old - old * self.keep + value * self.counts_per_value * self.share;
        *mean = kernel::whole((new + 0.5).clamp(0.0, 65535.0));
    }

    /// Averages the whole line in.
    pub(crate) fn all<P: Pixel>(&self, kernel: Kernel, mean: &mut [u16], pixels: &[P]) {
        let averaging = *self;
        kernel.run(All {
            averaging,
            mean,
            pixels,
        });
    }

    /// Averages the columns of `span` in; the line was kept by [`Pixel::pack`].
    pub(crate) fn some<P: Pixel>(&self, span: Range<usize>, mean: &mut [u16], line: &[f32]) {
        let v = |x: usize| f32::from(P::unpack(line, x));
        let span = span.start.max(self.from)..span.end.min(self.to);
        if let (Some((first, weights)), 1) = (self.taps, self.stride) {
            // Seven of a column's pixels are those of the column before.
            let at = span.start.wrapping_add_signed(first);
            let at = at.wrapping_sub(1);
            let [_, mut a, mut b, mut c, mut d, mut e, mut f, mut g]: [f32; TAPS] =
                core::array::from_fn(|k| v(at.wrapping_add(k)));
            let Some(mean) = mean.get_mut(span) else {
                return;
            };
            for (x, m) in mean.iter_mut().enumerate() {
                let h = v(at.wrapping_add(x + TAPS));
                let pixels = [a, b, c, d, e, f, g, h].into_iter();
                self.mix(m, pixels.zip(weights).map(|(v, weight)| weight * v).sum());
                (a, b, c, d, e, f, g) = (b, c, d, e, f, g, h);
            }
            return;
        }
        for x in span {
            let Some(m) = mean.get_mut(x) else { return };
            let value = match self.taps {
                None => v(x),
                Some((first, weights)) => {
                    let at = x.wrapping_add_signed(first);
                    let taps = (at..).step_by(self.stride).zip(weights);
                    taps.map(|(at, weight)| weight * v(at)).sum()
                }
            };
            self.mix(m, value);
        }
    }
}

/// A whole line.
struct All<'a, P> {
    averaging: Averaging,
    mean: &'a mut [u16],
    pixels: &'a [P],
}

impl<P: Pixel> Wide for All<'_, P> {
    type Out = ();
    #[inline(always)]
    fn run(self) {
        let (averaging, mean, pixels) = (self.averaging, self.mean, self.pixels);
        let Some((first, weights)) = averaging.taps else {
            for (m, p) in mean.iter_mut().take(averaging.to).zip(pixels) {
                averaging.mix(m, f32::from(p.value()));
            }
            return;
        };
        let Ok(first) = usize::try_from(averaging.from as isize + first) else {
            return;
        };
        let (Some(mean), Some(line)) = (
            mean.get_mut(averaging.from..averaging.to.max(averaging.from)),
            pixels.get(first..),
        ) else {
            return;
        };
        let tap = |k: usize| line.get(k * averaging.stride..).unwrap_or(&[]).iter();
        let [a, b, c, d, e, f, g, h] = weights;
        let pair = |k: usize| tap(k).zip(tap(k + 1));
        let (left, right) = (pair(0).zip(pair(2)), pair(4).zip(pair(6)));
        for (m, ((ab, cd), (ef, gh))) in mean.iter_mut().zip(left.zip(right)) {
            let v = |p: &P| f32::from(p.value());
            let left = a * v(ab.0) + b * v(ab.1) + c * v(cd.0) + d * v(cd.1);
            let right = e * v(ef.0) + f * v(ef.1) + g * v(gh.0) + h * v(gh.1);
            averaging.mix(m, left + right);
        }
    }
}

/// r(x) ← r(x − shift): moves a row to the right (to the left where negative), between pixels by
/// [`between`] those of one colour; what comes in repeats the edge. `scratch`: as long as the row,
/// else nothing moves.
pub(crate) fn move_row_by(row: &mut [u16], shift_px: f32, stride: usize, scratch: &mut [f32]) {
    let Some(old) = scratch.get_mut(..row.len()) else {
        return;
    };
    for (old, &r) in old.iter_mut().zip(row.iter()) {
        *old = f32::from(r);
    }
    // Further than that it is all edge.
    let most = old.len() as f32;
    let steps = shift_px.clamp(-most, most) / stride as f32;
    if steps.is_nan() {
        return;
    }
    let whole = libm::ceilf(steps);
    let weights = between(whole - steps);
    let offset = whole as isize * stride as isize;
    let last = old.len().saturating_sub(stride);
    for (x, r) in row.iter_mut().enumerate() {
        let mut value = 0.0;
        for (tap, weight) in (-(BEFORE as isize)..).zip(weights) {
            let at = x as isize + tap * stride as isize - offset;
            let colour = x % stride;
            let at = if at < 0 {
                colour
            } else if at as usize >= old.len() {
                last + (colour + stride - last % stride) % stride
            } else {
                at as usize
            };
            value += weight * old.get(at).copied().unwrap_or(0.0);
        }
        *r = (value + 0.5).clamp(0.0, 65535.0) as u16;
    }
}

/// Even and odd part of the weights about the middle between two pixels, in powers of the square of the distance from
/// there; the pixels next to the middle first.
const EVEN: [[f32; 3]; TAPS / 2] = [
    [0.607_782, -0.455_82, 0.100_987],
    [-0.138_273, 0.595_353, -0.173_237],
    [0.036_071, -0.165_59, 0.087_83],
    [-0.005_58, 0.026_057, -0.015_58],
];
const ODD: [[f32; 3]; TAPS / 2] = [
    [1.213_705, -0.898_251, -0.001_68],
    [-0.090_907, 0.387_693, 0.025_22],
    [0.013_836, -0.062_008, -0.028_027],
    [-0.001_452, 0.006_459, 0.009_45],
];

/// Weights of the pixels at −3 … 4 for a position `t` in 0..1.
///
/// A reference that is weaker in fine detail than its lines makes every shift read too large, so the largest error up to
/// 0.22 cycles/px is made as small as eight weights can: 0.02 %, while a constant and a slope stay exact (a Farrow
/// structure, its coefficients by iterated least squares). Lagrange's polynomial through six loses 2 % there.
pub(crate) fn between(t: f32) -> [f32; TAPS] {
    let off = t - 0.5;
    let square = off * off;
    let at = |[a, b, c]: [f32; 3]| a + square * (b + square * c);
    let mut weights = [0.0; TAPS];
    let (left, right) = weights.split_at_mut(TAPS / 2);
    let pairs = left.iter_mut().rev().zip(right).zip(EVEN).zip(ODD);
    for (((left, right), even), odd) in pairs {
        let (even, odd) = (at(even), off * at(odd));
        (*left, *right) = (even - odd, even + odd);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::{Averaging, BEFORE, Kernel, Recipe, TAPS, between, move_row_by};

    #[test]
    fn a_constant_and_a_slope_are_exact_and_detail_is_kept() {
        let pixels = || (0..TAPS).map(|k| k as f32 - BEFORE as f32);
        for t in [0.0, 0.1, 0.25, 0.37, 0.5, 0.99] {
            let sum: f32 = between(t).iter().sum();
            let place: f32 = between(t).iter().zip(pixels()).map(|(w, x)| w * x).sum();
            assert!((sum - 1.0).abs() < 2e-6 && (place - t).abs() < 3e-6, "{t}");
            for cycles in [0.02, 0.05, 0.1, 0.15, 0.2, 0.22] {
                for phase in [0.0, 1.0, 2.0] {
                    let wave = |x: f32| libm::sinf(core::f32::consts::TAU * cycles * x + phase);
                    let value: f32 = between(t)
                        .iter()
                        .zip(pixels())
                        .map(|(w, x)| w * wave(x))
                        .sum();
                    assert!((value - wave(t)).abs() < 2.5e-4, "{t} {cycles}");
                }
            }
        }
    }

    #[test]
    fn some_columns_at_a_time_are_the_whole_line() {
        use crate::camera::pixel::Pixel;
        let recipe = Recipe {
            level: crate::reference::band::Level::Fine,
            stride: 1,
            margin_px: 0,
            noise: crate::reference::noise::PixelNoise::guess(256.0),
            pattern: 0.0,
            counts_per_value: 128.0,
            saturation: 254.0,
            kernel: crate::kernel::Kernel::PORTABLE,
        };
        let line: [u8; 37] = core::array::from_fn(|x| (x * x * 7 % 251) as u8);
        let mut kept = [0.0; 74];
        u8::pack(&line, &mut kept);
        for shift_px in [0.0, 0.05, 0.3, -0.6, 5.2, -7.9, 30.0] {
            for stride in [1, 2] {
                let recipe = Recipe { stride, ..recipe };
                let averaging = Averaging::new(shift_px, 0.21, 0.2, &recipe, 37);
                let (mut at_once, mut in_steps) = ([9000; 37], [9000; 37]);
                averaging.all(Kernel::detect(), &mut at_once, &line);
                for start in (0..37).step_by(5) {
                    averaging.some::<u8>(start..start + 5, &mut in_steps, &kept);
                }
                assert_eq!(at_once, in_steps, "{shift_px} {stride}");
            }
        }
    }

    #[test]
    fn a_line_that_is_nowhere_near_leaves_the_mean_alone() {
        let recipe = |stride| Recipe {
            level: crate::reference::band::Level::Fine,
            stride,
            margin_px: 0,
            noise: crate::reference::noise::PixelNoise::guess(256.0),
            pattern: 0.0,
            counts_per_value: 128.0,
            saturation: 254.0,
            kernel: crate::kernel::Kernel::PORTABLE,
        };
        for stride in [1, 2] {
            for shift in [33.0, 1e6, 1e19, f32::MAX, f32::INFINITY, f32::NAN] {
                for shift in [shift, -shift] {
                    let mut mean = [777; 32];
                    let averaging = Averaging::new(shift, 0.5, 0.5, &recipe(stride), 32);
                    averaging.all(Kernel::detect(), &mut mean, &[200u8; 32]);
                    averaging.some::<u8>(0..32, &mut mean, &[0.0; 8]);
                    assert_eq!(mean, [777; 32], "{shift}");
                }
            }
        }
    }

    #[test]
    fn a_row_moves_by_parts_of_pixels_either_way() {
        let texture =
            |x: f32| 30000.0 + 9000.0 * libm::sinf(0.6 * x) + 4000.0 * libm::cosf(0.23 * x);
        let picture = |shift: f32| -> [u16; 64] {
            core::array::from_fn(|x| libm::roundf(texture(x as f32 - shift)) as u16)
        };
        for shift in [0.0, 0.3, -0.3, 0.5, 2.0, 7.7, -7.7, -1.0] {
            let mut row = picture(0.0);
            move_row_by(&mut row, shift, 1, &mut [0.0; 64]);
            let inner = row.iter().zip(picture(shift)).skip(12).take(40);
            for (&moved, want) in inner {
                assert!(moved.abs_diff(want) < 12, "{shift}: {moved} {want}");
            }
        }
    }

    #[test]
    fn colours_of_a_bayer_row_do_not_mix() {
        // One colour is flat at 1000, the other is a ramp.
        let mut row: [u16; 40] = core::array::from_fn(|x| {
            if x % 2 == 0 {
                1000
            } else {
                20000 + 100 * x as u16
            }
        });
        move_row_by(&mut row, 3.0, 2, &mut [0.0; 40]);
        for (x, &moved) in row.iter().enumerate().skip(10).take(20) {
            let want = if x % 2 == 0 {
                1000
            } else {
                20000 + 100 * (x as u16 - 3)
            };
            assert!(moved.abs_diff(want) <= 1, "{x}: {moved} {want}");
        }
        assert!(row.iter().step_by(2).all(|&r| r.abs_diff(1000) <= 1));
    }

    #[test]
    fn a_row_moved_beyond_its_edge_is_all_edge() {
        let mut row = [5, 6, 7, 8];
        move_row_by(&mut row, f32::MAX, 1, &mut [0.0; 4]);
        assert_eq!(row, [5; 4]);
        move_row_by(&mut row, f32::NAN, 2, &mut [0.0; 4]);
        move_row_by(&mut row, 1.0, 1, &mut []);
    }
}
