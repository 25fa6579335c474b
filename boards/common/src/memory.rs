//! The core's memory, as statics of sizes that fit half a megabyte of RAM, and what follows from the sizes.
//!
//! Everything starts as zeros, so it lies in `.bss` and costs no flash.

use rowtone::camera::Timing;
use rowtone::spectrum::StaticStorage;
use rowtone::timeline;

/// Samples of a window.
pub const SAMPLES: usize = 3072;
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
