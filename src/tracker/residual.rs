//! What a line leaves over when its shifted reference is taken off.

use super::overlap::{Overlap, nearest_step};
use crate::{
    camera::pixel::Pixel,
    reference::{Store, noise::LEAST_VARIANCE},
};

/// Parts of a line, each of which may have a brightness of its own under a shadow, and between what shares of the line's.
const PARTS: usize = 4;
const DARKEST: f32 = 0.6;
const BRIGHTEST: f32 = 1.6;

/// The residual of a line, per pixel and in units of the pixels' variance.
pub(super) struct Residual {
    /// Mean square.
    pub(super) power: f32,
    /// Mean square that an error of the shift of 1 px would leave.
    pub(super) slope_power: f32,
    /// Number of columns that were read.
    columns: f32,
}

/// A line is taken for one that has jumped where that lowers the residual by so many of its own variances, squared:
/// three standard deviations.
const BETTER: f32 = 9.0;

impl Residual {
    /// What noise does not explain, as the square of an error of the shift, px².
    pub(super) fn excess_px2(&self) -> f32 {
        (self.power - 2.0).max(0.0) / self.slope_power.max(1e-9)
    }

    /// The line lies here much rather than where it leaves `other`.
    pub(super) fn is_better_than(&self, other: &Self) -> bool {
        self.columns * (other.power - self.power) > BETTER * self.power.max(1.0)
    }

    /// What is left of a line of `row` that is shifted to the right and downwards when its shifted reference is taken
    /// off. `to_reference`: the factor that brings it to its reference's brightness; about so many `columns` are read.
    /// `SHADED`: a soft shadow may lie on it, so that each quarter has a brightness of its own.
    pub(super) fn of<const SHADED: bool, P: Pixel>(
        store: &Store<'_>,
        row: usize,
        pixels: &[P],
        [shift_px, down_px]: [f32; 2],
        to_reference: f32,
        columns: usize,
    ) -> Option<Self> {
        let width = pixels.len();
        let r = store.recipe();
        let mean = store.mean(row)?;
        let stride = r.stride as i32;
        let whole = nearest_step(shift_px, stride);
        let near = shift_px - whole as f32;
        let overlap = Overlap::new(width, whole)?;
        let (first, beside) = (overlap.reference.start, store.beside(row, down_px));
        let (mean, mask) = (
            mean.get(overlap.reference.clone())?,
            store.mask().get(overlap.reference)?,
        );
        let line = pixels.get(overlap.line)?;
        // What the motion carries in and out at the ends is little known.
        let from = r.margin_px + r.stride;
        let to = mean.len().checked_sub(from)?;
        let n = to.checked_sub(from)?;
        let step = (width / columns).max(1);
        let (left, here, right) = (
            mean.get(from - r.stride..)?.get(..n)?,
            mean.get(from..)?.get(..n)?,
            mean.get(from + r.stride..)?.get(..n)?,
        );
        let (line, mask) = (line.get(from..)?.get(..n)?, mask.get(from..)?.get(..n)?);
        // All in counts of the reference.
        let value = 1.0 / r.counts_per_value;
        let gain = value / to_reference;
        let near = near / r.stride as f32;
        let saturation = r.saturation * r.counts_per_value;
        let per_count = r.noise.per_value * value;
        let (mut power, mut slopes, mut read) = (0.0f32, 0.0f32, 0u16);
        let (mut part, mut fitted) = (Part::default(), 0u16);
        let part_columns = n.div_ceil(PARTS);
        let mut part_end = part_columns;
        // Not at the very edge, which a reference that was moved does not know.
        let mut next = step / 2;
        while next < n {
            let x = next;
            next += step;
            let (Some(&left), Some(&here), Some(&right), Some(&p), Some(&mask)) = (
                left.get(x),
                here.get(x),
                right.get(x),
                line.get(x),
                mask.get(x),
            ) else {
                break;
            };
            let (left, here, right) = (f32::from(left), f32::from(here), f32::from(right));
            // No branch: what is not used has no weight. (With one, compilers write the search for the next used column out.)
            let used = mask != 0 && here < saturation;
            let slope = right - left;
            let bend = right + left - 2.0 * here;
            let mut model = here - 0.5 * near * (slope - near * bend);
            if let Some(beside) = &beside {
                model -= beside.less(first + from + x, here);
            }
            let value = f32::from(p.value());
            let variance = r.noise.dark + per_count * here;
            let variance = if variance > LEAST_VARIANCE {
                variance
            } else {
                LEAST_VARIANCE
            };
            let weight = if used { 1.0 / variance } else { 0.0 };
            if SHADED {
                if x >= part_end {
                    power += core::mem::take(&mut part).residual(gain);
                    part_end += part_columns;
                    fitted += 1;
                }
                part.add(value, model, weight);
            } else {
                let residual = value - gain * model;
                power += residual * residual * weight;
            }
            slopes += slope * slope * weight;
            read += u16::from(used);
        }
        if SHADED {
            power += part.residual(gain);
            fitted += 1;
        }
        let read = read.checked_sub(fitted)?;
        let frames = f32::from(store.learning(row)?.frames());
        let own = 1.0 / (f32::from(read) * (1.0 + 1.0 / frames));
        let slope_px = 0.5 * value / r.stride as f32;
        (read >= 4).then_some(Self {
            power: power * own,
            slope_power: slopes * own * slope_px * slope_px,
            columns: f32::from(read),
        })
    }
}

/// Weighted moments of a part of a line and its model.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    pp: f32,
    pm: f32,
    mm: f32,
}

impl Part {
    fn add(&mut self, pixel: f32, model: f32, weight: f32) {
        self.pp += weight * pixel * pixel;
        self.pm += weight * pixel * model;
        self.mm += weight * model * model;
    }

    /// What is left at the brightness that suits the part, near that of the whole line, `gain`.
    fn residual(self, gain: f32) -> f32 {
        let own = self.pm / self.mm;
        // Not `clamp`, which panics where the limits are no numbers.
        let own = own.max(DARKEST * gain).min(BRIGHTEST * gain);
        (self.pp - own * (2.0 * self.pm - own * self.mm)).max(0.0)
    }
}

/// How a line of `row` at `shift_px` correlates with its reference, −1 to 1; `None` where one of them is even.
pub(super) fn likeness<P: Pixel>(
    store: &Store<'_>,
    row: usize,
    pixels: &[P],
    shift_px: f32,
) -> Option<f32> {
    let mean = store.mean(row)?;
    let overlap = Overlap::new(
        mean.len(),
        nearest_step(shift_px, store.recipe().stride as i32),
    )?;
    let (mean, line) = (mean.get(overlap.reference)?, pixels.get(overlap.line)?);
    let value = 1.0 / store.recipe().counts_per_value;
    let both = || {
        let pairs = mean.iter().zip(line);
        pairs.map(|(&m, p)| (f32::from(m) * value, f32::from(p.value())))
    };
    let (sum_m, sum_p) = both().fold((0.0, 0.0), |(a, b), (m, p)| (a + m, b + p));
    let per_pixel = 1.0 / mean.len() as f32;
    let (mean_m, mean_p) = (sum_m * per_pixel, sum_p * per_pixel);
    let (mut mm, mut pp, mut mp) = (0.0f32, 0.0f32, 0.0f32);
    for (m, p) in both() {
        let (m, p) = (m - mean_m, p - mean_p);
        mm += m * m;
        pp += p * p;
        mp += m * p;
    }
    let likeness = mp / crate::kernel::sqrtf(mm * pp);
    likeness.is_finite().then_some(likeness)
}
