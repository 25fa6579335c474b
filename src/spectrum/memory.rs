//! How much memory a window takes.

use super::storage::{FRAME_ROWS, slot_rows};
use super::window::{FrameMark, SlotCoupling};
use crate::timeline::Spread;
use crate::tracker::Axes;

/// Bytes that a [`ReportSide`](crate::pipeline::ReportSide) is lent ([`Storage`](super::Storage)) for windows of this many
/// frames of this many samples (slots) each, that know these axes, with at most this many tones fitted at once and a grid of
/// this many points. Twice the samples: one window is collected while another is computed.
///
/// ```
/// use rowtone::{spectrum::window_bytes, tracker::Axes};
/// // 60 frames of 64 samples, 8 tones, 8192 points.
/// const SECOND: usize = window_bytes(60, 64, Axes::X, 8, 8192);
/// assert!(SECOND > 2 * 8 * 60 * 64 && SECOND < 128 * 1024);
/// ```
pub const fn window_bytes(
    frames: usize,
    slots: usize,
    axes: Axes,
    tones: usize,
    grid: usize,
) -> usize {
    let channels = match axes {
        Axes::X => 1,
        Axes::Xy => 2,
    };
    let real = size_of::<f32>();
    // Shift and weight a channel, and one skew.
    let sample = channels * (real + size_of::<u16>()) + size_of::<i16>();
    let samples = sample * frames * slots
        + (size_of::<Spread>() + (channels - 1) * size_of::<SlotCoupling>()) * slots
        + size_of::<FrameMark>() * frames;
    let phasors = 2 * (tones + 1) * real * (frames + slots);
    let rows = FRAME_ROWS * real * frames + slot_rows(channels) * real * slots;
    let times = size_of::<i64>() * (frames + slots);
    2 * samples + phasors + rows + times + real * grid
}

#[cfg(test)]
mod tests {
    use core::mem::size_of_val;

    use super::*;
    use crate::spectrum::{SampleBuffer, StaticStorage};

    fn of_buffer(buffer: &SampleBuffer<'_>) -> usize {
        size_of_val(buffer.shift_px)
            + size_of_val(buffer.weight)
            + size_of_val(buffer.skew)
            + size_of_val(buffer.spread)
            + size_of_val(buffer.couplings)
            + size_of_val(buffer.frames)
    }

    #[test]
    fn it_is_what_the_buffers_take() {
        let mut storage = StaticStorage::<{ 30 * 20 }, 30, 20, 1024, 5>::new();
        let lent = storage.lend();
        let estimator = lent.estimator;
        let bytes = of_buffer(&lent.collected)
            + of_buffer(&estimator.samples)
            + size_of_val(estimator.frame_ns)
            + size_of_val(estimator.slot_ns)
            + size_of_val(estimator.frame_rows)
            + size_of_val(estimator.slot_rows)
            + size_of_val(estimator.frame_phasors)
            + size_of_val(estimator.slot_phasors)
            + size_of_val(estimator.grid);
        assert_eq!(window_bytes(30, 20, Axes::X, 4, 1024), bytes);
    }
}
