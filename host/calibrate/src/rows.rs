//! Pictures to row means.

/// Blocks of columns that are averaged apart, so that saturated ones can be left out.
const BLOCKS: usize = 32;

/// Share of the pixels that lie at the highest or lowest value where that cuts them off.
const CUT_OFF: f64 = 0.01;

/// The mean of every row of every frame, and when the frames were taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// `[frame][row]`, in units of the picture.
    pub rows: Vec<Vec<f64>>,
    /// Start of exposure of row 0 of every frame by the camera's clock, s. `None` for a single picture.
    pub times_s: Option<Vec<f64>>,
    /// Frame rate, Hz, where a single picture's is known.
    pub fps: Option<f64>,
    /// Share of the used pixels that are saturated, 0 to 1.
    pub saturated_share: f64,
    /// The value that dark pixels are cut off at, where many are.
    pub black: Option<f64>,
    /// Rows of the whole picture, where `rows` are a part of it.
    pub picture_rows: Option<usize>,
}

impl Recording {
    /// Its first frames.
    pub fn first(&self, frames: usize) -> Self {
        let cut = |times: &Vec<f64>| times[..frames.min(times.len())].to_vec();
        Self {
            rows: self.rows[..frames.min(self.rows.len())].to_vec(),
            times_s: self.times_s.as_ref().map(cut),
            ..self.clone()
        }
    }

    /// Typical (median) time from frame to frame, s.
    pub fn frame_period_s(&self) -> Option<f64> {
        match &self.times_s {
            Some(times) if times.len() > 1 => {
                let steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
                let typical = rowtone_linear::median(&steps);
                // A mean of the regular steps is finer than one step written in microseconds.
                let regular: Vec<f64> = steps
                    .into_iter()
                    .filter(|s| (s - typical).abs() < 0.2 * typical)
                    .collect();
                Some(regular.iter().sum::<f64>() / regular.len().max(1) as f64)
            }
            _ => self.fps.map(|fps| 1.0 / fps),
        }
    }
}

/// Sums up one frame after another.
#[derive(Clone, Debug)]
pub struct Collector {
    width: usize,
    full_scale: u16,
    frames: Vec<Vec<[Block; BLOCKS]>>,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    sum: f64,
    max: u16,
    at_max: u32,
    min: u16,
    at_min: u32,
}

impl Block {
    const EMPTY: Self = Self {
        sum: 0.0,
        max: 0,
        at_max: 0,
        min: u16::MAX,
        at_min: 0,
    };
}

impl Collector {
    /// For pictures `width` px wide with values up to `full_scale`.
    pub fn new(width: usize, full_scale: u16) -> Self {
        Self {
            width,
            full_scale,
            frames: Vec::new(),
        }
    }

    /// Adds a frame: its rows, each `width` values.
    pub fn push<'a>(&mut self, rows: impl Iterator<Item = &'a [u16]>) {
        let width = self.width;
        let frame = rows
            .map(|row| {
                let mut blocks = [Block::EMPTY; BLOCKS];
                for (x, &value) in row.iter().enumerate() {
                    let block = &mut blocks[(x * BLOCKS / width.max(1)).min(BLOCKS - 1)];
                    block.sum += f64::from(value);
                    match value.cmp(&block.max) {
                        std::cmp::Ordering::Greater => (block.max, block.at_max) = (value, 1),
                        std::cmp::Ordering::Equal => block.at_max += 1,
                        std::cmp::Ordering::Less => {}
                    }
                    match value.cmp(&block.min) {
                        std::cmp::Ordering::Less => (block.min, block.at_min) = (value, 1),
                        std::cmp::Ordering::Equal => block.at_min += 1,
                        std::cmp::Ordering::Greater => {}
                    }
                }
                blocks
            })
            .collect();
        self.frames.push(frame);
    }

    /// Frames so far.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// No frame yet.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Row means over the columns that are not saturated; over all where too few would be left.
    pub fn finish(self, times_s: Option<Vec<f64>>, fps: Option<f64>) -> Recording {
        let all = || self.frames.iter().flatten();
        let top = all().flatten().map(|b| b.max).max().unwrap_or(0);
        let pixels_in = |block: usize| {
            (0..self.width)
                .filter(|x| (x * BLOCKS / self.width) == block)
                .count() as f64
        };
        let sizes: Vec<f64> = (0..BLOCKS).map(pixels_in).collect();
        let row_count = all().count().max(1) as f64;
        // A ceiling only counts as saturation near full scale (235 of 255 is video white).
        let near_full = f64::from(top) >= 0.9 * f64::from(self.full_scale);
        let clipped: Vec<f64> = (0..BLOCKS)
            .map(|b| {
                let count: u32 = all()
                    .map(|row| if row[b].max == top { row[b].at_max } else { 0 })
                    .sum();
                if near_full && sizes[b] > 0.0 {
                    f64::from(count) / (row_count * sizes[b])
                } else {
                    0.0
                }
            })
            .collect();
        let mut used: Vec<usize> = (0..BLOCKS)
            .filter(|&b| sizes[b] > 0.0 && clipped[b] < CUT_OFF)
            .collect();
        if used.len() < BLOCKS.min(self.width) / 4 {
            used = (0..BLOCKS).filter(|&b| sizes[b] > 0.0).collect();
        }
        let pixels: f64 = used.iter().map(|&b| sizes[b]).sum();
        let share = used.iter().map(|&b| clipped[b] * sizes[b]).sum::<f64>() / pixels.max(1.0);
        let in_use = || all().flat_map(|row| used.iter().map(move |&b| row[b]));
        let bottom = in_use().map(|b| b.min).min().unwrap_or(0);
        let at_bottom: u32 = in_use().filter(|b| b.min == bottom).map(|b| b.at_min).sum();
        let black = f64::from(at_bottom) > CUT_OFF * row_count * pixels;
        let rows = self
            .frames
            .iter()
            .map(|frame| {
                frame
                    .iter()
                    .map(|row| used.iter().map(|&b| row[b].sum).sum::<f64>() / pixels.max(1.0))
                    .collect()
            })
            .collect();
        Recording {
            rows,
            times_s,
            fps,
            saturated_share: if share > CUT_OFF { share } else { 0.0 },
            black: black.then_some(f64::from(bottom)),
            picture_rows: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_without_saturated_columns() {
        let mut collector = Collector::new(64, 255);
        let rows: Vec<Vec<u16>> = (0..4u16)
            .map(|y| {
                (0..64)
                    .map(|x| if x < 32 { 255 } else { 100 + y })
                    .collect()
            })
            .collect();
        collector.push(rows.iter().map(Vec::as_slice));
        let recording = collector.finish(None, Some(50.0));
        assert_eq!(recording.rows, vec![vec![100.0, 101.0, 102.0, 103.0]]);
        assert_eq!(recording.saturated_share, 0.0);
        assert_eq!(recording.frame_period_s(), Some(0.02));
    }

    /// A fifth of the pixels at 3, none below: cut off there. One in 800 there: chance.
    #[test]
    fn black_that_is_cut_off_is_told() {
        for (dark, black) in [(8, Some(3.0)), (1, None)] {
            let mut collector = Collector::new(40, 255);
            let mut row = [100u16; 40];
            row[..dark].fill(3);
            let rows = (0..20).map(|y| if dark == 8 || y == 0 { row } else { [100; 40] });
            let rows: Vec<[u16; 40]> = rows.collect();
            collector.push(rows.iter().map(|r| &r[..]));
            assert_eq!(collector.finish(None, None).black, black);
        }
    }

    #[test]
    fn a_saturated_picture_says_so() {
        let mut collector = Collector::new(40, 255);
        let row = [255u16; 40];
        collector.push([&row[..], &row[..]].into_iter());
        assert!(collector.finish(None, None).saturated_share > 0.9);
    }
}
