//! A signal of any length, filled and filtered block by block: working memory does not grow with it.
//!
//! Each block is worked on with some of the signal before and after it, so that models and filter are settled
//! where the block begins; two blocks' values are cross-faded at their seam.

use super::butterworth::LowPass;
use super::{Method, fill};

/// Order of the low-pass. It runs both ways: no delay, and 6 dB at the corner.
pub const ORDER: usize = 6;
/// Corner of the low-pass where nothing else is asked for, Hz.
pub const USUAL_CORNER_HZ: f64 = 1000.0;

/// What is done to a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restoration {
    /// How gaps are filled.
    pub method: Method,
    /// Corner of the low-pass, Hz; none for `None` or where it is not below half the sample rate.
    pub low_pass_hz: Option<f64>,
}

impl Default for Restoration {
    fn default() -> Self {
        Self {
            method: Method::Ar,
            low_pass_hz: Some(USUAL_CORNER_HZ),
        }
    }
}

/// Lengths in samples.
#[derive(Clone, Copy, Debug)]
struct Lengths {
    /// Samples that a block adds.
    block: usize,
    /// Samples before and after it that are worked on with it.
    around: usize,
    /// Samples of the cross-fade.
    fade: usize,
}

impl Restoration {
    /// Fills and filters evenly spaced samples; hands every finished sample to `emit`, in order, none left out.
    pub fn run(
        &self,
        samples: impl IntoIterator<Item = Option<f64>>,
        rate_hz: f64,
        emit: impl FnMut(f64),
    ) {
        // The slowest of the filter's poles has died away to 1e-7 after ten periods of the corner.
        let settled = match self.low_pass_hz {
            Some(hz) if hz > 0.0 => (10.0 * rate_hz / hz).min(1e6) as usize,
            _ => 0,
        };
        let around = settled.max(4096);
        let lengths = Lengths {
            block: 4 * around,
            around,
            fade: 512,
        };
        self.in_blocks(samples.into_iter(), rate_hz, lengths, emit);
    }

    fn in_blocks(
        &self,
        mut samples: impl Iterator<Item = Option<f64>>,
        rate_hz: f64,
        lengths: Lengths,
        mut emit: impl FnMut(f64),
    ) {
        let filter = self.low_pass_hz.map(|hz| LowPass::new(ORDER, hz, rate_hz));
        let mut window: Vec<Option<f64>> = Vec::new();
        // Samples at the window's start that are out already, and what the last block made of those after them.
        let mut done = 0;
        let mut fading: Vec<f64> = Vec::new();
        loop {
            let wanted = done + lengths.block + lengths.around;
            window.extend(samples.by_ref().take(wanted - window.len()));
            let ended = window.len() < wanted;
            let mut restored = fill(&window, self.method);
            if let Some(filter) = &filter {
                filter.run_both_ways(&mut restored);
            }
            for (k, (new, old)) in restored[done..].iter_mut().zip(&fading).enumerate() {
                let share = (k as f64 + 0.5) / fading.len() as f64;
                *new = share * *new + (1.0 - share) * old;
            }
            let end = if ended {
                window.len()
            } else {
                done + lengths.block
            };
            restored[done..end].iter().for_each(|&v| emit(v));
            if ended {
                return;
            }
            fading = restored[end..end + lengths.fade].to_vec();
            let kept_from = end.saturating_sub(lengths.around);
            window.drain(..kept_from);
            done = end - kept_from;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(how: Restoration, samples: &[Option<f64>], lengths: Lengths) -> Vec<f64> {
        let mut out = Vec::new();
        how.in_blocks(samples.iter().copied(), 8000.0, lengths, |v| out.push(v));
        out
    }

    const SMALL: Lengths = Lengths {
        block: 1500,
        around: 600,
        fade: 64,
    };
    /// One block holds it all.
    const WHOLE: Lengths = Lengths {
        block: 1 << 20,
        around: 600,
        fade: 64,
    };

    fn tone(i: usize) -> f64 {
        (0.31 * i as f64).sin() + 0.5 * (0.0712 * i as f64 + 1.0).sin()
    }

    #[test]
    fn filtering_in_blocks_is_filtering_at_once() {
        let samples: Vec<Option<f64>> = (0..10_007).map(|i| Some(tone(i))).collect();
        let how = Restoration::default();
        let (blocks, whole) = (run(how, &samples, SMALL), run(how, &samples, WHOLE));
        assert_eq!((blocks.len(), whole.len()), (10_007, 10_007));
        for (a, b) in blocks.iter().zip(&whole) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn blocks_are_filled_without_a_step_at_their_seams() {
        let samples: Vec<Option<f64>> = (0..10_007)
            .map(|i| (i % 133 >= 20).then(|| tone(i)))
            .collect();
        let filled = run(Restoration::default(), &samples, SMALL);
        assert_eq!(filled.len(), samples.len());
        // 0.31 rad a sample is 395 Hz at 8 kHz: passed.
        for (i, value) in filled.iter().enumerate().skip(200).take(9600) {
            assert!((value - tone(i)).abs() < 0.05, "{i}: {value}");
        }
    }

    #[test]
    fn nothing_and_little() {
        assert!(run(Restoration::default(), &[], SMALL).is_empty());
        assert_eq!(run(Restoration::default(), &[None; 3], SMALL), [0.0; 3]);
        let how = Restoration {
            method: Method::Linear,
            low_pass_hz: None,
        };
        // As many as a block and what is around it, and one fewer and more.
        for count in [2099, 2100, 2101, 3600] {
            let samples: Vec<Option<f64>> = (0..count).map(|i| Some(f64::from(i))).collect();
            let out = run(how, &samples, SMALL);
            assert_eq!(out.len(), samples.len());
            assert!(out.iter().zip(0..).all(|(v, i)| *v == f64::from(i)));
        }
    }
}
