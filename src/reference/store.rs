//! The reference picture and everything made of it, in the buffers that the caller lends.
//!
//! A [`Store`] owns the lent [`Storage`]: rows are averaged into it, their coefficients are built from it, and
//! while tracking a background job ([`super::background`]) lets it follow the picture. Whoever measures a line
//! asks for its row: coefficients, table and mean.

use super::{
    Build, Parts, Recipe, RowLearning, RowTable, Storage, align::Averaging, band::Level,
    noise::PixelNoise, work::Background,
};
use crate::camera::pixel::Pixel;

/// See the [module](self).
// In this order in memory: a microcontroller reaches what every line needs, which is first, without a sum.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct Store<'a> {
    pub(super) buffers: Storage<'a>,
    /// Pixels of a row.
    pub(super) width: usize,
    pub(super) recipe: Recipe,
    pub(super) background: Background,
}

impl<'a> Store<'a> {
    /// A store that knows nothing yet; `buffers` are cut to the picture's size ([`Storage::cut`]).
    pub(crate) fn new(buffers: Storage<'a>, recipe: Recipe, width: u16) -> Self {
        Self {
            buffers,
            recipe,
            width: usize::from(width),
            background: Background::default(),
        }
    }

    /// Forgets all rows, and starts with these guesses.
    pub(crate) fn forget(&mut self, noise: PixelNoise, level: Level, margin_px: usize) {
        self.recipe.noise = noise;
        self.recipe.level = level;
        self.recipe.margin_px = margin_px;
        self.background = Background::default();
        self.buffers.learning.fill(RowLearning::default());
        self.buffers.tables.fill(RowTable::default());
        self.buffers.coefficients.fill(0);
        self.buffers.columns.fill(super::ColumnLearning::default());
        if let Some(v) = &mut self.buffers.vertical {
            v.tables.fill(super::VerticalTable::default());
            v.coefficients.fill(0);
        }
    }

    /// How rows become coefficients.
    #[inline(always)]
    pub(crate) fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// From now on pixels have this noise.
    pub(crate) fn set_noise(&mut self, noise: PixelNoise) {
        self.recipe.noise = noise;
    }

    /// From now on the sensor's fixed pattern has this share of the pixels' noise, as a variance.
    pub(crate) fn set_pattern(&mut self, share: f32) {
        self.recipe.pattern = share;
    }

    /// From now on a pixel of the reference is saturated from this value on.
    pub(crate) fn set_saturation(&mut self, saturation: f32) {
        self.recipe.saturation = saturation;
    }

    /// From now on the motion may carry so many columns out of the picture.
    pub(crate) fn set_margin_px(&mut self, margin_px: usize) {
        self.recipe.margin_px = margin_px;
    }

    /// Number of pixels of a row.
    #[inline(always)]
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    #[inline]
    pub(crate) fn rows(&self) -> usize {
        self.buffers.tables.len()
    }

    /// What the line path needs of a row.
    #[inline(always)]
    pub(crate) fn table(&self, row: usize) -> Option<&RowTable> {
        self.buffers.tables.get(row)
    }

    /// The tables of all rows.
    pub(crate) fn tables(&self) -> &[RowTable] {
        self.buffers.tables
    }

    /// A row's coefficients, as the kernel keeps them.
    #[inline(always)]
    pub(crate) fn coefficients(&self, row: usize) -> Option<&[i8]> {
        part(self.buffers.coefficients, row, self.width)
    }

    /// A row of the reference picture, in counts.
    #[inline(always)]
    pub(crate) fn mean(&self, row: usize) -> Option<&[u16]> {
        part(self.buffers.mean, row, self.width)
    }

    /// Weight of each column, 0 = unused.
    #[inline(always)]
    pub(crate) fn mask(&self) -> &[u8] {
        self.buffers.mask
    }

    /// What learning knows of a row.
    pub(crate) fn learning(&self, row: usize) -> Option<&RowLearning> {
        self.buffers.learning.get(row)
    }

    /// The same, to be changed.
    pub(crate) fn learning_mut(&mut self, row: usize) -> Option<&mut RowLearning> {
        self.buffers.learning.get_mut(row)
    }

    /// The print of the row's last line; 0 where there is no such row.
    #[inline(always)]
    pub(crate) fn print(&self, row: usize) -> u32 {
        self.buffers.tables.get(row).map_or(0, |t| t.print)
    }

    /// Keeps the print of a row's line; true where it was another.
    #[inline(always)]
    pub(crate) fn replace_print(&mut self, row: usize, print: u32) -> bool {
        let before = self.buffers.tables.get_mut(row).map(|t| &mut t.print);
        before.is_some_and(|before| core::mem::replace(before, print) != print)
    }

    /// Keeps the print of a row's line.
    #[inline(always)]
    pub(crate) fn set_print(&mut self, row: usize, print: u32) {
        if let Some(table) = self.buffers.tables.get_mut(row) {
            table.print = print;
        }
    }

    /// Averages a line into its row, of at most `memory` frames. `shift_px`: of the line against the row, and downwards;
    /// `to_reference`: the factor that brings it to the row's brightness.
    pub(crate) fn average<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        [shift_px, down_px]: [f32; 2],
        to_reference: f32,
        memory: u16,
    ) {
        let Some(averaging) = self.averaging(row, shift_px, to_reference, memory) else {
            return;
        };
        let width = self.width;
        if let Some(mean) = self.buffers.mean.get_mut(row * width..(row + 1) * width) {
            averaging.all(self.recipe.kernel, mean, pixels);
        }
        let keep = self.keep_of(row);
        self.settle_down(row, 0..width, down_px, keep);
    }

    /// Share of the frame that was averaged last in its row.
    pub(super) fn keep_of(&self, row: usize) -> f32 {
        let learning = self.buffers.learning.get(row);
        1.0 / f32::from(learning.map_or(1, RowLearning::frames))
    }

    /// How a line is to be averaged into its row; the row is counted to have seen it.
    pub(super) fn averaging(
        &mut self,
        row: usize,
        shift_px: f32,
        to_reference: f32,
        memory: u16,
    ) -> Option<Averaging> {
        let learning = self.buffers.learning.get_mut(row)?;
        learning.frames = learning.frames.saturating_add(1).min(memory);
        let keep = 1.0 / f32::from(learning.frames);
        // A line ten times darker than its reference is no measure of brightness.
        let bright = match to_reference {
            bright if bright < 10.0 => bright,
            _ => 1.0,
        };
        learning.light += (1.0 / bright - learning.light) * keep;
        let recipe = &self.recipe;
        Some(Averaging::new(
            shift_px,
            keep * bright,
            keep,
            recipe,
            self.width,
        ))
    }

    pub(super) fn build_of(&self, row: usize) -> Build {
        let learning = self.buffers.learning.get(row);
        let frames = learning.map_or(1, RowLearning::frames);
        let frames = self.recipe.noise_frames(f32::from(frames));
        Build::new(&self.recipe, frames).without(self.left_out(row))
    }

    /// Builds a row's coefficients from its mean, in one go, and those of its second product from the rows beside it.
    pub(crate) fn build(&mut self, row: usize) {
        self.build_first(row);
        self.build_vertical(row);
        let width = self.width;
        let coefficients = &mut self.buffers.coefficients;
        if let Some(coefficients) = coefficients.get_mut(row * width..(row + 1) * width) {
            self.recipe.kernel.keep_some(coefficients, 0..width);
        }
    }

    /// A row's coefficients as they are, which the kernel does not keep yet.
    pub(super) fn build_first(&mut self, row: usize) {
        let build = self.build_of(row);
        let width = self.width;
        let span = row * width..(row + 1) * width;
        let b = &mut self.buffers;
        if let (Some(mean), Some(coefficients), Some(slot)) = (
            b.mean.get(span.clone()),
            b.coefficients.get_mut(span),
            b.tables.get_mut(row),
        ) {
            let table = build.all(&mut Parts {
                mean,
                mask: b.mask,
                scratch: b.scratch,
                coefficients,
            });
            slot.become_built(table);
        }
    }

    /// Builds all rows.
    pub(crate) fn build_all(&mut self) {
        for row in 0..self.rows() {
            self.build(row);
        }
    }

    /// The lent buffers.
    #[cfg(test)]
    pub(crate) fn buffers(&self) -> &Storage<'a> {
        &self.buffers
    }
}

/// A row of a buffer that holds one row after the other.
#[inline(always)]
pub(super) fn part<T>(buffer: &[T], row: usize, width: usize) -> Option<&[T]> {
    let first = row * width;
    buffer.get(first..first + width)
}
