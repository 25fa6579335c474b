//! From a row of the reference to its coefficients, some columns at a time.
//!
//! A board must not spend a whole row's work in one line time, so the work is a small state machine:
//! [`Build::advance`] does the next few columns of the present step. On a desktop one call does all.

mod smooth_light;
mod vertical;

use super::align::UNKNOWN_STEPS;
use super::band::{HALFWAY, MAX_HALF, SLOPE};
use super::static_pixels::{LEFT_OUT, NONE, weigh_nothing};
use super::{Recipe, RowTable, Two, at_least_1};
use crate::kernel::{Kernel, Wide};
use core::ops::Range;

pub use vertical::{VerticalBuild, VerticalParts};

/// Rows whose shift is less sure than this are not used, px.
const WORST_SD_PX: f32 = 0.4;

/// Columns on either side over which the energy of the slope is averaged, and their number.
const ENERGY_REACH: usize = 4;
const ENERGY_COLUMNS: usize = 2 * ENERGY_REACH + 1;
/// Ring of the last squares: a power of two, so that a position is a mask away.
const RING: usize = ENERGY_COLUMNS.next_power_of_two();

/// The reference's own noise is at most that of so small a share of a frame.
const LEAST_FRAMES: f32 = 1e-3;

/// Whole shifts either way at which the phase-correlation function is taken.
const LAGS: usize = SLOPE.len();

/// A column of a correlation is so many times less work than one of another step.
const CORRELATED: usize = 4;

/// The buffers of one row, all of its width.
#[derive(Debug)]
pub struct Parts<'a> {
    /// The reference row, in counts.
    pub mean: &'a [u16],
    /// Weight of each column, 0 = unused; the band's filter reaches [`MAX_HALF`] strides into what lies
    /// beside.
    pub mask: &'a [u8],
    /// Scratch, kept from one call of [`Build::advance`] to the next: weights, then h.
    pub scratch: &'a mut [f32],
    /// What is built.
    pub coefficients: &'a mut [i8],
}

/// Which step comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Weigh,
    Derive,
    DropNoise,
    Balance,
    Orthogonalise,
    Quantise,
    Settle,
    Correlate(usize),
}

/// The work on one row, begun and not yet ended.
#[derive(Clone, Copy, Debug)]
pub struct Build {
    recipe: Recipe,
    /// Columns of pixels that do not move with the row.
    left_out: [u16; LEFT_OUT],
    /// Of how many frames a mean has as much noise as the reference.
    frames: f32,
    /// Pixel values in one reference count: a power of two, so that no bit differs from a division.
    per_count: f32,
    step: Step,
    column: usize,
    /// Σ r, in counts, and that of the columns that tell of the light.
    total: u64,
    light: u64,
    /// Squares of the last columns of h as they were, in a ring, and the sum around the present one.
    before: [f32; RING],
    energy: f32,
    sums: Moments,
    /// h ← h − w·(α + β·r).
    alpha_beta: (f32, f32),
    largest: f32,
    carry: f32,
    /// Σ of the coefficients so far; of those of odd columns too, where a kernel keeps them two by two.
    excess: i32,
    odd_excess: i32,
    /// Σ h²·variance and Σ w·variance.
    noise_power: f32,
    weight_power: f32,
    /// Σ h(x)·r(x − k) for k = −LAGS ..= LAGS strides.
    q: [f32; 2 * LAGS + 1],
}

/// Weighted moments of the reference and of h.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    w: f32,
    wr: f32,
    wrr: f32,
    h: f32,
    hr: f32,
}

impl Moments {
    /// α and β that make h − w·(α + β·r) orthogonal to 1 and r.
    fn solve(&self) -> (f32, f32) {
        let determinant = self.w * self.wrr - self.wr * self.wr;
        if determinant > 1e-3 * self.w * self.wrr {
            (
                (self.h * self.wrr - self.hr * self.wr) / determinant,
                (self.hr * self.w - self.h * self.wr) / determinant,
            )
        } else if self.w > 0.0 {
            (self.h / self.w, 0.0)
        } else {
            (0.0, 0.0)
        }
    }
}

impl Build {
    /// Begins a row. `frames`: of how many frames a mean has the noise of this one, above 0.
    pub fn new(recipe: &Recipe, frames: f32) -> Self {
        Self {
            recipe: *recipe,
            left_out: [NONE; LEFT_OUT],
            frames: if frames > LEAST_FRAMES {
                frames
            } else {
                LEAST_FRAMES
            },
            per_count: 1.0 / recipe.counts_per_value,
            step: Step::Weigh,
            column: 0,
            total: 0,
            light: 0,
            before: [0.0; RING],
            energy: 0.0,
            sums: Moments::default(),
            alpha_beta: (0.0, 0.0),
            largest: 0.0,
            carry: 0.0,
            excess: 0,
            odd_excess: 0,
            noise_power: 0.0,
            weight_power: 0.0,
            q: [0.0; 2 * LAGS + 1],
        }
    }

    /// The same, without these pixels and what the band's filter mixes with them.
    pub(super) fn without(mut self, left_out: [u16; LEFT_OUT]) -> Self {
        self.left_out = left_out;
        self
    }

    /// Builds a row in one go.
    pub fn all(self, parts: &mut Parts<'_>) -> RowTable {
        if cfg!(target_arch = "x86_64") {
            self.recipe.kernel.run(All(self, parts))
        } else {
            self.in_one_go(parts)
        }
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn in_one_go(mut self, parts: &mut Parts<'_>) -> RowTable {
        loop {
            if let Some(table) = self.advance(usize::MAX, parts) {
                return table;
            }
        }
    }

    /// Does the next `columns` columns of the present step; the row's table when the last step is done.
    /// The coefficients are overwritten on the way: the row must not be measured before its table is
    /// there. Buffers of the wrong size make a table without texture.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn advance(&mut self, columns: usize, parts: &mut Parts<'_>) -> Option<RowTable> {
        let width = parts.mean.len();
        let fits = parts.mask.len() == width
            && parts.scratch.len() == 2 * width
            && parts.coefficients.len() == width;
        if !fits {
            return Some(RowTable::default());
        }
        let span = self.column..self.column.saturating_add(columns.max(1)).min(width);
        self.column = span.end;
        let ended = span.end == width;
        let (w, h) = parts.scratch.split_at_mut(width);
        let next = match self.step {
            Step::Weigh => {
                self.weigh(span, parts.mean, parts.mask, w);
                Step::Derive
            }
            Step::Derive => {
                self.derive(span, parts.mean, w, h);
                Step::DropNoise
            }
            Step::DropNoise => {
                let half = self.recipe.level.half_filter();
                self.drop_noise(half, span, parts.mean, w, h);
                Step::Balance
            }
            Step::Balance => {
                self.balance(span, parts.mean, w, h);
                if ended {
                    self.alpha_beta = self.sums.solve();
                }
                Step::Orthogonalise
            }
            Step::Orthogonalise => {
                self.orthogonalise(span, parts.mean, w, h);
                Step::Quantise
            }
            Step::Quantise => {
                self.quantise(span, parts.mean, w, h, parts.coefficients);
                Step::Settle
            }
            Step::Settle => {
                if !self.settle(parts.coefficients) {
                    return Some(self.blank());
                }
                self.step = Step::Correlate(0);
                self.column = 0;
                return None;
            }
            Step::Correlate(lag) => {
                let Some(q) = self.q.get_mut(lag) else {
                    return Some(self.expand());
                };
                let lag_steps = lag as isize - LAGS as isize;
                let shared = width.saturating_sub(lag_steps.unsigned_abs() * self.recipe.stride);
                let end = span
                    .start
                    .saturating_add(columns.saturating_mul(CORRELATED));
                let span = span.start..end.min(shared);
                self.column = span.end;
                let recipe = &self.recipe;
                *q += correlation(recipe, parts.mean, parts.coefficients, lag_steps, &span);
                if span.end == shared {
                    self.step = Step::Correlate(lag + 1);
                    self.column = 0;
                }
                return None;
            }
        };
        if ended {
            self.step = next;
            self.column = 0;
        }
        None
    }

    #[inline(always)]
    fn value(&self, count: u16) -> f32 {
        f32::from(count) * self.per_count
    }

    /// Mean of the row so far: r is taken against it, for the sake of single precision.
    fn centre(&self, width: usize) -> f32 {
        self.total as f32 / width.max(1) as f32 / self.recipe.counts_per_value
    }

    /// w: a column's mask times the inverse variance of its pixel; 0 beyond the margin and where the pixel
    /// is saturated.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn weigh(&mut self, span: Range<usize>, mean: &[u16], mask: &[u8], w: &mut [f32]) {
        let r = self.recipe;
        // What came in from beyond the ends was not averaged: there the first frame's noise still stands.
        let reach = (r.level.half_filter().len() + UNKNOWN_STEPS) * r.stride;
        let edge = r.margin_px + MAX_HALF * r.stride;
        let last = mean.len().saturating_sub(1);
        let (Some(w), Some(mean), Some(mask)) = (
            w.get_mut(span.clone()),
            mean.get(span.clone()),
            mask.get(span.clone()),
        ) else {
            return;
        };
        self.total += mean.iter().map(|&count| u64::from(count)).sum::<u64>();
        self.light += u64::from(r.kernel.light(span.start, mean));
        // Nothing but arithmetic, so that a desktop does several columns at once.
        let first = span.start;
        for (((w, &count), &mask), x) in w.iter_mut().zip(mean).zip(mask).zip(span) {
            let value = f32::from(count) * self.per_count;
            let from_edge = x.min(last.saturating_sub(x));
            // A soft edge over four pixels, so that a picture moving past it changes little at a time.
            let ramp = match r.margin_px {
                0 => 1.0,
                _ => (from_edge + 4).saturating_sub(edge).min(4) as u8 as f32 / 4.0,
            };
            let full = ramp * f32::from(mask) / 255.0 / r.noise.variance(value);
            let used = (value < r.saturation) & (from_edge >= reach);
            *w = if used { full } else { 0.0 };
        }
        weigh_nothing(w, first, &self.left_out, &r);
    }

    /// h ← −w · band-passed r'.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn derive(&self, span: Range<usize>, mean: &[u16], w: &[f32], h: &mut [f32]) {
        let r = self.recipe;
        let (Some(h), Some(w)) = (h.get_mut(span.clone()), w.get(span.clone())) else {
            return;
        };
        h.fill(0.0);
        for (k, &f) in (1..).zip(r.level.half_filter()) {
            let f = -f / r.counts_per_value;
            let by = k * r.stride;
            // Where the filter does not fit, w is 0.
            let inner = span.start.max(by)..span.end.min(mean.len().saturating_sub(by));
            let (Some(left), Some(right), Some(h)) = (
                mean.get(inner.start.wrapping_sub(by)..inner.end.wrapping_sub(by)),
                mean.get(inner.start + by..inner.end + by),
                h.get_mut(inner.start - span.start..inner.end.saturating_sub(span.start)),
            ) else {
                continue;
            };
            for ((h, &left), &right) in h.iter_mut().zip(left).zip(right) {
                *h += f * (f32::from(right) - f32::from(left));
            }
        }
        for (h, &w) in h.iter_mut().zip(w) {
            *h *= w;
        }
    }

    /// Where the reference's slope is no larger than its own noise it says nothing and would only let the
    /// line's noise in: a Wiener gain by the energy of nine columns. `half`: the right half of the slope's filter.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn drop_noise(
        &mut self,
        half: &[f32],
        span: Range<usize>,
        mean: &[u16],
        w: &mut [f32],
        h: &mut [f32],
    ) {
        let filter_power = 2.0 * half.iter().map(|f| f * f).sum::<f32>() / self.frames;
        let threshold = filter_power * ENERGY_COLUMNS as f32;
        if span.start == 0 {
            self.energy = h.iter().take(ENERGY_REACH).map(|h| h * h).sum();
        }
        let (noise_of, mut running) = (self.recipe.noise, self.energy);
        for x in span {
            let ahead = h.get(x + ENERGY_REACH).map_or(0.0, |h| h * h);
            let (Some(h), Some(w), Some(&c)) = (h.get_mut(x), w.get_mut(x), mean.get(x)) else {
                return;
            };
            // A running sum over the columns x ± ENERGY_REACH, as they were before this step. What
            // rounding leaves behind is far below the noise.
            running += ahead;
            let energy = running;
            self.before[x % RING] = *h * *h;
            if x >= ENERGY_REACH {
                let behind = self.before[(x + RING - ENERGY_REACH) % RING];
                running = at_least_0(running - behind);
            }
            let noise = *w * *w * noise_of.variance(f32::from(c) * self.per_count) * threshold;
            let gain = if energy > 2.0 * noise {
                1.0 - noise / energy
            } else {
                0.0
            };
            // The weight goes along: it tells how much of the reference's noise is left in h.
            *h *= gain;
            *w *= gain;
        }
        self.energy = running;
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn balance(&mut self, span: Range<usize>, mean: &[u16], w: &[f32], h: &[f32]) {
        let centre = self.centre(mean.len());
        let (Some(mean), Some(w), Some(h)) =
            (mean.get(span.clone()), w.get(span.clone()), h.get(span))
        else {
            return;
        };
        for ((&h, &w), &count) in h.iter().zip(w).zip(mean) {
            if h != 0.0 {
                let r = self.value(count) - centre;
                self.sums.w += w;
                self.sums.wr += w * r;
                self.sums.wrr += w * r * r;
                self.sums.h += h;
                self.sums.hr += h * r;
            }
        }
    }

    /// h ← h − w·(α + β·r), so that Σ h = 0 and Σ h·r = 0.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn orthogonalise(&mut self, span: Range<usize>, mean: &[u16], w: &[f32], h: &mut [f32]) {
        let centre = self.centre(mean.len());
        let (alpha, beta) = self.alpha_beta;
        let per_count = self.per_count;
        let mut largest = self.largest.to_bits();
        let (Some(mean), Some(w), Some(h)) =
            (mean.get(span.clone()), w.get(span.clone()), h.get_mut(span))
        else {
            return;
        };
        for ((h, &w), &count) in h.iter_mut().zip(w).zip(mean) {
            let new = *h - w * (alpha + beta * (f32::from(count) * per_count - centre));
            *h = if *h != 0.0 { new } else { *h };
            // Bits of floats without a sign are in the order of the floats, and vectors compare them at once.
            largest = largest.max(h.abs().to_bits());
        }
        self.largest = f32::from_bits(largest);
    }

    /// What h is multiplied by to fill what a coefficient may be.
    #[inline(always)]
    fn scale(&self) -> f32 {
        let limit = f32::from(self.recipe.kernel.most_kept() - 1);
        if self.largest > 0.0 && self.largest.is_finite() {
            limit / self.largest
        } else {
            0.0
        }
    }

    /// h scaled to whole numbers. Each rounding error is carried on to the next pixel, which keeps the
    /// errors out of the texture's band.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn quantise(
        &mut self,
        span: Range<usize>,
        mean: &[u16],
        w: &[f32],
        h: &[f32],
        coefficients: &mut [i8],
    ) {
        let kernel = self.recipe.kernel;
        let most = kernel.most_kept();
        let scale = self.scale();
        let (Some(mean), Some(w), Some(h), Some(coefficients)) = (
            mean.get(span.clone()),
            w.get(span.clone()),
            h.get(span.clone()),
            coefficients.get_mut(span.clone()),
        ) else {
            return;
        };
        let most = i32::from(most);
        let first = span.start;
        let (mut carry, mut excess) = (self.carry, self.excess);
        for (c, &h) in coefficients.iter_mut().zip(h) {
            *c = 0;
            if h != 0.0 {
                // Beyond the limit by half a step at most: nothing in the way from one column to the next but this.
                let wanted = h * scale + carry;
                let whole = nearest(wanted);
                carry = wanted - whole;
                *c = (whole as i32).clamp(-most, most) as i8;
                excess += i32::from(*c);
            }
        }
        (self.carry, self.excess) = (carry, excess);
        if kernel.keeps_pairs() {
            let odd = coefficients.iter().skip(1 - first % 2).step_by(2);
            self.odd_excess += odd.map(|&c| i32::from(c)).sum::<i32>();
        }
        for ((&c, &w), &count) in coefficients.iter().zip(w).zip(mean) {
            let c = f32::from(c);
            let variance = self.recipe.noise.variance(self.value(count));
            self.noise_power += c * c * variance;
            self.weight_power += w * variance * scale;
        }
    }

    /// A table without texture.
    fn blank(&self) -> RowTable {
        RowTable {
            pixel_sum: at_least_1(self.light as f32 / self.recipe.counts_per_value),
            ..RowTable::default()
        }
    }

    /// Makes Σ h = 0 exact; false when that cannot be, for want of texture.
    fn settle(&mut self, coefficients: &mut [i8]) -> bool {
        let kernel = self.recipe.kernel;
        let excess = match kernel.keeps_pairs() {
            true => [self.excess - self.odd_excess, self.odd_excess],
            false => [self.excess, 0],
        };
        settle(kernel, coefficients, excess) && self.noise_power > 0.0
    }

    /// The table, from the row's phase-correlation function q at whole shifts.
    fn expand(&mut self) -> RowTable {
        let mut table = self.blank();
        // The reference's noise stands in h too, where it looks like texture: E Σ h(x)·n(x − k) is
        // ±f[k] times the noise, known, and taken off.
        for (k, &f) in (1..).zip(self.recipe.level.half_filter()) {
            let noise = f * self.weight_power / self.frames;
            self.q[LAGS + k] -= noise;
            self.q[LAGS - k] += noise;
        }
        let q = &self.q;
        let stride = self.recipe.stride as f32;
        let slope: f32 = (1..)
            .zip(SLOPE)
            .map(|(k, f)| f * (q[LAGS + k] - q[LAGS - k]))
            .sum::<f32>()
            / stride;
        let information = slope * slope / self.noise_power;
        // The reference's own noise makes slopes of about sqrt(Σ h²σ²/frames).
        let chance = crate::math::sqrtf(self.noise_power / self.frames) * 3.0;
        let sure = slope > chance && information * WORST_SD_PX * WORST_SD_PX >= 1.0;
        if !sure || !information.is_finite() {
            return table;
        }
        // Half-way between whole shifts; the inverse goes through both.
        let half = |left: usize| -> f32 {
            let pairs = (0..).zip(HALFWAY);
            let value: f32 = pairs
                .map(|(k, f)| f * (q[left - k] + q[left + 1 + k]))
                .sum();
            (value - q[LAGS]) / slope
        };
        let (right, left) = (half(LAGS), half(LAGS - 1));
        let (a, b) = inverse(right, left, stride);
        table.px_per_product = 1.0 / slope;
        table.information_and_offset = Two::new(information, q[LAGS] / slope);
        table.quadratic_and_cubic = Two::new(a, b);
        table
    }
}

/// A and B of ±stride/2 = u + A·u² + B·u³ at both, from u at half a step either way.
fn inverse(right: f32, left: f32, stride: f32) -> (f32, f32) {
    if right > 0.0 && left < 0.0 {
        let right_error = (0.5 * stride - right) / (right * right);
        let left_error = (-0.5 * stride - left) / (left * left);
        let b = (right_error - left_error) / (right - left);
        // A texture of single pixels has no more.
        let a = right_error - b * right;
        (a.clamp(-2.0, 2.0), b.clamp(-4.0, 4.0))
    } else {
        (0.0, 0.0)
    }
}

/// Takes the excess of a row off, one from each of its first columns; where a kernel keeps coefficients two by two, off the even
/// ones and off the odd ones. False where there are too few.
pub(crate) fn settle(kernel: Kernel, coefficients: &mut [i8], mut excess: [i32; 2]) -> bool {
    let odd = usize::from(kernel.keeps_pairs());
    for (x, c) in coefficients.iter_mut().enumerate() {
        if excess == [0, 0] {
            break;
        }
        let left = &mut excess[x & odd];
        if *left != 0 && *c != 0 && c.abs() < kernel.most_kept() {
            let step = left.signum();
            *c -= step as i8;
            *left -= step;
        }
    }
    excess == [0, 0]
}

/// [`Build::all`], where vectors are wide.
struct All<'s, 'a>(Build, &'s mut Parts<'a>);

impl Wide for All<'_, '_> {
    type Out = RowTable;
    #[inline(always)]
    fn run(self) -> RowTable {
        self.0.in_one_go(self.1)
    }
}

/// 0 for NaN.
#[inline(always)]
fn at_least_0(v: f32) -> f32 {
    if v > 0.0 { v } else { 0.0 }
}

/// The nearest whole number, of two as near the even one, for |v| < 2²²: no bits are left behind the point.
/// Each column waits for the one before it, and this is the shortest way.
#[inline(always)]
fn nearest(v: f32) -> f32 {
    const POINT_AT_THE_END: f32 = 12_582_912.0; // 1.5 · 2²³
    (v + POINT_AT_THE_END) - POINT_AT_THE_END
}

/// Σ h(x)·r(x − lag·stride) over these of the columns that both have, in pixel values.
fn correlation(
    recipe: &Recipe,
    mean: &[u16],
    coefficients: &[i8],
    lag: isize,
    span: &Range<usize>,
) -> f32 {
    let by = lag.unsigned_abs() * recipe.stride;
    let (mean, coefficients) = if lag >= 0 {
        (Some(mean), coefficients.get(by..))
    } else {
        (mean.get(by..), Some(coefficients))
    };
    let cut = (
        mean.and_then(|m| m.get(span.clone())),
        coefficients.and_then(|c| c.get(span.clone())),
    );
    let (Some(mean), Some(coefficients)) = cut else {
        return 0.0;
    };
    recipe.kernel.product_u16(mean, coefficients) as f32 / recipe.counts_per_value
}
