//! A row of the reference against a row of every frame.

use rowtone::camera::Pixels;
use rowtone::tracker::Tracker;
use rowtone_clip::Rect;
use rowtone_linear::upper_median;

use super::line::Seen;
use super::sums::Sums;
use super::{SLOPE, blocks};
use crate::tracking::codec::values;
use crate::tracking::region::Picture;

/// Rows beside one that tell its shifts; their slopes along y reach [`SLOPE`]'s length further.
const BESIDE: [isize; 4] = [-2, -1, 1, 2];
/// Rows at the top and the bottom that lack some beside them.
pub(super) const EDGE: usize = 2 + SLOPE.len();
/// The scene may be another after the first frames, which the reference was learned from.
const LEARNED: usize = 30;
/// A line that is further off is no linear function of its shift, px.
const LINEAR_PX: f64 = 1.0;
/// A line so many times more unlike its reference than the usual one does not count.
const UNLIKE: f64 = 2.0;

/// A row of the reference and those around it, in pixel values, with their slopes.
pub(super) struct Reference {
    /// Rows from [`BESIDE`]'s first to its last: value, slope along x, slope along y.
    rows: Vec<[Vec<f64>; 3]>,
    /// Variance of a pixel in each block of the middle row, as the tracker knows it.
    variance: Vec<f64>,
    /// Columns that see something, as 1; the others are 0 everywhere.
    sees: Vec<f64>,
    /// Frames that the middle row is the mean of.
    frames: f64,
    width: usize,
}

impl Reference {
    pub(super) fn around(tracker: &Tracker<'_>, row: usize) -> Option<Self> {
        let recipe = tracker.recipe();
        let sees: Vec<f64> = tracker.mask().iter().map(|&m| f64::from(m > 127)).collect();
        let per_value = 1.0 / f64::from(recipe.counts_per_value);
        let near: Option<Vec<Vec<f64>>> = (row - EDGE..=row + EDGE)
            .map(|y| {
                let counts = tracker.reference(u16::try_from(y).ok()?)?;
                Some(counts.iter().map(|&c| f64::from(c) * per_value).collect())
            })
            .collect();
        let near = near?;
        let width = near[EDGE].len();
        let reach = SLOPE.len();
        let rows = (EDGE - 2..=EDGE + 2).map(|k| {
            let mut along = vec![0.0; width];
            let mut down = vec![0.0; width];
            for (by, f) in (1..).zip(SLOPE) {
                for x in reach..width - reach {
                    along[x] += f * sees[x] * (near[k][x + by] - near[k][x - by]);
                    down[x] += f * sees[x] * (near[k + by][x] - near[k - by][x]);
                }
            }
            let row = near[k].iter().zip(&sees).map(|(r, sees)| r * sees);
            [row.collect(), along, down]
        });
        let saturation = f64::from(recipe.saturation);
        let variance = blocks(width).map(|block| {
            let row = &near[EDGE][block.clone()];
            let mean = row.iter().sum::<f64>() / block.len() as f64;
            let clipped = row.iter().any(|&value| value >= saturation);
            if clipped {
                f64::INFINITY
            } else {
                f64::from(recipe.noise.variance(mean as f32))
            }
        });
        Some(Self {
            variance: variance.collect(),
            rows: rows.collect(),
            sees,
            frames: f64::from(tracker.learned_frames(row as u16).max(1)),
            width,
        })
    }

    /// Adds what the row tells by its motion along x and along y.
    pub(super) fn patterns<P: Picture>(
        &self,
        frames: &[&P],
        part: &Rect,
        row: usize,
        to: &mut [Sums; 2],
    ) {
        let mut seen = Vec::with_capacity(frames.len());
        for frame in frames {
            let Some(shift) = self.shift(*frame, part, row) else {
                continue;
            };
            if shift.iter().all(|px| px.abs() < LINEAR_PX) {
                let line = self.difference(2, frame.row(part, row));
                seen.push((self.unlike(&line, shift), shift, line));
            }
        }
        // Something passed before some of them, or they are of another place.
        let learned = seen.iter().take(LEARNED).map(|(unlike, ..)| *unlike);
        let usual = upper_median(&learned.collect::<Vec<f64>>());
        seen.retain(|(unlike, ..)| *unlike < UNLIKE * usual);
        let (shifts, lines): (Vec<_>, Vec<_>) = seen
            .into_iter()
            .map(|(_, shift, line)| (shift, line))
            .unzip();
        if 2 * shifts.len() < frames.len() {
            return;
        }
        let Some(seen) = Seen::new(&shifts, &lines, self.width) else {
            return;
        };
        let [row, along, down] = &self.rows[2];
        for (axis, sums) in to.iter_mut().enumerate() {
            for (block, &variance) in blocks(self.width).zip(&self.variance) {
                let noise = seen.noise(axis, &block);
                if variance.is_finite() && noise > 0.0 {
                    let target = &seen.regression[axis][block.clone()];
                    let of = [row, along, down].map(|part| &part[block.clone()]);
                    let sees = &self.sees[block.clone()];
                    sums.add(target, (of, sees), noise, (variance, self.frames));
                }
            }
        }
    }

    /// Shift of a frame at the row, by the rows beside it; `None` where they have no texture.
    fn shift<P: Picture>(&self, frame: &P, part: &Rect, row: usize) -> Option<[f64; 2]> {
        let (mut a, mut b) = ([0.0; 3], [0.0; 2]);
        for by in BESIDE {
            let line = frame.row(part, row.checked_add_signed(by)?);
            let at = (2 + by) as usize;
            let difference = self.difference(at, line);
            let [_, along, down] = &self.rows[at];
            for ((d, x), y) in difference.iter().zip(along).zip(down) {
                a[0] += x * x;
                a[1] += x * y;
                a[2] += y * y;
                b[0] -= x * d;
                b[1] -= y * d;
            }
        }
        // Where all edges lean one way, the shift across them.
        let floor = 1e-3 * (a[0] + a[2]);
        let (xx, yy) = (a[0] + floor, a[2] + floor);
        let determinant = xx * yy - a[1] * a[1];
        (determinant > 0.0).then(|| {
            [
                (b[0] * yy - b[1] * a[1]) / determinant,
                (b[1] * xx - b[0] * a[1]) / determinant,
            ]
        })
    }

    /// Squares of what a line differs from its reference by, beyond its shift.
    fn unlike(&self, difference: &[f64], [u, v]: [f64; 2]) -> f64 {
        let [_, along, down] = &self.rows[2];
        let slopes = along.iter().zip(down);
        let left = difference.iter().zip(slopes);
        left.map(|(d, (x, y))| (d + u * x + v * y).powi(2)).sum()
    }

    /// A line less its reference, of the light of each block; 0 where there is none and in columns that see nothing.
    fn difference(&self, at: usize, line: Pixels<'_>) -> Vec<f64> {
        let row = &self.rows[at][0];
        let line = values(line);
        let mut difference = vec![0.0; self.width];
        for block in blocks(self.width) {
            let columns = || {
                let pixels = line.get(block.clone()).unwrap_or_default().iter();
                pixels.zip(&self.sees[block.clone()])
            };
            let light: f64 = columns().map(|(&p, sees)| f64::from(p) * sees).sum();
            let own: f64 = row[block.clone()].iter().sum();
            let gain = if light > 0.0 { own / light } else { 0.0 };
            let both = columns().zip(&row[block.clone()]);
            for (d, ((&p, sees), r)) in difference[block.clone()].iter_mut().zip(both) {
                *d = f64::from(p) * sees * gain - r;
            }
        }
        difference
    }
}
