//! Where the groups of rows are, and how many rows each has.

use core::fmt;

use super::Spread;
use crate::camera::Timing;
use crate::math::sin;

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
        let first = slot as u64 * self.rows_per_sample as u64;
        let half_rows = 2 * first + (self.rows_of(slot) as u64).saturating_sub(1);
        // Whole ns and the rest apart, as in [`Timing::start_ns`]: dividing 64 bits takes a microcontroller long.
        let line_ps = self.timing.line_time_ps();
        let half_ns = half_rows * (line_ps / 1000) as u64;
        let rest = (half_ns & 1) as u32 * 1000 + half_rows as u32 * (line_ps % 1000);
        (half_ns / 2) as i64 + (rest / 2000) as i64 + (self.timing.exposure_ns() / 2) as i64
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
        let line = PI * hz * self.timing.line_time_ps() as f32 * 1e-12;
        let rows = self.rows_per_sample as f32;
        let narrow = sin(line) * rows;
        let rowed = if narrow.abs() < 1e-6 {
            1.0
        } else {
            sin(line * rows) / narrow
        };
        (self.exposed(hz) * rowed).abs()
    }

    /// What is left of a tone's amplitude after the exposure alone, sinc(f·t_exp): below 0 where the exposure is
    /// longer than a period.
    pub fn exposed(&self, hz: f32) -> f32 {
        let exposure = core::f32::consts::PI * hz * self.timing.exposure_ns() as f32 * 1e-9;
        if exposure.abs() < 1e-3 {
            1.0
        } else {
            sin(exposure) / exposure
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_group_is_rounded_down_to_whole_ns() {
        for line_time_ps in [0, 1, 999, 1000, 9_451_999, 67_000_001, u32::MAX] {
            for (rows, rows_per_sample) in [(1, 1), (480, 23), (65_535, 7), (65_535, 65_535)] {
                let timing = Timing::new(line_time_ps, 501, rows).unwrap();
                let group = Group::new(timing, rows_per_sample).unwrap();
                for slot in [0, 1, group.slots() / 2, group.slots() - 1] {
                    let first = i64::from(slot) * i64::from(group.rows_per_sample());
                    let half_rows = 2 * first + i64::from(group.rows_of(slot)).max(1) - 1;
                    let middle_ps = half_rows * i64::from(line_time_ps) / 2;
                    assert_eq!(group.middle_ns(slot), middle_ps / 1000 + 250);
                }
            }
        }
    }
}
