//! A line is checked, and a lost picture searched for.

use super::{Config, Stage, Tracker, residual::Residual};
use crate::camera::pixel::Pixel;

/// A search begins again every so many pixels of one colour: where correlation converges from on a sharp
/// texture too.
const START_STEPS: i32 = 2;

/// Starts of a search: so many either way, and the middle.
pub(super) fn starts(config: &Config) -> u16 {
    let reach = config.search_px.min(config.width / 3);
    2 * (reach / (START_STEPS as u16 * u16::from(config.stride))) + 1
}

impl Tracker<'_> {
    /// Checks whether a line at `shift_px` resembles its reference. Returns its shift, found again if need
    /// be, or `None` for an occluded line.
    #[cold]
    pub(super) fn check_line<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<f32> {
        if self.is_hurried() {
            let fits = self.fits(row, pixels, shift_px);
            self.note_fit(fits);
            return fits.then_some(shift_px);
        }
        let mut fit = self.fits(row, pixels, shift_px).then_some(shift_px);
        if fit.is_none() && self.check.begin_search() {
            fit = self
                .search(row, pixels)
                .and_then(|near| self.correlate(row, &mut &*pixels, near, None).ok())
                .filter(|&shift| self.fits(row, pixels, shift));
        }
        self.note_fit(fit.is_some());
        fit
    }

    /// Remembers whether a line that was checked fitted.
    pub(super) fn note_fit(&mut self, fits: bool) {
        self.check.note(fits, self.is_hurried());
        if !fits {
            // The brightness is that of something else.
            self.light.to_reference = 1.0;
        }
    }

    /// Where a line has no time to be correlated to the end: it is as good as occluded, the next one is
    /// expected where it seemed to be.
    #[cold]
    pub(super) fn reject_unfinished(&mut self, shift_px: f32) {
        if !self.check.is_searching() {
            self.prediction.suppose(shift_px);
        }
        self.note_fit(false);
        self.schedule.next_check = 0;
        self.schedule.background = true;
    }

    /// Whether a line of `row` at `shift_px` fits its reference.
    pub(super) fn fits<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) -> bool {
        let fits = match self.residual(row, pixels, shift_px) {
            Some(residual) => self.check.fits(&residual, self.stage),
            None => return false,
        };
        fits || self.fits_in_shade(row, pixels, shift_px)
    }

    /// Whether it does under a soft shadow, which changes the brightness along the line.
    #[cold]
    fn fits_in_shade<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) -> bool {
        let columns = self.check.columns_in_shade(self.check_columns());
        let to_reference = self.light.to_reference;
        let (store, place_px) = (&self.store, [shift_px, self.planar.near_down_px()]);
        let shaded = Residual::of::<true, P>(store, row, pixels, place_px, to_reference, columns);
        shaded.is_some_and(|residual| self.check.fits(&residual, self.stage))
    }

    fn check_columns(&self) -> usize {
        let hurried = self.config.columns_per_line != u16::MAX;
        let moved = self.correlator.products > 0;
        self.check.columns(self.stage, hurried, moved)
    }

    /// What is left of a line of `row` when its reference, shifted, is taken off.
    pub(super) fn residual<P: Pixel>(
        &self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<Residual> {
        let (columns, to_reference) = (self.check_columns(), self.light.to_reference);
        let place_px = [shift_px, self.planar.near_down_px()];
        Residual::of::<false, P>(&self.store, row, pixels, place_px, to_reference, columns)
    }

    /// Where the next line is searched for while nothing fits, px: outwards from the usual place as by
    /// [`Tracker::search`], one start a line. `None` where it is expected as ever.
    pub(super) fn start_px(&self) -> Option<f32> {
        let start = self.check.next_start()?;
        let away = i32::from(start.div_ceil(2)) * START_STEPS * i32::from(self.config.stride);
        let away = if start.is_multiple_of(2) { away } else { -away };
        Some(self.prediction.usual_px() + away as f32)
    }

    /// Where a lost line resembles its reference, px: outwards from where the picture is most of the time,
    /// so that of several places that look alike (the stripes of a periodic texture) the likeliest is
    /// taken. From every start the line is brought to the nearest place where it correlates; a place that
    /// leaves next to nothing over ends the search, and else one further away must leave only half.
    fn search<P: Pixel>(&mut self, row: usize, pixels: &[P]) -> Option<f32> {
        let middle_px = match self.stage {
            Stage::Rough => 0.0,
            Stage::Refining | Stage::Tracking => self.prediction.usual_px(),
        };
        let reach = i32::from(self.config.search_px).min(pixels.len() as i32 / 3);
        let step = START_STEPS * i32::from(self.config.stride);
        let well_px2 = self.check.well_px2();
        let mut best: Option<(f32, f32)> = None;
        for start in (0..=reach).step_by(step as usize) {
            for start in [start, -start] {
                let start_px = middle_px + start as f32;
                let Ok(shift_px) = self.correlate(row, &mut &*pixels, start_px, None) else {
                    continue;
                };
                let Some(residual) = self.residual(row, pixels, shift_px) else {
                    continue;
                };
                let excess_px2 = residual.excess_px2();
                if excess_px2 < well_px2 {
                    return Some(shift_px);
                }
                if best.is_none_or(|(least, _)| excess_px2 < 0.5 * least) {
                    best = Some((excess_px2, shift_px));
                }
            }
        }
        best.map(|(_, shift_px)| shift_px)
    }
}
