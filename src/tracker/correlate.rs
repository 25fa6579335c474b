//! Where a line lies against its reference: inner products at whole shifts, and the row's polynomial between.

use super::{
    Tracker,
    overlap::{Overlap, nearest_step},
    row::Row,
};
use crate::{
    camera::pixel::Pixel,
    reference::{RowTable, at_least_1},
};

/// Why a line has no shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unfound {
    /// The result is no finite number.
    NoNumber,
    /// It would take more inner products than there is time for; where it seemed to be so far, px.
    Unfinished(f32),
}

/// Inner products that a line may take: as it likes, and where a line time is short.
const TURNS: u8 = 6;
const TURNS_IN_A_HURRY: u8 = 2;

/// Beyond this the row's polynomial is left for the next whole shift, px. While learning, a row of little but noise that is
/// moved on too readily aligns its noise and takes it for texture.
pub(super) const NEAR_PX: f32 = 0.55;
pub(super) const NEAR_WHILE_LEARNING_PX: f32 = 0.7;

impl Tracker<'_> {
    /// Σ h·p and Σ p of a whole line against its whole row: all that it takes where the picture has moved by
    /// less than half a step.
    #[inline(always)]
    pub(super) fn sums<R: Row>(&self, row: usize, pixels: &R) -> Option<(f32, f32)> {
        let coefficients = self.store.coefficients(row)?;
        Some(pixels.sums(self.config.kernel, coefficients))
    }

    /// The phase-correlation peak of a line near `expected_px`: one inner product where the motion is
    /// small. `sums`: those of the whole line, where they were taken before.
    #[inline(never)]
    pub(super) fn correlate<R: Row>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &mut R,
        expected_px: f32,
        sums: Option<(f32, f32)>,
    ) -> Result<f32, Unfound> {
        if expected_px.abs() < self.here_px {
            let Some((product, sum)) = sums.or_else(|| self.sums(row, pixels)) else {
                return Err(Unfound::NoNumber);
            };
            self.to_reference = table.factor_to_reference(sum);
            let near = table.shift_px(product * self.to_reference);
            if near.abs() <= self.near_px {
                return Ok(near);
            }
            let near = near.clamp(-4.0, 4.0);
            self.effort = self.effort.saturating_add(1);
            return self.correlate_far(row, table, pixels.pixels(), near, 1);
        }
        self.correlate_far(row, table, pixels.pixels(), expected_px, 0)
    }

    /// [`Tracker::correlate`] where the picture has moved by whole pixels: one inner product where that was
    /// foreseen, a few where not. `done`: how many were taken before.
    fn correlate_far<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
        done: u8,
    ) -> Result<f32, Unfound> {
        let hurried = self.is_hurried();
        let turns = if hurried { TURNS_IN_A_HURRY } else { TURNS };
        let far = self.converge(row, table, pixels, expected_px, turns - done);
        match far {
            Some((shift_px, true)) => Ok(shift_px),
            Some((shift_px, false)) if hurried => Err(Unfound::Unfinished(shift_px)),
            Some((shift_px, false)) => Ok(shift_px),
            None => Err(Unfound::NoNumber),
        }
    }

    /// The shift after so many inner products, and whether one more would not change it.
    #[inline(always)]
    fn converge<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
        turns: u8,
    ) -> Option<(f32, bool)> {
        let width = pixels.len();
        let coefficients = self.store.coefficients(row)?;
        let mean = self.store.mean(row)?;
        let stride = i32::from(self.config.stride);
        let limit = width as i32 / 2;
        let steps = |px: f32| nearest_step(px, stride);
        let mut whole = steps(expected_px).clamp(-limit, limit);
        let mut shift_px = f32::NAN;
        let mut converged = false;
        for _ in 0..turns {
            let overlap = Overlap::new(width, whole)?;
            self.effort = self.effort.saturating_add(1);
            let (product, sum) = P::part_sums(
                self.config.kernel,
                pixels.get(overlap.line)?,
                coefficients,
                overlap.reference.start,
            );
            let from = overlap.unseen.start;
            let unseen = self.config.kernel.light(from, mean.get(overlap.unseen)?);
            let seen = table.pixel_sum() - unseen as f32 / self.store.recipe().counts_per_value;
            self.to_reference = at_least_1(seen) / at_least_1(sum);
            let near = table.shift_px(product * self.to_reference);
            shift_px = whole as f32 + near;
            let next = (whole + steps(near.clamp(-4.0, 4.0))).clamp(-limit, limit);
            converged = near.abs() <= self.near_px || next == whole;
            if converged {
                break;
            }
            whole = next;
        }
        shift_px.is_finite().then_some((shift_px, converged))
    }

    /// The whole shift nearest to this one, and the inner product there, brought to the reference's brightness.
    #[inline(always)]
    pub(super) fn nearest_product<P: Pixel>(
        &self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<(i32, f32)> {
        let width = pixels.len();
        let whole = nearest_step(shift_px, i32::from(self.config.stride));
        let overlap = Overlap::new(width, whole)?;
        let (product, _) = P::part_sums(
            self.config.kernel,
            pixels.get(overlap.line)?,
            self.store.coefficients(row)?,
            overlap.reference.start,
        );
        Some((whole, product * self.to_reference))
    }
}
