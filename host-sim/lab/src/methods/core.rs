//! This project's own line engine as one [`Method`] among the others.

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::tracker::{Config, Outcome, Stage, Tracker};

use super::{Clip, Method, Shifts};
use rowtone_memory::TrackerMemory;

/// The core's tracker: two rounds of learning over all frames, then one inner product a line.
#[derive(Clone, Copy, Debug)]
pub struct Core {
    /// Time of one row; the tracker predicts with it.
    pub timing: Timing,
    /// Time from frame to frame, ns.
    pub frame_ns: i64,
    /// Bits of a pixel.
    pub bits: u8,
}

impl Method for Core {
    fn name(&self) -> &'static str {
        "rowtone"
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let count = clip.frames.len();
        let silent = vec![vec![f64::NAN; clip.height]; count];
        let (Ok(width), Ok(rows), Ok(learn_frames)) = (
            u16::try_from(clip.width),
            u16::try_from(clip.height),
            u16::try_from(count),
        ) else {
            return silent;
        };
        let config = Config {
            rows,
            bits: self.bits,
            learn_frames,
            ..Config::new(self.timing, width)
        };
        let mut memory = TrackerMemory::new(clip.width, clip.height);
        let Ok(mut tracker) = Tracker::new(config, memory.lend()) else {
            return silent;
        };
        let mut shifts = silent;
        let frames: Vec<Vec<u16>> = clip
            .frames
            .iter()
            .map(|f| f.iter().map(|v| v.round() as u16).collect())
            .collect();
        // Rounds of learning, then one that is measured.
        for round in 0..4 {
            let before = tracker.stage();
            for (n, frame) in frames.iter().enumerate() {
                for (y, row) in frame.chunks_exact(clip.width).enumerate() {
                    let line = Line {
                        frame: (round * count + n) as u32,
                        row: y as u16,
                        start_ns: (round * count + n) as i64 * self.frame_ns
                            + self.timing.start_ns(y as u16),
                        pixels: Pixels::U16(row),
                    };
                    if let Outcome::Measured(displacement) = tracker.push(&line) {
                        shifts[n][y] = f64::from(displacement.shift_px);
                    }
                }
            }
            match tracker.stage() {
                Stage::Tracking if before == Stage::Tracking => break,
                stage if stage == before => tracker.end_round(),
                _ => {}
            }
        }
        shifts
    }
}
