//! A line shifted back by its own displacement, averaged into its reference.

use crate::{
    kernel::{self, Kernel, Wide},
    pixel::Pixel,
    reference::Recipe,
};
use core::ops::Range;

/// Shifts smaller than this blur nothing: the line is averaged in as it is, px.
const STILL_PX: f32 = 0.08;

/// mean(x) ← mean(x)·(1 − keep) + p(x + shift)·share: `keep` = 1/n, `share` = keep / brightness. Between
/// pixels by Lagrange's polynomial through six; where the line does not reach, the mean stays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Averaging {
    share: f32,
    keep: f32,
    counts_per_value: f32,
    stride: usize,
    /// From a column to the first of its six pixels; `None` where each column takes its own pixel.
    taps: Option<(isize, [f32; 6])>,
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
            // Where all six taps are inside the line.
            let (before, after) = (2 * stride, 3 * stride);
            let first = offset - before;
            let end = width as isize - after - offset;
            averaging.from = (-first).max(0) as usize;
            averaging.to = end.clamp(0, width as isize) as usize;
            averaging.taps = Some((first, lagrange(steps - whole)));
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
        for x in span.start.max(self.from)..span.end.min(self.to) {
            let Some(m) = mean.get_mut(x) else { return };
            let value = match self.taps {
                None => v(x),
                Some((first, [a, b, c, d, e, f])) => {
                    let (at, by) = (x.wrapping_add_signed(first), self.stride);
                    a * v(at)
                        + b * v(at + by)
                        + c * v(at + 2 * by)
                        + d * v(at + 3 * by)
                        + e * v(at + 4 * by)
                        + f * v(at + 5 * by)
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
        let [a, b, c, d, e, f] = weights;
        let pairs = [tap(0).zip(tap(1)), tap(2).zip(tap(3)), tap(4).zip(tap(5))];
        let [first, second, third] = pairs;
        for (m, ((ab, cd), ef)) in mean.iter_mut().zip(first.zip(second).zip(third)) {
            let v = |p: &P| f32::from(p.value());
            let value =
                a * v(ab.0) + b * v(ab.1) + c * v(cd.0) + d * v(cd.1) + e * v(ef.0) + f * v(ef.1);
            averaging.mix(m, value);
        }
    }
}

/// r(x) ← r(x − shift): moves a row to the right (to the left where negative), between pixels by Lagrange's
/// polynomial through six of one colour; what comes in repeats the edge. `scratch`: as long as the row,
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
    let weights = lagrange(whole - steps);
    let offset = whole as isize * stride as isize;
    let last = old.len().saturating_sub(stride);
    for (x, r) in row.iter_mut().enumerate() {
        let mut value = 0.0;
        for (tap, weight) in (-2isize..).zip(weights) {
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

/// Lagrange's weights of the pixels at −2 … 3 for a position `t` in 0..1: between pixels it passes
/// 99.98 % of what varies with 0.1 cycles/px, 98.5 % at 0.2.
pub(crate) fn lagrange(t: f32) -> [f32; 6] {
    let [a, b, c, d, e, f] = [t + 2.0, t + 1.0, t, t - 1.0, t - 2.0, t - 3.0];
    [
        -b * c * d * e * f / 120.0,
        a * c * d * e * f / 24.0,
        -a * b * d * e * f / 12.0,
        a * b * c * e * f / 12.0,
        -a * b * c * d * f / 24.0,
        a * b * c * d * e / 120.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::{Averaging, Kernel, Recipe, lagrange, move_row_by};

    #[test]
    fn polynomials_of_fifth_degree_are_exact() {
        let p = |x: f32| 1.0 + x * (0.5 + x * (-0.25 + x * (0.125 + x * (0.0625 - 0.03125 * x))));
        for t in [0.0, 0.1, 0.37, 0.5, 0.99] {
            let value: f32 = (-2i8..)
                .zip(lagrange(t))
                .map(|(x, w)| w * p(f32::from(x)))
                .sum();
            assert!((value - p(t)).abs() < 1e-5, "{t}");
        }
    }

    #[test]
    fn some_columns_at_a_time_are_the_whole_line() {
        use crate::pixel::Pixel;
        let recipe = Recipe {
            level: crate::band::Level::Fine,
            stride: 1,
            margin_px: 0,
            noise: crate::noise::PixelNoise::guess(256.0),
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
            level: crate::band::Level::Fine,
            stride,
            margin_px: 0,
            noise: crate::noise::PixelNoise::guess(256.0),
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
