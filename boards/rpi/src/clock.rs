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
    /// Wanted from one frame to the next, ns.
    period_ns: Option<i64>,
    last: Option<Last>,
    counts: FrameCounts,
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
            period_ns: period_ns.filter(|&ns| ns > 0),
            last: None,
            counts: FrameCounts::default(),
        }
    }

    /// What became of the frames so far.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// The camera was asked for another frame rate.
    pub fn set_period(&mut self, period_ns: i64) {
        self.period_ns = Some(period_ns).filter(|&ns| ns > 0);
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
                let periods = self.period_ns.map_or(1.0, |p| after_ns as f64 / p as f64);
                let ahead = counted.max(periods.round().clamp(1.0, 1e6) as u32);
                if (periods - periods.round()).abs() > 0.1 && self.period_ns.is_some() {
                    self.counts.late += 1;
                }
                ahead
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
