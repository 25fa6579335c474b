//! The tracker's memory as one static.
//!
//! Everything in it starts as zeros, so it lies in `.bss` and costs no flash.

use rowtone::reference::RowTable;
use rowtone::tracker::{RowLearning, Storage};

/// Memory for pictures of up to `PIXELS` pixels, `ROWS` rows and `WIDTH` columns.
#[derive(Debug)]
pub struct TrackerMemory<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> {
    coefficients: [i8; PIXELS],
    mean: [u16; PIXELS],
    tables: heapless::Vec<RowTable, ROWS>,
    learning: heapless::Vec<RowLearning, ROWS>,
    mask: [u8; WIDTH],
    activity: [u8; WIDTH],
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
            activity: [0; WIDTH],
            scratch: [[0.0; 2]; WIDTH],
        }
    }

    /// Lend it to a tracker, all columns in use.
    pub fn lend(&mut self) -> Storage<'_> {
        // In place: an array of defaults would first stand on the stack. A length of the capacity always fits.
        let _ = self.tables.resize_default(ROWS);
        let _ = self.learning.resize_default(ROWS);
        self.mask.fill(u8::MAX);
        Storage {
            coefficients: &mut self.coefficients,
            tables: &mut self.tables,
            mean: &mut self.mean,
            learning: &mut self.learning,
            mask: &mut self.mask,
            activity: &mut self.activity,
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
    use rowtone::camera::Timing;
    use rowtone::tracker::{Config, Tracker};

    #[test]
    fn is_enough_for_the_cameras_picture() {
        let mut memory = Box::new(TrackerMemory::<{ 320 * 240 }, 240, 320>::new());
        let timing = Timing::new(67_200_000, 500_000, 240).unwrap();
        assert!(Tracker::new(Config::new(timing, 320), memory.lend()).is_ok());
    }
}
