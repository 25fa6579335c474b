//! What the store keeps of the motion along the columns, and what that motion does to the reference.

use super::{
    RowLearning, RowTable, Store, VerticalBuild, VerticalParts, VerticalTable, store::part,
};
use core::ops::Range;

/// Smaller shifts downwards blur nothing, px.
const STILL_PX: f32 = 0.02;

/// Beyond this a row is no longer made of those next to it, px.
const MOST_PX: f32 = 1.0;

/// The rows next to one, for a line that is displaced along the columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside<'a> {
    above: &'a [u16],
    below: &'a [u16],
    /// Displacement downwards, in rows of one colour.
    down: f32,
}

impl Beside<'_> {
    /// By how much less than its reference, `here`, such a line shows at column `x`, counts.
    #[inline(always)]
    pub(crate) fn less(&self, x: usize, here: f32) -> f32 {
        let at = |row: &[u16]| row.get(x).map_or(here, |&v| f32::from(v));
        less(self.down, at(self.above), here, at(self.below))
    }
}

/// Lagrange's weights of five rows for what lies so many rows below the third.
fn five(down: f32) -> [f32; 5] {
    let d2 = down * down;
    let (inner, outer) = (down * (4.0 - d2) / 6.0, down * (d2 - 1.0) / 24.0);
    [
        outer * (down - 2.0),
        inner * (down - 1.0),
        (d2 - 1.0) * (d2 - 4.0) / 4.0,
        inner * (down + 1.0),
        outer * (down + 2.0),
    ]
}

/// r(y) − r(y − down) by the parabola through three rows.
#[inline(always)]
fn less(down: f32, above: f32, here: f32, below: f32) -> f32 {
    0.5 * down * ((below - above) - down * (below + above - 2.0 * here))
}

impl Store<'_> {
    /// The rows next to this one; none where the displacement is too small to matter, or where there are none.
    pub(crate) fn beside(&self, row: usize, down_px: f32) -> Option<Beside<'_>> {
        let matters = down_px.abs() >= STILL_PX;
        if !matters || !self.is_planar() {
            return None;
        }
        let stride = self.recipe.stride;
        if self.reach(row) == 0 {
            return None;
        }
        Some(Beside {
            above: self.mean(row.checked_sub(stride)?)?,
            below: self.mean(row + stride)?,
            down: down_px.clamp(-MOST_PX, MOST_PX) / stride as f32,
        })
    }

    /// Both axes are measured.
    #[inline]
    pub(crate) fn is_planar(&self) -> bool {
        self.buffers.vertical.is_some()
    }

    /// Rows of this one's colour on either side that were seen, as far as they are used.
    pub(super) fn reach(&self, row: usize) -> usize {
        let stride = self.recipe.stride;
        let seen = |row: usize| {
            let learning = self.buffers.learning.get(row);
            learning.is_some_and(RowLearning::was_seen)
        };
        let steps = 1..=VerticalBuild::MOST_REACH;
        let both =
            |&k: &usize| row >= k * stride && seen(row - k * stride) && seen(row + k * stride);
        steps.take_while(both).count()
    }

    /// What the line path needs of a row's second product.
    #[inline(always)]
    pub(crate) fn vertical_table(&self, row: usize) -> Option<&VerticalTable> {
        self.buffers.vertical.as_ref()?.tables.get(row)
    }

    /// The tables of all rows' second products.
    pub(crate) fn vertical_tables(&self) -> &[VerticalTable] {
        self.buffers.vertical.as_ref().map_or(&[], |v| v.tables)
    }

    /// The coefficients of a row's second product, as the kernel keeps them.
    #[inline(always)]
    pub(crate) fn vertical_coefficients(&self, row: usize) -> Option<&[i8]> {
        let vertical = self.buffers.vertical.as_ref()?;
        part(vertical.coefficients, row, self.width)
    }

    /// Builds a row's second product, after its first one, whose coefficients are still as they are: these are made what the
    /// kernel keeps.
    pub(super) fn build_vertical(&mut self, row: usize) {
        let (width, reach) = (self.width, self.reach(row));
        let span = row * width..(row + 1) * width;
        let frames = f32::from(
            self.buffers
                .learning
                .get(row)
                .map_or(1, RowLearning::frames),
        );
        let frames = self.recipe.noise_frames(frames);
        let left_out = self.left_out(row);
        let b = &mut self.buffers;
        let Some(v) = &mut b.vertical else { return };
        let (Some(first), Some(coefficients), Some(slot), Some(table)) = (
            b.coefficients.get(span.clone()),
            v.coefficients.get_mut(span),
            v.tables.get_mut(row),
            b.tables.get_mut(row),
        ) else {
            return;
        };
        let build = VerticalBuild::new(&self.recipe, frames, *table, reach).without(left_out);
        let built = build.all(&mut VerticalParts {
            picture: b.mean,
            row,
            mask: b.mask,
            first,
            scratch: b.scratch,
            coefficients,
        });
        self.recipe.kernel.keep_some(coefficients, 0..width);
        place(reach, built, slot, table);
    }

    /// The picture was `down_px` below its row of the reference when a line was averaged into it, with a weight of `keep`:
    /// makes up for that in these columns.
    pub(crate) fn settle_down(&mut self, row: usize, span: Range<usize>, down_px: f32, keep: f32) {
        let small = down_px.abs() < STILL_PX || down_px.is_nan();
        let (width, stride) = (self.width, self.recipe.stride);
        if small || !VerticalBuild::is_enough(self.reach(row)) {
            return;
        }
        let weights = five(-down_px.clamp(-MOST_PX, MOST_PX) / stride as f32);
        let first = row * width;
        let (before, from) = self.buffers.mean.split_at_mut(first);
        let Some((here, after)) = from.split_at_mut_checked(width) else {
            return;
        };
        let above = |steps: usize| -> Option<&[u16]> {
            let at = before.len().checked_sub(steps * stride * width)?;
            before.get(at..)?.get(span.clone())
        };
        let below = |steps: usize| -> Option<&[u16]> {
            after.get((steps * stride - 1) * width..)?.get(span.clone())
        };
        let (Some(here), Some(a), Some(b), Some(d), Some(e)) = (
            here.get_mut(span.clone()),
            above(2),
            above(1),
            below(1),
            below(2),
        ) else {
            return;
        };
        for (m, ((&a, &b), (&d, &e))) in here.iter_mut().zip(a.iter().zip(b).zip(d.iter().zip(e))) {
            let seen = [a, b, *m, d, e].map(f32::from);
            let there: f32 = seen.iter().zip(weights).map(|(v, w)| v * w).sum();
            *m = (seen[2] + keep * (seen[2] - there) + 0.5) as u16;
        }
    }

    /// While learning: a row of the first round was so far below its reference, in the frame that it has just taken.
    pub(crate) fn note_down(&mut self, row: usize, down_px: f32, frames: f32) {
        if let Some(v) = &mut self.buffers.vertical
            && let Some(table) = v.tables.get_mut(row)
        {
            table.learned_px += (down_px - table.learned_px) / frames;
        }
    }

    /// Moves each row's reference to the middle of its motion along the columns, as [`Store::centre_rows`] along the rows.
    pub(crate) fn centre_rows_down(&mut self) {
        let (width, stride) = (self.width, self.recipe.stride);
        let rows = self.rows();
        for row in 0..rows {
            let Some(v) = &mut self.buffers.vertical else {
                return;
            };
            let Some(table) = v.tables.get_mut(row) else {
                return;
            };
            let down = core::mem::take(&mut table.learned_px);
            // The row above as it was: kept from the step before, `stride` rows of them in turn.
            let down = down.clamp(-MOST_PX, MOST_PX) / stride as f32;
            let b = &mut self.buffers;
            let (old, _) = b.scratch.split_at_mut((2 * width).min(b.scratch.len()));
            let Some(old) = old.get_mut(row % stride * width..(row % stride + 1) * width) else {
                return;
            };
            let (here, after) = b.mean.split_at_mut((row + 1) * width);
            let Some(here) = here.get_mut(row * width..) else {
                return;
            };
            let below = after.get((stride - 1) * width..stride * width);
            for (x, (m, old)) in here.iter_mut().zip(old).enumerate() {
                let h = f32::from(*m);
                let a = core::mem::replace(old, h);
                let b = below.and_then(|row| row.get(x)).map(|&b| f32::from(b));
                if let (Some(b), true) = (b, row >= stride && !down.is_nan()) {
                    *m = (h - less(down, a, h, b) + 0.5).clamp(0.0, 65535.0) as u16;
                }
            }
        }
    }

    /// Mean curvatures of the rows' responses along x and y, weighted like their shifts, 1/px²; 0 where nothing is known.
    pub(crate) fn usual_curvatures_per_px2(&self) -> [f32; 2] {
        let mean = |sum: f32, all: f32| if all > 0.0 { sum / all } else { 0.0 };
        let across = self.usual_curvature_per_px2();
        let (mut sum, mut all) = (0.0, 0.0);
        let tables = self.buffers.vertical.iter().flat_map(|v| v.tables.iter());
        for table in tables {
            let information = table.information_per_px2();
            sum += information * table.curvature_per_px2();
            all += information;
        }
        [
            if across.is_finite() { across } else { 0.0 },
            mean(sum, all),
        ]
    }
}

/// Puts what was built of a row's second product in its place; where there are no rows beside it, what y does to the first
/// product is not known either.
pub(super) fn place(
    reach: usize,
    built: VerticalTable,
    slot: &mut VerticalTable,
    table: &mut RowTable,
) {
    *slot = VerticalTable {
        learned_px: slot.learned_px,
        ..built
    };
    if !VerticalBuild::is_enough(reach) {
        *table = table.without_texture();
    }
}

#[cfg(test)]
mod tests {
    use super::five;

    #[test]
    fn five_rows_are_exact_for_a_polynomial() {
        for down in [-1.0f32, -0.4, 0.0, 0.3, 0.5, 1.0] {
            let of = |y: f32| 3.0 - y + 0.5 * y * y - 0.2 * y * y * y + 0.1 * y * y * y * y;
            let rows = [-2.0, -1.0, 0.0, 1.0, 2.0].map(of);
            let sum: f32 = rows.iter().zip(five(down)).map(|(v, w)| v * w).sum();
            assert!((sum - of(down)).abs() < 1e-5, "{down}: {sum}");
        }
    }
}
