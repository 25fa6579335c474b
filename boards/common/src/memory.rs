//! The core's memory, as statics of sizes that fit half a megabyte of RAM, and what follows from the sizes.
//!
//! Everything starts as zeros, so it lies in `.bss` and costs no flash.

use rowtone::camera::Timing;
use rowtone::spectrum::{self, StaticCouplings};
use rowtone::timeline;
use rowtone::tracker::{StaticStorage, StaticVerticalStorage};

/// Samples of a window.
pub const SAMPLES: usize = 4096;
/// Frames of a window.
pub const FRAMES: usize = 96;
/// Samples of a frame.
pub const SLOTS: usize = 96;
/// Frequencies up to this one are sampled well, where the memory allows.
pub const MAX_HZ: f32 = 2000.0;
/// Passes over a window's samples: with fewer, windows of five tones lose most of them. Eight tones take longer than a hop
/// of 0.5 s so (docs/performance.md); windows that end meanwhile are dropped, counted and said.
pub const MAX_PASSES: u32 = 60;
/// Columns of a row's coefficients that are built anew beside a line, when a row's are: about as long as the
/// line's own inner product.
pub const COLUMNS_PER_LINE: u16 = 16;

/// Memory of the spectrum: one window being collected and one being computed, nine tones at once.
pub type SpectrumMemory = spectrum::StaticStorage<SAMPLES, FRAMES, SLOTS, 8192, 10>;

/// The memory of a picture of 320 x 240 that is measured along its rows holds one of 256 x 200 that is measured along both
/// axes, with what its windows need besides.
const _: () = {
    type Wide = StaticStorage<{ 320 * 240 }, 240, 320>;
    type Both = StaticStorage<{ 256 * 200 }, 200, 256>;
    type Vertical = StaticVerticalStorage<{ 256 * 200 }, 200, 256>;
    let both = size_of::<Both>() + size_of::<Vertical>() + size_of::<StaticCouplings<SLOTS>>();
    assert!(both <= size_of::<Wide>());
};

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
