//! The reference follows the picture, slowly: light and focus change, and things creep.
//!
//! None of it is done in one line time: a row in its turn is averaged, and its coefficients are built anew,
//! some columns beside each line, while the old coefficients still serve; a whole reference is moved one
//! row beside each line.

use super::{RowLearning, Stage, Tracker};
use crate::{
    align::Averaging,
    pixel::Pixel,
    reference::{Build, Parts, RowTable},
};

/// What following remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Follow {
    /// What is under way; no more than one thing is.
    work: Work,
    /// Where the picture is on average, px: a mean over some seconds.
    drift_px: f32,
    /// By how much the reference was moved after a creeping picture, px.
    anchor_px: f32,
}

/// What is under way.
#[derive(Clone, Copy, Debug, Default)]
enum Work {
    #[default]
    Nothing,
    /// A line, kept in the scratch, is averaged into its row; the next column.
    Average {
        row: usize,
        averaging: Averaging,
        column: usize,
    },
    /// The row's coefficients are built anew.
    Build { row: usize, build: Build },
    /// They are there, with their table, and become what the kernel keeps; the next column.
    Keep {
        row: usize,
        table: RowTable,
        column: usize,
    },
    /// All rows are moved to the right by `by_px`; those from `next` on are still where they were. First the mean of a row,
    /// then its coefficients.
    Move {
        by_px: i32,
        next: usize,
        mean_moved: bool,
    },
}

/// One row in so many frames takes a little of the picture: building its coefficients anew is what costs. All
/// 240 rows at 60 fps have had their turn in a minute, and the reference forgets over a quarter of an hour; where a line
/// time is short, in twice as long.
const FRAMES_A_ROW: u32 = 16;
const FRAMES_A_ROW_IN_A_HURRY: u32 = 32;

/// The reference forgets over so many turns of a row: its noise is then that of twice as many frames.
const MEMORY_FRAMES: u16 = 16;

impl Follow {
    #[inline(always)]
    pub(super) fn anchor_px(&self) -> f32 {
        self.anchor_px
    }

    pub(super) fn is_busy(&self) -> bool {
        !matches!(self.work, Work::Nothing)
    }

    pub(super) fn is_moving(&self) -> bool {
        matches!(self.work, Work::Move { .. })
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
        let free = self.stage == Stage::Tracking && !self.follow.is_busy();
        let frames = match self.is_hurried() {
            true => FRAMES_A_ROW_IN_A_HURRY,
            false => FRAMES_A_ROW,
        };
        if !free || !frame.is_multiple_of(frames) {
            return usize::MAX;
        }
        // 619 is prime: every row has its turn.
        (frame / frames).wrapping_mul(619) as usize % usize::from(self.config.rows)
    }

    /// The reference of a row that was looked at and fitted is to take a little of it.
    pub(super) fn follow_row<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) {
        if self.follow.is_busy() {
            return;
        }
        P::pack(pixels, self.storage.scratch);
        if let Some(averaging) = self.averaging(row, pixels.len(), shift_px, MEMORY_FRAMES) {
            self.follow.work = Work::Average {
                row,
                averaging,
                column: 0,
            };
        }
    }

    /// Goes on with what is under way, some columns or one row a line. Returns by how much the reference of
    /// `row` lies to the left of where the other rows' lies, px.
    pub(super) fn follow_one_step<P: Pixel>(&mut self, row: usize) -> f32 {
        let width = usize::from(self.config.width);
        let columns = usize::from(self.config.columns_per_line).max(1);
        let s = &mut self.storage;
        match &mut self.follow.work {
            Work::Nothing => {}
            Work::Average {
                row,
                averaging,
                column,
            } => {
                let row = *row;
                if *column == width {
                    let build = self.build_of(row);
                    self.follow.work = Work::Build { row, build };
                    return 0.0;
                }
                // Many pixels go into one.
                let columns = columns.div_ceil(2);
                let span = *column..column.saturating_add(columns).min(width);
                *column = span.end;
                if let Some(mean) = s.mean.get_mut(row * width..(row + 1) * width) {
                    averaging.some::<P>(span, mean, s.scratch);
                }
            }
            Work::Build { row, build } => {
                let span = *row * width..(*row + 1) * width;
                let Some(mean) = s.mean.get(span.clone()) else {
                    self.follow.work = Work::Nothing;
                    return 0.0;
                };
                let parts = &mut Parts {
                    mean,
                    mask: s.mask,
                    scratch: s.scratch,
                    coefficients: s.fresh,
                };
                if let Some(table) = build.advance(columns, parts) {
                    self.follow.work = Work::Keep {
                        row: *row,
                        table,
                        column: 0,
                    };
                }
            }
            Work::Keep { row, table, column } => {
                let kernel = self.config.kernel;
                if *column == 0 && !kernel.can_keep(s.fresh) {
                    *table = table.without_texture();
                }
                // Two by two.
                let columns = columns.saturating_mul(2);
                let span = *column..column.saturating_add(columns).min(width);
                *column = span.end;
                if let Some(span) = s.fresh.get_mut(span) {
                    kernel.keep_some(span);
                }
                if *column == width || !kernel.keeps_pairs() {
                    let span = *row * width..(*row + 1) * width;
                    if let (Some(coefficients), Some(slot)) =
                        (s.coefficients.get_mut(span), s.tables.get_mut(*row))
                    {
                        coefficients.copy_from_slice(s.fresh);
                        *slot = *table;
                    }
                    self.follow.work = Work::Nothing;
                }
            }
            Work::Move {
                by_px,
                next,
                mean_moved,
            } => {
                let by_px = *by_px;
                let span = *next * width..(*next + 1) * width;
                // Where a line time is short one after the other; the row of this line must not be moved by half, as it would
                // be if it were the next one.
                let at_once = columns >= width;
                if !*mean_moved
                    && (at_once || row != *next)
                    && let Some(mean) = s.mean.get_mut(span.clone())
                {
                    move_row(mean, by_px);
                    *mean_moved = true;
                    if !at_once {
                        return if row >= *next { by_px as f32 } else { 0.0 };
                    }
                }
                if *mean_moved && let Some(coefficients) = s.coefficients.get_mut(span) {
                    let kernel = self.config.kernel;
                    kernel.move_kept(coefficients, by_px, move_row);
                    *mean_moved = false;
                    *next += 1;
                }
                let left = row >= *next;
                if *next >= usize::from(self.config.rows) {
                    self.follow.work = Work::Nothing;
                }
                return if left { by_px as f32 } else { 0.0 };
            }
        }
        0.0
    }

    fn build_of(&self, row: usize) -> Build {
        let learning = self.storage.learning.get(row);
        let frames = learning.map_or(1, RowLearning::frames);
        Build::new(&self.recipe, f32::from(frames))
    }

    /// Builds a row's coefficients from its mean, in one go.
    pub(super) fn build(&mut self, row: usize) {
        let build = self.build_of(row);
        let width = usize::from(self.config.width);
        let span = row * width..(row + 1) * width;
        let s = &mut self.storage;
        if let (Some(mean), Some(coefficients), Some(slot)) = (
            s.mean.get(span.clone()),
            s.coefficients.get_mut(span),
            s.tables.get_mut(row),
        ) {
            let table = build.all(&mut Parts {
                mean,
                mask: s.mask,
                scratch: s.scratch,
                coefficients,
            });
            let kept = self.config.kernel.keep(coefficients);
            *slot = if kept { table } else { table.without_texture() };
        }
    }

    /// Once a frame: has the whole reference moved by whole pixels after a picture that creeps.
    pub(super) fn follow_drift(&mut self) {
        if !self.prediction.is_sure() || self.stage != Stage::Tracking {
            return;
        }
        let here = self.prediction.at(0);
        self.follow.drift_px += (here - self.follow.drift_px) / DRIFT_FRAMES;
        if self.follow.drift_px.abs() < CREEP_PX || self.follow.is_moving() {
            return;
        }
        let stride = i32::from(self.config.stride);
        let by_px = stride * if self.follow.drift_px > 0.0 { 1 } else { -1 };
        // A row that is being followed will have another turn.
        self.follow.work = Work::Move {
            by_px,
            next: 0,
            mean_moved: false,
        };
        self.follow.anchor_px += by_px as f32;
        self.follow.drift_px -= by_px as f32;
        self.prediction.move_by(-by_px as f32);
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
