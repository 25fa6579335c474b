//! What a row answers to a line that was exposed along a path, and which displacement explains what it answered.

use super::{LAGS, LEAST_SLOPE, MOST_PX, SAMPLES, SHARP, TAPS};
use crate::{
    camera::pixel::Pixel,
    reference::RowTable,
    reference::align::between,
    tracker::{RowLearning, Stage, Tracker, correlate::nearest_product, overlap::Overlap},
};

/// The row's phase-correlation function at whole steps from −SHARP to SHARP, as a line exposed in no time would meet it,
/// and the path.
struct Response {
    q: [f32; 2 * SHARP + 1],
    path: [f32; SAMPLES],
}

impl Response {
    /// Mean along the path of a line that is displaced by so many steps; `None` beyond what is known.
    fn at(&self, steps: f32) -> Option<f32> {
        let mut sum = 0.0;
        for s in self.path {
            let place = steps + s + SHARP as f32;
            let whole = libm::floorf(place);
            let first = (whole as usize).checked_sub(TAPS - 1)?;
            let q = self.q.get(first..first + 2 * TAPS)?;
            let weights = between(place - whole);
            sum += q.iter().zip(weights).map(|(q, w)| q * w).sum::<f32>();
        }
        Some(sum / SAMPLES as f32)
    }

    /// Half a step's worth of slope, per step.
    fn slope(&self, steps: f32) -> Option<f32> {
        Some(2.0 * (self.at(steps + 0.25)? - self.at(steps - 0.25)?))
    }

    /// The displacement at which `product` is answered, from near there; `least`: slope below which nothing can be told.
    fn solve(&self, product: f32, near: f32, least: f32) -> Option<f32> {
        let (mut steps, mut last) = (near, f32::INFINITY);
        for _ in 0..4 {
            let slope = self.slope(steps)?;
            let told = slope > least;
            if !told {
                return None;
            }
            last = ((product - self.at(steps)?) / slope).clamp(-1.0, 1.0);
            steps += last;
            if last.abs() < 1e-3 {
                break;
            }
        }
        (last.abs() < 0.02).then_some(steps)
    }
}

impl Tracker<'_> {
    /// Measures a line once more along its path; `None` where that is not known.
    #[cold]
    #[inline(never)]
    pub(in crate::tracker) fn follow_path<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
    ) -> f32 {
        let information = table.information_per_px2();
        let at = row as u16 as f32;
        let refining = self.stage == Stage::Refining;
        let frames = self.paths.frames;
        let learning = self.store.learning(row);
        let own_px = learning.map_or(0.0, |l| self.own_px(l));
        let motion = self
            .paths
            .oscillation
            .motion(at, shift_px - own_px, information);
        let path = self.paths.path(motion);
        let unsmeared = path.and_then(|path| {
            if refining {
                self.paths.count(&path);
            }
            self.correlate_along(row, table, pixels, shift_px, path)
        });
        if let (true, Some(path), Some(learning)) = (refining, path, self.store.learning_mut(row)) {
            let px2 = path.iter().map(|s| s * s).sum::<f32>() / SAMPLES as f32;
            learning.add_smear(px2);
        }
        let shift_px = unsmeared.unwrap_or(shift_px);
        self.note_oscillation(row, shift_px - own_px, information);
        if let Some(learning) = self.store.learning_mut(row) {
            learning.shift_px += (shift_px - learning.shift_px) / frames.max(1.0);
        }
        shift_px
    }

    /// A row tells of the motion.
    pub(in crate::tracker) fn note_oscillation(&mut self, row: usize, px: f32, information: f32) {
        let sure = !self.prediction.is_lost_on(information);
        let row = row as u16 as f32;
        self.paths.oscillation.add(row, px, information, sure);
        if sure {
            let off_px = self.paths.ahead.add(row, px, information);
            if self.stage == Stage::Tracking {
                self.paths.note_slip(off_px);
            }
        }
    }

    /// A frame begins; where a swift picture will be, the rows of the one before tell.
    pub(in crate::tracker) fn look_ahead(&mut self) {
        if let (true, Some(px)) = (self.stage != Stage::Rough, self.paths.ahead.foreseen_px()) {
            let own_px = self.store.learning(0).map_or(0.0, |l| self.own_px(l));
            self.prediction.foresee(px + own_px);
        }
    }

    /// The mean of the motion in the frames that a row was learned from is in all its shifts, px: the next frames tell.
    fn own_px(&self, row: &RowLearning) -> f32 {
        let before = self.paths.frames - 1.0;
        row.shift_px * before / (before + self.paths.learned)
    }

    fn correlate_along<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
        path: [f32; SAMPLES],
    ) -> Option<f32> {
        if self.paths.sharpen[0][0] == 0.0 {
            return None;
        }
        let width = pixels.len();
        let stride = f32::from(self.config.stride);
        let (whole, product) = nearest_product(&self.store, row, pixels, shift_px)?;
        let lean = table.product_of_lean(self.correlator.lean_px);
        let product = product * self.light.to_reference - lean;
        let mut q = self.correlation_function(row, width)?;
        self.paths.note_repetition(&q);
        if self.stage == Stage::Tracking {
            table.drop_own_noise(
                &mut q,
                self.store.recipe().level,
                self.store.recipe().stride,
            );
        }
        let own_px2 = self.store.learning(row).and_then(|l| l.smear_px2());
        let step = 1.0 / stride;
        let response = Response {
            q: self.paths.sharpened(&q, own_px2),
            path: path.map(|s| s * step),
        };
        let least = LEAST_SLOPE * 0.5 * (q[LAGS + 1] - q[LAGS - 1]);
        let near = (shift_px - whole as f32) * step;
        let unsmeared_px = whole as f32 + response.solve(product, near, least)? * stride;
        ((unsmeared_px - shift_px).abs() < MOST_PX).then_some(unsmeared_px)
    }

    /// q at whole steps: what the row's own reference answers, moved by so many.
    fn correlation_function(&self, row: usize, width: usize) -> Option<[f32; 2 * LAGS + 1]> {
        let coefficients = self.store.coefficients(row)?;
        let mean = self.store.mean(row)?;
        if self.config.kernel.keeps_pairs() {
            return None;
        }
        let sum: u32 = mean.iter().map(|&c| u32::from(c)).sum();
        let level = sum as f32 / width as f32;
        let value = 1.0 / self.store.recipe().counts_per_value;
        let mut q = [0.0; 2 * LAGS + 1];
        for (at, q) in (0i32..).zip(&mut q) {
            let by = (LAGS as i32 - at) * i32::from(self.config.stride);
            let Some(overlap) = Overlap::new(width, by) else {
                continue;
            };
            let seen = mean.get(overlap.line)?;
            let from = overlap.reference.start;
            let (product, _) = u16::part_sums(self.config.kernel, seen, coefficients, from);
            // All of them are 0 together: what is not met is met by the mean.
            let unseen = coefficients.get(overlap.unseen)?;
            let rest: i32 = unseen.iter().map(|&c| i32::from(c)).sum();
            *q = (product + level * rest as f32) * value;
        }
        Some(q)
    }
}
