//! The reference follows the picture, slowly: light and focus change, and things creep.
//!
//! None of it is done in one line time: a row in its turn is averaged, and its coefficients are built again,
//! some columns in the background of each line, while the old coefficients still serve; a whole reference is moved one
//! row after the other, some columns in the background of each line.

use super::{
    Build, Parts, RowTable, Store, VerticalBuild, VerticalParts, VerticalTable, align::Averaging,
    build::settle, planar::place,
};
use crate::{camera::pixel::Pixel, kernel::Kernel};

/// What following remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Background {
    /// What is under way; no more than one thing is.
    work: Work,
    /// Where the picture is on average, px: a mean over some seconds.
    drift_px: f32,
    /// By how much the reference was moved after a creeping picture, px.
    anchor_px: f32,
}

/// What is under way.
#[derive(Clone, Copy, Debug, Default)]
#[expect(
    clippy::large_enum_variant,
    reason = "a tracker has one, and no heap to put a variant on"
)]
enum Work {
    #[default]
    Nothing,
    /// A line is kept in the scratch: where it was, and the factor that brings it to its reference's brightness.
    Kept {
        row: usize,
        /// To the right and downwards.
        shift_px: [f32; 2],
        to_reference: f32,
    },
    /// It is averaged into its row; the next column.
    Average {
        row: usize,
        averaging: Averaging,
        down_px: f32,
        column: usize,
    },
    /// The row's coefficients are built again.
    Build { row: usize, build: Build },
    /// Those of its second product are.
    BuildVertical {
        row: usize,
        table: RowTable,
        build: VerticalBuild,
    },
    /// They are there, with their tables, and become what the kernel keeps; the next column.
    Keep {
        row: usize,
        table: RowTable,
        vertical: Option<VerticalTable>,
        column: usize,
    },
    /// All rows are moved to the right by `by_px`; those from `next` on are still where they were.
    Move {
        by_px: i32,
        next: usize,
        moving: Moving,
    },
}

/// How far a row is moved; nothing of it is seen before its end.
#[derive(Clone, Copy, Debug)]
enum Moving {
    /// Its coefficients are laid where they are to be, among the fresh ones; the next column, and what the kernel
    /// left of those before.
    Lay {
        column: usize,
        lanes: u32,
    },
    /// What went over the ends is made up for.
    Settle,
    /// They become what the kernel keeps; the next column.
    Keep {
        column: usize,
    },
    /// The same three of its second product.
    LayVertical {
        column: usize,
        lanes: u32,
    },
    SettleVertical,
    KeepVertical {
        column: usize,
    },
    /// Its mean is moved; columns that are, from the end that they are moved to.
    Mean {
        moved: usize,
    },
    /// The coefficients take the place of the row's own.
    Place,
}

impl Moving {
    const BEGIN: Self = Self::Lay {
        column: 0,
        lanes: 0,
    };
}

/// One row in so many frames takes a little of the picture: building its coefficients again is what costs. All
/// 240 rows at 60 fps have had their turn in a minute, and the reference forgets over a quarter of an hour; where a line
/// time is short, in twice as long.
const FRAMES_A_ROW: u32 = 16;
const FRAMES_A_ROW_IN_A_HURRY: u32 = 32;

/// The reference forgets over so many turns of a row: its noise is then that of twice as many frames.
const MEMORY_FRAMES: u16 = 16;

/// Columns at either end of a row that have no coefficients, whatever its band; what is moved further in comes in as 0.
const ENDS: usize = 4;

/// A column is laid elsewhere, or kept, so many times faster than it is built again.
const LAID: usize = 4;

/// Columns of a mean that are moved in the background of a line.
const MEAN_COLUMNS: usize = 48;

/// Frames over which the drift is averaged.
const DRIFT_FRAMES: f32 = 128.0;

/// The reference is moved when the picture has crept so far. Coefficients near the edge are 0, so a move
/// by so few pixels loses none of them.
const CREEP_PX: f32 = 1.5;

impl Store<'_> {
    /// By how much the reference was moved after a creeping picture, px.
    #[inline(always)]
    pub(crate) fn anchor_px(&self) -> f32 {
        self.background.anchor_px
    }

    /// The background job is under way.
    #[inline]
    pub(crate) fn is_busy(&self) -> bool {
        !matches!(self.background.work, Work::Nothing)
    }

    /// The background job moves the whole reference.
    pub(crate) fn is_moving(&self) -> bool {
        matches!(self.background.work, Work::Move { .. })
    }

    /// By how much the reference of `row` lies to the left of where the other rows' lies, px.
    pub(crate) fn aside_px(&self, row: usize) -> f32 {
        match self.background.work {
            Work::Move { by_px, next, .. } if row >= next => by_px as f32,
            _ => 0.0,
        }
    }

    /// The row whose turn it is in this frame; rows far apart follow each other. `hurried`: a line time is short.
    pub(crate) fn turn_of(&self, frame: u32, hurried: bool) -> usize {
        let free = !self.is_busy();
        let frames = match hurried {
            true => FRAMES_A_ROW_IN_A_HURRY,
            false => FRAMES_A_ROW,
        };
        if !free || !frame.is_multiple_of(frames) {
            return usize::MAX;
        }
        // 619 is prime: every row has its turn.
        (frame / frames).wrapping_mul(619) as usize % self.rows()
    }

    /// The reference of a row that was checked and fitted is to take a little of it.
    pub(crate) fn follow_row<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        shift_px: [f32; 2],
        to_reference: f32,
        hurried: bool,
    ) {
        if self.is_busy() {
            return;
        }
        P::pack(pixels, self.buffers.scratch);
        self.background.work = Work::Kept {
            row,
            shift_px,
            to_reference,
        };
        if !hurried {
            self.begin_average();
        }
    }

    /// The line that was kept is about to be averaged.
    fn begin_average(&mut self) {
        let Work::Kept {
            row,
            shift_px,
            to_reference,
        } = self.background.work
        else {
            return;
        };
        let [shift_px, down_px] = shift_px;
        let averaging = self.averaging(row, shift_px, to_reference, MEMORY_FRAMES);
        self.background.work = averaging.map_or(Work::Nothing, |averaging| Work::Average {
            row,
            averaging,
            down_px,
            column: 0,
        });
    }

    /// Goes on with what is under way, some columns or one row a line. Returns by how much the reference of
    /// `row` lies to the left of where the other rows' lies, px.
    pub(crate) fn advance_background<P: Pixel>(&mut self, row: usize, columns: u16) -> f32 {
        let width = self.width;
        let columns = usize::from(columns).max(1);
        let s = &mut self.buffers;
        match &mut self.background.work {
            Work::Nothing => {}
            Work::Kept { .. } => self.begin_average(),
            Work::Average {
                row,
                averaging,
                down_px,
                column,
            } => {
                let (row, down_px) = (*row, *down_px);
                if *column == width {
                    let build = self.build_of(row);
                    self.background.work = Work::Build { row, build };
                    return 0.0;
                }
                // Many pixels go into one.
                let columns = columns.div_ceil(2);
                let span = *column..column.saturating_add(columns).min(width);
                *column = span.end;
                if let Some(mean) = s.mean.get_mut(row * width..(row + 1) * width) {
                    averaging.some::<P>(span.clone(), mean, s.scratch);
                }
                let keep = self.keep_of(row);
                self.settle_down(row, span, down_px, keep);
            }
            Work::Build { row, build } => {
                let span = *row * width..(*row + 1) * width;
                let Some(mean) = s.mean.get(span.clone()) else {
                    self.background.work = Work::Nothing;
                    return 0.0;
                };
                let parts = &mut Parts {
                    mean,
                    mask: s.mask,
                    scratch: s.scratch,
                    coefficients: s.fresh,
                };
                if let Some(table) = build.advance(columns, parts) {
                    let row = *row;
                    self.background.work = self.built_first(row, table);
                }
            }
            Work::BuildVertical { row, table, build } => {
                let Some(v) = &mut s.vertical else {
                    self.background.work = Work::Nothing;
                    return 0.0;
                };
                let parts = &mut VerticalParts {
                    picture: s.mean,
                    row: *row,
                    mask: s.mask,
                    first: s.fresh,
                    scratch: s.scratch,
                    coefficients: v.fresh,
                };
                if let Some(vertical) = build.advance(columns, parts) {
                    self.background.work = Work::Keep {
                        row: *row,
                        table: *table,
                        vertical: Some(vertical),
                        column: 0,
                    };
                }
            }
            Work::Keep { .. } => self.keep_one_step(columns),
            Work::Move { .. } => {
                self.move_one_step(row, columns);
                return self.aside_px(row);
            }
        }
        0.0
    }

    /// What comes after a row's first product has been built.
    fn built_first(&self, row: usize, table: RowTable) -> Work {
        if !self.is_planar() {
            return Work::Keep {
                row,
                table,
                vertical: None,
                column: 0,
            };
        }
        let frames = 1.0 / self.keep_of(row);
        let build = VerticalBuild::new(&self.recipe, frames, table, self.reach(row))
            .without(self.left_out(row));
        Work::BuildVertical { row, table, build }
    }

    /// Makes some fresh columns what the kernel keeps; at their end they take their row's place.
    fn keep_one_step(&mut self, columns: usize) {
        let (kernel, width) = (self.recipe.kernel, self.width);
        let reach = match self.background.work {
            Work::Keep { row, .. } => self.reach(row),
            _ => return,
        };
        let Work::Keep {
            row,
            table,
            vertical,
            column,
        } = &mut self.background.work
        else {
            return;
        };
        let s = &mut self.buffers;
        // Two by two.
        let columns = columns.saturating_mul(if vertical.is_some() { 1 } else { 2 });
        let span = *column
            ..column
                .saturating_add(columns)
                .next_multiple_of(2)
                .min(width);
        *column = span.end;
        kernel.keep_some(s.fresh, span.clone());
        if let Some(v) = &mut s.vertical {
            kernel.keep_some(v.fresh, span);
        }
        if *column < width && kernel.keeps_pairs() {
            return;
        }
        let span = *row * width..(*row + 1) * width;
        if let (Some(coefficients), Some(slot)) =
            (s.coefficients.get_mut(span.clone()), s.tables.get_mut(*row))
        {
            coefficients.copy_from_slice(s.fresh);
            // Without a print: its sums are others now.
            *slot = *table;
            if let (Some(v), &mut Some(built)) = (&mut s.vertical, vertical)
                && let (Some(coefficients), Some(vertical)) =
                    (v.coefficients.get_mut(span), v.tables.get_mut(*row))
            {
                coefficients.copy_from_slice(v.fresh);
                place(reach, built, vertical, slot);
            }
        }
        self.background.work = Work::Nothing;
    }

    /// Moves some columns of a row, in the background of the line of row `during`; a whole one where a line may take what it likes.
    #[inline(never)]
    fn move_one_step(&mut self, during: usize, columns: usize) {
        let Work::Move {
            by_px,
            next,
            moving,
        } = &mut self.background.work
        else {
            return;
        };
        let (kernel, width) = (self.recipe.kernel, self.width);
        let rows = self.buffers.tables.len();
        let row = *next * width..(*next + 1) * width;
        let s = &mut self.buffers;
        let (Some(mean), Some(coefficients), Some(table)) = (
            s.mean.get_mut(row.clone()),
            s.coefficients.get_mut(row.clone()),
            s.tables.get_mut(*next),
        ) else {
            self.background.work = Work::Nothing;
            return;
        };
        let mut vertical = s.vertical.as_mut().and_then(|v| {
            let row = v.coefficients.get_mut(row)?;
            Some((row, &mut *v.fresh, v.tables.get_mut(*next)?))
        });
        let at_once = columns >= width;
        if at_once && !kernel.keeps_pairs() {
            move_row(coefficients, *by_px);
            if let Some((coefficients, ..)) = &mut vertical {
                move_row(coefficients, *by_px);
            }
            *moving = Moving::Mean { moved: 0 };
        }
        loop {
            match moving {
                Moving::Lay { column, lanes } => {
                    if *column == 0 {
                        s.fresh.fill(0);
                    }
                    let columns = columns.saturating_mul(LAID);
                    let span = *column..column.saturating_add(columns).min(width);
                    *column = span.end;
                    let ended = span.end == width;
                    kernel.lay_kept(coefficients, span, lanes, s.fresh, *by_px);
                    if ended {
                        *moving = Moving::Settle;
                    }
                }
                Moving::Settle => {
                    if !settle_ends(kernel, s.fresh) {
                        *table = table.without_texture();
                    }
                    *moving = Moving::Keep { column: 0 };
                }
                Moving::Keep { column } => {
                    let columns = columns.saturating_mul(LAID);
                    let span = *column..column.saturating_add(columns).min(width);
                    *column = span.end;
                    if span.end == width {
                        *moving = match vertical.is_some() {
                            true => Moving::LayVertical {
                                column: 0,
                                lanes: 0,
                            },
                            false => Moving::Mean { moved: 0 },
                        };
                    }
                    kernel.keep_some(s.fresh, span);
                }
                Moving::LayVertical { column, lanes } => {
                    let Some((coefficients, fresh, _)) = &mut vertical else {
                        *moving = Moving::Mean { moved: 0 };
                        return;
                    };
                    if *column == 0 {
                        fresh.fill(0);
                    }
                    let columns = columns.saturating_mul(LAID);
                    let span = *column..column.saturating_add(columns).min(width);
                    *column = span.end;
                    let ended = span.end == width;
                    kernel.lay_kept(coefficients, span, lanes, fresh, *by_px);
                    if ended {
                        *moving = Moving::SettleVertical;
                    }
                }
                Moving::SettleVertical => {
                    if let Some((_, fresh, table)) = &mut vertical
                        && !settle_ends(kernel, fresh)
                    {
                        **table = table.without_texture();
                    }
                    *moving = Moving::KeepVertical { column: 0 };
                }
                Moving::KeepVertical { column } => {
                    let columns = columns.saturating_mul(LAID);
                    let span = *column..column.saturating_add(columns).min(width);
                    *column = span.end;
                    if span.end == width {
                        *moving = Moving::Mean { moved: 0 };
                    }
                    if let Some((_, fresh, _)) = &mut vertical {
                        kernel.keep_some(fresh, span);
                    }
                }
                Moving::Mean { moved } if at_once => {
                    move_row(mean, *by_px);
                    *moved = width;
                    *moving = Moving::Place;
                }
                Moving::Mean { moved } => {
                    let steps = width.div_ceil(MEAN_COLUMNS);
                    // It is to be done before its own line comes.
                    let ahead = (*next + rows).saturating_sub(during) % rows;
                    if *moved == 0 && ahead <= steps + 2 && rows > 2 * steps {
                        return;
                    }
                    let end = (*moved + MEAN_COLUMNS).min(width);
                    move_some(mean, *by_px, *moved..end);
                    *moved = end;
                    if end == width {
                        *moving = Moving::Place;
                    }
                }
                Moving::Place => {
                    if !at_once || kernel.keeps_pairs() {
                        coefficients.copy_from_slice(s.fresh);
                        if let Some((coefficients, fresh, _)) = &mut vertical {
                            coefficients.copy_from_slice(fresh);
                        }
                    }
                    table.print = 0;
                    *next += 1;
                    *moving = Moving::BEGIN;
                    if *next >= self.rows() {
                        self.background.work = Work::Nothing;
                    }
                    return;
                }
            }
            if !at_once {
                return;
            }
        }
    }

    /// Once a frame: has the whole reference moved by whole pixels after a picture that creeps. `here_px`: where it
    /// is at the frame's start. Returns by how much the reference is going to be moved, where it is.
    pub(crate) fn follow_drift(&mut self, here_px: f32) -> Option<f32> {
        let moving = self.is_moving();
        let background = &mut self.background;
        background.drift_px += (here_px - background.drift_px) / DRIFT_FRAMES;
        if background.drift_px.abs() < CREEP_PX || moving {
            return None;
        }
        let stride = self.recipe.stride as i32;
        let by_px = stride * if background.drift_px > 0.0 { 1 } else { -1 };
        // A row that is being followed will have another turn.
        background.work = Work::Move {
            by_px,
            next: 0,
            moving: Moving::BEGIN,
        };
        background.anchor_px += by_px as f32;
        background.drift_px -= by_px as f32;
        Some(by_px as f32)
    }
}

/// The coefficients at the ends of a row that was moved are left out, and the others make up for them, so that light
/// that is the same everywhere is still no motion. False where there are too few.
fn settle_ends(kernel: Kernel, row: &mut [i8]) -> bool {
    let width = row.len();
    let mut excess = [0; 2];
    for x in (0..ENDS).chain(width.saturating_sub(ENDS)..width) {
        if let Some(h) = row.get_mut(x) {
            excess[x & 1] -= i32::from(core::mem::take(h));
        }
    }
    if !kernel.keeps_pairs() {
        excess = [excess[0] + excess[1], 0];
    }
    settle(kernel, row, excess)
}

/// Moves a row to the right by `by` (to the left where negative); what comes in repeats the edge.
fn move_row<T: Copy>(row: &mut [T], by: i32) {
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

/// Some columns of what [`move_row`] does, counted from the end that it moves to; one after the other it does all.
fn move_some<T: Copy>(row: &mut [T], by: i32, span: core::ops::Range<usize>) {
    let last = row.len().saturating_sub(1);
    let away = by.unsigned_abs() as usize;
    for x in span {
        let from = (x + away).min(last);
        let (to, from) = match by > 0 {
            true => (last.wrapping_sub(x), last - from),
            false => (x, from),
        };
        if let Some(&v) = row.get(from)
            && let Some(to) = row.get_mut(to)
        {
            *to = v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{move_row, move_some};

    #[test]
    fn rows_move_piece_by_piece_as_at_once() {
        for by in [-3, -1, 0, 1, 2, 20] {
            let mut at_once: [u16; 13] = core::array::from_fn(|x| x as u16 * 7);
            let mut pieces = at_once;
            move_row(&mut at_once, by);
            for span in [0..5, 5..12, 12..13] {
                move_some(&mut pieces, by, span);
            }
            assert_eq!(pieces, at_once, "{by}");
        }
        move_some::<u8>(&mut [], 1, 0..3);
    }

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
