//! What is settled of the whole reference at the end of a round of learning.

use super::{
    ColumnLearning, RowTable, Store, align,
    band::{Level, MAX_HALF},
};
use crate::camera::pixel::Pixel;

/// Rows on which the levels of the band are tried.
const TRIAL_ROWS: usize = 24;

/// A coarser level that finds this share of the most information is taken: it costs a two-hundredth of the noise, and the
/// reference's own noise, which the lines that it was learned from share, pulls their shifts less. A handful of frames
/// had 32 false peaks where the finest was taken for a thousandth more, and none so.
const AS_MUCH: f32 = 0.99;

/// The same where the sensor's fixed pattern is known, which is white: the coarsest level passes a tenth of what the finest
/// does, and how much that is, is known to a tenth.
const AS_MUCH_BESIDE_PATTERN: f32 = 0.8;

impl Store<'_> {
    /// Gives each row the mean brightness of its lines: that of the first frame, against which they were
    /// all brought, bears the pattern of a flickering lamp.
    pub(crate) fn even_light(&mut self) {
        let width = self.width;
        let rows = self.buffers.mean.chunks_exact_mut(width);
        for (mean, learning) in rows.zip(self.buffers.learning.iter()) {
            if learning.light > 0.0 {
                for m in mean {
                    *m = (f32::from(*m) * learning.light + 0.5) as u16;
                }
            }
        }
    }

    /// Moves each row's reference to the middle of its motion: the first frame, to which it is anchored,
    /// may have met the picture anywhere, and elsewhere in the next row.
    pub(crate) fn centre_rows(&mut self) {
        let width = self.width;
        let rows = self.buffers.mean.chunks_exact_mut(width);
        for (mean, learning) in rows.zip(self.buffers.learning.iter_mut()) {
            align::move_row_by(
                mean,
                learning.shift_px,
                self.recipe.stride,
                self.buffers.scratch,
            );
            learning.shift_px = 0.0;
        }
    }

    /// The level that finds the most information in the picture: the coarsest of those that find about as much.
    pub(crate) fn choose_level(&mut self) {
        let rows = self.rows();
        let step = rows.div_ceil(TRIAL_ROWS).max(1);
        let as_much = match self.recipe.pattern > 0.0 {
            true => AS_MUCH_BESIDE_PATTERN,
            false => AS_MUCH,
        };
        let mut best = (0.0, Level::Medium);
        for level in Level::ALL {
            self.recipe.level = level;
            let mut information = 0.0;
            for row in (0..rows).step_by(step) {
                self.build_first(row);
                let table = self.buffers.tables.get(row);
                information += table.map_or(0.0, RowTable::information_per_px2);
            }
            if information > best.0 * as_much {
                best = (information.max(best.0), level);
            }
        }
        self.recipe.level = best.1;
    }

    /// The next round's frames are counted again.
    pub(crate) fn count_frames_again(&mut self) {
        for l in self.buffers.learning.iter_mut() {
            l.frames = 0;
        }
    }

    /// Mean information of the rows with texture, 1/px².
    pub(crate) fn usual_information(&self) -> f32 {
        let rows = self
            .buffers
            .tables
            .iter()
            .map(RowTable::information_per_px2);
        let (sum, n) = rows
            .filter(|&information| information > 0.0)
            .fold((0.0f32, 0.0f32), |(sum, n), information| {
                (sum + information, n + 1.0)
            });
        sum / n.max(1.0)
    }

    /// Mean curvature of the rows, weighted like their shifts, 1/px²; no number where no row has texture.
    pub(crate) fn usual_curvature_per_px2(&self) -> f32 {
        let (mut sum, mut all) = (0.0f32, 0.0f32);
        for table in self.buffers.tables.iter() {
            let information = table.information_per_px2();
            sum += information * table.curvature_per_px2();
            all += information;
        }
        sum / all
    }

    /// A live column is never still: it has noise, and its rows differ. What never changes is dead.
    pub(crate) fn note_activity<P: Pixel>(&mut self, pixels: &[P]) {
        for (&p, column) in pixels.iter().zip(self.buffers.columns.iter_mut()) {
            let value = *column.first.get_or_insert(p.value());
            column.changes = column.changes.saturating_add(u16::from(p.value() != value));
        }
    }

    /// Masks columns that never changed while their neighbours did: up to three side by side. (A longer
    /// run is a part of the picture without noise, a clipped one say, and knows nothing anyway.)
    pub(crate) fn mask_dead_columns(&mut self) {
        let reach = MAX_HALF * self.recipe.stride;
        let columns = &self.buffers.columns;
        let dead = |x: usize| {
            columns
                .get(x)
                .is_some_and(|c: &ColumnLearning| c.changes == 0)
        };
        let mut x = 0;
        while x < columns.len() {
            let mut run = 0;
            while dead(x + run) {
                run += 1;
            }
            let alone = x > 0 && x + run < columns.len();
            if alone && (1..=3).contains(&run) {
                // The band's filter must not reach a dead column either.
                let from = x.saturating_sub(reach);
                let mask = self.buffers.mask.iter_mut().skip(from);
                mask.take(x - from + run + reach).for_each(|m| *m = 0);
            }
            x += run + 1;
        }
    }
}
