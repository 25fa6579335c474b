//! The whole reference moves after a picture that creeps: one row after the other, some columns in the background of
//! each line.

use super::{
    Store,
    build::settle,
    work::{Moving, Work},
};
use crate::kernel::Kernel;

/// A column is laid elsewhere, or kept, so many times faster than it is built again.
const LAID: usize = 4;

/// Columns at either end of a row that have no coefficients, whatever its band; what is moved further in comes in as 0.
const ENDS: usize = 4;

/// Columns of a mean that are moved in the background of a line.
const MEAN_COLUMNS: usize = 48;

/// Frames over which the drift is averaged.
const DRIFT_FRAMES: f32 = 128.0;

/// The reference is moved when the picture has crept so far. Coefficients near the edge are 0, so a move
/// by so few pixels loses none of them.
const CREEP_PX: f32 = 1.5;

impl Store<'_> {
    /// Moves some columns of a row, in the background of the line of row `during`; a whole one where a line may take what it likes.
    #[inline(never)]
    pub(super) fn move_one_step(&mut self, during: usize, columns: usize) {
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
