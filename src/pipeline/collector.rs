//! The line side: a ring of frames, and when a window is complete.

use super::warn::WindowTally;
use super::{Reading, Reporter};
use crate::math::since;
use crate::report::Warning;
use crate::spectrum::{
    Config, ConfigError, FrameMark, SampleBuffer, WindowMark, follow_spread, pack_weight, skew_of,
};
use crate::timeline::{Curvature, Group, Sample, Spread, Tally, Vertical};

/// Collects samples to windows.
#[derive(Debug)]
pub struct Collector<'a> {
    window_ns: i64,
    hop_ns: i64,
    pub(super) group: Group,
    pub(super) ring: SampleBuffer<'a>,
    /// Frames the ring holds.
    pub(super) capacity: usize,
    /// Column of the oldest frame, and how many there are.
    oldest: usize,
    pub(super) held: usize,
    /// The sample that showed a window to be complete; it belongs to the next.
    pending: Option<Sample>,
    origin_ns: Option<i64>,
    /// End of the window being collected, ns.
    end_ns: i64,
    /// End of the last window that was complete, ns.
    done_ns: Option<i64>,
    ready: Option<WindowMark>,
    /// The frames held belong to the past: forget them before the next is stored.
    restart: bool,
    seq: u32,
    dropped_samples: u32,
    dropped_windows: u32,
    /// A window was dropped since the last one was handed over.
    missed: bool,
    /// What became of frames that had no sample, since the newest that is held.
    tally: Tally,
    /// Of the sample stored last.
    curvature: Curvature,
}

impl<'a> Collector<'a> {
    /// # Errors
    /// [`ConfigError`] when the config cannot be used or `ring` does not hold two frames.
    pub fn new(config: &Config, group: Group, ring: SampleBuffer<'a>) -> Result<Self, ConfigError> {
        config.check()?;
        let holds = ring.frame_capacity(usize::from(group.slots()));
        let capacity = holds.min(usize::from(u16::MAX));
        if capacity < 2 {
            return Err(ConfigError::Storage {
                part: "collected frames",
                needs: 2,
                holds,
            });
        }
        Ok(Self {
            window_ns: config.window_ns,
            hop_ns: config.hop_ns,
            group,
            ring,
            capacity,
            oldest: 0,
            held: 0,
            pending: None,
            origin_ns: None,
            end_ns: 0,
            done_ns: None,
            ready: None,
            restart: false,
            seq: 0,
            dropped_samples: 0,
            dropped_windows: 0,
            missed: false,
            tally: Tally::NONE,
            curvature: Curvature::default(),
        })
    }

    /// As [`super::ReportSide::push`]; a complete window waits for [`Collector::hand_over`] until the next push.
    pub fn push(&mut self, reading: impl Into<Reading>) -> bool {
        let Reading {
            sample,
            tally,
            frame,
        } = reading.into();
        if self.ready.take().is_some() {
            self.dropped_windows = self.dropped_windows.saturating_add(1);
            self.missed = true;
        }
        if let Some(pending) = self.pending.take() {
            self.store(pending);
        }
        self.note(frame, &tally);
        sample.is_some_and(|sample| self.take(sample))
    }

    fn take(&mut self, sample: Sample) -> bool {
        let second = self.second(&sample);
        let known = (sample.information_per_px2 > 0.0
            || sample.information_per_px2 == 0.0 && second.is_some())
            && sample.information_per_px2.is_finite()
            && sample.shift_px.is_finite()
            && sample.shift_px.abs() < 1e6
            && sample.slot < self.group.slots();
        let start_ns = since(sample.time_ns, self.group.middle_ns(sample.slot));
        // Clocks count from when something was switched on: centuries are nonsense.
        if !known || start_ns.unsigned_abs() > 1 << 62 {
            self.dropped_samples = self.dropped_samples.saturating_add(1);
            return false;
        }
        if self.origin_ns.is_none() {
            self.origin_ns = Some(start_ns);
            self.end_ns = start_ns.saturating_add(self.window_ns);
        }
        let new_frame = self.newest().is_none_or(|f| f.number != sample.frame);
        let back = self
            .newest()
            .is_some_and(|f| start_ns < since(f.start_ns, self.window_ns));
        if back || (new_frame && start_ns >= since(self.end_ns, self.slack_ns())) {
            let complete = self.complete(self.end_ns);
            self.pending = Some(sample);
            self.advance(start_ns, back);
            return complete;
        }
        self.store(sample);
        false
    }

    /// The input ends: what has come since the last window becomes one, if it is two fifths of a hop or more.
    pub fn finish(&mut self) -> bool {
        if self.ready.is_some() {
            return true;
        }
        if let Some(pending) = self.pending.take() {
            self.store(pending);
        }
        let Some(newest) = self.newest() else {
            return false;
        };
        // The last frame lasts as long as the others; a lone one as long as its rows.
        let period = self.period_ns().unwrap_or(self.group.timing().readout_ns());
        let end = newest.start_ns.saturating_add(period.max(1));
        let fresh = match self.done_ns {
            Some(done) => {
                since(end, done).saturating_mul(5)
                    >= self.hop_ns.min(self.window_ns).saturating_mul(2)
            }
            None => true,
        };
        let done = fresh && self.complete(end);
        self.restart = true;
        done
    }

    /// Gives the complete window to the computing side; `false` when none is complete.
    pub fn hand_over(&mut self, to: &mut Reporter<'_>) -> bool {
        let Some(mark) = self.ready.take() else {
            return false;
        };
        self.missed = false;
        let (capacity, first) = (self.capacity, self.first_of(mark.start_ns));
        let (oldest, ring) = (self.oldest, &self.ring);
        to.load(mark, ring, capacity, |i| (oldest + first + i) % capacity);
        true
    }

    /// Gives its memory back, for a collector with another config.
    pub fn into_storage(self) -> SampleBuffer<'a> {
        self.ring
    }

    /// Samples dropped so far.
    pub const fn dropped_samples(&self) -> u32 {
        self.dropped_samples
    }

    /// Windows complete but never handed over.
    pub const fn dropped_windows(&self) -> u32 {
        self.dropped_windows
    }

    /// A sample came too late for its frame.
    fn drop_sample(&mut self) {
        self.dropped_samples = self.dropped_samples.saturating_add(1);
        let tally = Tally {
            dropped_samples: 1,
            ..Tally::NONE
        };
        self.note_newest(&tally);
    }

    /// Adds what became of rows up to those of `frame`: to that frame where it is the newest that is held, or else to what
    /// is told of both sides of the gap that opens behind the newest.
    fn note(&mut self, frame: u32, tally: &Tally) {
        let held = self.newest().is_some_and(|f| f.number == frame);
        if held && !self.restart {
            self.note_newest(tally);
        } else {
            self.tally.add(tally);
        }
    }

    fn note_newest(&mut self, tally: &Tally) {
        let newest = self.held.checked_sub(1).map(|i| self.column(i));
        if let Some(frame) = newest.and_then(|column| self.ring.frames.get_mut(column)) {
            frame.tally.add(tally);
        }
    }

    pub(super) fn column(&self, i: usize) -> usize {
        (self.oldest + i) % self.capacity
    }

    fn frame(&self, i: usize) -> Option<FrameMark> {
        self.ring.frames.get(self.column(i)).copied()
    }

    fn newest(&self) -> Option<FrameMark> {
        self.held.checked_sub(1).and_then(|i| self.frame(i))
    }

    /// How many of the held frames are before `start_ns`.
    fn first_of(&self, start_ns: i64) -> usize {
        let start_ns = since(start_ns, self.slack_ns());
        (0..self.held)
            .take_while(|&i| self.frame(i).is_some_and(|f| f.start_ns < start_ns))
            .count()
    }

    /// How much earlier than a window a frame may begin and still be of it. A frame's start is known
    /// through its first sample, whose weights move it, and rates are rounded to whole nanoseconds: a frame
    /// that begins with its window must not fall out of it by either.
    fn slack_ns(&self) -> i64 {
        self.period_ns().unwrap_or(0) / 4
    }

    /// Mean time between the frames held, by their numbers.
    fn period_ns(&self) -> Option<i64> {
        let (first, last) = (self.frame(0)?, self.newest()?);
        let periods = i64::from(last.number.wrapping_sub(first.number));
        let span = since(last.start_ns, first.start_ns);
        (periods > 0 && span > 0 && self.held > 1).then(|| span / periods)
    }

    /// What the sample knows besides, where it is asked for.
    fn second(&self, sample: &Sample) -> Option<Vertical> {
        let both = self.ring.channels(usize::from(self.group.slots())) > 1;
        sample.vertical.filter(|v| {
            both && v.information_per_px2 > 0.0
                && v.information_per_px2.is_finite()
                && v.shift_px.abs() < 1e6
        })
    }

    fn store(&mut self, sample: Sample) {
        if self.restart {
            self.restart = false;
            self.held = 0;
        }
        let start_ns = since(sample.time_ns, self.group.middle_ns(sample.slot));
        if let Some(newest) = self.newest()
            && newest.number != sample.frame
            && start_ns <= newest.start_ns
        {
            self.drop_sample();
            return;
        }
        let slots = usize::from(self.group.slots());
        if self.newest().is_none_or(|f| f.number != sample.frame) {
            if self.held == self.capacity {
                self.oldest = self.column(1);
                self.held -= 1;
            }
            let column = self.column(self.held);
            self.held += 1;
            let mut tally = core::mem::take(&mut self.tally);
            if self.held == 1 {
                // What came before the first frame is no loss between frames.
                (tally.frames, tally.bad_light) = (0, 0);
            }
            if let Some(frame) = self.ring.frames.get_mut(column) {
                *frame = FrameMark {
                    number: sample.frame,
                    start_ns,
                    tally,
                };
            }
            for series in 0..self.ring.channels(slots) * slots {
                if let Some(weight) = self.ring.weight.get_mut(series * self.capacity + column) {
                    *weight = 0;
                }
            }
        }
        let Some(newest) = self.newest() else { return };
        self.curvature = sample.curvature;
        let column = self.column(self.held - 1);
        let at = usize::from(sample.slot) * self.capacity + column;
        let second = self.second(&sample);
        let ring = &mut self.ring;
        if let Some(spread) = ring.spread.get_mut(usize::from(sample.slot)) {
            let first = self.held == 1 || *spread == Spread::default();
            if !follow_spread(spread, sample.spread, first, &self.group.even_spread()) {
                self.dropped_samples = self.dropped_samples.saturating_add(1);
                let tally = Tally {
                    thin_groups: 1,
                    ..Tally::NONE
                };
                self.note_newest(&tally);
                return;
            }
        }
        if let (Some(x), Some(w), Some(d)) = (
            ring.shift_px.get_mut(at),
            ring.weight.get_mut(at),
            ring.skew.get_mut(at),
        ) {
            *x = sample.shift_px;
            *w = pack_weight(sample.information_per_px2);
            *d = skew_of(&self.group, &sample, newest.start_ns);
        }
        let Some(vertical) = second else { return };
        let at = at + slots * self.capacity;
        if let (Some(y), Some(w), Some(coupling)) = (
            ring.shift_px.get_mut(at),
            ring.weight.get_mut(at),
            ring.couplings.get_mut(usize::from(sample.slot)),
        ) {
            *y = vertical.shift_px;
            *w = pack_weight(vertical.information_per_px2);
            coupling.follow(&vertical, self.held == 1);
        }
    }

    /// Marks the window that ends at `end_ns` as complete, if there is a frame in it.
    fn complete(&mut self, end_ns: i64) -> bool {
        let start_ns = since(end_ns, self.window_ns);
        let first = self.first_of(start_ns);
        let frames = self.held - first;
        let (Some(a), Some(b)) = (self.frame(first), self.newest()) else {
            return false;
        };
        if frames == 0 {
            return false;
        }
        self.leave_out_elsewhere(first);
        let numbers = b.number.wrapping_sub(a.number);
        let mut sum = WindowTally::default();
        for i in first..self.held {
            if let Some(FrameMark { mut tally, .. }) = self.frame(i) {
                if i == first {
                    // Frames without a sample before it are no part of what lies between its frames.
                    tally.frames = tally.frames.min(1);
                }
                sum.add(&tally);
            }
        }
        if self.tally != Tally::NONE {
            // A gap reaches over the window's end.
            let frames = 0;
            sum.add(&Tally {
                frames,
                ..self.tally
            });
        }
        // Frames of which no row could be measured came all the same.
        let came = frames.max(sum.frames() as usize);
        let lost = (numbers as usize).saturating_add(1).saturating_sub(came);
        let mut warnings = sum.warnings(self.group.slots());
        warnings.insert_if(self.missed, Warning::DroppedWindows);
        let mut lines = 0_u32;
        for slot in 0..self.group.slots() {
            for i in first..self.held {
                let at = usize::from(slot) * self.capacity + self.column(i);
                let other = at + usize::from(self.group.slots()) * self.capacity;
                let two = self.ring.channels(usize::from(self.group.slots())) > 1;
                let knows = |at: usize| self.ring.weight.get(at).is_some_and(|&w| w > 0);
                if knows(at) || two && knows(other) {
                    lines = lines.saturating_add(u32::from(self.group.rows_of(slot)));
                }
            }
        }
        let origin_ns = self.origin_ns.unwrap_or(start_ns);
        let period = self.period_ns().unwrap_or(0);
        // Short: the first frame is more than a frame late, as at a start or where the ring is too small.
        let short = since(a.start_ns, start_ns) > period.saturating_mul(3) / 2;
        self.ready = Some(WindowMark {
            seq: self.seq,
            start_ns: start_ns.max(a.start_ns),
            end_ns,
            origin_ns,
            frames: frames as u16,
            lost_frames: lost.min(usize::from(u16::MAX)) as u16,
            lines,
            curvature: self.curvature,
            short,
            warnings,
        });
        self.seq = self.seq.wrapping_add(1);
        self.done_ns = Some(end_ns);
        true
    }

    /// Moves the end on past `start_ns`; after a pause or a clock set back, begins anew there.
    fn advance(&mut self, start_ns: i64, back: bool) {
        let late = since(start_ns, self.end_ns);
        if back || late > self.window_ns {
            self.end_ns = start_ns.saturating_add(self.window_ns);
            self.done_ns = None;
            self.restart = true;
            return;
        }
        let hops = late.max(0) / self.hop_ns + 1;
        self.end_ns = self.end_ns.saturating_add(hops.saturating_mul(self.hop_ns));
    }
}

#[cfg(test)]
mod tests;
