//! One part of the picture, its tracker and the tracker's memory.

use std::ops::Range;

use rowtone::camera::Timing;
use rowtone::timeline::{Binner, Curvature, Displacement, Sample};
use rowtone::tracker::{Axes, Config, ConfigError, Counts, Outcome, Tracker};

use crate::memory::TrackerMemory;
use rowtone_clip::{Frame, Rect};
use rowtone_failure::Failure;

/// How many lines could not be measured, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unmeasured {
    /// Rows without enough texture.
    pub no_texture: u32,
    /// Rows that something passed through.
    pub disturbed: u32,
    /// Rows too dark beside their reference.
    pub unlit: u32,
    /// Rows of copies of the frame before.
    pub repeated: u32,
    /// Rows that came while a reference was being learned anew.
    pub learning: u32,
}

impl Unmeasured {
    fn between(before: &Counts, after: &Counts) -> Self {
        let count = |count: fn(&Counts) -> u64| count(after).wrapping_sub(count(before)) as u32;
        Self {
            no_texture: count(|c| c.no_texture) + count(|c| c.misfit),
            disturbed: count(|c| c.occluded),
            unlit: count(|c| c.unlit),
            repeated: count(|c| c.repeated),
            learning: count(|c| c.learning),
        }
    }
}

impl std::ops::AddAssign for Unmeasured {
    fn add_assign(&mut self, other: Self) {
        self.no_texture += other.no_texture;
        self.disturbed += other.disturbed;
        self.unlit += other.unlit;
        self.repeated += other.repeated;
        self.learning += other.learning;
    }
}

/// A tracker on one part of the picture.
#[derive(Debug)]
pub struct Engine<'a> {
    part: Rect,
    rows: Range<usize>,
    timing: Timing,
    tracker: Tracker<'a>,
}

/// Fewer rows than this know too little of the rows beside them.
const LEAST_ROWS: usize = 8;

/// The axes that a part of a picture can be measured along: both want some rows.
pub(super) fn axes_of(part: &Rect, wanted: Axes) -> Axes {
    if part.height < LEAST_ROWS {
        Axes::X
    } else {
        wanted
    }
}

impl<'a> Engine<'a> {
    /// A tracker on `part` of a picture with this timing, along these axes; `memory` is for them. `bits`: of a pixel.
    ///
    /// # Errors
    /// [`Failure::Input`] when the part cannot be measured; `name` stands in front.
    pub fn new(
        part: Rect,
        timing: Timing,
        axes: Axes,
        bits: u8,
        learn_frames: u16,
        memory: &'a mut TrackerMemory,
        name: &str,
    ) -> Result<Self, Failure> {
        let refuse = |error: ConfigError| Failure::input(format!("{name}: {error}"));
        // Sizes beyond u16 were refused with the header.
        let width = u16::try_from(part.width).unwrap_or(u16::MAX);
        let config = Config {
            rows: part.height as u16,
            bits,
            axes,
            learn_frames,
            ..Config::new(timing, width)
        };
        let tracker = Tracker::new(config, memory.lend()).map_err(refuse)?;
        Ok(Self {
            part,
            rows: 0..part.height,
            timing,
            tracker,
        })
    }

    /// Only these rows of the part are measured, counted from its top.
    pub fn only_rows(mut self, rows: Range<usize>) -> Self {
        self.rows = rows;
        self
    }

    /// Shows the tracker a frame while it learns.
    pub fn learn(&mut self, frame: &Frame) {
        for line in frame.lines(&self.part, &self.timing, self.rows.clone()) {
            self.tracker.push(&line);
        }
    }

    /// Ends a round of learning.
    pub fn end_round(&mut self) {
        self.tracker.end_round();
    }

    /// What the tracker says of its rows, for the samples made of them.
    pub fn curvature(&self) -> Curvature {
        self.tracker.curvature()
    }

    /// A texture that repeats was read at another of its repetitions.
    pub fn slipped(&self) -> bool {
        self.tracker.slips() > 0
    }

    /// Measures every line of a frame and hands what came of it to `take`.
    pub fn measure(&mut self, frame: &Frame, mut take: impl FnMut(Displacement)) -> Unmeasured {
        let before = self.tracker.counts();
        for line in frame.lines(&self.part, &self.timing, self.rows.clone()) {
            if let Outcome::Measured(displacement) = self.tracker.push(&line) {
                take(displacement);
            }
        }
        Unmeasured::between(&before, &self.tracker.counts())
    }

    /// Measures every line of a frame, and hands the groups of rows that `binner` makes of them to `take`.
    pub fn measure_into(
        &mut self,
        frame: &Frame,
        binner: &mut Binner,
        mut take: impl FnMut(Sample),
    ) -> Unmeasured {
        let before = self.tracker.counts();
        for line in frame.lines(&self.part, &self.timing, self.rows.clone()) {
            if let Some(sample) = self.tracker.push_into(&line, binner) {
                take(sample);
            }
        }
        Unmeasured::between(&before, &self.tracker.counts())
    }
}
