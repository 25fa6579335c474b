//! Where a line lies against its reference: inner products at whole shifts, and the row's polynomial between.

use super::{
    light::Light,
    overlap::{Overlap, nearest_step},
    row::Row,
};
use crate::{
    camera::pixel::Pixel,
    reference::{RowTable, Store, at_least_1},
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

/// How far the row's polynomial is believed and what a line has taken so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correlator {
    /// A line that is expected nearer than this is read where its reference lies: half the pixels from one to the next of
    /// the same colour, or `near_px` where a line time is short, as reading it elsewhere takes longer.
    pub(super) here_px: f32,
    /// [`NEAR_PX`] of those pixels.
    pub(super) near_px: f32,
    /// Inner products that this line has taken beyond the first where it had moved by whole pixels; a check counts as two.
    pub(super) products: u8,
    /// How much this line's displacement along the columns adds to what its first product reads, px; 0 where the rows alone
    /// are measured.
    pub(super) lean_px: f32,
}

/// Σ h·p and Σ p of a line, where they were taken.
pub(super) type Sums = Option<(f32, f32)>;

/// Beyond this the row's polynomial is left for the next whole shift, px. While learning, a row of little but noise that is
/// moved on too readily aligns its noise and takes it for texture.
pub(super) const NEAR_PX: f32 = 0.55;
pub(super) const NEAR_WHILE_LEARNING_PX: f32 = 0.7;

impl Correlator {
    /// One that learns, of pixels that are `stride` from one to the next of the same colour.
    pub(super) fn learning(stride: u8) -> Self {
        Self {
            here_px: 0.5 * f32::from(stride),
            near_px: NEAR_WHILE_LEARNING_PX * f32::from(stride),
            products: 0,
            lean_px: 0.0,
        }
    }

    /// Learning has ended.
    pub(super) fn end_learning(&mut self, stride: u8, hurried: bool) {
        self.near_px = NEAR_PX * f32::from(stride);
        if hurried {
            self.here_px = self.near_px;
        }
    }

    /// The phase-correlation peak of a line near `expected_px`: one inner product where the motion is
    /// small. `sums`: those of the whole line, where they were taken before; `hurried`: a line time is short.
    #[inline(never)]
    #[expect(clippy::too_many_arguments)]
    pub(super) fn find<R: Row>(
        &mut self,
        store: &Store<'_>,
        light: &mut Light,
        row: usize,
        pixels: &mut R,
        expected_px: f32,
        sums: Sums,
        hurried: bool,
    ) -> Result<f32, Unfound> {
        let Some(table) = store.table(row) else {
            return Err(Unfound::NoNumber);
        };
        let mut done = 0;
        let mut expected_px = expected_px;
        if expected_px.abs() < self.here_px {
            let Some((product, sum)) = sums.or_else(|| whole_sums(store, row, pixels)) else {
                return Err(Unfound::NoNumber);
            };
            light.to_reference = table.factor_to_reference(sum);
            let near = table.shift_of_leaning_px(product * light.to_reference, self.lean_px);
            if near.abs() <= self.near_px {
                return Ok(near);
            }
            expected_px = near.clamp(-4.0, 4.0);
            self.products = self.products.saturating_add(1);
            done = 1;
        }
        // The picture has moved by whole pixels: one inner product where that was foreseen, a few where not.
        let turns = if hurried { TURNS_IN_A_HURRY } else { TURNS };
        let turns = turns - done;
        match self.converge(
            store,
            light,
            row,
            table,
            pixels.pixels(),
            expected_px,
            turns,
        ) {
            Some((shift_px, true)) => Ok(shift_px),
            Some((shift_px, false)) if hurried => Err(Unfound::Unfinished(shift_px)),
            Some((shift_px, false)) => Ok(shift_px),
            None => Err(Unfound::NoNumber),
        }
    }

    /// The shift after so many inner products, and whether one more would not change it.
    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    fn converge<P: Pixel>(
        &mut self,
        store: &Store<'_>,
        light: &mut Light,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
        turns: u8,
    ) -> Option<(f32, bool)> {
        let width = pixels.len();
        let coefficients = store.coefficients(row)?;
        let mean = store.mean(row)?;
        let stride = store.recipe().stride as i32;
        let limit = width as i32 / 2;
        let steps = |px: f32| nearest_step(px, stride);
        let mut whole = steps(expected_px).clamp(-limit, limit);
        let mut shift_px = f32::NAN;
        let mut converged = false;
        for _ in 0..turns {
            let overlap = Overlap::new(width, whole)?;
            self.products = self.products.saturating_add(1);
            let (product, sum) = P::part_sums(
                store.recipe().kernel,
                pixels.get(overlap.line)?,
                coefficients,
                overlap.reference.start,
            );
            let from = overlap.unseen.start;
            let unseen = store.recipe().kernel.light(from, mean.get(overlap.unseen)?);
            let seen = table.pixel_sum() - unseen as f32 / store.recipe().counts_per_value;
            light.to_reference = at_least_1(seen) / at_least_1(sum);
            let near = table.shift_of_leaning_px(product * light.to_reference, self.lean_px);
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
}

/// Σ h·p and Σ p of a whole line against its whole row: all that it takes where the picture has moved by
/// less than half a step.
#[inline(always)]
pub(super) fn whole_sums<R: Row>(store: &Store<'_>, row: usize, pixels: &R) -> Sums {
    Some(pixels.sums(store.recipe().kernel, store.coefficients(row)?))
}

/// The whole shift nearest to this one, and the inner product there, not yet brought to the reference's
/// brightness.
#[inline(always)]
pub(super) fn nearest_product<P: Pixel>(
    store: &Store<'_>,
    row: usize,
    pixels: &[P],
    shift_px: f32,
) -> Option<(i32, f32)> {
    let whole = nearest_step(shift_px, store.recipe().stride as i32);
    let overlap = Overlap::new(pixels.len(), whole)?;
    let (product, _) = P::part_sums(
        store.recipe().kernel,
        pixels.get(overlap.line)?,
        store.coefficients(row)?,
        overlap.reference.start,
    );
    Some((whole, product))
}
