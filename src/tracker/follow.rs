//! The reference follows the picture, slowly: light and focus change, and things creep.

use super::{RowLearning, Stage, Tracker};
use crate::reference::{Build, Parts};

/// What following remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Follow {
    /// A row whose coefficients are being built anew.
    work: Option<(usize, Build)>,
    /// Where the picture is on average, px: a mean over some seconds.
    drift_px: f32,
    /// By how much the reference was moved after a creeping picture, px.
    anchor_px: i32,
}

/// One row in so many frames takes a little of the picture: building its coefficients anew is what costs.
const FRAMES_A_ROW: u32 = 4;

impl Follow {
    #[inline]
    pub(super) fn anchor_px(&self) -> f32 {
        self.anchor_px as f32
    }
}

/// Frames over which the drift is averaged.
const DRIFT_FRAMES: f32 = 128.0;

/// The reference is moved when the picture has crept so far. Coefficients near the edge are 0, so a move
/// by so few pixels loses none of them.
const CREEP_PX: f32 = 1.5;

impl Tracker<'_> {
    /// The row whose turn it is in this frame; rows far apart follow each other.
    pub(super) fn turn_of(&self, frame: u32) -> usize {
        let free = self.stage == Stage::Tracking && self.follow.work.is_none();
        if !free || !frame.is_multiple_of(FRAMES_A_ROW) {
            return usize::MAX;
        }
        // 619 is prime: every row has its turn.
        (frame / FRAMES_A_ROW).wrapping_mul(619) as usize % usize::from(self.config.rows)
    }

    /// Goes on with the row whose coefficients are being built anew, some columns a line; a row that is
    /// about to be measured is finished first.
    #[inline]
    pub(super) fn follow_one_step(&mut self, row: usize) {
        if let Some((at, build)) = self.follow.work {
            self.step(at, build, at == row);
        }
    }

    #[cold]
    fn step(&mut self, row: usize, mut build: Build, to_the_end: bool) {
        let width = usize::from(self.config.width);
        let span = row * width..(row + 1) * width;
        let columns = usize::from(self.config.columns_per_line);
        let s = &mut self.storage;
        let (Some(mean), Some(coefficients), Some(slot)) = (
            s.mean.get(span.clone()),
            s.coefficients.get_mut(span),
            s.tables.get_mut(row),
        ) else {
            self.follow.work = None;
            return;
        };
        let mut parts = Parts {
            mean,
            mask: s.mask,
            scratch: s.scratch,
            coefficients,
        };
        let table = if to_the_end {
            Some(build.all(&mut parts))
        } else {
            build.advance(columns, &mut parts)
        };
        match table {
            Some(table) => {
                *slot = table;
                self.follow.work = None;
            }
            None => self.follow.work = Some((row, build)),
        }
    }

    /// Builds a row's coefficients from its mean, in one go.
    pub(super) fn build(&mut self, row: usize) {
        let frames = self
            .storage
            .learning
            .get(row)
            .map_or(1, RowLearning::frames);
        let build = Build::new(&self.recipe, f32::from(frames));
        self.step(row, build, true);
    }

    /// Begins to build a row anew, unless another one is under way.
    pub(super) fn begin_build(&mut self, row: usize) {
        if self.follow.work.is_none() {
            let frames = self
                .storage
                .learning
                .get(row)
                .map_or(1, RowLearning::frames);
            self.follow.work = Some((row, Build::new(&self.recipe, f32::from(frames))));
        }
    }

    /// Once a frame: moves the whole reference by whole pixels after a picture that creeps.
    pub(super) fn follow_drift(&mut self) {
        if !self.prediction.is_sure() || self.stage != Stage::Tracking {
            return;
        }
        let here = self.prediction.at(0);
        self.follow.drift_px += (here - self.follow.drift_px) / DRIFT_FRAMES;
        if self.follow.drift_px.abs() < CREEP_PX {
            return;
        }
        let stride = i32::from(self.config.stride);
        let by = stride * if self.follow.drift_px > 0.0 { 1 } else { -1 };
        if let Some((row, build)) = self.follow.work {
            self.step(row, build, true);
        }
        let width = usize::from(self.config.width);
        for row in self.storage.coefficients.chunks_exact_mut(width) {
            move_row(row, by);
        }
        for row in self.storage.mean.chunks_exact_mut(width) {
            move_row(row, by);
        }
        self.follow.anchor_px = self.follow.anchor_px.saturating_add(by);
        self.follow.drift_px -= by as f32;
        self.prediction.move_by(-by as f32);
    }
}

/// Moves a row to the right by `by` (to the left where negative); what comes in repeats the edge.
pub(super) fn move_row<T: Copy>(row: &mut [T], by: i32) {
    let n = (by.unsigned_abs() as usize).min(row.len());
    let edge = if by > 0 { row.first() } else { row.last() };
    let Some(&edge) = edge else { return };
    if by > 0 {
        row.copy_within(..row.len() - n, n);
        row.iter_mut().take(n).for_each(|v| *v = edge);
    } else {
        row.copy_within(n.., 0);
        row.iter_mut().rev().take(n).for_each(|v| *v = edge);
    }
}

#[cfg(test)]
mod tests {
    use super::move_row;

    #[test]
    fn rows_move_either_way_and_never_beyond() {
        let mut row = [1, 2, 3, 4];
        move_row(&mut row, 1);
        assert_eq!(row, [1, 1, 2, 3]);
        move_row(&mut row, -2);
        assert_eq!(row, [2, 3, 3, 3]);
        move_row(&mut row, 99);
        assert_eq!(row, [2; 4]);
        move_row::<u8>(&mut [], 3);
    }
}
