//! Whether a line still resembles its reference.
//!
//! The inner product alone cannot tell a moving surface from a hand in front of it. So now and then, and
//! whenever a line surprises, what the line leaves over after its shifted reference is taken off is
//! compared with the pixels' noise and with what an error of the shift would leave. A line that fails is
//! searched for over the whole range of motion; if it is not found either, it is occluded, and so are
//! the following ones until one fits again.

use super::{
    Stage, Tracker,
    overlap::{Overlap, nearest_step},
};
use crate::{camera::pixel::Pixel, reference::RowTable, reference::noise::LEAST_VARIANCE};

/// While tracking, one row in this many is checked even if it does not surprise; and where a line time is short.
const EVERY: usize = 32;
const EVERY_IN_A_HURRY: usize = 64;

/// Columns that a check reads, about: of a line that may be anywhere, of one among others that fitted, where a line time is
/// short, and where the line has moved by whole pixels then, which takes longer.
const COLUMNS: usize = 48;
const COLUMNS_AMONG_FITTING: usize = 24;
const COLUMNS_IN_A_HURRY: usize = 12;
const COLUMNS_IN_MORE_HURRY: usize = 10;

/// A search begins again every so many pixels of one colour: where correlation converges from on a sharp
/// texture too.
const START_STEPS: i32 = 2;

/// A line that leaves no more over than an error of this would, squared, is found, px².
const WELL_PX2: f32 = 0.02;

/// A scene that does not fit for so long is a new scene, ns.
const NEW_SCENE_NS: i64 = 1_500_000_000;

/// What the watch remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Check {
    /// The last line checked did not fit, or the frame has just begun: check every line.
    every_line: bool,
    /// Remainder of the rows that are checked in this frame.
    turn: usize,
    /// Lines to wait before the next search, while nothing fits.
    lines_to_search: u8,
    /// While nothing fits and a line has no time for a whole search: the number of starts tried since.
    start: Option<u16>,
    /// Lines of this frame that fitted, and that did not.
    fitted: u32,
    unfit: u32,
    /// When the scene stopped to fit.
    since_ns: Option<i64>,
    /// What even a good line leaves over, as the square of an error of the shift, px²: a background that
    /// stands still, a lens that distorts.
    usual_px2: f32,
}

impl Check {
    /// A lost picture is searched for, one start a line.
    #[inline(always)]
    pub(super) fn is_searching(&self) -> bool {
        self.start.is_some()
    }

    /// Every line is to be checked, and not only because a frame has just begun.
    pub(super) fn checks_every_line(&self) -> bool {
        self.every_line && (self.unfit > 0 || self.is_searching())
    }

    /// The next row to be checked after `row`.
    pub(super) fn next_due(&self, row: usize, hurried: bool) -> usize {
        if self.every_line {
            return 0;
        }
        let every = if hurried { EVERY_IN_A_HURRY } else { EVERY };
        let next = row + 1;
        // Both are powers of two.
        next + (self.turn.wrapping_sub(next) & (every - 1))
    }

    pub(super) fn begin_frame(&mut self, frame: u32) {
        self.turn = frame as usize % EVERY_IN_A_HURRY;
        self.every_line = true;
        self.lines_to_search = 0;
        self.fitted = 0;
        self.unfit = 0;
    }

    /// Closes the frame that ended; the scene has changed for good when this returns true.
    pub(super) fn end_frame(&mut self, now_ns: i64) -> bool {
        if self.unfit > 3 * self.fitted && self.unfit > 0 {
            let since = *self.since_ns.get_or_insert(now_ns);
            return now_ns.saturating_sub(since) > NEW_SCENE_NS;
        }
        self.since_ns = None;
        false
    }

    /// Learns what a good line leaves over.
    fn learn(&mut self, excess_px2: f32) {
        self.usual_px2 += (excess_px2 - self.usual_px2) / 64.0;
    }
}

/// What a line leaves over, per pixel and in units of the pixels' variance.
pub(super) struct Residual {
    /// Mean square of what is left.
    power: f32,
    /// Mean square that an error of the shift of 1 px would leave.
    slope_power: f32,
}

impl Residual {
    /// What noise does not explain, as the square of an error of the shift, px².
    fn excess_px2(&self) -> f32 {
        (self.power - 2.0).max(0.0) / self.slope_power.max(1e-9)
    }
}

impl Tracker<'_> {
    /// Checks whether a line at `shift_px` resembles its reference. Returns its shift, found again if need
    /// be, or `None` for an occluded line.
    #[cold]
    pub(super) fn check_line<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<f32> {
        if self.is_hurried() {
            let fits = self.fits(row, pixels, shift_px);
            self.note_fit(fits);
            return fits.then_some(shift_px);
        }
        let mut fit = self.fits(row, pixels, shift_px).then_some(shift_px);
        if fit.is_none() && self.check.lines_to_search == 0 {
            self.check.lines_to_search = 8;
            self.check.every_line = true;
            fit = self
                .search(row, table, pixels)
                .and_then(|near| self.correlate(row, table, &mut &*pixels, near, None).ok())
                .filter(|&shift| self.fits(row, pixels, shift));
        }
        self.note_fit(fit.is_some());
        fit
    }

    /// Remembers whether a line that was checked fitted.
    pub(super) fn note_fit(&mut self, fits: bool) {
        self.check.every_line = !fits;
        self.check.lines_to_search = self.check.lines_to_search.saturating_sub(1);
        if fits {
            self.check.fitted += 1;
            self.check.start = None;
        } else {
            // The brightness is that of something else.
            self.to_reference = 1.0;
            self.check.unfit += 1;
            if self.is_hurried() {
                self.check.start = Some(self.check.start.map_or(0, |s| s.wrapping_add(1)));
            }
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
        self.next_check = 0;
        self.background = true;
    }

    pub(super) fn fits<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) -> bool {
        let Some(residual) = self.residual(row, pixels, shift_px) else {
            return false;
        };
        // While learning, the reference is still blurred and a still background not yet known.
        let allowed_px2 = match self.stage {
            Stage::Tracking => 0.2 + 4.0 * self.check.usual_px2,
            Stage::Rough | Stage::Refining => 2.0,
        };
        let mut fits = residual.power <= 5.0 + allowed_px2 * residual.slope_power;
        if fits && self.is_strict() {
            fits = residual.excess_px2() < self.well_px2();
        }
        if fits && self.stage == Stage::Refining && residual.slope_power > 0.0 {
            self.check
                .learn((residual.power - 2.0).max(0.0) / residual.slope_power);
        }
        fits
    }

    /// What is left of a line when its reference, shifted, is taken off; some columns serve.
    pub(super) fn residual<P: Pixel>(
        &self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<Residual> {
        let width = pixels.len();
        let r = self.store.recipe();
        let mean = self.store.mean(row)?;
        let stride = r.stride as i32;
        let whole = nearest_step(shift_px, stride);
        let near = shift_px - whole as f32;
        let overlap = Overlap::new(width, whole)?;
        let (mean, mask) = (
            mean.get(overlap.reference.clone())?,
            self.store.mask().get(overlap.reference)?,
        );
        let line = pixels.get(overlap.line)?;
        let columns = match self.config.columns_per_line {
            u16::MAX if self.check.every_line || self.stage != Stage::Tracking => COLUMNS,
            u16::MAX => COLUMNS_AMONG_FITTING,
            _ if self.effort == 0 => COLUMNS_IN_A_HURRY,
            _ => COLUMNS_IN_MORE_HURRY,
        };
        // What the motion carries in and out at the ends is little known.
        let from = r.margin_px + r.stride;
        let to = mean.len().checked_sub(from)?;
        let n = to.checked_sub(from)?;
        let step = (width / columns).max(1);
        let (left, here, right) = (
            mean.get(from - r.stride..)?.get(..n)?,
            mean.get(from..)?.get(..n)?,
            mean.get(from + r.stride..)?.get(..n)?,
        );
        let (line, mask) = (line.get(from..)?.get(..n)?, mask.get(from..)?.get(..n)?);
        // All in counts of the reference.
        let value = 1.0 / r.counts_per_value;
        let gain = value / self.to_reference;
        let near = near / r.stride as f32;
        let saturation = r.saturation * r.counts_per_value;
        let per_count = r.noise.per_value * value;
        let (mut power, mut slopes, mut read) = (0.0f32, 0.0f32, 0u16);
        // Not at the very edge, which a reference that was moved does not know.
        let mut next = step / 2;
        while next < n {
            let x = next;
            next += step;
            let (Some(&left), Some(&here), Some(&right), Some(&p), Some(&mask)) = (
                left.get(x),
                here.get(x),
                right.get(x),
                line.get(x),
                mask.get(x),
            ) else {
                break;
            };
            let (left, here, right) = (f32::from(left), f32::from(here), f32::from(right));
            if mask == 0 || here >= saturation {
                continue;
            }
            let slope = right - left;
            let bend = right + left - 2.0 * here;
            let model = here - 0.5 * near * (slope - near * bend);
            let residual = f32::from(p.value()) - gain * model;
            let variance = r.noise.dark + per_count * here;
            let weight = 1.0
                / if variance > LEAST_VARIANCE {
                    variance
                } else {
                    LEAST_VARIANCE
                };
            power += residual * residual * weight;
            slopes += slope * slope * weight;
            read += 1;
        }
        let frames = f32::from(self.store.learning(row)?.frames());
        let own = 1.0 / (f32::from(read) * (1.0 + 1.0 / frames));
        let slope_px = 0.5 * value / r.stride as f32;
        (read >= 4).then_some(Residual {
            power: power * own,
            slope_power: slopes * own * slope_px * slope_px,
        })
    }

    /// Starts of a search: so many either way, and the middle.
    fn starts(&self) -> u16 {
        let reach = self.config.search_px.min(self.config.width / 3);
        2 * (reach / (START_STEPS as u16 * u16::from(self.config.stride))) + 1
    }

    /// A search goes the first time round: only a place that leaves next to nothing over will do.
    fn is_strict(&self) -> bool {
        matches!(self.check.start, Some(start) if start > 0 && start <= self.starts())
    }

    /// A line that leaves no more over is found for certain, px².
    fn well_px2(&self) -> f32 {
        WELL_PX2 + 2.0 * self.check.usual_px2
    }

    /// Where the next line is searched for while nothing fits, px: outwards from the usual place as by
    /// [`Tracker::search`], one start a line. `None` where it is expected as ever.
    pub(super) fn start_px(&self) -> Option<f32> {
        let start = self.check.start?.checked_sub(1)? % self.starts();
        let away = i32::from(start.div_ceil(2)) * START_STEPS * i32::from(self.config.stride);
        let away = if start.is_multiple_of(2) { away } else { -away };
        Some(self.prediction.usual_px() + away as f32)
    }

    /// Where a lost line resembles its reference, px: outwards from where the picture is most of the time,
    /// so that of several places that look alike (the stripes of a periodic texture) the likeliest is
    /// taken. From every start the line is brought to the nearest place where it correlates; a place that
    /// leaves next to nothing over ends the search, and else one further away must leave only half.
    fn search<P: Pixel>(&mut self, row: usize, table: &RowTable, pixels: &[P]) -> Option<f32> {
        let middle_px = match self.stage {
            Stage::Rough => 0.0,
            Stage::Refining | Stage::Tracking => self.prediction.usual_px(),
        };
        let reach = i32::from(self.config.search_px).min(pixels.len() as i32 / 3);
        let step = START_STEPS * i32::from(self.config.stride);
        let well_px2 = self.well_px2();
        let mut best: Option<(f32, f32)> = None;
        for start in (0..=reach).step_by(step as usize) {
            for start in [start, -start] {
                let start_px = middle_px + start as f32;
                let Ok(shift_px) = self.correlate(row, table, &mut &*pixels, start_px, None) else {
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
