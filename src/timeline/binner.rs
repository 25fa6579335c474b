//! Rows of one frame, combined a few at a time.
//!
//! Contract: displacements come in the order of their rows; [`Binner::push`] gives the finished group
//! when the first row of the next one arrives, [`Binner::finish`] the last. Groups never reach over a
//! frame's end. A group of which less than half of the rows could be measured gives no sample: its
//! rows' own offsets would no longer be those of the other frames.

use core::fmt;

use super::{Displacement, Sample, Spread};
use crate::camera::Timing;
use crate::spectrum::sin;

/// Rows of a sample are combined by their information, so none may be worth more than this, 1/px².
const MOST_INFORMATION: f32 = 1e18;

/// Longest frame gap that is still counted as lost frames: beyond it the camera was restarted.
const LONGEST_LOSS: u32 = 100_000;

/// How many rows make a sample, so that `max_hz` is sampled well and `capacity` samples hold `frames` frames.
///
/// Samples lie at most `0.45 / max_hz` apart (a tenth above two a period); where that would take more
/// than `capacity` samples, rows are combined further and the highest frequency falls with it.
/// A global shutter has one sample a frame.
///
/// ```
/// use rowtone::{camera::Timing, timeline::rows_per_sample};
/// let timing = Timing::new(18_900_000, 500_000, 1080)?;
/// assert_eq!(rows_per_sample(timing, 1000.0, 47, 65_536), 23); // 435 µs
/// assert_eq!(rows_per_sample(timing, 1000.0, 47, 1_024), 52); // 21 samples a frame at most
/// # Ok::<(), rowtone::camera::TimingError>(())
/// ```
pub fn rows_per_sample(timing: Timing, max_hz: f32, frames: u32, capacity: usize) -> u16 {
    if timing.is_global_shutter() {
        return timing.rows();
    }
    let spacing_ps = 0.45e12 / max_hz.max(1e-3);
    // The cast saturates, NaN becomes 0.
    let wanted = (spacing_ps / timing.line_time_ps() as f32) as u16;
    let a_frame = (capacity / (frames.max(1) as usize)).max(1);
    let least = (timing.rows() as usize).div_ceil(a_frame);
    wanted.max(least as u16).clamp(1, timing.rows())
}

/// Where and how long the groups of rows are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    timing: Timing,
    rows_per_sample: u16,
}

impl Group {
    /// Groups of `rows_per_sample` rows; a global shutter has one group a frame whatever is asked for.
    ///
    /// # Errors
    /// [`BinnerError::RowsPerSample`] when it is 0 or more than a frame has.
    pub const fn new(timing: Timing, rows_per_sample: u16) -> Result<Self, BinnerError> {
        if timing.is_global_shutter() {
            return Ok(Self {
                timing,
                rows_per_sample: timing.rows(),
            });
        }
        if rows_per_sample == 0 || rows_per_sample > timing.rows() {
            return Err(BinnerError::RowsPerSample {
                given: rows_per_sample,
                rows: timing.rows(),
            });
        }
        Ok(Self {
            timing,
            rows_per_sample,
        })
    }

    /// The camera's timing.
    pub const fn timing(&self) -> Timing {
        self.timing
    }

    /// Rows of a group (the last of a frame may have fewer).
    pub const fn rows_per_sample(&self) -> u16 {
        self.rows_per_sample
    }

    /// Groups a frame.
    pub const fn slots(&self) -> u16 {
        self.timing.rows().div_ceil(self.rows_per_sample)
    }

    /// Rows of this group.
    pub const fn rows_of(&self, slot: u16) -> u16 {
        let first = slot as u32 * self.rows_per_sample as u32;
        let left = (self.timing.rows() as u32).saturating_sub(first);
        if left < self.rows_per_sample as u32 {
            left as u16
        } else {
            self.rows_per_sample
        }
    }

    /// Middle of the group after the start of exposure of row 0, ns.
    pub const fn middle_ns(&self, slot: u16) -> i64 {
        let first = slot as i64 * self.rows_per_sample as i64;
        let rows = self.rows_of(slot) as i64;
        let middle_ps =
            (2 * first + rows.saturating_sub(1)) * self.timing.line_time_ps() as i64 / 2;
        middle_ps / 1000 + (self.timing.exposure_ns() / 2) as i64
    }

    /// Time from a group to the next, ns (0 with a global shutter).
    pub const fn spacing_ns(&self) -> i64 {
        self.rows_per_sample as i64 * self.timing.line_time_ps() as i64 / 1000
    }

    /// How the times of a group's rows lie about their middle where all know the same.
    pub const fn even_spread(&self) -> Spread {
        let (rows, line_ns) = (
            self.rows_per_sample as f32,
            self.timing.line_time_ps() as f32 * 1e-3,
        );
        Spread {
            variance_ns2: (rows * rows - 1.0) / 12.0 * line_ns * line_ns,
            third_ns3: 0.0,
        }
    }

    /// What is left of a tone's amplitude after the exposure and the averaging of a group's rows, 0 to 1:
    /// sinc(f·t_exp) · sin(πfRτ)/(R·sin(πfτ)), R rows of line time τ.
    pub fn attenuation(&self, hz: f32) -> f32 {
        use core::f32::consts::PI;
        let exposure = PI * hz * self.timing.exposure_ns() as f32 * 1e-9;
        let open = if exposure.abs() < 1e-3 {
            1.0
        } else {
            sin(exposure) / exposure
        };
        let line = PI * hz * self.timing.line_time_ps() as f32 * 1e-12;
        let rows = self.rows_per_sample as f32;
        let narrow = sin(line) * rows;
        let rowed = if narrow.abs() < 1e-6 {
            1.0
        } else {
            sin(line * rows) / narrow
        };
        (open * rowed).abs()
    }
}

/// Why a [`Group`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinnerError {
    /// Rows a sample must be from 1 to the rows of a frame.
    RowsPerSample {
        /// What was asked for.
        given: u16,
        /// Rows of a frame.
        rows: u16,
    },
}

impl fmt::Display for BinnerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RowsPerSample { given, rows } => {
                write!(
                    f,
                    "rows per sample must be from 1 to the frame's {rows}, not {given}"
                )
            }
        }
    }
}

impl core::error::Error for BinnerError {}

/// The group being filled.
#[derive(Clone, Copy, Debug)]
struct Open {
    frame: u32,
    slot: u16,
    /// First row of the group and how many it should have.
    first_row: u16,
    rows_due: u16,
    /// Rows taken.
    rows: u16,
    first_ns: i64,
    information: f32,
    weighted_shift: f32,
    weighted_ns: f32,
    /// Σ w·x, w·x², w·x³; x in rows from the group's middle, which is at this row.
    middle_row: f32,
    moments: [f32; 3],
}

impl Open {
    fn spread(&self, group: &Group) -> Spread {
        let line_ns = group.timing.line_time_ps() as f32 * 1e-3;
        let per_information = 1.0 / self.information;
        let [first, second, third] = self.moments.map(|m| m * per_information);
        let variance = (second - first * first).max(0.0) * line_ns * line_ns;
        let third = third - first * (3.0 * second - 2.0 * first * first);
        Spread {
            variance_ns2: variance,
            third_ns3: third * line_ns * line_ns * line_ns,
        }
    }
}

impl Open {
    /// Takes one row of this group.
    #[inline(always)]
    fn add(&mut self, d: &Displacement) {
        let information = if d.information_per_px2 < MOST_INFORMATION {
            d.information_per_px2
        } else {
            MOST_INFORMATION
        };
        // A group lasts some ms; converting 64 bits takes a microcontroller long.
        let later_ns = d.time_ns.wrapping_sub(self.first_ns);
        let later_ns = if later_ns == i64::from(later_ns as i32) {
            later_ns as i32 as f32
        } else {
            much_later_ns(d.time_ns, self.first_ns)
        };
        self.rows = self.rows.saturating_add(1);
        self.information += information;
        self.weighted_shift += information * d.shift_px;
        self.weighted_ns += information * later_ns;
        let x = f32::from(d.row) - self.middle_row;
        let mut power = information;
        for moment in &mut self.moments {
            power *= x;
            *moment += power;
        }
    }
}

#[cold]
#[inline(never)]
fn much_later_ns(time_ns: i64, first_ns: i64) -> f32 {
    time_ns.saturating_sub(first_ns) as f32
}

#[cold]
#[inline(never)]
fn rounded_ns(ns: f32) -> i64 {
    libm::roundf(ns) as i64
}

/// A row of which something is known.
fn is_known(information: f32, shift_px: f32) -> bool {
    information > 0.0 && information.is_finite() && shift_px.is_finite()
}

/// Combines rows to samples.
///
/// ```
/// use rowtone::camera::Timing;
/// use rowtone::timeline::{Binner, Displacement, Group};
/// let group = Group::new(Timing::new(20_000_000, 0, 4)?, 2)?;
/// let mut binner = Binner::new(group);
/// let row = |row, shift_px| Displacement {
///     frame: 0, row, time_ns: row as i64 * 20_000, shift_px, information_per_px2: 100.0,
/// };
/// assert_eq!(binner.push(row(0, 0.1)), None);
/// assert_eq!(binner.push(row(1, 0.3)), None);
/// let sample = binner.push(row(2, 0.5)).unwrap();
/// assert_eq!((sample.slot, sample.time_ns, sample.information_per_px2), (0, 10_000, 200.0));
/// assert!((sample.shift_px - 0.2).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Binner {
    group: Group,
    open: Option<Open>,
    last_frame: Option<u32>,
    lost_frames: u32,
    thin_groups: u32,
}

impl Binner {
    /// A binner for these groups.
    pub const fn new(group: Group) -> Self {
        Self {
            group,
            open: None,
            last_frame: None,
            lost_frames: 0,
            thin_groups: 0,
        }
    }

    /// Takes one row; gives the group before it, if this row begins another.
    ///
    /// A row that knows nothing (information not greater than 0, or anything not finite) is skipped.
    #[inline(always)]
    pub fn push(&mut self, displacement: Displacement) -> Option<Sample> {
        let known = is_known(displacement.information_per_px2, displacement.shift_px);
        if known && displacement.row < self.group.timing.rows() {
            return self.push_sound(displacement);
        }
        self.skip(&displacement)
    }

    /// Counts a row of which nothing is known, and ends the group that it does not belong to.
    #[cold]
    fn skip(&mut self, d: &Displacement) -> Option<Sample> {
        self.count_lost(d.frame);
        let slot = d.row / self.group.rows_per_sample;
        match self.open {
            Some(open) if open.frame == d.frame && open.slot == slot => None,
            _ => self.finish(),
        }
    }

    /// [`Binner::push`] for a row of this timing whose shift and information are finite and greater than 0.
    #[inline(always)]
    pub(crate) fn push_sound(&mut self, d: Displacement) -> Option<Sample> {
        if let Some(open) = &mut self.open
            && open.frame == d.frame
            && d.row.wrapping_sub(open.first_row) < open.rows_due
        {
            open.add(&d);
            return None;
        }
        self.begin(d)
    }

    /// Gives the group before, and begins the next with this row.
    #[inline(never)]
    fn begin(&mut self, d: Displacement) -> Option<Sample> {
        self.count_lost(d.frame);
        let slot = d.row / self.group.rows_per_sample;
        let done = self.finish();
        let mut open = Open {
            frame: d.frame,
            slot,
            first_row: slot * self.group.rows_per_sample,
            rows_due: self.group.rows_of(slot),
            rows: 0,
            first_ns: d.time_ns,
            information: 0.0,
            weighted_shift: 0.0,
            weighted_ns: 0.0,
            middle_row: f32::from(slot * self.group.rows_per_sample)
                + 0.5 * f32::from(self.group.rows_per_sample - 1),
            moments: [0.0; 3],
        };
        open.add(&d);
        self.open = Some(open);
        done
    }

    /// Gives the group being filled: at the end of the input.
    pub fn finish(&mut self) -> Option<Sample> {
        let open = self.open.take()?;
        if 2 * u32::from(open.rows) < u32::from(open.rows_due) {
            self.thin_groups = self.thin_groups.saturating_add(1);
            return None;
        }
        let shift_px = open.weighted_shift / open.information;
        let later_ns = open.weighted_ns / open.information;
        let later_ns = if later_ns.abs() < 1e9 {
            // The nearest, as fast as a cast.
            i64::from((later_ns + 0.5f32.copysign(later_ns)) as i32)
        } else {
            rounded_ns(later_ns)
        };
        (shift_px.is_finite() && open.information.is_finite()).then_some(Sample {
            frame: open.frame,
            slot: open.slot,
            time_ns: open.first_ns.saturating_add(later_ns),
            shift_px,
            information_per_px2: open.information,
            spread: open.spread(&self.group),
        })
    }

    /// Frames missing so far, by their numbers.
    pub const fn lost_frames(&self) -> u32 {
        self.lost_frames
    }

    /// Groups given up so far because less than half of their rows could be measured.
    pub const fn thin_groups(&self) -> u32 {
        self.thin_groups
    }

    fn count_lost(&mut self, frame: u32) {
        let ahead = match self.last_frame {
            Some(last) => frame.wrapping_sub(last),
            None => 1,
        };
        if ahead > 1 && ahead < LONGEST_LOSS {
            self.lost_frames = self.lost_frames.saturating_add(ahead - 1);
        }
        self.last_frame = Some(frame);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn group() -> Group {
        Group::new(Timing::new(10_000_000, 0, 8).unwrap(), 4).unwrap()
    }

    fn row(frame: u32, row: u16, shift_px: f32, information_per_px2: f32) -> Displacement {
        Displacement {
            frame,
            row,
            time_ns: i64::from(frame) * 1_000_000 + i64::from(row) * 10_000,
            shift_px,
            information_per_px2,
        }
    }

    #[test]
    fn weights_shift_and_time_by_information() {
        let mut binner = Binner::new(group());
        for (y, w) in [(0, 1.0), (1, 1.0), (2, 1.0), (3, 5.0)] {
            assert_eq!(binner.push(row(0, y, f32::from(y), w)), None);
        }
        let sample = binner.finish().unwrap();
        assert_eq!(sample.shift_px, 18.0 / 8.0);
        assert_eq!(sample.time_ns, 22_500);
        assert_eq!(sample.information_per_px2, 8.0);
    }

    #[test]
    fn the_spread_is_that_of_the_rows_that_know_something() {
        let mut binner = Binner::new(group());
        for y in 0..4 {
            binner.push(row(0, y, 0.0, 2.0));
        }
        let even = binner.push(row(0, 4, 0.0, 3.0)).unwrap().spread;
        assert_eq!(even, group().even_spread());
        for (y, w) in [(5, 1e-9), (6, 1e-9), (7, 1.0)] {
            binner.push(row(0, y, 0.0, w));
        }
        // 3/4 of the weight at 0, 1/4 three lines of 10 µs later: variance 27/16, third moment 81/32 lines.
        let uneven = binner.finish().unwrap().spread;
        assert!((uneven.variance_ns2 / (27.0 / 16.0 * 1e8) - 1.0).abs() < 1e-5);
        assert!((uneven.third_ns3 / (81.0 / 32.0 * 1e12) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_thin_group_gives_none() {
        let mut binner = Binner::new(group());
        for y in 0..4 {
            let information = if y == 1 { 1.0 } else { 0.0 };
            assert_eq!(binner.push(row(0, y, 1.0, information)), None);
        }
        assert_eq!(binner.push(row(0, 4, 1.0, 1.0)), None);
        assert_eq!(binner.thin_groups(), 1);
    }

    #[test]
    fn lost_frames_are_counted_by_number() {
        let mut binner = Binner::new(group());
        for frame in [u32::MAX, 0, 3, 4] {
            binner.push(row(frame, 0, 0.0, 1.0));
        }
        assert_eq!(binner.lost_frames(), 2);
    }

    #[test]
    fn nonsense_gives_nothing_and_breaks_nothing() {
        let mut binner = Binner::new(group());
        let odd = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            -1.0,
            0.0,
            f32::MAX,
        ];
        for (i, shift) in odd.into_iter().enumerate() {
            for information in odd {
                let mut d = row(i as u32, 65_535, shift, information);
                d.time_ns = if i % 2 == 0 { i64::MIN } else { i64::MAX };
                assert_eq!(binner.push(d), None);
                d.row = 1;
                let _ = binner.push(d);
            }
        }
        let _ = binner.finish();
    }
}
