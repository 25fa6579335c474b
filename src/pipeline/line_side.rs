//! Lines to readings: the tracker, the binner, the light, and a tally of what became of the rows.

use super::{Light, Reading};
use crate::camera::Line;
use crate::timeline::{Binner, Displacement, Group, Sample, Tally};
use crate::tracker::{Config, ConfigError, Counts, Outcome, Storage, Tracker};

/// The line side of the pipeline.
///
/// Contract: [`LineSide::push`] takes every line as it comes, in the order of rows and frames, and never waits. It gives
/// a [`Reading`] where a group of rows is complete, to be pushed into a [`super::Collector`] (or a
/// [`super::ReportSide`]), if need be over a queue to another core; what finds no room in the queue goes back by
/// [`LineSide::drop_reading`], so that the loss is counted and said. At the end of the input
/// [`LineSide::finish`] gives the last reading.
#[derive(Debug)]
pub struct LineSide<'a> {
    tracker: Tracker<'a>,
    binner: Binner,
    bits: u8,
    rows: u16,
    light: Light,
    /// Of the last line.
    frame: u32,
    /// Its frame has not ended yet.
    in_frame: bool,
    /// The row of this frame whose light is looked at.
    lit_row: u16,
    /// As they were when they were counted last.
    counted: [u32; 7],
    /// What no reading has taken along yet, of frames up to this one, and that there is something.
    tally: Tally,
    ended: u32,
    tally_waits: bool,
    /// The last reading took a tally along.
    tally_given: bool,
    /// The last reading that [`LineSide::push`] gave.
    ready: Reading,
}

impl<'a> LineSide<'a> {
    /// A line side that has learned nothing yet, which combines rows to `group`s.
    ///
    /// # Errors
    /// [`ConfigError`] where the tracker refuses its config or its storage.
    pub fn new(config: Config, group: Group, storage: Storage<'a>) -> Result<Self, ConfigError> {
        Ok(Self {
            tracker: Tracker::new(config, storage)?,
            binner: Binner::new(group),
            bits: config.bits,
            rows: config.rows.max(1),
            light: Light::UNSEEN,
            frame: 0,
            in_frame: false,
            lit_row: 0,
            counted: [0; 7],
            tally: Tally::NONE,
            ended: 0,
            tally_waits: false,
            tally_given: false,
            ready: Reading {
                sample: None,
                tally: Tally::NONE,
                frame: 0,
            },
        })
    }

    /// As [`Tracker::with_line_room`].
    #[must_use]
    pub fn with_line_room(mut self, room: &'a mut [u8]) -> Self {
        self.tracker = self.tracker.with_line_room(room);
        self
    }

    /// Takes one line; gives what the group of rows before it measured, where this line begins another. (Lent, so that it
    /// is moved but once, to where the caller wants it.)
    #[inline(always)]
    pub fn push(&mut self, line: &Line<'_>) -> Option<&Reading> {
        let complete = if self.tracker.expects(line) {
            // Nothing else is to be done with it (`attend`).
            let done = &mut self.ready.sample;
            self.tracker
                .push_expected_into(line, &mut self.binner, done)
        } else {
            self.note_line(line);
            let done = &mut self.ready.sample;
            self.tracker
                .push_otherwise_into(line, None, &mut self.binner, done)
        };
        // Most lines end here: nothing of a reading is written for them.
        if !complete {
            return None;
        }
        if self.tally_waits {
            (self.ready.tally, self.ready.frame) = self.take_tally();
            self.tally_given = true;
        } else {
            if core::mem::take(&mut self.tally_given) {
                self.ready.tally = Tally::NONE;
            }
            self.ready.frame = line.frame;
        }
        Some(&self.ready)
    }

    /// Takes one line and gives what became of it, for callers that want every row; nothing goes to the binner. What
    /// shall become part of a sample goes on by [`LineSide::bin`].
    pub fn push_row(&mut self, line: &Line<'_>) -> Outcome {
        self.note_line(line);
        self.tracker.push(line)
    }

    /// Passes a row's displacement on that [`LineSide::push_row`] gave, corrected by the caller (for the camera's own
    /// motion, say); gives what the group of rows before it measured, where this row begins another.
    pub fn bin(&mut self, displacement: Displacement) -> Option<Reading> {
        self.binner.set_curvature(self.tracker.curvature());
        let sample = self.binner.push(displacement)?;
        Some(self.read(sample))
    }

    /// Ends a round of learning, for callers that know when; otherwise it ends after `learn_frames`.
    pub fn end_round(&mut self) {
        self.tracker.end_round();
    }

    /// Forgets the reference and learns again, as when the camera was moved.
    pub fn relearn(&mut self) {
        self.tracker.relearn();
    }

    /// No further rows of this frame come: gives the group of rows that is open.
    pub fn finish(&mut self) -> Option<Reading> {
        let sample = self.binner.finish();
        self.end_frame();
        sample.map(|sample| self.read(sample))
    }

    /// A reading found no room on its way: it is dropped, and the next one says so.
    pub fn drop_reading(&mut self, reading: &Reading) {
        let lost = u16::from(reading.sample.is_some());
        self.tally.add(&reading.tally);
        self.tally.dropped_samples = self.tally.dropped_samples.saturating_add(lost);
        self.tally_waits = true;
    }

    /// What no reading has taken along: after the last sample of the input, for [`super::Collector::push`].
    pub fn rest(&mut self) -> Reading {
        self.end_frame();
        let (tally, frame) = self.take_tally();
        Reading {
            sample: None,
            tally,
            frame,
        }
    }

    /// The tracker.
    pub const fn tracker(&self) -> &Tracker<'a> {
        &self.tracker
    }

    /// Tells the tracker of the sensor's [fixed pattern](Tracker::set_fixed_pattern).
    pub fn set_fixed_pattern(&mut self, share: f32) {
        self.tracker.set_fixed_pattern(share);
    }

    /// How bright the picture is, a running mean over some sixteen frames.
    pub const fn light(&self) -> Light {
        self.light
    }

    /// What became of the lines so far.
    pub fn counts(&self) -> Counts {
        self.tracker.counts()
    }

    #[inline(always)]
    fn note_line(&mut self, line: &Line<'_>) {
        // The first line of all is seen by its row, where its frame has the number that is held at first.
        if line.frame != self.frame || line.row == self.lit_row {
            self.attend(line);
        }
    }

    #[cold]
    #[inline(never)]
    fn attend(&mut self, line: &Line<'_>) {
        if line.frame != self.frame {
            self.end_frame();
            // Another one in every frame, but not its first, which has enough to do.
            let others = u32::from(self.rows).saturating_sub(1).max(1);
            self.lit_row = (line.frame % others) as u16 + u16::from(self.rows > 1);
            self.tracker.begin_frame(self.lit_row);
        }
        (self.frame, self.in_frame) = (line.frame, true);
        if line.row != self.lit_row {
            return;
        }
        self.light.follow(Light::of(&line.pixels, self.bits));
        let bad = u16::from(self.light.is_bad());
        self.tally.bad_light = self.tally.bad_light.saturating_add(bad);
    }

    /// What became of the rows of the frame that ended goes into the tally.
    fn end_frame(&mut self) {
        if !core::mem::take(&mut self.in_frame) {
            return;
        }
        let counts = self.tracker.counts();
        // A frame has at most 65 535 rows, so the lower halves tell.
        let now = [
            counts.measured as u32,
            counts.no_texture as u32,
            counts.occluded as u32,
            counts.unlit as u32,
            counts.repeated as u32,
            counts.relearned,
            self.binner.thin_groups(),
        ];
        let before = core::mem::replace(&mut self.counted, now);
        let since = |i: usize| now[i].wrapping_sub(before[i]).min(u16::MAX.into()) as u16;
        let [
            measured,
            no_texture,
            occluded,
            unlit,
            repeated,
            relearned,
            thin_groups,
        ] = core::array::from_fn(since);
        let outcomes = [measured, no_texture, occluded, unlit, repeated];
        let rows = outcomes.into_iter().fold(0, u16::saturating_add);
        self.tally.add(&Tally {
            frames: 1,
            rows,
            no_texture,
            occluded,
            unlit,
            repeated_frames: u16::from(repeated > rows / 2),
            relearned,
            thin_groups,
            ..Tally::NONE
        });
        (self.ended, self.tally_waits) = (self.frame, true);
    }

    fn read(&mut self, sample: Sample) -> Reading {
        let (tally, frame) = self.take_tally();
        Reading {
            sample: Some(sample),
            tally,
            frame,
        }
    }

    /// What became of the rows of the frames that ended, and the number of the last.
    #[inline(never)]
    fn take_tally(&mut self) -> (Tally, u32) {
        self.tally_waits = false;
        (core::mem::take(&mut self.tally), self.ended)
    }
}
