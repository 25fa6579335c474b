//! Moments of filtered samples, and how they differ from block to block of them.

/// What filtered samples come to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    weight: f32,
    second: f32,
    fourth: f32,
    /// The block that is being filled.
    block: Block,
    blocks: f32,
    /// Means of the blocks' second and fourth moments, and sums of squares and products of what they are off.
    means: [f32; 2],
    off: [f32; 3],
    /// Samples that were added.
    pub(super) count: f32,
    pub(super) lowest: f32,
    pub(super) highest: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Block {
    weight: f32,
    second: f32,
    fourth: f32,
}

impl Moments {
    #[inline(always)]
    pub(super) fn add(&mut self, weight: f32, value: f32) {
        let square = value * value;
        self.block.weight += weight;
        self.block.second += weight * square;
        self.block.fourth += weight * square * square;
        self.count += 1.0;
        self.lowest = self.lowest.min(value);
        self.highest = self.highest.max(value);
    }

    /// What follows is another block.
    pub(super) fn end_block(&mut self) {
        let block = core::mem::take(&mut self.block);
        if block.weight <= 0.0 {
            return;
        }
        self.weight += block.weight;
        self.second += block.second;
        self.fourth += block.fourth;
        // Welford's: sums of squares of what is off the running mean.
        self.blocks += 1.0;
        let now = [block.second, block.fourth].map(|sum| sum / block.weight);
        let before = [now[0] - self.means[0], now[1] - self.means[1]];
        self.means[0] += before[0] / self.blocks;
        self.means[1] += before[1] / self.blocks;
        let after = [now[0] - self.means[0], now[1] - self.means[1]];
        self.off[0] += before[0] * after[0];
        self.off[1] += before[0] * after[1];
        self.off[2] += before[1] * after[1];
    }

    pub(super) const fn blocks(&self) -> f32 {
        self.blocks
    }

    /// Means of the squares and of their squares.
    pub(super) fn means(&self) -> [f32; 2] {
        [self.second, self.fourth].map(|sum| sum / self.weight)
    }

    /// Variance of `of_second` times the one mean and `of_fourth` times the other, as the blocks differ.
    pub(super) fn variance(&self, of_second: f32, of_fourth: f32) -> f32 {
        let [a, b, c] = self.off;
        let sum =
            of_second * of_second * a + 2.0 * of_second * of_fourth * b + of_fourth * of_fourth * c;
        sum.max(0.0) / (self.blocks * (self.blocks - 1.0)).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_the_definition() {
        let mut moments = Moments::default();
        let blocks = [[1.0, -2.0, 0.5], [3.0, 0.0, 1.0], [-1.0, 1.5, 2.0]];
        let (mut squares, mut fourths) = ([0.0_f32; 3], [0.0_f32; 3]);
        for (i, block) in blocks.iter().enumerate() {
            for &value in block {
                moments.add(2.0, value);
                squares[i] += value * value / 3.0;
                fourths[i] += value * value * value * value / 3.0;
            }
            moments.end_block();
        }
        let [second, fourth] = [squares, fourths].map(|x| x.iter().sum::<f32>() / 3.0);
        let got = moments.means();
        assert!((got[0] - second).abs() < 1e-5 && (got[1] - fourth).abs() < 1e-4);
        assert_eq!((moments.lowest, moments.highest), (-2.0, 3.0));
        assert_eq!((moments.count, moments.blocks()), (9.0, 3.0));
        let mut variance = 0.0;
        for (a, b) in squares.iter().zip(fourths) {
            let off = 0.5 * (a - second) - 0.1 * (b - fourth);
            variance += off * off / 6.0;
        }
        let got = moments.variance(0.5, -0.1);
        assert!((got / variance - 1.0).abs() < 1e-3, "{got} {variance}");
    }
}
