//! Learning the reference, in two rounds of frames.

use super::{
    Place, Planar, Rejected, Stage, Tracker,
    check::Check,
    correlate::{Correlator, whole_sums},
    predict::Prediction,
    residual::likeness,
    vetting::{UNLIT, Vetting},
};
use crate::{
    camera::pixel::Pixel,
    reference::{NoiseMeter, band::Level, noise::PixelNoise},
    timeline::Curvature,
};

/// A row that knows its shift no better than this is aligned like its neighbours, 1/px².
const OWN_INFORMATION_PER_PX2: f32 = 25.0;

/// Frames that a row is the mean of before its sharpest pixels are watched.
const WATCH_AFTER: u16 = 3;

/// Rows of a frame after which the prediction owes nothing to the frame before.
const ROWS_TO_SETTLE: usize = 12;

/// One row in so many measures the pixels' noise, in turns.
const NOISE_ROWS: usize = 4;

/// In the second round, a row so many times further than the range of the first and this more is not learned, px.
const BEYOND: f32 = 2.0;
const BEYOND_PX: f32 = 4.0;

/// Motion below this stays within the rows' polynomials, px.
const SMALL_MOTION_PX: f32 = 0.6;

impl Tracker<'_> {
    /// Forgets the reference and learns it again from the next line on. Counters go on.
    pub fn relearn(&mut self) {
        self.stage = Stage::Rough;
        self.frame = None;
        self.schedule.fast_path.end();
        self.frames_in_stage = 0;
        self.vetting = Vetting::default();
        self.range_px = f32::INFINITY;
        self.light.relearn();
        self.prediction = Prediction::default();
        self.curvature = Curvature::default();
        self.correlator = Correlator::learning(self.config.stride);
        self.blur.relearn();
        self.planar = Planar::default();
        #[cfg(feature = "long-exposure")]
        self.paths.relearn();
        self.meter = NoiseMeter::default();
        self.check = Check::new(super::search::starts(&self.config));
        self.store.set_saturation(self.config.saturation());
        self.store.forget(
            PixelNoise::guess(self.config.values()),
            self.config.level.unwrap_or(Level::Medium),
            usize::from((self.config.width / 8).min(self.config.search_px)),
        );
    }

    /// Ends the present round of learning now, with the frames that were seen: for a recording that is
    /// shorter than the configured rounds. Nothing happens while tracking.
    pub fn end_round(&mut self) {
        match self.stage {
            Stage::Rough => {
                self.settle_noise();
                self.store.mask_dead_columns();
                self.store.leave_out_still_pixels();
                self.settle_margin();
                self.store.even_light();
                self.store.centre_rows();
                self.store.centre_rows_down();
                if self.config.level.is_none() {
                    self.store.choose_level();
                }
                self.store.build_all();
                self.store.count_frames_again();
                #[cfg(feature = "long-exposure")]
                self.paths.end_round(false);
                self.stage = Stage::Refining;
            }
            Stage::Refining => {
                self.settle_noise();
                // What is cut off in a lamp's bright moments does not follow the light: it would be a motion.
                let share = self.light.unsaturated_share();
                self.store.set_saturation(share * self.config.saturation());
                self.store.leave_out_still_pixels();
                self.settle_margin();
                self.store.even_light();
                self.store.build_all();
                #[cfg(feature = "long-exposure")]
                self.paths.end_round(true);
                self.stage = Stage::Tracking;
                let hurried = self.is_hurried();
                self.correlator.end_learning(self.config.stride, hurried);
            }
            Stage::Tracking => {}
        }
        self.prediction.end_round(self.store.usual_information());
        if self.store.is_planar() {
            self.planar.end_round(self.store.usual_curvatures_per_px2());
            self.correlator.lean_px = 0.0;
        }
        #[cfg(feature = "long-exposure")]
        if self.paths.smear() {
            self.prediction.expect_far();
        }
        if self.is_hurried() {
            // Lines of a motion that may be swift take longer.
            self.prediction.come_to_rest();
        }
        self.curvature = Curvature::of_per_px2(self.store.usual_curvature_per_px2());
        self.blur.end_round();
        self.meter = NoiseMeter::default();
        self.range_px = self.vetting.range_px();
        self.vetting.end_round();
        self.frames_in_stage = 0;
        self.frame = None;
        self.schedule.fast_path.end();
    }

    /// Aligns a line and averages it into its reference.
    ///
    /// `found`: its own shift. In the first frame nothing is known, so no row has texture: it is not moved.
    #[cold]
    pub(super) fn learn<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        found: Result<Place, Rejected>,
    ) {
        self.vet(row, pixels, found);
        let mut textured = false;
        let shift_px = match found {
            Ok(Place {
                shift_px,
                information_per_px2,
            }) if information_per_px2 > OWN_INFORMATION_PER_PX2 => {
                if shift_px.abs() > BEYOND * self.range_px + BEYOND_PX {
                    // A frame that is elsewhere for once.
                    return;
                }
                textured = true;
                self.prediction.note_extent(shift_px, information_per_px2);
                #[cfg(feature = "long-exposure")]
                if self.stage == Stage::Rough && self.paths.are_of_use() {
                    self.note_oscillation(row, shift_px, information_per_px2);
                }
                shift_px
            }
            Ok(_) => self.prediction.at(row),
            Err(Rejected::NoTexture) if self.is_lit(row, pixels) => self.prediction.at(row),
            Err(_) => return,
        };
        let Some(&seen) = self.store.learning(row) else {
            return;
        };
        // A row with a pixel that stands still is wrong itself; the first ones have none before them.
        let moved_px = match row < ROWS_TO_SETTLE {
            true => shift_px,
            false => self.prediction.at(row),
        };
        if self.prediction.is_sure() {
            self.store
                .watch(row, pixels, moved_px, self.light.to_reference);
        }
        if self.prediction.is_sure() {
            self.vetting.note_extent(self.prediction.at(row));
        }
        if row.is_multiple_of(8) {
            self.store.note_activity(pixels);
        }
        // A row that reads black or white throughout would tell of too little noise.
        if textured && row % NOISE_ROWS == self.frames_in_stage as usize % NOISE_ROWS {
            self.measure_noise(row, pixels, shift_px, seen.frames);
        }
        let down_px = self.planar.near_down_px();
        let place_px = [shift_px, down_px];
        self.store
            .average(row, pixels, place_px, self.light.to_reference, u16::MAX);
        if self.stage == Stage::Refining && textured {
            self.light.note_learned();
        }
        if seen.frames == WATCH_AFTER {
            self.store.watch_row(row);
        }
        if self.stage == Stage::Rough {
            let frames = seen.frames.saturating_add(1);
            if let Some(l) = self.store.learning_mut(row) {
                l.shift_px += (shift_px - l.shift_px) / f32::from(frames);
            }
            let total_px = self.planar.total_down_px();
            self.store.note_down(row, total_px, f32::from(frames));
            // A better reference at once, then ever more rarely: the work must stay small.
            if matches!(frames, 1 | 4 | 16) && !self.store.is_planar() {
                self.store.build(row);
            }
        }
    }

    /// The frame is vetted by its rows, before they are learned.
    fn vet<P: Pixel>(&mut self, row: usize, pixels: &[P], found: Result<Place, Rejected>) {
        let seen = self.store.learning(row).is_some_and(|l| l.frames > 0);
        if self.stage != Stage::Rough || !seen {
            self.vetting.note_light(1.0);
            return;
        }
        let (information, shift_px) = match found {
            Ok(place) => (place.information_per_px2, place.shift_px),
            Err(Rejected::Occluded) => (OWN_INFORMATION_PER_PX2, self.prediction.at(row)),
            Err(_) => (0.0, 0.0),
        };
        let to_reference = self.factor_to_reference(row, pixels);
        self.vetting.note_light(to_reference);
        if information >= OWN_INFORMATION_PER_PX2
            && let Some(likeness) = likeness(&self.store, row, pixels, shift_px)
        {
            self.vetting.note_row(likeness, shift_px, information);
        }
    }

    /// The factor that brings a whole line to its reference's brightness, wherever it lies.
    fn factor_to_reference<P: Pixel>(&self, row: usize, pixels: &[P]) -> f32 {
        match (self.store.table(row), whole_sums(&self.store, row, &pixels)) {
            (Some(table), Some((_, sum))) => table.factor_to_reference(sum),
            _ => 1.0,
        }
    }

    /// The line is not too dark to be learned from.
    fn is_lit<P: Pixel>(&self, row: usize, pixels: &[P]) -> bool {
        self.factor_to_reference(row, pixels) <= UNLIT
    }

    pub(super) fn measure_noise<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
        frames: u16,
    ) {
        let Some(mean) = self.store.mean(row) else {
            return;
        };
        if frames >= 2 || self.stage == Stage::Rough && frames >= 1 {
            let frames = f32::from(frames);
            self.meter.add_line(
                mean,
                self.store.beside(row, self.planar.near_down_px()),
                pixels,
                shift_px,
                1.0 / self.light.to_reference,
                self.store.recipe(),
                frames,
            );
        }
    }

    pub(super) fn settle_noise(&mut self) {
        if let Some(noise) = self.meter.noise(self.store.recipe().saturation) {
            self.store.set_noise(noise);
        }
    }

    /// Small motion stays within the polynomial and needs no margin.
    fn settle_margin(&mut self) {
        let range = self
            .vetting
            .range_px()
            .min(f32::from(self.config.width / 3));
        self.store.set_margin_px(if range < SMALL_MOTION_PX {
            0
        } else {
            (range * 1.25) as usize + 2
        });
    }
}
