//! Sums of the tiles in some blocks of time, and what the tones themselves sum up to in each.

use num_complex::Complex64;
use rowtone::shape::ToneSums;

/// When there are so many blocks, neighbours become one.
const MOST: usize = 32;

/// Sums over some frames, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) frames: u32,
    /// Sum of the frames' starts after the recording's, s.
    seconds: f64,
    /// Tile by tile, the tones of a tile side by side.
    pub(super) sums: Vec<ToneSums>,
    /// Σ e^{i(a − b)} and Σ e^{i(a + b)} of the phases a, b of every two tones, b not behind a, at the frames' starts.
    pub(super) pairs: Vec<[Complex64; 2]>,
}

impl Block {
    /// Mean start of its frames, s.
    pub(super) fn middle_s(&self) -> f64 {
        self.seconds / f64::from(self.frames.max(1))
    }

    fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.seconds += other.seconds;
        for (sum, other) in self.sums.iter_mut().zip(&other.sums) {
            add(sum, other);
        }
        for (sum, other) in self.pairs.iter_mut().zip(&other.pairs) {
            sum[0] += other[0];
            sum[1] += other[1];
        }
    }
}

/// All blocks of a recording.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    hz: Vec<f64>,
    tiles: usize,
    /// Frames of a block that is full.
    full: u32,
    pub(super) all: Vec<Block>,
}

impl Blocks {
    /// None yet, for a recording of about `frames` frames.
    pub(super) fn new(hz: &[f64], tiles: usize, frames: usize) -> Self {
        Self {
            hz: hz.to_vec(),
            tiles,
            full: (frames / (MOST - 4)).max(1) as u32,
            all: Vec::new(),
        }
    }

    /// Frequencies that were summed, Hz.
    pub(super) fn hz(&self) -> &[f64] {
        &self.hz
    }

    /// Frames in all blocks.
    pub(super) fn frames(&self) -> u32 {
        self.all.iter().map(|block| block.frames).sum()
    }

    /// Adds a frame that started `after_s` after the first one.
    pub(super) fn add(&mut self, after_s: f64, sums: &[ToneSums]) {
        if self
            .all
            .last()
            .is_none_or(|block| block.frames >= self.full)
        {
            if self.all.len() >= MOST {
                self.halve();
            }
            self.all.push(Block {
                frames: 0,
                seconds: 0.0,
                sums: vec![ToneSums::default(); self.tiles * self.hz.len()],
                pairs: vec![[Complex64::default(); 2]; self.hz.len() * (self.hz.len() + 1) / 2],
            });
        }
        let Some(block) = self.all.last_mut() else {
            return;
        };
        block.frames += 1;
        block.seconds += after_s;
        for (sum, new) in block.sums.iter_mut().zip(sums) {
            add(sum, new);
        }
        let turn = |hz: &f64| Complex64::cis(std::f64::consts::TAU * (hz * after_s).fract());
        let turns: Vec<Complex64> = self.hz.iter().map(turn).collect();
        let pairs = (0..turns.len()).flat_map(|a| (0..=a).map(move |b| (a, b)));
        for (sum, (a, b)) in block.pairs.iter_mut().zip(pairs) {
            sum[0] += turns[a] * turns[b].conj();
            sum[1] += turns[a] * turns[b];
        }
    }

    fn halve(&mut self) {
        let mut halved: Vec<Block> = Vec::with_capacity(MOST);
        for (k, block) in self.all.drain(..).enumerate() {
            match halved.last_mut() {
                Some(last) if k % 2 == 1 => last.add(&block),
                _ => halved.push(block),
            }
        }
        self.all = halved;
        self.full *= 2;
    }
}

fn add(sum: &mut ToneSums, other: &ToneSums) {
    for k in [0, 1] {
        sum.x[k] += other.x[k];
        sum.y[k] += other.y[k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_stay_few_and_lose_nothing() {
        let mut blocks = Blocks::new(&[0.0, 2.0], 3, 10);
        let one = ToneSums {
            x: [1.0, 2.0],
            y: [3.0, 4.0],
        };
        for k in 0..1000 {
            blocks.add(f64::from(k) * 0.01, &[one; 6]);
            assert!(blocks.all.len() <= MOST);
        }
        assert_eq!(blocks.frames(), 1000);
        let sum: f32 = blocks.all.iter().map(|b| b.sums[5].y[1]).sum();
        assert_eq!(sum, 4000.0);
        let seconds: f64 = blocks.all.iter().map(|b| b.seconds).sum();
        assert!((seconds - 4995.0).abs() < 1e-6);
        // The tone with itself: Σ 1, and Σ e^{2i} over whole periods.
        let own = blocks.all.iter().fold([Complex64::default(); 2], |sum, b| {
            [sum[0] + b.pairs[2][0], sum[1] + b.pairs[2][1]]
        });
        assert!((own[0] - 1000.0).norm() < 1e-6 && own[1].norm() < 1e-6);
        assert!(
            blocks
                .all
                .windows(2)
                .all(|w| w[0].middle_s() < w[1].middle_s())
        );
    }
}
