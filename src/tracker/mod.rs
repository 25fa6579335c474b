//! Lines become displacements: learning the reference, following it, and knowing when it is lost.
//!
//! A [`Tracker`] is pushed every line of every frame. It first *learns* (`learn.rs`): the first frame is
//! the first reference, and each later line is aligned by its own estimate before it is averaged in, so
//! that motion does not blur the reference (the thesis's Algorithm 1, as a running mean). A second round
//! over as many frames refines it: only then is the motion's range known, and with it the margin and the
//! level of the band. Then it *tracks*: one inner product a line, at the whole shift where the rows
//! before it were. Now and then, and whenever a line surprises, it checks whether the line still resembles
//! its reference (`check.rs`); if not, it searches, and if that finds nothing either, the line is
//! occluded. The reference slowly follows the picture, as a background job.

mod blur;
mod check;
mod config;
mod correlate;
mod counts;
mod frame;
mod gap;
mod learn;
mod light;
mod line;
mod locate;
mod memory;
mod overlap;
#[cfg(feature = "long-exposure")]
mod path;
mod planar;
mod predict;
mod print;
mod residual;
mod row;
mod schedule;
mod search;
#[cfg(test)]
mod tests;
mod vetting;

pub use crate::reference::{
    ColumnLearning, RowLearning, StaticStorage, StaticVerticalStorage, Storage, VerticalStorage,
};
pub use config::{Axes, Config, ConfigError};
pub use counts::Counts;
pub use memory::picture_bytes;

use crate::{
    camera::{Line, Pixels, UpperBytes},
    reference::{
        NoiseMeter, Recipe, RowTable, Store, VerticalTable, band::Level, noise::PixelNoise,
    },
    timeline::{Begin, Binner, Curvature, Displacement, RowShift, Sample},
};
use blur::Blur;
use check::Check;
use correlate::{Correlator, Sums};
use light::Light;
use line::{Place, Rejected};
use planar::Planar;
use predict::Prediction;
use print::Copies;
use schedule::{FastRows, Schedule};
use vetting::Vetting;

/// Where the shifts of rows go, and where the group before them goes when it is complete.
type Bins<'b> = (&'b mut Binner, &'b mut Option<Sample>);

/// The outcome of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Its shift.
    Measured(Displacement),
    /// The reference is still being learned.
    Learning,
    /// The row has too little texture.
    NoTexture,
    /// The line does not look like its reference: something passes through the picture.
    Occluded,
    /// The line has less than an eighth of its reference's light.
    Unlit,
    /// The line is a copy, in a frame all of whose lines so far are those of the frame before.
    Repeated,
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
// In this order in memory: a microcontroller reaches what every line needs, which is first, without a sum.
#[repr(C)]
#[derive(Debug)]
pub struct Tracker<'a> {
    prediction: Prediction,
    light: Light,
    correlator: Correlator,
    counts: Counts,
    schedule: Schedule,
    /// See [`Tracker::curvature`]; where lines are not unsmeared one by one.
    curvature: Curvature,
    planar: Planar,
    store: Store<'a>,
    config: Config,
    /// Where a line of scattered pixels is brought together.
    room: &'a mut [u8],
    stage: Stage,
    frame: Option<u32>,
    frames_in_stage: u16,
    blur: Blur,
    #[cfg(feature = "long-exposure")]
    paths: path::Paths,
    meter: NoiseMeter,
    vetting: Vetting,
    copies: Copies,
    /// Largest shift of the round before, px; beyond reach in the first round.
    range_px: f32,
    check: Check,
}

impl<'a> Tracker<'a> {
    /// A tracker that has learned nothing yet. `storage.mask` is kept as given; the other buffers are
    /// overwritten.
    ///
    /// # Errors
    /// [`ConfigError`] names the field that is out of range, or the buffer that is too short.
    pub fn new(mut config: Config, storage: Storage<'a>) -> Result<Self, ConfigError> {
        let storage = config.check(storage)?;
        if config.columns_per_line != u16::MAX {
            config.kernel = config.kernel.with_half_the_light();
        }
        let values = config.values();
        let recipe = Recipe {
            level: config.level.unwrap_or(Level::Medium),
            stride: usize::from(config.stride),
            margin_px: 0,
            noise: PixelNoise::guess(values),
            pattern: 0.0,
            counts_per_value: 32768.0 / values,
            saturation: config.saturation(),
            kernel: config.kernel,
        };
        let mut tracker = Self {
            config,
            store: Store::new(storage, recipe, config.width),
            room: &mut [],
            stage: Stage::Rough,
            frame: None,
            frames_in_stage: 0,
            prediction: Prediction::default(),
            light: Light::new(&config.timing),
            blur: Blur::new(&config.timing),
            planar: Planar::default(),
            #[cfg(feature = "long-exposure")]
            paths: path::Paths::new(
                &config.timing,
                config.stride,
                config.columns_per_line != u16::MAX,
            ),
            meter: NoiseMeter::default(),
            vetting: Vetting::default(),
            copies: Copies::default(),
            range_px: f32::INFINITY,
            check: Check::new(search::starts(&config)),
            correlator: Correlator::learning(config.stride),
            schedule: Schedule::new(),
            curvature: Curvature::default(),
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

    /// The band's level in use.
    pub fn level(&self) -> Level {
        self.store.recipe().level
    }

    /// The rows' tables, one a row.
    pub fn tables(&self) -> &[RowTable] {
        self.store.tables()
    }

    /// What the rows know of the motion along the columns, one a row; none with [`Axes::X`].
    pub fn vertical_tables(&self) -> &[VerticalTable] {
        self.store.vertical_tables()
    }

    /// Curvature of the rows, mean by information: what a fast tone's amplitude needs, told with every sample. 0 while
    /// learning, and where the motion is so large that each line is corrected for its own smear.
    pub fn curvature(&self) -> Curvature {
        if self.prediction.is_swift() {
            Curvature::default()
        } else {
            self.curvature
        }
    }

    /// How rows become coefficients, as it was learned.
    pub fn recipe(&self) -> &Recipe {
        self.store.recipe()
    }

    /// A row of the reference picture, in [counts](Recipe::counts_per_value); `None` below the last.
    pub fn reference(&self, row: u16) -> Option<&[u16]> {
        self.store.mean(row.into())
    }

    /// Weight of each column, 255 for one that counts in full, 0 for one that sees nothing.
    pub fn mask(&self) -> &[u8] {
        self.store.mask()
    }

    /// How many frames a row of the reference is the mean of; 0 below the last.
    pub fn learned_frames(&self, row: u16) -> u16 {
        self.store
            .learning(row.into())
            .map_or(0, |row| row.frames())
    }

    /// The sensor's fixed pattern (unequal gains and offsets of its pixels: PRNU and DSNU of EMVA 1288, sections 4 and 8),
    /// known from elsewhere: its variance as a share of the pixels' temporal noise's, 0 or greater. It does not move
    /// with the picture, but looks like texture, and shifts would come out too small. All rows are built again; not for a
    /// board that hurries.
    pub fn set_fixed_pattern(&mut self, share: f32) {
        let known = share > 0.0 && share.is_finite();
        self.store.set_pattern(if known { share } else { 0.0 });
        if self.config.level.is_none() {
            self.store.choose_level();
        }
        self.store.build_all();
        let usual_information = self.store.usual_information();
        self.prediction.expect_information(usual_information);
        if self.store.is_planar() {
            self.planar.end_round(self.store.usual_curvatures_per_px2());
        }
        self.curvature = Curvature::of_per_px2(self.store.usual_curvature_per_px2());
    }

    /// What became of the lines so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// How often a line of a texture that repeats along x was found more than 3 px from where the lines before it led, since
    /// the beginning: at another of its repetitions, or before it was. What was measured since may be off by their distance. 0 while
    /// the motion is small, and with [`Config::columns_per_line`].
    #[cfg(feature = "long-exposure")]
    pub fn slips(&self) -> u32 {
        self.paths.slips
    }

    /// Takes one line.
    #[inline]
    pub fn push(&mut self, line: &Line<'_>) -> Outcome {
        match line.pixels {
            Pixels::U8(p) => self.push_u8(line, p),
            Pixels::U16(p) => self.push_u16(line, p),
            Pixels::Upper(ref p) => self.push_upper(line, p),
        }
    }

    /// A frame has begun, in which this row does not take the fast path (0 for none).
    pub(crate) fn begin_frame(&mut self, pause_row: u16) {
        self.schedule.pause_row = pause_row;
        self.schedule.fast_path.end();
        self.planar.fast = FastRows::default();
    }

    /// The line is expected to take the fast path: its frame has begun, and its row is not that of
    /// [`Tracker::begin_frame`].
    #[inline(always)]
    pub(crate) fn expects(&self, line: &Line<'_>) -> bool {
        self.schedule.fast_path.has(line)
    }

    /// Takes one line that it [expects](Tracker::expects) and passes what it measures on to `binner`. Says whether the group of
    /// rows before it is complete, which is in `done` then. As [`Tracker::push`] and [`Binner::push`] one after the
    /// other, in fewer instructions.
    // Not inlined and not generic: compiled here, as this crate is. The pixels are taken from the line again where it turns
    // out to be unlike what was expected, or they would be kept for that.
    #[inline(never)]
    pub(crate) fn push_expected_into(
        &mut self,
        line: &Line<'_>,
        binner: &mut Binner,
        done: &mut Option<Sample>,
    ) -> bool {
        let Pixels::U8(pixels) = line.pixels else {
            return self.push_expected_wide_into(line, binner, done);
        };
        match self.take_expected(line, &pixels, false) {
            // At rest, so not swift.
            Ok(place) => self.pass_on(line, place, self.curvature, (binner, done)),
            Err(sums) => self.push_otherwise_into(line, sums, binner, done),
        }
    }

    /// [`Tracker::push_expected_into`] of other pixels than bytes.
    #[inline(never)]
    fn push_expected_wide_into(
        &mut self,
        line: &Line<'_>,
        binner: &mut Binner,
        done: &mut Option<Sample>,
    ) -> bool {
        let taken = match line.pixels {
            Pixels::U8(p) => self.take_expected(line, &p, false),
            Pixels::U16(p) => self.take_expected(line, &p, false),
            Pixels::Upper(ref p) => self.take_expected(line, p, false),
        };
        match taken {
            Ok(place) => self.pass_on(line, place, self.curvature, (binner, done)),
            Err(sums) => self.push_otherwise_into(line, sums, binner, done),
        }
    }

    /// [`Tracker::push_expected_into`] of a line that was not expected, or that turned out to be unlike that; `sums`: what is
    /// known of it.
    #[inline(never)]
    pub(crate) fn push_otherwise_into(
        &mut self,
        line: &Line<'_>,
        sums: Sums,
        binner: &mut Binner,
        done: &mut Option<Sample>,
    ) -> bool {
        let to = (binner, done);
        match line.pixels {
            Pixels::U8(p) => self.take_otherwise_into(line, p, sums, to),
            Pixels::U16(p) => self.take_otherwise_into(line, p, sums, to),
            Pixels::Upper(ref p) => self.take_scattered_otherwise_into(line, p, sums, to),
        }
    }

    // Not inlined and not generic: compiled here, as this crate is, and what a firmware never pushes is left out.
    #[inline(never)]
    fn push_u8(&mut self, line: &Line<'_>, pixels: &[u8]) -> Outcome {
        let place = self.take(line, pixels);
        self.outcome(line, place)
    }

    #[inline(never)]
    fn push_u16(&mut self, line: &Line<'_>, pixels: &[u16]) -> Outcome {
        let place = self.take(line, pixels);
        self.outcome(line, place)
    }

    #[inline(never)]
    fn push_upper(&mut self, line: &Line<'_>, pixels: &UpperBytes<'_>) -> Outcome {
        let place = self.take_scattered(line, pixels);
        self.outcome(line, place)
    }

    #[inline(always)]
    fn outcome(&self, line: &Line<'_>, place: Result<Place, Rejected>) -> Outcome {
        let time_ns = || {
            let delay_ns = self.light.delay_ns().unwrap_or(0.0) as i32;
            self.middle_ns(line).wrapping_add(i64::from(delay_ns))
        };
        match place {
            Ok(_) if self.store.is_planar() => {
                Outcome::Measured(self.planar_displacement(line, time_ns()))
            }
            Ok(place) => Outcome::Measured(Displacement {
                frame: line.frame,
                row: line.row,
                time_ns: time_ns(),
                shift_px: place.shift_px + self.store.anchor_px(),
                information_per_px2: place.information_per_px2,
                vertical: None,
            }),
            Err(Rejected::Learning) => Outcome::Learning,
            Err(Rejected::NoTexture) => Outcome::NoTexture,
            Err(Rejected::Occluded) => Outcome::Occluded,
            Err(Rejected::Unlit) => Outcome::Unlit,
            Err(Rejected::Repeated) => Outcome::Repeated,
            Err(Rejected::Misfit) => Outcome::Misfit,
        }
    }

    #[inline(always)]
    fn pass_on(
        &self,
        line: &Line<'_>,
        place: Place,
        curvature: Curvature,
        (binner, done): Bins<'_>,
    ) -> bool {
        let Place {
            shift_px,
            information_per_px2,
        } = place;
        let row = RowShift {
            frame: line.frame,
            row: line.row,
            shift_px,
            information_per_px2,
        };
        let begin = || Begin {
            middle_ns: self.middle_ns(line),
            curvature,
            to_reference: self.light.to_reference,
            anchor_px: self.store.anchor_px(),
        };
        binner.push_row(row, begin, done)
    }

    /// Middle of a line's exposure, ns on the camera's clock.
    #[inline(always)]
    fn middle_ns(&self, line: &Line<'_>) -> i64 {
        line.start_ns
            .wrapping_add(i64::from(self.config.timing.exposure_ns() / 2))
    }

    /// What a line may need is bounded: not while learning, which cannot be done in a line time.
    fn is_hurried(&self) -> bool {
        self.stage == Stage::Tracking && self.config.columns_per_line != u16::MAX
    }
}

/// The nearest whole number, as fast as a cast. Saturates; 0 for NaN.
#[inline]
fn nearest(v: f32) -> i32 {
    (v + 0.5f32.copysign(v)) as i32
}
