//! The core's memory, as statics of the sizes that fit the RP2350, and what follows from the sizes.
//!
//! Everything starts as zeros, so it lies in `.bss` and costs no flash.

use rowtone::camera::Timing;
use rowtone::reference::RowTable;
use rowtone::spectrum::StaticStorage;
use rowtone::timeline;
use rowtone::tracker::{ColumnLearning, RowLearning, Storage};

/// Samples of a window.
pub const SAMPLES: usize = 4096;
/// Frames of a window.
pub const FRAMES: usize = 96;
/// Samples of a frame.
pub const SLOTS: usize = 96;
/// Frequencies up to this one are sampled well, where the memory allows.
pub const MAX_HZ: f32 = 2000.0;
/// Passes over a window's samples: so many take less than a hop of 0.5 s, whatever is in it (README.md).
pub const MAX_PASSES: u32 = 36;
/// Columns of a row's coefficients that are built anew beside a line, when a row's are: about as long as the
/// line's own inner product.
pub const COLUMNS_PER_LINE: u16 = 16;

/// Memory of the spectrum: one window being collected and one being computed, nine tones at once.
pub type SpectrumMemory = StaticStorage<SAMPLES, FRAMES, SLOTS, 8192, 10>;

/// Rows that make a sample, so that a window of `frames` frames fits [`SpectrumMemory`].
pub fn rows_per_sample(timing: Timing, frames: u32) -> u16 {
    let rows = timeline::rows_per_sample(timing, MAX_HZ, frames, SAMPLES);

    rows.max(timing.rows().div_ceil(SLOTS as u16))
}

/// Memory for pictures of up to `PIXELS` pixels, `ROWS` rows and `WIDTH` columns.
///
/// The coefficients come first and at a whole word: where the width is a multiple of four, every row of
/// them lies so, and the inner product loads two words at once.
#[derive(Debug)]
#[repr(C, align(8))]
pub struct TrackerMemory<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> {
    coefficients: [i8; PIXELS],
    mean: [u16; PIXELS],
    tables: heapless::Vec<RowTable, ROWS>,
    learning: heapless::Vec<RowLearning, ROWS>,
    mask: [u8; WIDTH],
    columns: heapless::Vec<ColumnLearning, WIDTH>,
    fresh: [i8; WIDTH],
    scratch: [[f32; 2]; WIDTH],
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize>
    TrackerMemory<PIXELS, ROWS, WIDTH>
{
    /// All zeros.
    pub const fn new() -> Self {
        Self {
            coefficients: [0; PIXELS],
            mean: [0; PIXELS],
            tables: heapless::Vec::new(),
            learning: heapless::Vec::new(),
            mask: [0; WIDTH],
            columns: heapless::Vec::new(),
            fresh: [0; WIDTH],
            scratch: [[0.0; 2]; WIDTH],
        }
    }

    /// Lend it to a tracker, all columns in use.
    pub fn lend(&mut self) -> Storage<'_> {
        // In place: an array of defaults would first stand on the stack. A length of the capacity always fits.
        let _ = self.tables.resize_default(ROWS);
        let _ = self.learning.resize_default(ROWS);
        let _ = self.columns.resize_default(WIDTH);
        self.mask.fill(u8::MAX);
        Storage {
            coefficients: &mut self.coefficients,
            tables: &mut self.tables,
            mean: &mut self.mean,
            learning: &mut self.learning,
            mask: &mut self.mask,
            columns: &mut self.columns,
            fresh: &mut self.fresh,
            scratch: self.scratch.as_flattened_mut(),
        }
    }
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> Default
    for TrackerMemory<PIXELS, ROWS, WIDTH>
{
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::tracker::{Config, Tracker};

    #[test]
    fn samples_of_a_window_fit() {
        for (line_time_us, rows, frames) in [
            (67, 240, 57),
            (125, 240, 31),
            (40, 300, 60),
            (50, 400, 30),
            (9, 480, 120),
        ] {
            let timing = Timing::new(line_time_us * 1_000_000, 0, rows).unwrap();
            let group = timeline::Group::new(timing, rows_per_sample(timing, frames)).unwrap();
            assert!(usize::from(group.slots()) <= SLOTS);
            assert!(usize::from(group.slots()) * frames as usize <= SAMPLES);
        }
    }

    #[test]
    fn is_enough_for_the_cameras_picture() {
        let mut memory = Box::new(TrackerMemory::<{ 320 * 240 }, 240, 320>::new());
        let timing = Timing::new(67_200_000, 500_000, 240).unwrap();
        assert!(Tracker::new(Config::new(timing, 320), memory.lend()).is_ok());
    }
}
