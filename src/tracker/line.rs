//! What becomes of a line.
//!
//! Most lines are taken in a straight line: the picture has moved little, nothing is looked at and nothing else
//! is to be done ([`Tracker::take_quietly`]). All that decides it is settled by the line before, as a row up to
//! which lines are quiet. Whatever is not so, or turns out not to be, is taken with care.

use super::{
    Stage, Tracker,
    correlate::{Unfound, part},
    flicker::Flicker,
    predict::Prediction,
    row::{Row, Scattered, Summed},
};
use crate::{
    camera::{Line, UpperBytes},
    kernel,
    pixel::Pixel,
    reference::RowTable,
};

/// A line that was looked at and is further than this from where it was expected has jumped, px.
const JUMP_PX: f32 = 1.0;

/// Where a line is against the reference, and what it knows of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) shift_px: f32,
    pub(super) information_per_px2: f32,
}

/// Why a line has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    Learning,
    NoTexture,
    Disturbed,
    Misfit,
}

/// Which lines are taken in a straight line: rows of this frame below this one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quiet {
    frame: u32,
    until_row: u16,
}

impl Quiet {
    /// None.
    pub(super) fn end(&mut self) {
        self.until_row = 0;
    }
}

/// Σ h·p and Σ p of a line, where they were taken.
type Sums = Option<(f32, f32)>;

impl Tracker<'_> {
    /// Takes one line.
    #[inline(always)]
    pub(super) fn take<R: Row>(&mut self, line: &Line<'_>, pixels: R) -> Result<Place, Left> {
        self.take_quietly(line, &pixels)
            .or_else(|sums| self.take_with_care(line, pixels, sums))
    }

    /// Takes one whose pixels do not lie side by side. They are lent: a copy would read as one what was just written
    /// in parts, and wait for it.
    #[inline(always)]
    pub(super) fn take_scattered(
        &mut self,
        line: &Line<'_>,
        upper: &UpperBytes<'_>,
    ) -> Result<Place, Left> {
        self.take_quietly(line, upper)
            .or_else(|sums| self.take_scattered_with_care(line, upper, sums))
    }

    #[inline(never)]
    fn take_scattered_with_care(
        &mut self,
        line: &Line<'_>,
        upper: &UpperBytes<'_>,
        sums: Sums,
    ) -> Result<Place, Left> {
        let room = core::mem::take(&mut self.room);
        let place = match Scattered::new(*upper, self.config.kernel, &mut *room) {
            Some(row) => self.take_with_care(line, row, sums),
            None => Err(self.misfit()),
        };
        self.room = room;
        place
    }

    /// What every line takes. Nothing has changed where it is refused.
    #[inline(always)]
    fn take_quietly<R: Summed>(&mut self, line: &Line<'_>, pixels: &R) -> Result<Place, Sums> {
        if line.row >= self.quiet.until_row
            || line.frame != self.quiet.frame
            || pixels.len() != usize::from(self.config.width)
        {
            return Err(None);
        }
        let row = usize::from(line.row);
        let expected = self.prediction.rest_px();
        let (Some(table), Some(coefficients)) = (
            self.storage.tables.get(row),
            part(self.storage.coefficients, row, pixels.len()),
        ) else {
            return Err(None);
        };
        if !table.has_texture() || expected.abs() >= self.half_step_px {
            return Err(None);
        }
        let (product, sum) = pixels.sums(self.config.kernel, coefficients);
        let (before, now) = (self.to_reference, table.factor_to_reference(sum));
        let shift_px = table.shift_px(product * now);
        let surprise = shift_px - expected;
        // Neither is true of what is no number.
        let small = shift_px.abs() <= self.near_px && Prediction::is_small(surprise);
        if !small || !Flicker::is_plausible(before, now) {
            return Err(Some((product, sum)));
        }
        let information_per_px2 = table.information_per_px2();
        self.to_reference = now;
        self.flicker.add_settled(before, now);
        self.prediction.add_at_rest(surprise, information_per_px2);
        self.counts.measured = self.counts.measured.wrapping_add(1);
        Ok(Place {
            shift_px: shift_px + self.follow.anchor_px(),
            information_per_px2,
        })
    }

    /// Everything that a line may come to.
    #[inline(never)]
    fn take_with_care<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
    ) -> Result<Place, Left> {
        let row = usize::from(line.row);
        if line.row >= self.config.rows || pixels.len() != usize::from(self.config.width) {
            return Err(self.misfit());
        }
        if self.frame != Some(line.frame) {
            self.next_frame(line.frame, line.start_ns);
        }
        let mut aside_px = 0.0;
        if self.beside && self.stage == Stage::Tracking {
            aside_px = self.work_beside::<R::P>(row);
        }
        let found = self.locate(row, &mut pixels, aside_px, sums);
        if self.stage != Stage::Tracking {
            self.counts.learning = self.counts.learning.wrapping_add(1);
            self.learn(row, pixels.pixels(), found);
            return Err(Left::Learning);
        }
        self.settle_quiet(line.frame);
        let counts = &mut self.counts;
        let count = match found {
            Ok(_) => &mut counts.measured,
            Err(Left::Disturbed) => &mut counts.disturbed,
            Err(_) => &mut counts.no_texture,
        };
        *count = count.wrapping_add(1);
        found.map(|place| Place {
            shift_px: place.shift_px + self.follow.anchor_px(),
            ..place
        })
    }

    fn misfit(&mut self) -> Left {
        self.counts.misfit = self.counts.misfit.wrapping_add(1);
        Left::Misfit
    }

    /// Which lines will be quiet, after one that was not: none while something is done beside them, while the
    /// motion is swift, and at the beginning of a frame.
    fn settle_quiet(&mut self, frame: u32) {
        let quiet = !self.beside && self.prediction.is_at_rest() && self.flicker.is_settled();
        let rows = usize::from(self.config.rows);
        self.quiet = Quiet {
            frame,
            until_row: if quiet {
                self.attend.min(rows) as u16
            } else {
                0
            },
        };
    }

    /// What is done beside a line, when there is something. Returns by how much the row's reference lies to
    /// the left of the others', px.
    #[cold]
    #[inline(never)]
    fn work_beside<P: Pixel>(&mut self, row: usize) -> f32 {
        // A line that will be looked at has enough to do.
        let idle = row < self.attend;
        let aside_px = if idle || self.follow.is_moving() || !self.is_hurried() {
            self.follow_one_step::<P>(row)
        } else {
            0.0
        };
        if let Some(start_px) = self.start_px() {
            self.prediction.suppose(start_px);
        }
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        aside_px
    }

    #[cold]
    fn next_frame(&mut self, frame: u32, start_ns: i64) {
        if self.stage == Stage::Tracking {
            if self.watch.end_frame(start_ns) {
                self.counts.relearned = self.counts.relearned.saturating_add(1);
                self.relearn();
            } else {
                self.follow_drift();
            }
        } else if self.frame.is_some() && self.frames_in_stage >= self.config.learn_frames {
            self.end_round();
        }
        if self.stage == Stage::Rough && self.frames_in_stage.is_power_of_two() {
            self.settle_noise();
        }
        self.frames_in_stage = self.frames_in_stage.saturating_add(1);
        self.frame = Some(frame);
        self.turn = self.turn_of(frame);
        self.prediction
            .begin_frame(start_ns, self.stage != Stage::Rough);
        self.watch.begin_frame(frame);
        self.attend = 0;
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        self.flicker.begin_frame();
    }

    /// Place of a line against the reference, whose row lies `aside_px` to the left of the others.
    fn locate<R: Row>(
        &mut self,
        row: usize,
        pixels: &mut R,
        aside_px: f32,
        sums: Sums,
    ) -> Result<Place, Left> {
        let Some(&table) = self.storage.tables.get(row) else {
            return Err(Left::NoTexture);
        };
        if !table.has_texture() {
            self.note_light(row, &table, pixels);
            return Err(Left::NoTexture);
        }
        let information_per_px2 = table.information_per_px2();
        let expected = self.prediction.at(row) + aside_px;
        let before = self.to_reference;
        let mut shift_px = match self.correlate(row, &table, pixels, expected, sums) {
            Ok(shift_px) => shift_px,
            Err(Unfound::NoNumber) => return Err(Left::NoTexture),
            Err(Unfound::Unfinished(shift_px)) => {
                self.leave(shift_px - aside_px);
                return Err(Left::Disturbed);
            }
        };
        let surprise = shift_px - expected;
        let due = row >= self.attend
            || surprise * surprise * information_per_px2 > 49.0 + information_per_px2
            || !Flicker::is_plausible(before, self.to_reference);
        let mut jumped = false;
        if due {
            // A swift picture must be found anew after a gap, and a row that knows so little could take any
            // place for it.
            if self.prediction.needs_more_than(information_per_px2) {
                return Err(Left::NoTexture);
            }
            let Some(looked) = self.look_and_follow(row, &table, pixels.pixels(), shift_px) else {
                return Err(Left::Disturbed);
            };
            shift_px = looked;
            jumped = (shift_px - expected).abs() > JUMP_PX;
        }
        if self.prediction.is_swift() && aside_px == 0.0 {
            shift_px = self.unsmear(row, &table, pixels.pixels(), shift_px);
        }
        shift_px -= aside_px;
        if jumped {
            self.prediction.jump(row, shift_px, information_per_px2);
        } else {
            self.prediction.add(row, shift_px, information_per_px2);
        }
        self.flicker.add(before, self.to_reference);
        Ok(Place {
            shift_px,
            information_per_px2,
        })
    }

    /// A row without texture tells of the light too, where it is neither dark nor near to being clipped.
    fn note_light<R: Row>(&mut self, row: usize, table: &RowTable, pixels: &R) {
        let mean = table.pixel_sum() / f32::from(self.config.width);
        let (dark, bright) = (self.recipe.saturation / 16.0, self.recipe.saturation * 0.6);
        if !(dark..bright).contains(&mean) {
            return;
        }
        if let Some((_, sum)) = self.sums(row, pixels) {
            let before = core::mem::replace(&mut self.to_reference, table.factor_to_reference(sum));
            self.flicker.add(before, self.to_reference);
        }
    }

    /// What becomes of a line that is looked at; its shift, unless it is disturbed.
    #[cold]
    fn look_and_follow<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<f32> {
        let looked = self.look(row, table, pixels, shift_px);
        if let Some(shift_px) = looked
            && self.turn == row
        {
            self.follow_row(row, pixels, shift_px);
        }
        self.attend = self.watch.next_due(row);
        if self.turn > row {
            self.attend = self.attend.min(self.turn);
        }
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        // Some ten microseconds before it is read: between two looks at a row, 32 frames have been through the caches.
        let width = usize::from(self.config.width);
        let mean = self.storage.mean.get(self.attend * width..);
        kernel::ask_for(mean.and_then(|m| m.get(..width)).unwrap_or_default());
        looked
    }
}
