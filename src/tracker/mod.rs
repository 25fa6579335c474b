//! Lines become displacements: learning the reference, following it, and knowing when it is lost.
//!
//! A [`Tracker`] is pushed every line of every frame. It first *learns* (`learn.rs`): the first frame is
//! the first reference, and each later line is aligned by its own estimate before it is averaged in, so
//! that motion does not blur the reference (the thesis's Algorithm 1, as a running mean). A second round
//! over as many frames refines it: only then is the motion's range known, and with it the margin and the
//! level of the band. Then it *tracks*: one inner product a line, at the whole shift where the rows
//! before it were. Now and then, and whenever a line surprises, it looks whether the line still resembles
//! its reference (`watch.rs`); if not, it searches, and if that finds nothing either, the line is
//! disturbed. The reference slowly follows the picture (`follow.rs`).

mod blur;
mod config;
mod counts;
mod flicker;
mod follow;
mod gap;
mod learn;
mod overlap;
mod predict;
#[cfg(test)]
mod tests;
mod watch;

pub use config::{Config, ConfigError, Storage};
pub use counts::Counts;
pub use learn::{ColumnLearning, RowLearning};

use crate::{
    band::Level,
    camera::{Line, Pixels, Timing},
    noise::{NoiseMeter, PixelNoise},
    pixel::Pixel,
    reference::{Recipe, RowTable},
    timeline::Displacement,
};
use blur::Blur;
use flicker::Flicker;
use follow::Follow;
use overlap::{Overlap, nearest_step};
use predict::Prediction;
use watch::Watch;

/// What a line came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Its shift.
    Measured(Displacement),
    /// The reference is still being learned.
    Learning,
    /// The row has too little texture.
    NoTexture,
    /// The line does not look like its reference: something passes through the picture.
    Disturbed,
    /// The line has another width, or a row that is not there.
    Misfit,
}

/// Which round a tracker is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The first reference: anchored to the first frame.
    Rough,
    /// The reference at the middle of the motion.
    Refining,
    /// Measuring.
    Tracking,
}

/// See the [module](self).
#[derive(Debug)]
pub struct Tracker<'a> {
    config: Config,
    storage: Storage<'a>,
    recipe: Recipe,
    stage: Stage,
    frame: Option<u32>,
    frames_in_stage: u16,
    prediction: Prediction,
    /// The factor that brings the last line to its reference's brightness.
    to_reference: f32,
    flicker: Flicker,
    /// T²/(12·line time): what a relative change of the light from row to row delays the exposure's mean
    /// time by, ns. 0 with a global shutter.
    ns_per_slope: f32,
    blur: Blur,
    meter: NoiseMeter,
    /// Largest shift met in this round, px.
    range_px: f32,
    watch: Watch,
    follow: Follow,
    /// The row of this frame from which the reference is followed; none while learning.
    turn: usize,
    counts: Counts,
}

/// A line's shift against its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Found {
    At {
        shift_px: f32,
        information_per_px2: f32,
    },
    NoTexture,
    Disturbed,
}

/// Beyond this the row's polynomial is left for the next whole shift, px.
const NEAR_PX: f32 = 0.7;

/// A line that was looked at and is further than this from where it was expected has jumped, px.
const JUMP_PX: f32 = 1.0;

impl<'a> Tracker<'a> {
    /// A tracker that has learned nothing yet. `storage.mask` is kept as given; the other buffers are
    /// overwritten.
    ///
    /// # Errors
    /// [`ConfigError`] names the field that is out of range, or the buffer that is too short.
    pub fn new(config: Config, storage: Storage<'a>) -> Result<Self, ConfigError> {
        let storage = config.check(storage)?;
        let values = f32::from(1u16 << (config.bits - 1)) * 2.0;
        let mut tracker = Self {
            config,
            storage,
            recipe: Recipe {
                level: config.level.unwrap_or(Level::Medium),
                stride: usize::from(config.stride),
                margin_px: 0,
                noise: PixelNoise::guess(values),
                counts_per_value: 32768.0 / values,
                saturation: values * (254.0 / 256.0),
                kernel: config.kernel,
            },
            stage: Stage::Rough,
            frame: None,
            frames_in_stage: 0,
            prediction: Prediction::default(),
            to_reference: 1.0,
            flicker: Flicker::default(),
            ns_per_slope: ns_per_slope(&config.timing),
            blur: Blur::new(&config.timing),
            meter: NoiseMeter::default(),
            range_px: 0.0,
            watch: Watch::default(),
            follow: Follow::default(),
            turn: usize::MAX,
            counts: Counts::default(),
        };
        tracker.relearn();
        Ok(tracker)
    }

    /// Which round it is in.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Noise of one pixel, as measured while learning.
    pub fn pixel_noise(&self) -> PixelNoise {
        self.recipe.noise
    }

    /// The band's level in use.
    pub fn level(&self) -> Level {
        self.recipe.level
    }

    /// The rows' tables, one a row.
    pub fn tables(&self) -> &[RowTable] {
        self.storage.tables
    }

    /// What became of the lines so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Takes one line.
    #[inline]
    pub fn push(&mut self, line: &Line<'_>) -> Outcome {
        let outcome = match line.pixels {
            Pixels::U8(p) => self.push_u8(line, p),
            Pixels::U16(p) => self.push_u16(line, p),
        };
        self.counts.add(&outcome);
        outcome
    }

    // Not inlined and not generic: compiled here, as this crate is, and what a firmware never pushes is left out.
    fn push_u8(&mut self, line: &Line<'_>, pixels: &[u8]) -> Outcome {
        self.push_pixels(line, pixels)
    }

    fn push_u16(&mut self, line: &Line<'_>, pixels: &[u16]) -> Outcome {
        self.push_pixels(line, pixels)
    }

    #[inline]
    fn push_pixels<P: Pixel>(&mut self, line: &Line<'_>, pixels: &[P]) -> Outcome {
        let row = usize::from(line.row);
        if line.row >= self.config.rows || pixels.len() != usize::from(self.config.width) {
            return Outcome::Misfit;
        }
        if self.frame != Some(line.frame) {
            self.next_frame(line.frame, line.start_ns);
        }
        if self.stage != Stage::Tracking {
            self.learn(row, pixels);
            return Outcome::Learning;
        }
        self.follow_one_step(row);
        match self.locate(row, pixels) {
            Found::NoTexture => Outcome::NoTexture,
            Found::Disturbed => Outcome::Disturbed,
            Found::At {
                shift_px,
                information_per_px2,
            } => Outcome::Measured(Displacement {
                frame: line.frame,
                row: line.row,
                time_ns: line
                    .start_ns
                    .saturating_add(i64::from(self.config.timing.exposure_ns() / 2))
                    .saturating_add(self.flicker.delay_ns(self.ns_per_slope)),
                shift_px: shift_px + self.follow.anchor_px(),
                information_per_px2,
            }),
        }
    }

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
        self.frames_in_stage = self.frames_in_stage.saturating_add(1);
        self.frame = Some(frame);
        self.turn = self.turn_of(frame);
        self.prediction
            .begin_frame(start_ns, self.stage != Stage::Rough);
        self.watch.begin_frame(frame);
        self.flicker.begin_frame();
    }

    /// Shift of a line against its reference, in the reference's own coordinates.
    #[inline]
    fn locate<P: Pixel>(&mut self, row: usize, pixels: &[P]) -> Found {
        let Some(&table) = self.storage.tables.get(row) else {
            return Found::NoTexture;
        };
        let information_per_px2 = table.information_per_px2();
        if information_per_px2 == 0.0 {
            return Found::NoTexture;
        }
        let expected = self.prediction.at(row);
        let before = self.to_reference;
        let Some(mut shift_px) = self.correlate(row, &table, pixels, expected) else {
            return Found::NoTexture;
        };
        let surprise = shift_px - expected;
        let turn = self.turn == row;
        let due = turn
            || self.watch.is_due(row)
            || surprise * surprise * information_per_px2 > 49.0 + information_per_px2
            || (self.to_reference - before).abs() > 0.05 * before;
        if due {
            match self.look(row, &table, pixels, shift_px) {
                Some(looked) => shift_px = looked,
                None => return Found::Disturbed,
            }
            if turn {
                self.follow_row(row, pixels, shift_px);
            }
        }
        if self.prediction.is_swift() {
            shift_px = self.unsmear(row, &table, pixels, shift_px);
        }
        if due && (shift_px - expected).abs() > JUMP_PX {
            self.prediction.jump(row, shift_px, information_per_px2);
        } else {
            self.prediction.add(row, shift_px, information_per_px2);
        }
        self.flicker.add(self.to_reference);
        Found::At {
            shift_px,
            information_per_px2,
        }
    }

    /// The phase-correlation peak of a line near `expected_px`: one inner product where the motion is
    /// small or was foreseen, a few where not. `None` for a result that is no number.
    #[inline]
    fn correlate<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
    ) -> Option<f32> {
        let width = pixels.len();
        let coefficients = self.storage.coefficients.get(row * width..)?.get(..width)?;
        let mean = self.storage.mean.get(row * width..)?.get(..width)?;
        let stride = i32::from(self.config.stride);
        let limit = width as i32 / 2;
        let steps = |px: f32| nearest_step(px, stride);
        let mut whole = steps(expected_px).clamp(-limit, limit);
        let mut shift_px = f32::NAN;
        for _ in 0..6 {
            let overlap = Overlap::new(width, whole)?;
            let sums = P::sums(
                self.config.kernel,
                pixels.get(overlap.line)?,
                coefficients.get(overlap.reference)?,
            );
            let unseen: u32 = mean
                .get(overlap.unseen)?
                .iter()
                .map(|&c| u32::from(c))
                .sum();
            let seen = table.pixel_sum() - unseen as f32 / self.recipe.counts_per_value;
            // A black line has no brightness to divide by, and no texture to measure.
            self.to_reference = seen.max(1.0) / (sums.pixels as f32).max(1.0);
            let near = table.shift_px(sums.product as f32 * self.to_reference);
            shift_px = whole as f32 + near;
            let next = (whole + steps(near.clamp(-4.0, 4.0))).clamp(-limit, limit);
            if near.abs() <= NEAR_PX * stride as f32 || next == whole {
                break;
            }
            whole = next;
        }
        shift_px.is_finite().then_some(shift_px)
    }
}

/// See [`flicker`].
fn ns_per_slope(timing: &Timing) -> f32 {
    if timing.is_global_shutter() {
        return 0.0;
    }
    let exposure_ns = timing.exposure_ns() as f32;
    exposure_ns * exposure_ns / (12.0 * timing.line_time_ps() as f32 / 1000.0)
}

/// The nearest whole number, as fast as a cast. Saturates; 0 for NaN.
#[inline]
fn nearest(v: f32) -> i32 {
    (v + 0.5f32.copysign(v)) as i32
}
