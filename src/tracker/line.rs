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
    camera::pixel::Pixel,
    camera::{Line, UpperBytes},
    kernel,
    reference::RowTable,
    timeline::{Binner, Sample},
};

/// A line that was looked at and is further than this from where it was expected has jumped, px.
const JUMP_PX: f32 = 1.0;

/// Inner products of a line that is read at another whole pixel, beside which nothing else can be done where a line time is short; a look takes as
/// long.
const MUCH: u8 = 2;

/// Where a line is against the reference, and what it knows of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Where the reference has been moved to ([`Follow::anchor_px`](super::follow::Follow::anchor_px)) comes on top.
    pub(super) shift_px: f32,
    pub(super) information_per_px2: f32,
}

/// A quiet line.
#[derive(Clone, Copy, Debug)]
struct Measured {
    shift_px: f32,
    /// How far from where it was expected.
    surprise_px: f32,
    /// The factor that brings it to its reference's brightness.
    to_reference: f32,
    information_per_px2: f32,
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
    /// Those below this one would be, but that they are looked at or that something is done beside them.
    calm_until_row: u16,
}

impl Quiet {
    /// None.
    pub(super) fn end(&mut self) {
        self.until_row = 0;
        self.calm_until_row = 0;
    }
}

/// Σ h·p and Σ p of a line, where they were taken.
pub(super) type Sums = Option<(f32, f32)>;

impl Tracker<'_> {
    /// Takes one line, whatever comes of it.
    #[inline(always)]
    pub(super) fn take<R: Row>(&mut self, line: &Line<'_>, pixels: R) -> Result<Place, Left> {
        match self.take_quietly(line, &pixels, true) {
            Ok(place) => Ok(place),
            Err(sums) => self.take_otherwise(line, pixels, sums),
        }
    }

    /// Takes one whose pixels do not lie side by side. They are lent: a copy would read as one what was just written
    /// in parts, and wait for it.
    #[inline(always)]
    pub(super) fn take_scattered(
        &mut self,
        line: &Line<'_>,
        upper: &UpperBytes<'_>,
    ) -> Result<Place, Left> {
        match self.take_quietly(line, upper, true) {
            Ok(place) => Ok(place),
            Err(sums) => self.take_scattered_otherwise(line, upper, sums),
        }
    }

    #[inline(never)]
    fn take_scattered_otherwise(
        &mut self,
        line: &Line<'_>,
        upper: &UpperBytes<'_>,
        sums: Sums,
    ) -> Result<Place, Left> {
        let room = core::mem::take(&mut self.room);
        let place = match Scattered::new(*upper, self.config.kernel, &mut *room) {
            Some(row) => self.take_otherwise(line, row, sums),
            None => Err(self.misfit()),
        };
        self.room = room;
        place
    }

    #[inline(never)]
    pub(super) fn take_scattered_otherwise_into(
        &mut self,
        line: &Line<'_>,
        upper: &UpperBytes<'_>,
        sums: Sums,
        binner: &mut Binner,
    ) -> Option<Sample> {
        let room = core::mem::take(&mut self.room);
        let sample = match Scattered::new(*upper, self.config.kernel, &mut *room) {
            Some(row) => self.take_otherwise_into(line, row, sums, binner),
            None => {
                self.misfit();
                None
            }
        };
        self.room = room;
        sample
    }

    /// Takes a line that was not quiet; apart from those that are, so that what they come to stays in registers.
    #[inline(never)]
    fn take_otherwise<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
    ) -> Result<Place, Left> {
        match self.take_calmly(line, &mut pixels, sums, true) {
            Ok(place) => Ok(place),
            Err(sums) => self.take_with_care(line, pixels, sums),
        }
    }

    /// [`Tracker::take_otherwise`], and what it measures is passed on.
    #[inline(never)]
    pub(super) fn take_otherwise_into<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
        binner: &mut Binner,
    ) -> Option<Sample> {
        let place = match self.take_calmly(line, &mut pixels, sums, false) {
            Ok(place) => place,
            Err(sums) => self.take_with_care(line, pixels, sums).ok()?,
        };
        self.pass_on(line, place, self.curvature(), binner)
    }

    /// What every line takes. Nothing has changed where it is refused. `times`: how late it was exposed is asked
    /// afterwards.
    #[inline(always)]
    pub(super) fn take_quietly<R: Summed>(
        &mut self,
        line: &Line<'_>,
        pixels: &R,
        times: bool,
    ) -> Result<Place, Sums> {
        let quiet = line.row < self.quiet.until_row
            && line.frame == self.quiet.frame
            && pixels.len() == usize::from(self.config.width);
        if !quiet {
            return Err(None);
        }
        let quiet = self.measure_quietly(usize::from(line.row), pixels)?;
        Ok(self.accept(quiet, times))
    }

    /// What a line comes to where the picture has moved little; the light as it was with the line before is still there.
    #[inline(always)]
    fn measure_quietly<R: Summed>(&self, row: usize, pixels: &R) -> Result<Measured, Sums> {
        let (Some(table), Some(coefficients)) = (
            self.storage.tables.get(row),
            part(
                self.storage.coefficients,
                row,
                usize::from(self.config.width),
            ),
        ) else {
            return Err(None);
        };
        if !table.has_texture() {
            return Err(None);
        }
        let (product, sum) = pixels.sums(self.config.kernel, coefficients);
        let to_reference = table.factor_to_reference(sum);
        let shift_px = table.shift_px(product * to_reference);
        let surprise_px = shift_px - self.prediction.rest_px();
        // Neither is true of what is no number.
        let small = shift_px.abs() <= self.near_px && Prediction::is_small(surprise_px);
        if !small || !Flicker::is_plausible(self.to_reference, to_reference) {
            return Err(Some((product, sum)));
        }
        Ok(Measured {
            shift_px,
            surprise_px,
            to_reference,
            information_per_px2: table.information_per_px2(),
        })
    }

    #[inline(always)]
    fn accept(&mut self, measured: Measured, times: bool) -> Place {
        let Measured {
            shift_px,
            surprise_px,
            to_reference,
            information_per_px2,
        } = measured;
        if times {
            self.flicker.add_settled(self.to_reference, to_reference);
        }
        self.to_reference = to_reference;
        self.prediction
            .add_at_rest(surprise_px, information_per_px2);
        self.counts.measured = self.counts.measured.wrapping_add(1);
        Place {
            shift_px,
            information_per_px2,
        }
    }

    /// A line that would be quiet, but that it is looked at or that something is done beside it. Where it is refused nothing
    /// has changed but that.
    #[inline(always)]
    fn take_calmly<R: Row>(
        &mut self,
        line: &Line<'_>,
        pixels: &mut R,
        sums: Sums,
        times: bool,
    ) -> Result<Place, Sums> {
        let calm = line.row < self.quiet.calm_until_row && line.frame == self.quiet.frame;
        if !calm || sums.is_some() || pixels.len() != usize::from(self.config.width) {
            return Err(sums);
        }
        let row = usize::from(line.row);
        let measured = self.measure_quietly(row, pixels)?;
        self.effort = 0;
        if row >= self.attend {
            let before = core::mem::replace(&mut self.to_reference, measured.to_reference);
            let fits = self.fits(row, pixels.pixels(), measured.shift_px);
            self.to_reference = before;
            if !fits {
                return Err(None);
            }
            self.note_fit(true);
            self.after_look(row, pixels.pixels(), Some(measured.shift_px));
        } else if self.beside {
            // The reference is not being moved.
            self.work_beside::<R::P>(row);
        }
        let place = self.accept(measured, times);
        self.settle_quiet(line.frame);
        Ok(place)
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
        let beside = self.beside && self.stage == Stage::Tracking;
        // Then how much time there is is known only afterwards.
        let afterwards = beside && self.is_hurried();
        if afterwards {
            aside_px = self.follow.aside_px(row);
            self.look_elsewhere();
        } else if beside {
            aside_px = self.work_beside::<R::P>(row);
        }
        // A line that will be looked at has enough to do.
        let idle = row < self.attend;
        self.effort = 0;
        let found = self.locate(row, &mut pixels, aside_px, sums);
        if afterwards && self.effort < MUCH && (idle || self.follow.is_moving()) {
            let columns = self.config.columns_per_line;
            let fewer = if self.effort > 0 { columns / 4 } else { 0 };
            self.follow_one_step::<R::P>(row, columns - fewer);
            self.beside = self.follow.is_busy() || self.watch.is_searching();
        }
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
        found
    }

    fn misfit(&mut self) -> Left {
        self.counts.misfit = self.counts.misfit.wrapping_add(1);
        Left::Misfit
    }

    /// Which lines will be quiet, after one that was not: none while something is done beside them, while the
    /// motion is swift, and at the beginning of a frame.
    fn settle_quiet(&mut self, frame: u32) {
        // Where lines are expected then stays between the shifts of those before, none of which is further than `near_px`.
        let near = self.prediction.rest_px().abs() < self.here_px;
        let undisturbed = !self.follow.is_moving() && !self.watch.is_searching();
        let calm = undisturbed && self.prediction.is_at_rest() && self.flicker.is_settled() && near;
        let rows = usize::from(self.config.rows);
        self.quiet = Quiet {
            frame,
            until_row: if calm && !self.beside {
                self.attend.min(rows) as u16
            } else {
                0
            },
            calm_until_row: if calm { rows as u16 } else { 0 },
        };
    }

    /// What is done beside a line, when there is something. Returns by how much the row's reference lies to
    /// the left of the others', px.
    #[cold]
    #[inline(never)]
    fn work_beside<P: Pixel>(&mut self, row: usize) -> f32 {
        let aside_px = self.follow_one_step::<P>(row, self.config.columns_per_line);
        self.look_elsewhere();
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        aside_px
    }

    /// A lost line is looked for where it is its turn.
    fn look_elsewhere(&mut self) {
        if let Some(start_px) = self.start_px() {
            self.prediction.suppose(start_px);
        }
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
        #[cfg(feature = "long-exposure")]
        self.paths
            .begin_frame(start_ns, self.stage == Stage::Refining);
        #[cfg(feature = "long-exposure")]
        self.look_ahead();
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
        // After two inner products there is no time for it where it is but its turn; the next one will do.
        let in_turn = row >= self.attend
            && (self.effort < MUCH || !self.is_hurried() || self.watch.is_uneasy());
        let due = in_turn
            || surprise * surprise * information_per_px2 > 49.0 + information_per_px2
            || !Flicker::is_plausible(before, self.to_reference);
        let mut jumped = false;
        if due {
            // A swift picture must be found anew after a gap, and a row that knows so little could take any
            // place for it.
            if self.prediction.needs_more_than(information_per_px2) {
                return Err(Left::NoTexture);
            }
            let looked = self.look_and_follow(row, &table, pixels.pixels(), shift_px);
            self.effort = self.effort.saturating_add(MUCH);
            let Some(looked) = looked else {
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
        let columns = self.config.kernel.light_columns(self.config.width);
        let mean = table.pixel_sum() / f32::from(columns);
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
        self.after_look(row, pixels, looked);
        looked
    }

    /// `looked`: the shift of a line that was found to fit.
    fn after_look<P: Pixel>(&mut self, row: usize, pixels: &[P], looked: Option<f32>) {
        if let Some(shift_px) = looked
            && self.turn == row
        {
            self.follow_row(row, pixels, shift_px);
        }
        self.attend = self.watch.next_due(row, self.is_hurried());
        if self.turn > row {
            self.attend = self.attend.min(self.turn);
        }
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        // Some ten microseconds before it is read: between two looks at a row, 32 frames have been through the caches.
        let width = usize::from(self.config.width);
        let mean = self.storage.mean.get(self.attend * width..);
        kernel::ask_for(mean.and_then(|m| m.get(..width)).unwrap_or_default());
    }
}
