//! A frame that is elsewhere for once is left out of the window.
//!
//! A driver delivers a frame that is stale or cut at another place, a codec misplaces one, somebody knocks the
//! camera for a moment: all rows of one frame lie pixels away from where they lie in every other. No tone does that. The
//! mean of such a frame's samples is further from the mean of all others than any of those is, by far.

use super::Collector;

/// At most so many frames of a window.
const MOST: u8 = 3;
/// Fewer frames than this do not tell which of them is the odd one.
const LEAST_FRAMES: usize = 8;
/// Further than the next by this many times and so many px more.
const TIMES: f32 = 4.0;
const FURTHER_PX: f32 = 2.0;

impl Collector<'_> {
    /// Leaves such frames out of those from `first` on.
    pub(super) fn leave_out_elsewhere(&mut self, first: usize) {
        for _ in 0..MOST {
            let Some(odd) = self.elsewhere(first) else {
                return;
            };
            let column = self.column(odd);
            for series in 0..self.series() {
                if let Some(weight) = self.ring.weight.get_mut(series * self.capacity + column) {
                    *weight = 0;
                }
            }
        }
    }

    /// The frame that is, counted from the oldest.
    fn elsewhere(&self, first: usize) -> Option<usize> {
        let means = || (first..self.held).filter_map(|i| Some((i, self.mean_px(i)?)));
        let (mut n, mut sum) = (0.0f32, 0.0f32);
        for (_, px) in means() {
            n += 1.0;
            sum += px;
        }
        if n < LEAST_FRAMES as f32 {
            return None;
        }
        let mean = sum / n;
        let away = |px: f32| (px - mean).abs();
        let (odd, odd_px) = means().max_by(|a, b| away(a.1).total_cmp(&away(b.1)))?;
        // The mean of the others, and how far the next of them is from it.
        let others = (sum - odd_px) / (n - 1.0);
        let away = |px: f32| (px - others).abs();
        let next = means().filter(|&(i, _)| i != odd);
        let next = next.map(|(_, px)| away(px)).fold(0.0, f32::max);
        (away(odd_px) > TIMES * next + FURTHER_PX).then_some(odd)
    }

    /// Mean shift of a frame's samples along the rows, px; `None` where it has none.
    fn mean_px(&self, frame: usize) -> Option<f32> {
        let column = self.column(frame);
        let (mut n, mut sum) = (0.0f32, 0.0f32);
        for slot in 0..usize::from(self.group.slots()) {
            let at = slot * self.capacity + column;
            if let (Some(&px), Some(1..)) = (self.ring.shift_px.get(at), self.ring.weight.get(at)) {
                n += 1.0;
                sum += px;
            }
        }
        (n > 0.0).then(|| sum / n)
    }

    fn series(&self) -> usize {
        let slots = usize::from(self.group.slots());
        self.ring.channels(slots) * slots
    }
}

#[cfg(test)]
mod tests {
    use super::super::ReportSide;
    use crate::camera::Timing;
    use crate::report::Report;
    use crate::spectrum::{Config, StaticStorage};
    use crate::timeline::{Curvature, Group, Sample};
    extern crate std;
    use std::boxed::Box;

    /// A second of 60 frames that swing by `amplitude_px` at 24.7 Hz, one of which is elsewhere.
    fn report(amplitude_px: f32, odd: u32, away_px: f32) -> Report {
        let group = Group::new(Timing::new(50_000_000, 0, 300).unwrap(), 10).unwrap();
        let mut memory = Box::new(StaticStorage::<2048, 64, 32, 4096, 9>::new());
        let mut analyzer = ReportSide::new(Config::default(), group, memory.lend()).unwrap();
        let mut dice = 1_u32;
        for frame in 0..60 {
            for slot in 0..group.slots() {
                let time_ns = i64::from(frame) * 16_666_667 + group.middle_ns(slot);
                dice = dice.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = 0.02 * ((dice >> 8) as f32 / 16_777_216.0 - 0.5);
                let turn = core::f32::consts::TAU * 24.7 * (time_ns as f32 * 1e-9);
                let elsewhere = if frame == odd { away_px } else { 0.0 };
                assert!(!analyzer.push(Sample {
                    frame,
                    slot,
                    curvature: Curvature::default(),
                    time_ns,
                    shift_px: amplitude_px * libm::sinf(turn) + noise + elsewhere,
                    information_per_px2: 3e4,
                    spread: group.even_spread(),
                    vertical: None,
                }));
            }
        }
        analyzer.finish().unwrap()
    }

    #[test]
    fn a_frame_that_is_elsewhere_for_once_costs_itself() {
        for (amplitude_px, odd, away_px) in [(0.3, 0, -40.0), (0.3, 31, 5.0), (3.0, 59, 25.0)] {
            let report = report(amplitude_px, odd, away_px);
            assert_eq!(report.peaks.len(), 1, "{:?}", report.peaks);
            let off = report.peaks[0].amplitude_px / amplitude_px - 1.0;
            assert!(off.abs() < 0.01, "{off}");
            assert_eq!(report.lines, 59 * 300);
        }
    }

    #[test]
    fn frames_that_swing_are_all_kept() {
        for amplitude_px in [0.3, 3.0, 30.0] {
            assert_eq!(report(amplitude_px, 0, 0.0).lines, 60 * 300);
        }
    }
}
