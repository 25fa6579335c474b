//! Displacement of small cells of the picture, frame after frame, without keeping the pictures.
//!
//! A cell is one row of one block of columns along one axis. Its displacement is the inner product of its pixels
//! with the slope of the first frames' mean, blind to brightness; beside parts that do not move, or two that
//! move against each other, a whole row would read too little or nothing.

use rowtone_linear::{dot, orthonormal, remove};

/// Frames whose mean is what the others are compared with.
const REFERENCE: usize = 32;
/// Fewest frames from which a cell's mean is known.
pub(super) const LEAST_FRAMES: usize = 8;
/// Columns of a block, at least, px.
const BLOCK_PX: usize = 24;
/// Blocks of a row, at most.
const MOST_BLOCKS: usize = 8;
/// Values kept, at most: 256 MiB of them.
const MOST_VALUES: usize = 1 << 26;

/// Reads the displacement of every cell from pictures that are handed in one after another.
#[derive(Clone, Debug)]
pub struct Watcher {
    width: usize,
    height: usize,
    first: Vec<Vec<u16>>,
    cells: Vec<Cell>,
    frames: Vec<Vec<f32>>,
}

/// What tells the displacement of a cell.
#[derive(Clone, Debug)]
struct Cell {
    row: usize,
    from: usize,
    is_down: bool,
    /// Minus the slope over its power: the displacement is the inner product with the pixels, px.
    slope: Vec<f32>,
    /// Power of the slope, (values/px)².
    power: f64,
}

/// Displacements of cells.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Row of every cell.
    pub rows: Vec<usize>,
    /// Whether a cell tells motion down the columns, else along the rows.
    pub is_down: Vec<bool>,
    /// What a cell's pixels know, (values/px)².
    pub power: Vec<f64>,
    /// Rows of the pictures.
    pub height: usize,
    /// `[frame][cell]`, px.
    pub frames: Vec<Vec<f32>>,
}

impl Watcher {
    /// For pictures of that size, px.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width: width.max(1),
            height,
            first: Vec::new(),
            cells: Vec::new(),
            frames: Vec::new(),
        }
    }

    /// Whether no more frames can be kept.
    pub fn is_full(&self) -> bool {
        !self.cells.is_empty() && self.frames.len() * self.cells.len() >= MOST_VALUES
    }

    /// Adds a picture, row by row; one of another size is left alone.
    pub fn push(&mut self, picture: &[u16]) {
        if picture.len() != self.width * self.height {
            return;
        }
        if self.cells.is_empty() && self.first.len() < REFERENCE {
            self.first.push(picture.to_vec());
            if self.first.len() == REFERENCE {
                self.look();
            }
        } else {
            let frame = self.read(picture);
            self.frames.push(frame);
        }
    }

    /// The displacements; none where there are fewer frames than 8.
    pub fn finish(mut self) -> Motion {
        if self.cells.is_empty() && self.first.len() >= LEAST_FRAMES {
            self.look();
        }
        Motion {
            rows: self.cells.iter().map(|c| c.row).collect(),
            is_down: self.cells.iter().map(|c| c.is_down).collect(),
            power: self.cells.iter().map(|c| c.power).collect(),
            height: self.height,
            frames: self.frames,
        }
    }

    /// Makes the cells from the mean of the first frames, and reads those.
    fn look(&mut self) {
        let first = std::mem::take(&mut self.first);
        let mut mean = vec![0.0; self.width * self.height];
        for picture in &first {
            let share = 1.0 / first.len() as f64;
            let values = mean.iter_mut().zip(picture);
            values.for_each(|(m, &v)| *m += share * f64::from(v));
        }
        let smooth = self.smoothed(&mean);
        let blocks = (self.width / BLOCK_PX).clamp(1, MOST_BLOCKS);
        for row in 0..self.height {
            for block in 0..blocks {
                let [from, to] = [block, block + 1].map(|b| b * self.width / blocks);
                for is_down in [false, true] {
                    self.cells
                        .extend(self.cell(&mean, &smooth, (row, from, to), is_down));
                }
            }
        }
        self.frames = first.iter().map(|picture| self.read(picture)).collect();
    }

    fn cell(
        &self,
        mean: &[f64],
        smooth: &[f64],
        (row, from, to): (usize, usize, usize),
        is_down: bool,
    ) -> Option<Cell> {
        let at = |y: usize, x: usize| smooth[y * self.width + x];
        let mut slope: Vec<f64> = (from..to)
            .map(|x| {
                if is_down && row > 0 && row + 1 < self.height {
                    0.5 * (at(row + 1, x) - at(row - 1, x))
                } else if !is_down && x > 0 && x + 1 < self.width {
                    0.5 * (at(row, x + 1) - at(row, x - 1))
                } else {
                    0.0
                }
            })
            .collect();
        let own = mean[row * self.width + from..row * self.width + to].to_vec();
        let basis = orthonormal(vec![vec![1.0; to - from], own]);
        remove(&basis, &mut slope);
        let power = dot(&slope, &slope);
        // A slope of half a value in every pixel drowns in the rounding.
        (power > 0.25 * (to - from) as f64).then(|| Cell {
            row,
            from,
            is_down,
            slope: slope.iter().map(|s| (-s / power) as f32).collect(),
            power,
        })
    }

    /// Binomial smoothing over five pixels along the rows and three down the columns.
    fn smoothed(&self, picture: &[f64]) -> Vec<f64> {
        let (w, h) = (self.width, self.height);
        let mut out = picture.to_vec();
        for pass in 0..3 {
            let before = out.clone();
            for y in 0..h {
                for x in 0..w {
                    let [a, b] = if pass < 2 {
                        [y * w + x.saturating_sub(1), y * w + (x + 1).min(w - 1)]
                    } else {
                        [y.saturating_sub(1) * w + x, (y + 1).min(h - 1) * w + x]
                    };
                    out[y * w + x] = 0.25 * before[a] + 0.5 * before[y * w + x] + 0.25 * before[b];
                }
            }
        }
        out
    }

    fn read(&self, picture: &[u16]) -> Vec<f32> {
        let read = |cell: &Cell| {
            let start = cell.row * self.width + cell.from;
            let pixels = &picture[start..start + cell.slope.len()];
            let products = cell.slope.iter().zip(pixels);
            products.map(|(s, &v)| s * f32::from(v)).sum()
        };
        self.cells.iter().map(read).collect()
    }
}

impl Motion {
    /// Displacement of whole rows along the rows in the first `frames` frames, px: the mean of a row's cells and of
    /// its two neighbours', each by what it knows.
    pub fn whole_rows(&self, frames: usize) -> Vec<Vec<f64>> {
        let mut known = vec![0.0; self.height];
        let along = || (0..self.rows.len()).filter(|&c| !self.is_down[c]);
        along().for_each(|c| known[self.rows[c]] += self.power[c]);
        let near = |y: usize| y.saturating_sub(1)..(y + 2).min(self.height);
        let rows = |frame: &Vec<f32>| {
            let mut sums = vec![0.0; self.height];
            along().for_each(|c| sums[self.rows[c]] += self.power[c] * f64::from(frame[c]));
            let mean = |y| {
                let total: f64 = known[near(y)].iter().sum();
                let sum: f64 = sums[near(y)].iter().sum();
                if total > 0.0 { sum / total } else { 0.0 }
            };
            (0..self.height).map(mean).collect()
        };
        self.frames.iter().take(frames).map(rows).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to 0.2 px along the rows beside up to 0.1 px down the columns; the smoothed slope makes a tenth too much of it.
    #[test]
    fn shifts_along_the_rows_are_read_beside_others() {
        let mut watcher = Watcher::new(48, 24);
        let moved = |n: usize| [0.2 * (n as f64).sin(), 0.1 * (1.7 * n as f64).cos()];
        for n in 0..40 {
            let [dx, dy] = moved(n);
            let value = |y: usize, x: usize| {
                let [x, y] = [x as f64 - dx, y as f64 - dy];
                (600.0 + 150.0 * (0.4 * x).sin() + 150.0 * (0.5 * y).sin()).round() as u16
            };
            let picture: Vec<u16> = (0..48 * 24).map(|i| value(i / 48, i % 48)).collect();
            watcher.push(&picture);
        }
        let motion = watcher.finish();
        assert_eq!(motion.frames.len(), 40);
        let rows = motion.whole_rows(40);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let x: Vec<f64> = rows.iter().map(|r| mean(&r[4..20])).collect();
        let truth: Vec<f64> = (0..40).map(|n| moved(n)[0]).collect();
        for n in 0..40 {
            let off = x[n] - mean(&x) - truth[n] + mean(&truth);
            assert!(off.abs() < 0.03, "{n}: off by {off}");
        }
    }

    #[test]
    fn too_few_frames_show_no_motion() {
        let mut watcher = Watcher::new(4, 4);
        (0..7).for_each(|_| watcher.push(&[1; 16]));
        assert!(watcher.finish().frames.is_empty());
    }
}
