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
mod row;
#[cfg(test)]
mod tests;
mod watch;

pub use config::{Config, ConfigError, Storage};
pub use counts::Counts;
pub use learn::{ColumnLearning, RowLearning};

use crate::{
    band::Level,
    camera::{Line, Pixels, Timing, UpperBytes},
    noise::{NoiseMeter, PixelNoise},
    pixel::Pixel,
    reference::{Recipe, RowTable},
    timeline::{Binner, Displacement, Sample},
};
use blur::Blur;
use flicker::{Flicker, STEEPEST};
use follow::Follow;
use overlap::{Overlap, nearest_step};
use predict::Prediction;
use row::{Row, Scattered};
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
    /// Where a line of scattered pixels is brought together.
    room: &'a mut [u8],
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
    /// There is something to be done beside the next line: the reference is followed, or a lost picture
    /// is looked for.
    beside: bool,
    /// The row from which on the next line is looked at.
    attend: usize,
    /// Half the pixels from one to the next of the same colour, and [`NEAR_PX`] of them.
    half_step_px: f32,
    near_px: f32,
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

/// Why a line has no shift.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unfound {
    /// The result is no finite number.
    NoNumber,
    /// It would take more inner products than there is time for; where it seemed to be so far, px.
    Unfinished(f32),
}

/// Inner products that a line may take: as it likes, and where a line time is short.
const TURNS: u8 = 6;
const TURNS_IN_A_HURRY: u8 = 2;

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
            room: &mut [],
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
            beside: false,
            attend: 0,
            half_step_px: 0.5 * f32::from(config.stride),
            near_px: NEAR_PX * f32::from(config.stride),
            counts: Counts::default(),
        };
        tracker.relearn();
        Ok(tracker)
    }

    /// Lends the room that lines of [`Pixels::Upper`] need, which are brought together there when the motion is large:
    /// a line's width, best [`UpperBytes::SPARE`] more. Without it
    /// such lines are misfits.
    #[must_use]
    pub fn with_line_room(mut self, room: &'a mut [u8]) -> Self {
        self.room = room;
        self
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
        match line.pixels {
            Pixels::U8(p) => self.push_u8(line, p),
            Pixels::U16(p) => self.push_u16(line, p),
            Pixels::Upper(p) => self.push_upper(line, p),
        }
    }

    /// Takes one line and passes what it measures on to `binner`: a group of rows that is complete. As
    /// [`Tracker::push`] and [`Binner::push`] one after the other, in fewer instructions.
    #[inline]
    pub fn push_into(&mut self, line: &Line<'_>, binner: &mut Binner) -> Option<Sample> {
        match line.pixels {
            Pixels::U8(p) => self.push_u8_into(line, p, binner),
            Pixels::U16(p) => self.push_u16_into(line, p, binner),
            Pixels::Upper(p) => self.push_upper_into(line, p, binner),
        }
    }

    // Not inlined and not generic: compiled here, as this crate is, and what a firmware never pushes is left out.
    #[inline(never)]
    fn push_u8(&mut self, line: &Line<'_>, pixels: &[u8]) -> Outcome {
        self.push_pixels(line, pixels)
    }

    #[inline(never)]
    fn push_u16(&mut self, line: &Line<'_>, pixels: &[u16]) -> Outcome {
        self.push_pixels(line, pixels)
    }

    #[inline(never)]
    fn push_u8_into(&mut self, line: &Line<'_>, p: &[u8], binner: &mut Binner) -> Option<Sample> {
        match self.push_pixels(line, p) {
            Outcome::Measured(displacement) => binner.push_sound(displacement),
            _ => None,
        }
    }

    #[inline(never)]
    fn push_u16_into(&mut self, line: &Line<'_>, p: &[u16], binner: &mut Binner) -> Option<Sample> {
        match self.push_pixels(line, p) {
            Outcome::Measured(displacement) => binner.push_sound(displacement),
            _ => None,
        }
    }

    #[inline(never)]
    fn push_upper(&mut self, line: &Line<'_>, pixels: UpperBytes<'_>) -> Outcome {
        self.push_scattered(line, pixels)
    }

    #[inline(always)]
    fn push_scattered(&mut self, line: &Line<'_>, upper: UpperBytes<'_>) -> Outcome {
        let room = core::mem::take(&mut self.room);
        let outcome = match Scattered::new(upper, self.config.kernel, &mut *room) {
            Some(row) => self.push_pixels(line, row),
            None => self.misfit(),
        };
        self.room = room;
        outcome
    }

    #[inline(never)]
    fn push_upper_into(
        &mut self,
        line: &Line<'_>,
        p: UpperBytes<'_>,
        binner: &mut Binner,
    ) -> Option<Sample> {
        match self.push_scattered(line, p) {
            Outcome::Measured(displacement) => binner.push_sound(displacement),
            _ => None,
        }
    }

    fn misfit(&mut self) -> Outcome {
        self.counts.misfit = self.counts.misfit.wrapping_add(1);
        Outcome::Misfit
    }

    /// What every line takes, in a straight line; what only some take is called.
    #[inline(always)]
    fn push_pixels<R: Row>(&mut self, line: &Line<'_>, mut pixels: R) -> Outcome {
        let row = usize::from(line.row);
        if line.row >= self.config.rows || pixels.len() != usize::from(self.config.width) {
            return self.misfit();
        }
        if self.frame != Some(line.frame) {
            self.next_frame(line.frame, line.start_ns);
        }
        let mut aside_px = 0.0;
        if self.beside && self.stage == Stage::Tracking {
            aside_px = self.work_beside::<R::P>(row);
        }
        let found = self.locate(row, &mut pixels, aside_px);
        if self.stage != Stage::Tracking {
            self.counts.learning = self.counts.learning.wrapping_add(1);
            self.learn(row, pixels.pixels(), found);
            return Outcome::Learning;
        }
        match found {
            Found::NoTexture => {
                self.counts.no_texture = self.counts.no_texture.wrapping_add(1);
                Outcome::NoTexture
            }
            Found::Disturbed => {
                self.counts.disturbed = self.counts.disturbed.wrapping_add(1);
                Outcome::Disturbed
            }
            Found::At {
                shift_px,
                information_per_px2,
            } => {
                self.counts.measured = self.counts.measured.wrapping_add(1);
                Outcome::Measured(Displacement {
                    frame: line.frame,
                    row: line.row,
                    time_ns: line.start_ns.wrapping_add(self.middle_ns()),
                    shift_px: shift_px + self.follow.anchor_px(),
                    information_per_px2,
                })
            }
        }
    }

    /// What a line may need is bounded: not while learning, which cannot be done in a line time.
    fn is_hurried(&self) -> bool {
        self.stage == Stage::Tracking && self.config.columns_per_line != u16::MAX
    }

    /// What is done beside a line, when there is something. Returns by how much the row's reference lies to
    /// the left of the others', px.
    #[cold]
    #[inline(never)]
    fn work_beside<P: Pixel>(&mut self, row: usize) -> f32 {
        // A line that will be looked at has enough to do.
        let idle = row < self.attend;
        let aside_px = if idle || self.follow.is_moving() || !self.is_hurried() {
            self.follow_one_step::<P>(row)
        } else {
            0.0
        };
        if let Some(start_px) = self.start_px() {
            self.prediction.suppose(start_px);
        }
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        aside_px
    }

    /// From the start of a line's exposure to its mean time, ns.
    #[inline(always)]
    fn middle_ns(&self) -> i64 {
        let half = (self.config.timing.exposure_ns() / 2) as i32;
        i64::from(half.saturating_add(self.flicker.delay_ns(self.ns_per_slope)))
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
        self.frames_in_stage = self.frames_in_stage.saturating_add(1);
        self.frame = Some(frame);
        self.turn = self.turn_of(frame);
        self.prediction
            .begin_frame(start_ns, self.stage != Stage::Rough);
        self.watch.begin_frame(frame);
        self.attend = 0;
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        self.flicker.begin_frame();
    }

    /// Shift of a line against the reference, whose row lies `aside_px` to the left of the others.
    #[inline(always)]
    fn locate<R: Row>(&mut self, row: usize, pixels: &mut R, aside_px: f32) -> Found {
        let Some(&table) = self.storage.tables.get(row) else {
            return Found::NoTexture;
        };
        if !table.has_texture() {
            return Found::NoTexture;
        }
        let information_per_px2 = table.information_per_px2();
        let expected = self.prediction.at(row) + aside_px;
        let before = self.to_reference;
        let mut shift_px = match self.correlate(row, &table, pixels, expected) {
            Ok(shift_px) => shift_px,
            Err(Unfound::NoNumber) => return Found::NoTexture,
            Err(Unfound::Unfinished(shift_px)) => {
                self.leave(shift_px - aside_px);
                return Found::Disturbed;
            }
        };
        let surprise = shift_px - expected;
        // How much brighter than the line before it, against their references.
        let mut brighter = before / self.to_reference - 1.0;
        let due = row >= self.attend
            || surprise * surprise * information_per_px2 > 49.0 + information_per_px2
            || brighter.abs() > STEEPEST;
        let mut jumped = false;
        if due {
            let Some(looked) = self.look_and_follow(row, &table, pixels.pixels(), shift_px) else {
                return Found::Disturbed;
            };
            shift_px = looked;
            jumped = (shift_px - expected).abs() > JUMP_PX;
            brighter = before / self.to_reference - 1.0;
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
        self.flicker.add(brighter);
        Found::At {
            shift_px,
            information_per_px2,
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
        if self.prediction.needs_more_than(table.information_per_px2()) {
            return None;
        }
        let looked = self.look(row, table, pixels, shift_px);
        if let Some(shift_px) = looked
            && self.turn == row
        {
            self.follow_row(row, pixels, shift_px);
        }
        self.attend = self.watch.next_due(row);
        if self.turn > row {
            self.attend = self.attend.min(self.turn);
        }
        self.beside = self.follow.is_busy() || self.watch.is_searching();
        looked
    }

    /// The phase-correlation peak of a line near `expected_px`: one inner product where the motion is
    /// small.
    #[inline(always)]
    fn correlate<R: Row>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &mut R,
        expected_px: f32,
    ) -> Result<f32, Unfound> {
        // The common case: less than half a step from the reference, the whole line meets the whole row.
        if expected_px.abs() < self.half_step_px {
            let Some(coefficients) = part(self.storage.coefficients, row, pixels.len()) else {
                return Err(Unfound::NoNumber);
            };
            let (product, sum) = pixels.sums(self.config.kernel, coefficients);
            // A black line has no brightness to divide by, and no texture to measure.
            self.to_reference = at_least_1(table.pixel_sum()) / at_least_1(sum);
            let near = table.shift_px(product * self.to_reference);
            if near.abs() <= self.near_px {
                return Ok(near);
            }
            let near = near.clamp(-4.0, 4.0);
            return self.correlate_far(row, table, pixels.pixels(), near, 1);
        }
        self.correlate_far(row, table, pixels.pixels(), expected_px, 0)
    }

    /// [`Tracker::correlate`] where the picture has moved by whole pixels: one inner product where that was
    /// foreseen, a few where not. `done`: how many were taken before.
    #[inline(never)]
    fn correlate_far<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
        done: u8,
    ) -> Result<f32, Unfound> {
        let hurried = self.is_hurried();
        let turns = if hurried { TURNS_IN_A_HURRY } else { TURNS };
        let far = self.converge(row, table, pixels, expected_px, turns - done);
        match far {
            Some((shift_px, true)) => Ok(shift_px),
            Some((shift_px, false)) if hurried => Err(Unfound::Unfinished(shift_px)),
            Some((shift_px, false)) => Ok(shift_px),
            None => Err(Unfound::NoNumber),
        }
    }

    /// The shift after so many inner products, and whether one more would not change it.
    #[inline(always)]
    fn converge<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        expected_px: f32,
        turns: u8,
    ) -> Option<(f32, bool)> {
        let width = pixels.len();
        let coefficients = part(self.storage.coefficients, row, width)?;
        let mean = part(self.storage.mean, row, width)?;
        let stride = i32::from(self.config.stride);
        let limit = width as i32 / 2;
        let steps = |px: f32| nearest_step(px, stride);
        let mut whole = steps(expected_px).clamp(-limit, limit);
        let mut shift_px = f32::NAN;
        let mut converged = false;
        for _ in 0..turns {
            let overlap = Overlap::new(width, whole)?;
            let (product, sum) = P::sums(
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
            self.to_reference = at_least_1(seen) / at_least_1(sum);
            let near = table.shift_px(product * self.to_reference);
            shift_px = whole as f32 + near;
            let next = (whole + steps(near.clamp(-4.0, 4.0))).clamp(-limit, limit);
            converged = near.abs() <= self.near_px || next == whole;
            if converged {
                break;
            }
            whole = next;
        }
        shift_px.is_finite().then_some((shift_px, converged))
    }
}

/// A row of a buffer that holds one row after the other.
#[inline(always)]
fn part<T>(buffer: &[T], row: usize, width: usize) -> Option<&[T]> {
    buffer.get(row * width..)?.get(..width)
}

/// 1 for NaN; `f32::max` takes a microcontroller twice as long.
#[inline(always)]
fn at_least_1(v: f32) -> f32 {
    if v > 1.0 { v } else { 1.0 }
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
