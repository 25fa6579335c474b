//! Pixels that do not move with their row: hot and dead ones, dust.
//!
//! Such a pixel stands still in the picture and looks like texture, the more the brighter it is: its row answers to
//! the motion too weakly and knows far too much. Three of them among 144 rows took 4.5 % of an amplitude. While the
//! reference is learned the two sharpest pixels of each row are watched. Where the picture moves by d, the
//! difference of a sharp pixel's neighbours, D = p(x + 1) − p(x − 1), changes by d·(2r(x) − r(x − 2) − r(x + 2))/2 if it
//! moves along; beside a pixel that stands still it does not. A least-squares slope over the frames tells them apart, and
//! what does not follow is left out of the row's coefficients, with all that the band's filter reaches.

use super::{Recipe, RowLearning, Store, band::MAX_HALF};
use crate::camera::pixel::Pixel;

/// Pixels of a row that are watched, and left out.
pub(super) const WATCHED: usize = 2;

/// Pixels left out of a row, its own and those of the rows beside it that the filter across rows mixes with it.
pub(super) const LEFT_OUT: usize = (2 * MAX_HALF + 1) * WATCHED;

/// No pixel: the first of a row has no neighbour to tell its sharpness. (Zero, so that a static of it
/// lies in `.bss`.)
pub(super) const NONE: u16 = 0;

/// A pixel that follows the motion by less than this share of what its sharpness asks for stands still.
const FOLLOWS: f32 = 0.3;

/// The slope is known well enough to tell at so many standard deviations.
const SURE: f32 = 6.0;

/// A pixel is sharp enough to matter from so many standard deviations of its noise on.
const SHARP: f32 = 8.0;

/// Beyond this motion, in pixels of one colour, a difference is no linear function of it.
const LINEAR: f32 = 0.75;

/// The sharpest pixels of a row, and how they follow its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Watched {
    /// Columns that are watched.
    columns: [u16; WATCHED],
    /// Columns that are left out.
    left_out: [u16; WATCHED],
    /// Σ D and Σ D·d of each, in pixel values and times px.
    difference: [f32; WATCHED],
    product: [f32; WATCHED],
    /// Frames, Σ d and Σ d², px and px².
    frames: f32,
    shift: f32,
    square: f32,
}

impl Watched {
    pub(super) const EMPTY: Self = Self {
        columns: [NONE; WATCHED],
        left_out: [NONE; WATCHED],
        difference: [0.0; WATCHED],
        product: [0.0; WATCHED],
        frames: 0.0,
        shift: 0.0,
        square: 0.0,
    };

    /// Columns that are left out; [`NONE`] for none.
    pub(super) fn left_out(&self) -> [u16; WATCHED] {
        self.left_out
    }

    /// Σ (d − its mean)², px².
    fn motion(&self) -> f32 {
        self.square - self.shift * self.shift / self.frames.max(1.0)
    }

    /// Each watched column with Σ D·(d − its mean).
    fn changes(&self) -> [(u16, f32); WATCHED] {
        let mean_px = self.shift / self.frames.max(1.0);
        core::array::from_fn(|k| {
            let change = self.product[k] - self.difference[k] * mean_px;
            (self.columns[k], change)
        })
    }
}

impl Default for Watched {
    fn default() -> Self {
        Self::EMPTY
    }
}

/// Sharpness of a pixel of the reference: what D changes by for each px of motion, in pixel values.
fn sharpness(mean: &[u16], x: usize, recipe: &Recipe) -> Option<f32> {
    let by = 2 * recipe.stride;
    let at = |x: usize| mean.get(x).map(|&m| f32::from(m));
    let ends = at(x.checked_sub(by)?)? + at(x + by)?;
    Some((2.0 * at(x)? - ends) / (2.0 * recipe.counts_per_value * recipe.stride as f32))
}

impl Store<'_> {
    /// Chooses the pixels of a row that are watched from now on: the sharpest that are not left out already.
    pub(crate) fn watch_row(&mut self, row: usize) {
        let (recipe, width) = (self.recipe, self.width);
        let Some(mean) = self.buffers.mean.get(row * width..(row + 1) * width) else {
            return;
        };
        let Some(RowLearning { watched, .. }) = self.buffers.learning.get_mut(row) else {
            return;
        };
        let apart = 2 * recipe.stride;
        let far = |x: usize, other: u16| x.abs_diff(usize::from(other)) > apart;
        let (mut columns, mut sharpest) = ([NONE; WATCHED], [0.0f32; WATCHED]);
        for x in 0..width {
            let Some(sharp) = sharpness(mean, x, &recipe) else {
                continue;
            };
            let value = f32::from(mean.get(x).copied().unwrap_or(0)) / recipe.counts_per_value;
            let matters = sharp * sharp > SHARP * SHARP * recipe.noise.variance(value);
            if !matters || watched.left_out.iter().any(|&other| !far(x, other)) {
                continue;
            }
            let sharp = sharp.abs();
            if far(x, columns[0]) && sharp > sharpest[0] {
                (columns, sharpest) = ([x as u16, columns[0]], [sharp, sharpest[0]]);
            } else if !far(x, columns[0]) && sharp > sharpest[0] {
                (columns[0], sharpest[0]) = (x as u16, sharp);
            } else if far(x, columns[0]) && sharp > sharpest[1] {
                (columns[1], sharpest[1]) = (x as u16, sharp);
            }
        }
        *watched = Watched {
            columns,
            left_out: watched.left_out,
            ..Watched::EMPTY
        };
    }

    /// A line of a row whose picture has moved by `shift_px`, as the rows beside it tell.
    pub(crate) fn watch<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
        to_reference: f32,
    ) {
        let stride = self.recipe.stride;
        let Some(RowLearning { watched, .. }) = self.buffers.learning.get_mut(row) else {
            return;
        };
        // Not true of what is no number.
        let linear = shift_px.abs() <= LINEAR * stride as f32;
        if !linear || watched.columns == [NONE; WATCHED] {
            return;
        }
        watched.frames += 1.0;
        watched.shift += shift_px;
        watched.square += shift_px * shift_px;
        for k in 0..WATCHED {
            let x = usize::from(watched.columns[k]);
            let left = x.checked_sub(stride).and_then(|x| pixels.get(x));
            if let (Some(left), Some(right)) = (left, pixels.get(x + stride)) {
                let difference = f32::from(right.value()) - f32::from(left.value());
                watched.difference[k] += difference * to_reference;
                watched.product[k] += difference * to_reference * shift_px;
            }
        }
    }

    /// Leaves out what did not follow, at the end of a round.
    pub(crate) fn leave_out_still_pixels(&mut self) {
        let (recipe, width) = (self.recipe, self.width);
        let rows = self.buffers.mean.chunks_exact(width);
        for (mean, learning) in rows.zip(self.buffers.learning.iter_mut()) {
            let watched = &mut learning.watched;
            let motion = watched.motion();
            for (column, change) in watched.changes() {
                let x = usize::from(column);
                let Some(sharp) = sharpness(mean, x, &recipe) else {
                    continue;
                };
                let value = f32::from(mean.get(x).copied().unwrap_or(0)) / recipe.counts_per_value;
                // Two pixels' noise.
                let variance = 2.0 * recipe.noise.variance(value);
                let told = sharp * sharp * motion > SURE * SURE * variance;
                let follows = change * sharp > FOLLOWS * sharp * sharp * motion;
                if told && !follows {
                    let free = watched.left_out.iter_mut().find(|other| **other == NONE);
                    if let Some(free) = free {
                        *free = column;
                    }
                }
            }
            watched.columns = [NONE; WATCHED];
        }
    }

    /// Pixels that are left out of a row, and of the rows beside it where both axes are measured.
    pub(super) fn left_out(&self, row: usize) -> [u16; LEFT_OUT] {
        let mut all = [NONE; LEFT_OUT];
        let beside = if self.is_planar() {
            MAX_HALF as isize
        } else {
            0
        };
        let steps = (-beside..=beside).map(|k| k * self.recipe.stride as isize);
        let rows = steps.map(|by| row.checked_add_signed(by));
        for (row, all) in rows.zip(all.chunks_exact_mut(WATCHED)) {
            if let Some(learning) = row.and_then(|row| self.buffers.learning.get(row)) {
                all.copy_from_slice(&learning.watched.left_out());
            }
        }
        all
    }
}

/// Takes the weight of what the band's filter mixes with the pixels left out; `w` begins at column `first`.
pub(super) fn weigh_nothing(w: &mut [f32], first: usize, left_out: &[u16], recipe: &Recipe) {
    let reach = MAX_HALF * recipe.stride;
    for &column in left_out.iter().filter(|&&column| column != NONE) {
        let column = usize::from(column);
        let from = column.saturating_sub(reach).saturating_sub(first);
        let to = (column + reach + 1).saturating_sub(first).min(w.len());
        if let Some(w) = w.get_mut(from..to) {
            w.fill(0.0);
        }
    }
}
