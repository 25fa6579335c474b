//! The sequence that a line goes through.
//!
//! Most lines take the fast path: the picture has moved little, nothing is checked and there is no background
//! job ([`Tracker::take_fast`]). The line before settles which lines those are, as the row up to which the fast
//! path goes. Any other line, and one that turns out to be unlike them, takes the slow path.

use super::{
    Bins, Stage, Tracker,
    correlate::Sums,
    predict::Prediction,
    print,
    row::{Row, Scattered, Summed},
    schedule::{FastPath, FastRows},
    vetting::UNLIT,
};
use crate::{
    camera::pixel::Pixel,
    camera::{Line, UpperBytes},
};

/// A check takes as long as this many inner products of a line that is read at another whole pixel. A line that took so many
/// has no time for a background job where a line time is short.
pub(super) const PRODUCTS_OF_A_CHECK: u8 = 2;

/// Where a line is against the reference, and what it knows of that.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Place {
    /// Where the reference has been moved to ([`Store::anchor_px`](crate::reference::Store::anchor_px)) comes on top.
    pub(super) shift_px: f32,
    pub(super) information_per_px2: f32,
}

/// A line on the fast path.
#[derive(Clone, Copy, Debug)]
struct Measured {
    shift_px: f32,
    /// How far from where it was expected.
    surprise_px: f32,
    /// The factor that brings it to its reference's brightness.
    to_reference: f32,
    information_per_px2: f32,
    print: u32,
}

/// Why a line was not measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rejected {
    Learning,
    NoTexture,
    Occluded,
    /// Too dark beside its reference.
    Unlit,
    /// A copy of the frame before.
    Repeated,
    Misfit,
}

impl Tracker<'_> {
    /// Takes one line, whatever comes of it.
    #[inline(always)]
    pub(super) fn take<R: Row>(&mut self, line: &Line<'_>, pixels: R) -> Result<Place, Rejected> {
        match self.take_fast(line, &pixels, true) {
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
    ) -> Result<Place, Rejected> {
        match self.take_fast(line, upper, true) {
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
    ) -> Result<Place, Rejected> {
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
        to: Bins<'_>,
    ) -> bool {
        let room = core::mem::take(&mut self.room);
        let complete = match Scattered::new(*upper, self.config.kernel, &mut *room) {
            Some(row) => self.take_otherwise_into(line, row, sums, to),
            None => {
                self.misfit();
                false
            }
        };
        self.room = room;
        complete
    }

    /// Takes a line that was not on the fast path; apart from those that are, so that their outcome stays in registers.
    #[inline(never)]
    fn take_otherwise<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
    ) -> Result<Place, Rejected> {
        if let Some(place) = self.take_fast_planar(line, &pixels, true) {
            self.work_after_fast::<R::P>(line);
            return Ok(place);
        }
        match self.take_with_background(line, &mut pixels, sums, true) {
            Ok(place) => Ok(place),
            Err(sums) => self.take_slow(line, pixels, sums),
        }
    }

    /// [`Tracker::take_otherwise`], and what it measures is passed on.
    #[inline(never)]
    pub(super) fn take_otherwise_into<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
        to: Bins<'_>,
    ) -> bool {
        if self.take_fast_planar(line, &pixels, false).is_some() {
            self.work_after_fast::<R::P>(line);
            return self.pass_on_planar(line, to);
        }
        let place = match self.take_with_background(line, &mut pixels, sums, false) {
            Ok(place) => place,
            Err(sums) => match self.take_slow(line, pixels, sums) {
                Ok(place) => place,
                Err(_) => return false,
            },
        };
        if self.store.is_planar() {
            return self.pass_on_planar(line, to);
        }
        self.pass_on(line, place, self.curvature(), to)
    }

    /// What every line takes. Nothing has changed where it is refused. `times`: how late it was exposed is asked
    /// afterwards.
    #[inline(always)]
    pub(super) fn take_fast<R: Summed>(
        &mut self,
        line: &Line<'_>,
        pixels: &R,
        times: bool,
    ) -> Result<Place, Sums> {
        if !self.schedule.fast_path.has(line) {
            return Err(None);
        }
        self.take_expected(line, pixels, times)
    }

    /// [`Tracker::take_fast`] of a line that is expected to take the fast path.
    #[inline(always)]
    pub(super) fn take_expected<R: Summed>(
        &mut self,
        line: &Line<'_>,
        pixels: &R,
        times: bool,
    ) -> Result<Place, Sums> {
        if pixels.len() != self.store.width() {
            return Err(None);
        }
        let row = usize::from(line.row);
        let measured = self.measure_fast(row, pixels)?;
        if !self.store.replace_print(row, measured.print) {
            // The same line again.
            return Err(None);
        }
        Ok(self.accept(measured, times))
    }

    /// What a line comes to where the picture has moved little; the light as it was with the line before is still there.
    #[inline(always)]
    fn measure_fast<R: Summed>(&self, row: usize, pixels: &R) -> Result<Measured, Sums> {
        let Some(table) = self.store.table(row) else {
            return Err(None);
        };
        let Some(coefficients) = self.store.coefficients(row) else {
            return Err(None);
        };
        let (product, sum) = pixels.sums(self.store.recipe().kernel, coefficients);
        if !table.has_texture() {
            return Err(Some((product, sum)));
        }
        let print = print::of_sums((product, sum));
        let to_reference = table.factor_to_reference(sum);
        let shift_px = table.shift_px(product * to_reference);
        let surprise_px = shift_px - self.prediction.predicted_px();
        // Neither is true of what is no number.
        let small = shift_px.abs() <= self.correlator.near_px && Prediction::is_small(surprise_px);
        if !small || !self.light.may_become(to_reference) {
            return Err(Some((product, sum)));
        }
        Ok(Measured {
            shift_px,
            surprise_px,
            to_reference,
            information_per_px2: table.information_per_px2(),
            print,
        })
    }

    #[inline(always)]
    fn accept(&mut self, measured: Measured, times: bool) -> Place {
        let Measured {
            shift_px,
            surprise_px,
            to_reference,
            information_per_px2,
            ..
        } = measured;
        if times {
            self.light.add_settled(to_reference);
        }
        self.light.to_reference = to_reference;
        self.prediction
            .add_at_rest(surprise_px, information_per_px2);
        self.counts.measured = self.counts.measured.wrapping_add(1);
        Place {
            shift_px,
            information_per_px2,
        }
    }

    /// A line that would be on the fast path but for a check or a background job. Where it is refused nothing
    /// but that job has changed.
    #[inline(always)]
    fn take_with_background<R: Row>(
        &mut self,
        line: &Line<'_>,
        pixels: &mut R,
        sums: Sums,
        times: bool,
    ) -> Result<Place, Sums> {
        let at_rest = line.row < self.schedule.fast_path.background_until_row
            && line.frame == self.schedule.fast_path.frame;
        if !at_rest || sums.is_some() || pixels.len() != usize::from(self.config.width) {
            return Err(sums);
        }
        let row = usize::from(line.row);
        let measured = self.measure_fast(row, pixels)?;
        if !self.store.replace_print(row, measured.print) {
            return Err(None);
        }
        self.correlator.products = 0;
        if row >= self.schedule.next_check {
            let before = core::mem::replace(&mut self.light.to_reference, measured.to_reference);
            let fits = self.fits(row, pixels.pixels(), measured.shift_px);
            self.light.to_reference = before;
            if !fits {
                return Err(None);
            }
            self.note_fit(true);
            self.after_check([row, row], pixels.pixels(), Some(measured.shift_px));
        } else if self.schedule.background {
            // The reference is not being moved.
            self.work_in_background::<R::P>(row);
        }
        let place = self.accept(measured, times);
        self.settle_fast_path(line);
        Ok(place)
    }

    /// Everything that a line may come to.
    #[inline(never)]
    fn take_slow<R: Row>(
        &mut self,
        line: &Line<'_>,
        mut pixels: R,
        sums: Sums,
    ) -> Result<Place, Rejected> {
        let row = usize::from(line.row);
        if line.row >= self.config.rows || pixels.len() != usize::from(self.config.width) {
            return Err(self.misfit());
        }
        if self.frame != Some(line.frame) {
            self.next_frame(line.frame, line.start_ns);
        }
        let mut aside_px = 0.0;
        let in_background = self.schedule.background && self.stage == Stage::Tracking;
        // Then how much time there is is known only afterwards.
        let afterwards = in_background && self.is_hurried();
        if afterwards {
            aside_px = self.store.aside_px(row);
            self.search_elsewhere();
        } else if in_background {
            aside_px = self.work_in_background::<R::P>(row);
        }
        // A line that will be checked has enough to do.
        let idle = row < self.schedule.next_check;
        self.correlator.products = 0;
        let found = self.locate(row, &mut pixels, aside_px, sums);
        if afterwards
            && self.correlator.products < PRODUCTS_OF_A_CHECK
            && (idle || self.store.is_moving())
        {
            let columns = self.config.columns_per_line;
            let fewer = if self.correlator.products > 0 {
                columns / 4
            } else {
                0
            };
            self.store.advance_background::<R::P>(row, columns - fewer);
            self.schedule.background = self.store.is_busy() || self.check.is_searching();
        }
        if self.stage != Stage::Tracking {
            self.counts.learning = self.counts.learning.wrapping_add(1);
            let row = match self.store.is_planar() {
                true => self.planar.read_row(),
                false => Some(row),
            };
            if let Some(row) = row {
                self.learn(row, pixels.pixels(), found);
            }
            return Err(Rejected::Learning);
        }
        self.settle_fast_path(line);
        let counts = &mut self.counts;
        let count = match found {
            Ok(_) => &mut counts.measured,
            Err(Rejected::Occluded) => &mut counts.occluded,
            Err(Rejected::Unlit) => &mut counts.unlit,
            Err(Rejected::Repeated) => &mut counts.repeated,
            Err(_) => &mut counts.no_texture,
        };
        *count = count.wrapping_add(1);
        found
    }

    fn misfit(&mut self) -> Rejected {
        self.counts.misfit = self.counts.misfit.wrapping_add(1);
        Rejected::Misfit
    }

    /// Which lines will be on the fast path, after one that was not: none while there is a background job, while the
    /// motion is swift, and at the beginning of a frame.
    fn settle_fast_path(&mut self, line: &Line<'_>) {
        // Where lines are expected then stays between the shifts of those before, none of which is further than `near_px`.
        let near = self.prediction.predicted_px().abs() < self.correlator.here_px
            && self.light.to_reference <= UNLIT;
        let unhindered = !self.store.is_moving() && !self.check.is_searching();
        let at_rest = unhindered && self.prediction.is_at_rest() && self.light.is_settled() && near;
        let (frame, rows) = (line.frame, usize::from(self.config.rows));
        self.schedule.fast_path = FastPath {
            frame,
            until_row: if at_rest && !self.schedule.background {
                self.schedule.fast_until(line.row, rows)
            } else {
                0
            },
            background_until_row: if at_rest { rows as u16 } else { 0 },
        };
        if self.store.is_planar() {
            self.planar.fast = FastRows {
                frame,
                until_row: match self.planar.is_here() {
                    true => self.schedule.fast_path.background_until_row,
                    false => 0,
                },
            };
            self.schedule.fast_path.end();
        }
    }

    /// The background job of a line, where there is one. Returns by how much the row's reference lies to
    /// the left of the others', px.
    #[cold]
    #[inline(never)]
    fn work_in_background<P: Pixel>(&mut self, row: usize) -> f32 {
        let aside_px = self
            .store
            .advance_background::<P>(row, self.config.columns_per_line);
        self.search_elsewhere();
        self.schedule.background = self.store.is_busy() || self.check.is_searching();
        aside_px
    }

    /// The background job of a line that took the fast path of both axes: the reference is not being moved.
    #[inline(always)]
    fn work_after_fast<P: Pixel>(&mut self, line: &Line<'_>) {
        if self.schedule.background {
            self.work_in_background::<P>(usize::from(line.row));
            if self.store.is_moving() {
                self.planar.fast = FastRows::default();
            }
        }
    }

    /// A lost line is searched for at the next start.
    fn search_elsewhere(&mut self) {
        if let Some(start_px) = self.start_px() {
            self.prediction.suppose(start_px);
        }
    }
}
