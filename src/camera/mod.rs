//! What a camera delivers: lines, and when each was exposed.

pub(crate) mod pixel;
mod pixels;
mod raw;

pub use pixels::{Pixels, UpperBytes};
pub use raw::{RawError, RawFormat};

use core::fmt;

/// When the rows of a frame are exposed.
///
/// Row `y` of a frame whose first row starts its exposure at `t` is exposed during
/// `[t + y·line_time, t + y·line_time + exposure]`. A line time of zero is a global shutter.
///
/// ```
/// use rowtone::camera::Timing;
/// let timing = Timing::new(18_900_000, 500_000, 1080)?; // IMX219 at 1080p, exposed for 0.5 ms
/// assert_eq!(timing.middle_ns(0), 250_000);
/// assert_eq!(timing.middle_ns(1000), 18_900_000 + 250_000);
/// # Ok::<(), rowtone::camera::TimingError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    line_time_ps: u32,
    exposure_ns: u32,
    rows: u16,
}

impl Timing {
    /// `line_time_ps`: picoseconds from one row to the next, 0 to 4.29 ms (a calibration knows it to
    /// parts in 100 000, so whole nanoseconds would not do). `exposure_ns`: exposure of a row,
    /// 0 to 4.29 s. `rows`: rows of a frame, at least 1.
    ///
    /// # Errors
    /// [`TimingError::NoRows`] when `rows` is 0.
    pub const fn new(line_time_ps: u32, exposure_ns: u32, rows: u16) -> Result<Self, TimingError> {
        if rows == 0 {
            return Err(TimingError::NoRows);
        }
        Ok(Self {
            line_time_ps,
            exposure_ns,
            rows,
        })
    }

    /// Time from one row to the next, ps.
    pub const fn line_time_ps(&self) -> u32 {
        self.line_time_ps
    }

    /// Exposure of a row, ns.
    pub const fn exposure_ns(&self) -> u32 {
        self.exposure_ns
    }

    /// Rows of a frame.
    pub const fn rows(&self) -> u16 {
        self.rows
    }

    /// All rows are exposed at once.
    pub const fn is_global_shutter(&self) -> bool {
        self.line_time_ps == 0
    }

    /// Start of exposure of `row` after that of row 0, ns, rounded down.
    #[inline]
    pub const fn start_ns(&self, row: u16) -> i64 {
        // Whole ns and the rest apart: a microcontroller asks for every line, and divides 64 bits slowly.
        let (ns, ps) = (self.line_time_ps / 1000, self.line_time_ps % 1000);
        (row as u64 * ns as u64 + (row as u32 * ps / 1000) as u64) as i64
    }

    /// Middle of exposure of `row` after the start of exposure of row 0, ns: the sample time.
    pub const fn middle_ns(&self, row: u16) -> i64 {
        self.start_ns(row) + (self.exposure_ns / 2) as i64
    }

    /// Time from the first row's start to one line time after the last row's, ns.
    pub const fn readout_ns(&self) -> i64 {
        self.start_ns(self.rows)
    }
}

/// Why a [`Timing`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingError {
    /// A frame has at least one row.
    NoRows,
}

impl fmt::Display for TimingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRows => f.write_str("a frame needs at least one row"),
        }
    }
}

impl core::error::Error for TimingError {}

/// One line of one frame, as it leaves the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// Number of the frame, counted by the camera: a lost frame leaves a gap. Wraps at 2³².
    pub frame: u32,
    /// Row in the picture (or in the part of it that is used), from 0.
    pub row: u16,
    /// Start of this line's exposure, ns on the camera's clock. Where the exposure changes from frame to
    /// frame and the camera tells it: its middle less half of [`Timing::exposure_ns`], because what is
    /// measured is where the picture was then. (A step of 30 % that nobody told makes side tones of 0.35 %
    /// beside 37 Hz at 0.2 ms; brightness alone cannot tell exposure from gain.)
    pub start_ns: i64,
    /// Its pixels.
    pub pixels: Pixels<'a>,
}
