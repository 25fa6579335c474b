//! Learning the reference, in two rounds of frames.

use super::correlate::{NEAR_PX, NEAR_WHILE_LEARNING_PX};
use super::{Place, Rejected, Stage, Tracker, check::Check, follow::Follow, predict::Prediction};
use crate::{
    camera::pixel::Pixel,
    reference::NoiseMeter,
    reference::RowTable,
    reference::align::{self, Averaging},
    reference::band::{Level, MAX_HALF},
    reference::noise::PixelNoise,
    timeline::Curvature,
};

/// What learning keeps of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowLearning {
    /// Mean shift of the frames of the first round, px: the middle of the motion.
    pub(super) shift_px: f32,
    /// Frames that the reference is the mean of.
    pub(super) frames: u16,
    /// Mean variance of the paths along which they were exposed, px²/1024.
    #[cfg(feature = "long-exposure")]
    smear: u16,
    /// Mean brightness of the lines against the reference.
    light: f32,
}

/// What learning keeps of a column.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColumnLearning {
    /// The first pixel seen.
    first: Option<u16>,
    /// How many differed from it.
    changes: u16,
}

impl ColumnLearning {
    pub(super) const EMPTY: Self = Self {
        first: None,
        changes: 0,
    };
}

impl RowLearning {
    pub(super) const EMPTY: Self = Self {
        shift_px: 0.0,
        frames: 0,
        #[cfg(feature = "long-exposure")]
        smear: 0,
        light: 0.0,
    };

    pub(super) fn frames(&self) -> u16 {
        self.frames.max(1)
    }

    /// The next frame's line was exposed along a path of this variance.
    #[cfg(feature = "long-exposure")]
    pub(super) fn add_smear(&mut self, px2: f32) {
        let before = f32::from(self.smear) / 1024.0;
        let mean = before + (px2 - before) / f32::from(self.frames.saturating_add(1));
        self.smear = (mean * 1024.0 + 0.5) as u16;
    }

    /// Of the frames that the reference is the mean of, px²; `None` while there are none.
    #[cfg(feature = "long-exposure")]
    pub(super) fn smear_px2(&self) -> Option<f32> {
        (self.frames > 0).then_some(f32::from(self.smear) / 1024.0)
    }
}

/// A row that knows its shift no better than this is aligned like its neighbours, 1/px².
const OWN_INFORMATION_PER_PX2: f32 = 25.0;

/// Rows on which the levels of the band are tried.
const TRIAL_ROWS: usize = 24;

/// A coarser level that finds this share of the most information is taken: it costs a two-hundredth of the noise, and the
/// reference's own noise, which the lines that it was learned from share, pulls their shifts less. A handful of frames
/// had 32 false peaks where the finest was taken for a thousandth more, and none so.
const AS_MUCH: f32 = 0.99;

/// One row in so many measures the pixels' noise, in turns.
const NOISE_ROWS: usize = 4;

/// Motion below this stays within the rows' polynomials, px.
const SMALL_MOTION_PX: f32 = 0.6;

impl Tracker<'_> {
    /// Forgets the reference and learns it again from the next line on. Counters go on.
    pub fn relearn(&mut self) {
        let values = 32768.0 / self.recipe.counts_per_value;
        self.stage = Stage::Rough;
        self.frame = None;
        self.fast_path.end();
        self.frames_in_stage = 0;
        self.range_px = 0.0;
        self.to_reference = 1.0;
        self.prediction = Prediction::default();
        self.curvature = Curvature::default();
        self.here_px = 0.5 * f32::from(self.config.stride);
        self.near_px = NEAR_WHILE_LEARNING_PX * f32::from(self.config.stride);
        self.blur.relearn();
        #[cfg(feature = "long-exposure")]
        self.paths.relearn();
        self.meter = NoiseMeter::default();
        self.check = Check::default();
        self.follow = Follow::default();
        self.recipe.noise = PixelNoise::guess(values);
        self.recipe.level = self.config.level.unwrap_or(Level::Medium);
        self.recipe.margin_px = usize::from((self.config.width / 8).min(self.config.search_px));
        self.storage.learning.fill(RowLearning::default());
        self.storage.tables.fill(RowTable::default());
        self.storage.coefficients.fill(0);
        self.storage.columns.fill(ColumnLearning::default());
    }

    /// Ends the present round of learning now, with the frames that were seen: for a recording that is
    /// shorter than the configured rounds. Nothing happens while tracking.
    pub fn end_round(&mut self) {
        match self.stage {
            Stage::Rough => {
                self.settle_noise();
                self.mask_dead_columns();
                self.settle_margin();
                self.even_light();
                self.centre_rows();
                if self.config.level.is_none() {
                    self.choose_level();
                }
                self.build_all();
                for l in self.storage.learning.iter_mut() {
                    l.frames = 0;
                }
                #[cfg(feature = "long-exposure")]
                self.paths.end_round(false);
                self.stage = Stage::Refining;
            }
            Stage::Refining => {
                self.settle_noise();
                self.settle_margin();
                self.even_light();
                self.build_all();
                #[cfg(feature = "long-exposure")]
                self.paths.end_round(true);
                self.stage = Stage::Tracking;
                self.near_px = NEAR_PX * f32::from(self.config.stride);
                if self.is_hurried() {
                    self.here_px = self.near_px;
                }
            }
            Stage::Tracking => {}
        }
        self.prediction.end_round(self.usual_information());
        #[cfg(feature = "long-exposure")]
        if self.paths.smear() {
            self.prediction.expect_far();
        }
        if self.is_hurried() {
            // Lines of a motion that may be swift take longer.
            self.prediction.come_to_rest();
        }
        self.curvature = self.usual_curvature();
        self.blur.end_round();
        self.meter = NoiseMeter::default();
        self.range_px = 0.0;
        self.frames_in_stage = 0;
        self.frame = None;
        self.fast_path.end();
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
        let mut textured = false;
        let shift_px = match found {
            Ok(Place {
                shift_px,
                information_per_px2,
            }) if information_per_px2 > OWN_INFORMATION_PER_PX2 => {
                textured = true;
                self.prediction.note_extent(shift_px, information_per_px2);
                #[cfg(feature = "long-exposure")]
                if self.stage == Stage::Rough && self.paths.are_of_use() {
                    self.note_oscillation(row, shift_px, information_per_px2);
                }
                shift_px
            }
            Ok(_) | Err(Rejected::NoTexture) => self.prediction.at(row),
            Err(_) => return,
        };
        let Some(&seen) = self.storage.learning.get(row) else {
            return;
        };
        if self.prediction.is_sure() {
            self.range_px = self.range_px.max(self.prediction.at(row).abs());
        }
        if row.is_multiple_of(8) {
            self.note_activity(pixels);
        }
        // A row that reads black or white throughout would tell of too little noise.
        if textured && row % NOISE_ROWS == self.frames_in_stage as usize % NOISE_ROWS {
            self.measure_noise(row, pixels, shift_px, seen.frames);
        }
        self.average(row, pixels, shift_px, u16::MAX);
        if self.stage == Stage::Rough {
            let frames = seen.frames.saturating_add(1);
            if let Some(l) = self.storage.learning.get_mut(row) {
                l.shift_px += (shift_px - l.shift_px) / f32::from(frames);
            }
            // A better reference at once, then ever more rarely: the work must stay small.
            if matches!(frames, 1 | 4 | 16) {
                self.build(row);
            }
        }
    }

    fn average<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32, memory: u16) {
        let Some(averaging) = self.averaging(row, pixels.len(), shift_px, memory) else {
            return;
        };
        let width = pixels.len();
        if let Some(mean) = self.storage.mean.get_mut(row * width..(row + 1) * width) {
            averaging.all(self.config.kernel, mean, pixels);
        }
    }

    /// How the present line is to be averaged into its row; the row is counted to have seen it.
    pub(super) fn averaging(
        &mut self,
        row: usize,
        width: usize,
        shift_px: f32,
        memory: u16,
    ) -> Option<Averaging> {
        let learning = self.storage.learning.get_mut(row)?;
        learning.frames = learning.frames.saturating_add(1).min(memory);
        let keep = 1.0 / f32::from(learning.frames);
        // A line ten times darker than its reference is no measure of brightness.
        let bright = match self.to_reference {
            bright if bright < 10.0 => bright,
            _ => 1.0,
        };
        learning.light += (1.0 / bright - learning.light) * keep;
        let recipe = &self.recipe;
        Some(Averaging::new(shift_px, keep * bright, keep, recipe, width))
    }

    pub(super) fn measure_noise<P: Pixel>(
        &mut self,
        row: usize,
        pixels: &[P],
        shift_px: f32,
        frames: u16,
    ) {
        let width = pixels.len();
        let Some(mean) = self.storage.mean.get(row * width..(row + 1) * width) else {
            return;
        };
        if frames >= 2 || self.stage == Stage::Rough && frames >= 1 {
            let frames = f32::from(frames);
            self.meter.add_line(
                mean,
                pixels,
                shift_px,
                1.0 / self.to_reference,
                &self.recipe,
                frames,
            );
        }
    }

    pub(super) fn settle_noise(&mut self) {
        if let Some(noise) = self.meter.noise(self.recipe.saturation) {
            self.recipe.noise = noise;
        }
    }

    /// Small motion stays within the polynomial and needs no margin.
    fn settle_margin(&mut self) {
        let range = self.range_px.min(f32::from(self.config.width / 3));
        self.recipe.margin_px = if range < SMALL_MOTION_PX {
            0
        } else {
            (range * 1.25) as usize + 2
        };
    }

    /// The level that finds the most information in the picture: the coarsest of those that find about as much.
    fn choose_level(&mut self) {
        let rows = usize::from(self.config.rows);
        let step = rows.div_ceil(TRIAL_ROWS).max(1);
        let mut best = (0.0, Level::Medium);
        for level in Level::ALL {
            self.recipe.level = level;
            let mut information = 0.0;
            for row in (0..rows).step_by(step) {
                self.build(row);
                let table = self.storage.tables.get(row);
                information += table.map_or(0.0, RowTable::information_per_px2);
            }
            if information > best.0 * AS_MUCH {
                best = (information.max(best.0), level);
            }
        }
        self.recipe.level = best.1;
    }

    /// Gives each row the mean brightness of its lines: that of the first frame, against which they were
    /// all brought, bears the pattern of a flickering lamp.
    fn even_light(&mut self) {
        let width = usize::from(self.config.width);
        let rows = self.storage.mean.chunks_exact_mut(width);
        for (mean, learning) in rows.zip(self.storage.learning.iter()) {
            if learning.light > 0.0 {
                for m in mean {
                    *m = (f32::from(*m) * learning.light + 0.5) as u16;
                }
            }
        }
    }

    /// Moves each row's reference to the middle of its motion: the first frame, to which it is anchored,
    /// may have met the picture anywhere, and elsewhere in the next row.
    fn centre_rows(&mut self) {
        let width = usize::from(self.config.width);
        let rows = self.storage.mean.chunks_exact_mut(width);
        for (mean, learning) in rows.zip(self.storage.learning.iter_mut()) {
            align::move_row_by(
                mean,
                learning.shift_px,
                self.recipe.stride,
                self.storage.scratch,
            );
            learning.shift_px = 0.0;
        }
    }

    /// Mean information of the rows with texture, 1/px².
    fn usual_information(&self) -> f32 {
        let rows = self
            .storage
            .tables
            .iter()
            .map(RowTable::information_per_px2);
        let (sum, n) = rows
            .filter(|&information| information > 0.0)
            .fold((0.0f32, 0.0f32), |(sum, n), information| {
                (sum + information, n + 1.0)
            });
        sum / n.max(1.0)
    }

    /// Mean of the rows', weighted like their shifts.
    fn usual_curvature(&self) -> Curvature {
        let (mut sum, mut all) = (0.0f32, 0.0f32);
        for table in self.storage.tables.iter() {
            let information = table.information_per_px2();
            sum += information * table.curvature_per_px2();
            all += information;
        }
        Curvature::of_per_px2(sum / all)
    }

    fn build_all(&mut self) {
        for row in 0..usize::from(self.config.rows) {
            self.build(row);
        }
    }

    /// A live column is never still: it has noise, and its rows differ. What never changes is dead.
    fn note_activity<P: Pixel>(&mut self, pixels: &[P]) {
        for (&p, column) in pixels.iter().zip(self.storage.columns.iter_mut()) {
            let value = *column.first.get_or_insert(p.value());
            column.changes = column.changes.saturating_add(u16::from(p.value() != value));
        }
    }

    /// Masks columns that never changed while their neighbours did: up to three side by side. (A longer
    /// run is a part of the picture without noise, a clipped one say, and knows nothing anyway.)
    fn mask_dead_columns(&mut self) {
        let reach = MAX_HALF * usize::from(self.config.stride);
        let columns = &self.storage.columns;
        let dead = |x: usize| {
            columns
                .get(x)
                .is_some_and(|c: &ColumnLearning| c.changes == 0)
        };
        let mut x = 0;
        while x < columns.len() {
            let mut run = 0;
            while dead(x + run) {
                run += 1;
            }
            let alone = x > 0 && x + run < columns.len();
            if alone && (1..=3).contains(&run) {
                // The band's filter must not reach a dead column either.
                let from = x.saturating_sub(reach);
                let mask = self.storage.mask.iter_mut().skip(from);
                mask.take(x - from + run + reach).for_each(|m| *m = 0);
            }
            x += run + 1;
        }
    }
}
