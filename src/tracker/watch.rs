//! Does a line still look like its reference?
//!
//! The inner product alone cannot tell a moving surface from a hand in front of it. So now and then, and
//! whenever a line surprises, what the line leaves over after its shifted reference is taken off is
//! compared with the pixels' noise and with what an error of the shift would leave. A line that fails is
//! searched for over the whole range of motion; if it is not found either, it is disturbed, and so are
//! the following ones until one fits again.

use super::{
    Stage, Tracker,
    overlap::{Overlap, nearest_step},
};
use crate::{pixel::Pixel, reference::RowTable};

/// In tracking one row in this many is looked at even if it does not surprise.
const EVERY: usize = 32;

/// Columns that are looked at, about.
const COLUMNS: usize = 48;

/// A search begins anew every so many pixels of one colour: where correlation converges from on a sharp
/// texture too.
const START_STEPS: i32 = 2;

/// A line that leaves no more over than an error of this would, squared, is found, px².
const WELL_PX2: f32 = 0.02;

/// A scene that does not fit for so long is a new scene, ns.
const NEW_SCENE_NS: i64 = 1_500_000_000;

/// What the watch remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    /// The last line looked at did not fit, or the frame has just begun: look at every line.
    every_line: bool,
    /// Remainder of the rows that are looked at in this frame.
    turn: usize,
    /// Lines to wait before the next search, while nothing fits.
    rest: u8,
    /// Lines of this frame that fitted, and that did not.
    fitted: u32,
    unfit: u32,
    /// When the scene stopped to fit.
    since_ns: Option<i64>,
    /// What even a good line leaves over, as the square of an error of the shift, px²: a background that
    /// stands still, a lens that distorts.
    usual_px2: f32,
}

impl Watch {
    #[inline]
    pub(super) fn is_due(&self, row: usize) -> bool {
        self.every_line || row % EVERY == self.turn
    }

    pub(super) fn begin_frame(&mut self, frame: u32) {
        self.turn = frame as usize % EVERY;
        self.every_line = true;
        self.rest = 0;
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
pub(super) struct Rest {
    /// Mean square of what is left.
    power: f32,
    /// Mean square that an error of the shift of 1 px would leave.
    slope_power: f32,
}

impl Tracker<'_> {
    /// Looks whether a line at `shift_px` resembles its reference. Returns its shift, found anew if need
    /// be, or `None` for a disturbed line.
    #[cold]
    pub(super) fn look<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
    ) -> Option<f32> {
        if self.prediction.needs_more_than(table.information_per_px2()) {
            return None;
        }
        let mut fit = self.fits(row, pixels, shift_px).then_some(shift_px);
        if fit.is_none() && self.watch.rest == 0 {
            self.watch.rest = 8;
            fit = self
                .search(row, table, pixels)
                .and_then(|near| self.correlate(row, table, pixels, near))
                .filter(|&shift| self.fits(row, pixels, shift));
        }
        self.watch.rest = self.watch.rest.saturating_sub(1);
        self.watch.every_line = fit.is_none();
        if fit.is_some() {
            self.watch.fitted += 1;
        } else {
            // The brightness is that of something else.
            self.to_reference = 1.0;
            self.watch.unfit += 1;
        }
        fit
    }

    fn fits<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) -> bool {
        let Some(rest) = self.rest(row, pixels, shift_px) else {
            return false;
        };
        // While learning, the reference is still blurred and a still background not yet known.
        let allowed_px2 = match self.stage {
            Stage::Tracking => 0.2 + 4.0 * self.watch.usual_px2,
            Stage::Rough | Stage::Refining => 2.0,
        };
        let fits = rest.power <= 5.0 + allowed_px2 * rest.slope_power;
        if fits && self.stage == Stage::Refining && rest.slope_power > 0.0 {
            self.watch
                .learn((rest.power - 2.0).max(0.0) / rest.slope_power);
        }
        fits
    }

    /// What is left of a line when its reference, shifted, is taken off; some columns serve.
    pub(super) fn rest<P: Pixel>(&self, row: usize, pixels: &[P], shift_px: f32) -> Option<Rest> {
        let width = pixels.len();
        let r = &self.recipe;
        let mean = self.storage.mean.get(row * width..)?.get(..width)?;
        let frames = f32::from(self.storage.learning.get(row)?.frames.max(1));
        let stride = r.stride as i32;
        let whole = nearest_step(shift_px, stride);
        let near = shift_px - whole as f32;
        let overlap = Overlap::new(width, whole)?;
        let (mean, mask) = (
            mean.get(overlap.reference.clone())?,
            self.storage.mask.get(overlap.reference)?,
        );
        let line = pixels.get(overlap.line)?;
        let (value, pitch) = (1.0 / r.counts_per_value, 1.0 / r.stride as f32);
        let own = 1.0 + 1.0 / frames;
        let gain = 1.0 / self.to_reference;
        let (mut power, mut slopes, mut n) = (0.0f32, 0.0f32, 0.0f32);
        // What the motion carries in and out at the ends is little known.
        let inner = mean.len().checked_sub(2 * r.margin_px + 2 * r.stride)?;
        for ((window, &p), &mask) in mean
            .get(r.margin_px..)?
            .windows(2 * r.stride + 1)
            .zip(line.get(r.margin_px + r.stride..)?)
            .zip(mask.get(r.margin_px + r.stride..)?)
            .take(inner)
            .step_by((width / COLUMNS).max(1))
        {
            let (Some(&left), Some(&here), Some(&right)) =
                (window.first(), window.get(r.stride), window.last())
            else {
                continue;
            };
            let here = f32::from(here) * value;
            if mask == 0 || here >= r.saturation {
                continue;
            }
            let (left, right) = (f32::from(left) * value, f32::from(right) * value);
            let slope = 0.5 * (right - left) * pitch;
            let bend = (right - 2.0 * here + left) * pitch * pitch;
            let model = here - near * (slope - 0.5 * near * bend);
            let rest = f32::from(p.value()) - gain * model;
            let weight = 1.0 / (r.noise.variance(here) * own);
            power += rest * rest * weight;
            slopes += slope * slope * weight;
            n += 1.0;
        }
        (n >= 4.0).then(|| Rest {
            power: power / n,
            slope_power: slopes / n,
        })
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
        let well_px2 = WELL_PX2 + 2.0 * self.watch.usual_px2;
        let mut best: Option<(f32, f32)> = None;
        for start in (0..=reach).step_by(step as usize) {
            for start in [start, -start] {
                let start_px = middle_px + start as f32;
                let Some(shift_px) = self.correlate(row, table, pixels, start_px) else {
                    continue;
                };
                let Some(rest) = self.rest(row, pixels, shift_px) else {
                    continue;
                };
                let left_px2 = (rest.power - 2.0).max(0.0) / rest.slope_power.max(1e-9);
                if left_px2 < well_px2 {
                    return Some(shift_px);
                }
                if best.is_none_or(|(least, _)| left_px2 < 0.5 * least) {
                    best = Some((left_px2, shift_px));
                }
            }
        }
        best.map(|(_, shift_px)| shift_px)
    }
}
