//! One part of the picture, and the line side of the pipeline on it.

use std::ops::Range;

use rowtone::camera::Timing;
use rowtone::pipeline::{LineSide, Reading};
use rowtone::timeline::{Displacement, Group};
use rowtone::tracker::{Axes, Config, Outcome};

use super::pattern;
use crate::PartError;
use rowtone_clip::{Frame, Rect};
use rowtone_memory::TrackerMemory;

/// A line side on one part of the picture.
#[derive(Debug)]
pub struct Engine<'a> {
    part: Rect,
    rows: Range<usize>,
    timing: Timing,
    lines: LineSide<'a>,
}

/// What is wanted of the rows of a part.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// The axes along which they are measured.
    pub axes: Axes,
    /// How they are combined; none where only rows are asked for.
    pub group: Option<Group>,
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
    /// A line side on `part` of a picture with this timing and this many `bits` a pixel; `memory` is for the axes wanted.
    ///
    /// # Errors
    /// [`PartError`] when the part cannot be measured.
    pub fn new(
        part: Rect,
        timing: Timing,
        wanted: Wanted,
        bits: u8,
        learn_frames: u16,
        memory: &'a mut TrackerMemory,
    ) -> Result<Self, PartError> {
        // Sizes beyond u16 were refused with the header.
        let width = u16::try_from(part.width).unwrap_or(u16::MAX);
        let config = Config {
            rows: part.height as u16,
            bits,
            axes: wanted.axes,
            learn_frames,
            ..Config::new(timing, width)
        };
        let one_row = || Group::new(timing, 1);
        let group = wanted.group.map_or_else(one_row, Ok)?;
        let lines = LineSide::new(config, group, memory.lend())?;
        Ok(Self {
            part,
            rows: 0..part.height,
            timing,
            lines,
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
            self.lines.push_row(&line);
        }
    }

    /// Ends a round of learning.
    pub fn end_round(&mut self) {
        self.lines.end_round();
    }

    /// What the sensor's fixed pattern takes of the motion, as it stands in these frames, is made good; the reference was
    /// learned from the first of them.
    pub fn mend_pattern(&mut self, frames: &[Frame]) {
        let tracker = self.lines.tracker();
        if let Some(share) = pattern::share(frames, &self.part, self.rows.clone(), tracker) {
            self.lines.set_fixed_pattern(share);
        }
    }

    /// A texture that repeats was read at another of its repetitions; not known without the feature `long-exposure`.
    pub fn slipped(&self) -> bool {
        #[cfg(feature = "long-exposure")]
        return self.lines.tracker().slips() > 0;
        #[cfg(not(feature = "long-exposure"))]
        false
    }

    /// Measures every line of a frame and hands what came of it to `take`.
    pub fn measure(&mut self, frame: &Frame, mut take: impl FnMut(Displacement)) {
        for line in frame.lines(&self.part, &self.timing, self.rows.clone()) {
            if let Outcome::Measured(displacement) = self.lines.push_row(&line) {
                take(displacement);
            }
        }
    }

    /// Combines rows that [`Engine::measure`] gave, corrected, and hands what comes of them to `take`; the frame ends
    /// with them.
    pub fn combine(
        &mut self,
        rows: impl IntoIterator<Item = Displacement>,
        mut take: impl FnMut(Reading),
    ) {
        for row in rows {
            if let Some(reading) = self.lines.bin(row) {
                take(reading);
            }
        }
        self.end_frame(take);
    }

    /// Measures every line of a frame, and hands what comes of its groups of rows to `take`.
    pub fn measure_into(&mut self, frame: &Frame, mut take: impl FnMut(Reading)) {
        for line in frame.lines(&self.part, &self.timing, self.rows.clone()) {
            if let Some(&reading) = self.lines.push(&line) {
                take(reading);
            }
        }
        self.end_frame(take);
    }

    /// No group reaches over the end of a frame, and a frame without any group has its tally all the same.
    fn end_frame(&mut self, mut take: impl FnMut(Reading)) {
        take(self.lines.finish().unwrap_or_else(|| self.lines.rest()));
    }
}
