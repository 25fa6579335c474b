//! Which frames count, and when each began.
//!
//! A frame's number and time go to the core; what was lost, late or corrupt on the way is counted here. A gap
//! in the camera's own count means lost frames; so does a gap in its times that the count does not show (a
//! camera without free buffers may count on only when it has one again).

use crate::capture::Frame;
use crate::config::Replay;

/// What became of the frames so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Measured.
    pub good: u64,
    /// Never came.
    pub lost: u64,
    /// Came more than a tenth of a period off their time; they were measured.
    pub late: u64,
    /// Called bad by the camera, or too short; they were not measured.
    pub corrupt: u64,
}

/// A frame to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Its number, lost ones counted.
    pub number: u32,
    /// Start of exposure of its first row, ns.
    pub start_ns: i64,
}

/// Follows a camera's frames.
#[derive(Clone, Debug, Default)]
pub struct FrameClock {
    replay: Option<Replay>,
    /// Wanted from one frame to the next, ns: now, and before the last change.
    periods_ns: [Option<i64>; 2],
    last: Option<Last>,
    counts: FrameCounts,
}

/// How far from a whole number.
fn off(periods: f64) -> f64 {
    (periods - periods.round()).abs()
}

#[derive(Clone, Copy, Debug)]
struct Last {
    sequence: u32,
    due: Due,
}

impl FrameClock {
    /// `period_ns`: what the camera was set to, where it is known.
    pub fn new(replay: Option<Replay>, period_ns: Option<i64>) -> Self {
        Self {
            replay,
            periods_ns: [period_ns.filter(|&ns| ns > 0), None],
            last: None,
            counts: FrameCounts::default(),
        }
    }

    /// What became of the frames so far.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// The camera was asked for another frame rate; some frames may still come at the one before.
    pub fn set_period(&mut self, period_ns: i64) {
        if period_ns > 0 && self.periods_ns[0] != Some(period_ns) {
            self.periods_ns = [Some(period_ns), self.periods_ns[0]];
        }
    }

    /// How many periods so long a time is, by the frame rate that it fits best.
    fn periods(&self, after_ns: i64) -> Option<f64> {
        let periods = self.periods_ns.iter().flatten();
        periods
            .map(|&ns| after_ns as f64 / ns as f64)
            .min_by(|a, b| off(*a).total_cmp(&off(*b)))
    }

    /// What to do with a frame of which `complete` says whether all its rows are there; `None`: leave it out.
    pub fn frame(&mut self, frame: &Frame<'_>, complete: bool) -> Option<Due> {
        if let Some(replay) = self.replay {
            return self.replayed(frame, complete, replay);
        }
        let Some(start_ns) = frame.start_ns.filter(|_| frame.intact && complete) else {
            self.counts.corrupt += 1;
            return None;
        };
        let ahead = match self.last {
            None => 1,
            Some(last) => {
                let counted = frame.sequence.wrapping_sub(last.sequence);
                let after_ns = start_ns.saturating_sub(last.due.start_ns);
                if counted == 0 || counted > u32::MAX / 2 || after_ns <= 0 {
                    // Out of order: it has no place in time any more.
                    self.counts.corrupt += 1;
                    return None;
                }
                let periods = self.periods(after_ns).unwrap_or(1.0);
                self.counts.late += u64::from(off(periods) > 0.1);
                counted.max(periods.round().clamp(1.0, 1e6) as u32)
            }
        };
        Some(self.take(frame.sequence, ahead, start_ns))
    }

    /// Pictures that are each shown several times: the first that comes of each counts.
    fn replayed(&mut self, frame: &Frame<'_>, complete: bool, replay: Replay) -> Option<Due> {
        let picture = frame.sequence / replay.take_every.max(1);
        let ahead = match self.last {
            Some(last) if picture <= last.sequence => return None,
            Some(last) => picture - last.sequence,
            None => 1,
        };
        if !frame.intact || !complete {
            self.counts.corrupt += 1;
            return None;
        }
        let start_ns = i64::from(picture).saturating_mul(replay.frame_period_ns);
        Some(self.take(picture, ahead, start_ns))
    }

    fn take(&mut self, sequence: u32, ahead: u32, start_ns: i64) -> Due {
        let number = self
            .last
            .map_or(0, |last| last.due.number.wrapping_add(ahead));
        self.counts.good += 1;
        self.counts.lost += u64::from(ahead - 1);
        let due = Due { number, start_ns };
        self.last = Some(Last { sequence, due });
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(sequence: u32, start_ns: i64) -> Frame<'static> {
        Frame {
            sequence,
            start_ns: Some(start_ns),
            bytes: &[],
            intact: true,
        }
    }

    #[test]
    fn gaps_in_count_or_in_time_are_lost_frames() {
        let mut clock = FrameClock::new(None, Some(10_000));
        let take = |clock: &mut FrameClock, s, t| clock.frame(&frame(s, t), true).map(|d| d.number);
        assert_eq!(take(&mut clock, 7, 100_000), Some(0));
        assert_eq!(take(&mut clock, 8, 110_000), Some(1));
        assert_eq!(take(&mut clock, 10, 130_000), Some(3)); // 9 never came
        assert_eq!(take(&mut clock, 11, 160_000), Some(6)); // nor two that were not counted
        assert_eq!(take(&mut clock, 12, 173_000), Some(7)); // late
        assert_eq!(take(&mut clock, 12, 183_000), None); // twice
        assert_eq!(take(&mut clock, 13, 150_000), None); // back in time
        let counts = clock.counts();
        assert_eq!((counts.good, counts.lost), (5, 3));
        assert_eq!((counts.late, counts.corrupt), (1, 2));
    }

    #[test]
    fn frames_at_the_rate_before_are_not_late() {
        let mut clock = FrameClock::new(None, Some(10_000));
        let mut start_ns = 0;
        for (sequence, period_ns) in [10_000, 10_000, 12_500, 12_500, 10_000].iter().enumerate() {
            clock.set_period(if sequence < 2 { 10_000 } else { 12_500 });
            assert!(
                clock
                    .frame(&frame(sequence as u32, start_ns), true)
                    .is_some()
            );
            start_ns += period_ns;
        }
        assert_eq!((clock.counts().late, clock.counts().lost), (0, 0));
        // Two of the new ones lost, and not counted by the camera.
        start_ns += 2 * 12_500;
        assert_eq!(
            clock.frame(&frame(5, start_ns), true).map(|d| d.number),
            Some(7)
        );
        assert_eq!(clock.counts().lost, 2);
    }

    #[test]
    fn what_is_not_whole_is_left_out() {
        let mut clock = FrameClock::new(None, None);
        let bad = Frame {
            intact: false,
            ..frame(0, 5)
        };
        assert_eq!(clock.frame(&bad, true), None);
        assert_eq!(clock.frame(&frame(1, 10), false), None);
        let timeless = Frame {
            start_ns: None,
            ..frame(2, 0)
        };
        assert_eq!(clock.frame(&timeless, true), None);
        assert_eq!(clock.counts().corrupt, 3);
        assert!(clock.frame(&frame(3, 40), true).is_some());
    }

    #[test]
    fn a_picture_shown_four_times_counts_once() {
        let replay = Replay {
            take_every: 4,
            frame_period_ns: 1000,
        };
        let mut clock = FrameClock::new(Some(replay), None);
        let taken: Vec<_> = (0..12)
            .filter(|&s| s != 4) // the second picture's first showing is lost, its second serves
            .filter_map(|s| clock.frame(&frame(s, 0), true))
            .map(|due| (due.number, due.start_ns))
            .collect();
        assert_eq!(taken, [(0, 0), (1, 1000), (2, 2000)]);
        assert_eq!(clock.counts().lost, 0);
    }
}
