//! The reference follows the picture, slowly: light and focus change, and things creep.
//!
//! None of it is done in one line time: a row in its turn is averaged, and its coefficients are built again,
//! some columns in the background of each line, while the old coefficients still serve; a whole reference is moved one
//! row after the other, some columns in the background of each line.

use super::{Parts, RowTable, Store, VerticalBuild, VerticalParts, planar::place, work::Work};
use crate::camera::pixel::Pixel;

/// One row in so many frames takes a little of the picture: building its coefficients again is what costs. All
/// 240 rows at 60 fps have had their turn in a minute, and the reference forgets over a quarter of an hour; where a line
/// time is short, in twice as long.
const FRAMES_A_ROW: u32 = 16;
const FRAMES_A_ROW_IN_A_HURRY: u32 = 32;

/// The reference forgets over so many turns of a row: its noise is then that of twice as many frames.
const MEMORY_FRAMES: u16 = 16;

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
        let frames = self.recipe.noise_frames(1.0 / self.keep_of(row));
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
}
