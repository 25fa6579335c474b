//! Where a line is against its row of the reference: found, checked, and corrected for its own smear.

use super::{
    Stage, Tracker,
    correlate::{Sums, Unfound, whole_sums},
    line::{PRODUCTS_OF_A_CHECK, Place, Rejected},
    print,
    row::Row,
    vetting::UNLIT,
};
use crate::{camera::pixel::Pixel, kernel, reference::RowTable};

/// A line that was checked and is further than this from where it was expected has jumped, px.
const JUMP_PX: f32 = 1.0;

impl Tracker<'_> {
    /// Place of a line against the reference, whose row lies `aside_px` to the left of the others.
    pub(super) fn locate<R: Row>(
        &mut self,
        place: usize,
        pixels: &mut R,
        aside_px: f32,
        sums: Sums,
    ) -> Result<Place, Rejected> {
        let row = match self.store.is_planar() {
            true => self.reference_row(place, pixels.pixels()),
            false => Some(place),
        };
        let Some(row) = row else {
            return Err(Rejected::NoTexture);
        };
        let Some(&table) = self.store.table(row) else {
            return Err(Rejected::NoTexture);
        };
        if !table.has_texture() {
            if self.store.is_planar() {
                let found = self.locate_down([place, row], &table, pixels, aside_px);
                if found != Err(Rejected::NoTexture) {
                    return found;
                }
            }
            // The first frame's rows have none yet, but may be delivered twice.
            if self.stage == Stage::Rough && self.is_repeated(row, pixels, None) {
                return Err(Rejected::Repeated);
            }
            self.note_light(row, &table, pixels, sums);
            return Err(Rejected::NoTexture);
        }
        let information_per_px2 = table.information_per_px2();
        let expected = self.prediction.at(place) + aside_px;
        let sums = if expected.abs() < self.correlator.here_px {
            sums.or_else(|| whole_sums(&self.store, row, pixels))
        } else {
            None
        };
        if self.is_repeated(row, pixels, sums) {
            return Err(Rejected::Repeated);
        }
        if self.store.is_planar() {
            self.begin_planar(row, pixels.pixels(), expected);
        }
        let before = self.light.to_reference;
        let mut shift_px = match self.correlate(row, pixels, expected, sums) {
            Ok(shift_px) => shift_px,
            Err(Unfound::NoNumber) => return Err(Rejected::NoTexture),
            Err(Unfound::Unfinished(shift_px)) => {
                self.reject_unfinished(shift_px - aside_px);
                return Err(Rejected::Occluded);
            }
        };
        if self.light.to_reference > UNLIT {
            self.light.to_reference = before;
            return Err(Rejected::Unlit);
        }
        let surprise = shift_px - expected;
        // After two inner products there is no time for it where it is but its turn; the next one will do.
        let in_turn = place >= self.schedule.next_check
            && (self.correlator.products < PRODUCTS_OF_A_CHECK
                || !self.is_hurried()
                || self.check.checks_every_line());
        let due = in_turn
            || surprise * surprise * information_per_px2 > 49.0 + information_per_px2
            || !self.light.may_have_been(before);
        let mut jumped = false;
        if due {
            // A swift picture must be found again after a gap, and a row that knows so little could take any
            // place for it.
            if self.prediction.needs_more_than(information_per_px2) {
                return Err(Rejected::NoTexture);
            }
            let checked = self.check_and_follow([place, row], pixels.pixels(), shift_px);
            self.correlator.products = self.correlator.products.saturating_add(PRODUCTS_OF_A_CHECK);
            let Some(checked) = checked else {
                return Err(Rejected::Occluded);
            };
            shift_px = checked;
            jumped = (shift_px - expected).abs() > JUMP_PX;
            if jumped && !self.may_jump(row, pixels.pixels(), shift_px, expected) {
                self.note_fit(false);
                return Err(Rejected::Occluded);
            }
        }
        if self.prediction.is_swift() && aside_px == 0.0 && place == row {
            shift_px = self.unsmear(row, &table, pixels.pixels(), shift_px);
        }
        if self.store.is_planar() {
            shift_px = self.measure_down(row, &table, pixels.pixels(), shift_px, aside_px)?;
        }
        shift_px -= aside_px;
        if jumped {
            self.prediction.jump(place, shift_px, information_per_px2);
        } else {
            self.prediction.add(place, shift_px, information_per_px2);
        }
        self.light.add_since(before);
        Ok(Place {
            shift_px,
            information_per_px2,
        })
    }

    /// A line that lies far from where the rows before it led may have been read at a false place: noise, a codec's
    /// blocks or another edge may fit nearly as well. The rows below would inherit that, so it must fit much better.
    #[cold]
    fn may_jump<P: Pixel>(&self, row: usize, pixels: &[P], to_px: f32, from_px: f32) -> bool {
        if !self.prediction.is_sure() || self.stage == Stage::Rough {
            return true;
        }
        match (
            self.residual(row, pixels, to_px),
            self.residual(row, pixels, from_px),
        ) {
            (Some(there), Some(here)) => there.is_better_than(&here),
            _ => true,
        }
    }

    /// The place of a line near `expected_px`; its light is noted.
    #[inline(always)]
    pub(super) fn correlate<R: Row>(
        &mut self,
        row: usize,
        pixels: &mut R,
        expected_px: f32,
        sums: Sums,
    ) -> Result<f32, Unfound> {
        let hurried = self.is_hurried();
        let (store, light) = (&self.store, &mut self.light);
        self.correlator
            .find(store, light, row, pixels, expected_px, sums, hurried)
    }

    /// The line is that of the frame before, in a frame that may be a copy; its print is kept.
    pub(super) fn is_repeated<R: Row>(&mut self, row: usize, pixels: &mut R, sums: Sums) -> bool {
        // While learning the coefficients change, and the sums with them.
        let by_sums = sums.filter(|_| self.stage == Stage::Tracking);
        let print = match by_sums {
            Some(sums) => print::of_sums(sums),
            None => print::of_pixels(pixels.pixels()),
        };
        let before = self.store.print(row);
        self.store.set_print(row, print);
        if !self.copies.may_be() {
            return false;
        }
        let read_otherwise = print::is_by_pixels(before) != by_sums.is_none();
        if before == 0 || read_otherwise && self.is_hurried() {
            // The row was built again meanwhile, or there is no time to read it the other way: the next row tells.
            return self.copies.seems();
        }
        // The row of the frame before may have been read the other way.
        let repeated = before == print
            || match by_sums {
                Some(_) => read_otherwise && before == print::of_pixels(pixels.pixels()),
                None => {
                    let sums = match read_otherwise {
                        true => whole_sums(&self.store, row, pixels),
                        false => None,
                    };
                    sums.is_some_and(|sums| before == print::of_sums(sums))
                }
            };
        self.copies.note(repeated);
        repeated
    }

    /// A row without texture tells of the light too, where it is neither dark nor near to being clipped.
    fn note_light<R: Row>(&mut self, row: usize, table: &RowTable, pixels: &R, sums: Sums) {
        let columns = self.config.kernel.light_columns(self.config.width);
        let mean = table.pixel_sum() / f32::from(columns);
        let (dark, bright) = (
            self.store.recipe().saturation / 16.0,
            self.store.recipe().saturation * 0.6,
        );
        if !(dark..bright).contains(&mean) {
            return;
        }
        if let Some((_, sum)) = sums.or_else(|| whole_sums(&self.store, row, pixels)) {
            let before = self.light.to_reference;
            self.light.to_reference = table.factor_to_reference(sum);
            self.light.add_since(before);
        }
    }

    /// Checks a line and lets the reference follow it; its shift, unless it is occluded.
    #[cold]
    fn check_and_follow<P: Pixel>(
        &mut self,
        [place, row]: [usize; 2],
        pixels: &[P],
        shift_px: f32,
    ) -> Option<f32> {
        let checked = self.check_line(row, pixels, shift_px);
        self.after_check([place, row], pixels, checked);
        checked
    }

    /// `checked`: the shift of a line that was found to fit.
    pub(super) fn after_check<P: Pixel>(
        &mut self,
        [place, row]: [usize; 2],
        pixels: &[P],
        checked: Option<f32>,
    ) {
        if let Some(shift_px) = checked
            && self.schedule.turn == row
        {
            let hurried = self.is_hurried();
            let place_px = [shift_px, self.planar.near_down_px()];
            self.store
                .follow_row(row, pixels, place_px, self.light.to_reference, hurried);
        }
        self.schedule.next_check = self.check.next_due(place, self.is_hurried());
        if self.schedule.turn > place {
            self.schedule.next_check = self.schedule.next_check.min(self.schedule.turn);
        }
        self.schedule.background = self.store.is_busy() || self.check.is_searching();
        // Some ten microseconds before it is read: between two checks of a row, 32 frames have been through the caches.
        kernel::ask_for(
            self.store
                .mean(self.schedule.next_check)
                .unwrap_or_default(),
        );
    }
}
