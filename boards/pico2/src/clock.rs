//! When each frame began, by the camera's own clock.
//!
//! VSYNC's time as an interrupt reads it is a microsecond coarse and late by whatever the interrupt waited
//! for. The camera's frames are evenly spaced to a few parts in a million, so a straight line through all
//! VSYNCs tells the times better than each of them: a growing-memory filter of first order (the recursive
//! least-squares line; e.g. Brookner, *Tracking and Kalman Filtering Made Easy*, section 1.2.10), whose memory
//! stops growing after [`MEMORY`] frames so that it follows a drifting oscillator.

use fixed::types::I56F8;

/// Frames that the line is fitted through at most.
pub const MEMORY: u32 = 256;
/// Frames after which the period is known well enough to measure by (some parts in a million).
pub const SETTLED: u32 = 64;

/// Once settled, a VSYNC that is read so much later or earlier than expected tells nothing of the time, ns:
/// the interrupt had to wait (for the flash, say). It still counts its frame.
pub const MOST_LATE_NS: i64 = 100_000;
/// After so many of them in a row it is the camera that changed, and the rhythm is learned anew.
pub const MOST_LATE: u32 = 16;

/// A frame began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameStart {
    /// Its number: one more than the last one's, and one more for each frame whose VSYNC was not seen.
    pub frame: u32,
    /// When, ns.
    pub start_ns: i64,
    /// Frames that were not seen just before this one.
    pub lost: u32,
}

/// Follows VSYNC.
#[derive(Clone, Debug)]
pub struct FrameClock {
    nominal_ns: i64,
    /// Period, ns: to 1/256, which is 1 part in 4·10⁹ of a frame.
    period: I56F8,
    /// Last start, ns.
    start: I56F8,
    frame: u32,
    /// Frames in the filter's memory, at most [`MEMORY`].
    seen: u32,
    glitches: u32,
    late_in_a_row: u32,
}

impl FrameClock {
    /// A clock that expects frames every `nominal_ns`.
    pub const fn new(nominal_ns: i64) -> Self {
        let nominal_ns = if nominal_ns < 1 { 1 } else { nominal_ns };
        Self {
            nominal_ns,
            period: I56F8::const_from_int(nominal_ns),
            start: I56F8::ZERO,
            frame: 0,
            seen: 0,
            glitches: 0,
            late_in_a_row: 0,
        }
    }

    /// VSYNC rose at this time. `None` when it came less than half a period after the last: a glitch.
    pub fn vsync(&mut self, now_ns: i64) -> Option<FrameStart> {
        let now = I56F8::saturating_from_num(now_ns);
        if self.seen == 0 {
            (self.start, self.seen) = (now, 1);
            return Some(FrameStart {
                frame: self.frame,
                start_ns: now_ns,
                lost: 0,
            });
        }
        let elapsed = now.saturating_sub(self.start);
        let half_more = elapsed.saturating_add(self.period / 2);
        let frames = half_more.to_bits() / self.period.to_bits();
        if frames < 1 {
            self.glitches = self.glitches.saturating_add(1);
            return None;
        }
        if self.seen == 1 && frames == 1 {
            self.period = elapsed;
        }
        let predicted = self
            .start
            .saturating_add(self.period.saturating_mul_int(frames));
        let mut error = now.saturating_sub(predicted);
        if self.is_settled() && error.saturating_abs() > MOST_LATE_NS {
            self.late_in_a_row += 1;
            if self.late_in_a_row >= MOST_LATE {
                self.restart();
                return self.vsync(now_ns);
            }
            error = I56F8::ZERO;
        } else {
            self.late_in_a_row = 0;
        }
        let k = i64::from(self.seen);
        self.seen = (self.seen + 1).min(MEMORY);
        let (weights, both) = ((k + 1) * (k + 2), 2 * (2 * k + 1));
        self.start = predicted.saturating_add(error.saturating_mul_int(both) / weights);
        self.period =
            (self.period + error.saturating_mul_int(6) / weights / frames).max(I56F8::DELTA);
        let frames = u32::try_from(frames).unwrap_or(u32::MAX);
        self.frame = self.frame.wrapping_add(frames);
        Some(FrameStart {
            frame: self.frame,
            start_ns: self.start.round_to_zero().to_num(),
            lost: frames - 1,
        })
    }

    /// Forget the rhythm, not the numbers: the camera was started anew.
    pub fn restart(&mut self) {
        *self = Self {
            frame: self.frame.wrapping_add(1),
            glitches: self.glitches,
            ..Self::new(self.nominal_ns)
        };
    }

    /// The period is known well enough.
    pub const fn is_settled(&self) -> bool {
        self.seen >= SETTLED
    }

    /// Time from frame to frame as measured, ps.
    pub const fn period_ps(&self) -> u64 {
        (self.period.to_bits() as u64).saturating_mul(1000) >> I56F8::FRAC_NBITS
    }

    /// Measured over nominal period, less 1, in parts in a thousand: wrong clock settings show here.
    pub fn off_nominal_permille(&self) -> i64 {
        (self.period.to_num::<i64>() - self.nominal_ns) * 1000 / self.nominal_ns
    }

    /// VSYNCs that came too early to be any.
    pub const fn glitches(&self) -> u32 {
        self.glitches
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 17_472_000;

    /// An interrupt reads whole microseconds, up to 3 µs late.
    fn read(true_ns: i64, n: i64) -> i64 {
        let late = (n * 7919 % 3001) + true_ns;
        late / 1000 * 1000
    }

    #[test]
    fn times_are_better_than_their_readings_and_the_period_is_measured() {
        // 100 ppm off what was configured.
        let true_period = PERIOD_NS + PERIOD_NS / 10_000;
        let mut clock = FrameClock::new(PERIOD_NS);
        let mut worst = 0;
        for n in 0..2000 {
            let at = clock.vsync(read(5_000_000 + n * true_period, n)).unwrap();
            assert_eq!((i64::from(at.frame), at.lost), (n, 0));
            if clock.is_settled() {
                let error = at.start_ns - (5_000_000 + n * true_period + 1000); // the mean reading is 1 µs late
                worst = worst.max(error.abs());
            }
        }
        assert!(worst < 600, "{worst} ns");
        let ppm = (clock.period_ps() as f64 / (true_period as f64 * 1000.0) - 1.0) * 1e6;
        assert!(ppm.abs() < 1.0, "{ppm} ppm");
    }

    #[test]
    fn lost_frames_are_counted_and_glitches_ignored() {
        let mut clock = FrameClock::new(PERIOD_NS);
        for n in 0..100 {
            clock.vsync(n * PERIOD_NS);
        }
        assert_eq!(clock.vsync(99 * PERIOD_NS + 300_000), None);
        assert_eq!(clock.glitches(), 1);
        let after = clock.vsync(104 * PERIOD_NS).unwrap();
        assert_eq!((after.frame, after.lost), (104, 4));
    }

    #[test]
    fn a_camera_with_another_oscillator_is_followed_and_told() {
        let mut clock = FrameClock::new(PERIOD_NS);
        for n in 0..100 {
            assert_eq!(clock.vsync(n * PERIOD_NS * 25 / 24).unwrap().lost, 0);
        }
        assert_eq!(clock.off_nominal_permille(), 41);
    }

    #[test]
    fn a_late_interrupt_counts_its_frame_and_moves_nothing() {
        let mut clock = FrameClock::new(PERIOD_NS);
        for n in 0..100 {
            clock.vsync(n * PERIOD_NS);
        }
        let late = clock.vsync(100 * PERIOD_NS + 8_000_000).unwrap();
        assert_eq!((late.frame, late.start_ns), (100, 100 * PERIOD_NS));
        // A camera that really shifted is followed after a while.
        for n in 101..200 {
            clock.vsync(n * PERIOD_NS + 5_000_000);
        }
        let after = clock.vsync(200 * PERIOD_NS + 5_000_000).unwrap();
        assert!((after.start_ns - (200 * PERIOD_NS + 5_000_000)).abs() < 1000);
    }

    #[test]
    fn restart_keeps_counting() {
        let mut clock = FrameClock::new(PERIOD_NS);
        for n in 0..70 {
            clock.vsync(n * PERIOD_NS);
        }
        clock.restart();
        assert!(!clock.is_settled());
        assert_eq!(clock.vsync(90 * PERIOD_NS).unwrap().frame, 70);
    }

    #[test]
    fn no_time_breaks_it() {
        let mut clock = FrameClock::new(0);
        for t in [0, i64::MAX, i64::MIN, -1, 1, i64::MAX] {
            let _ = clock.vsync(t);
            let _ = clock.off_nominal_permille();
        }
    }
}
