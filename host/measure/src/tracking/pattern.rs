//! The sensor's fixed pattern, told from texture by the motion.
//!
//! No two pixels of a sensor have quite the same gain and offset (EMVA 1288: PRNU, DSNU; some 0.5 to 1 % of gain). In the
//! reference that looks like texture, but it does not move with the picture: a line that has moved by u differs from
//! its reference by −u·s', s being the surface alone, while the reference's slope is r' = s' + n' with the
//! pattern n. Least squares with r' find κ·u with κ = Σ s'²/Σ r'²: on a surface of little contrast half of the motion.
//!
//! s' is seen where the motion is: the regression of each pixel on the shifts of the frames is −α·s', whatever
//! the scale α of the shifts. For these the rows beside are asked, whose pattern and noise are their own.
//! A fit of r' (along both axes, with a gradient of the amplitude along the row: a part that turns) to α·s' leaves
//! Σ α²·s'²·(1 − κ) over, beyond the noise of the regression, and explains κ times Σ α²·s'². From both follows the
//! pattern's variance n² = κ·left/Σ f², f being the filter that was fitted: what is taken for texture. (With one shape this
//! is exact, whatever the spectra: Σ r'² = Σ s'² + n²·Σ f².)
//!
//! Rows are asked one by one, and their weighted median counts: an edge between two parts, a hot pixel or a
//! hand spoil some.

use std::ops::Range;

use rowtone::camera::Pixels;
use rowtone::tracker::Tracker;
use rowtone_clip::Rect;
use rowtone_linear::Symmetric;

use super::codec::{distinct, values};
use super::region::Picture;

/// Rows that are asked, and as how many each time.
const ROWS: usize = 64;
const TOGETHER: usize = 4;
/// Pixels that are looked at, of all frames together: fewer rows of many large frames are asked.
const PIXELS: usize = 4 << 20;
/// Rows beside one that tell its shifts; their slopes along y reach [`SLOPE`]'s length further.
const BESIDE: [isize; 4] = [-2, -1, 1, 2];
/// Rows at the top and the bottom that lack some beside them.
const EDGE: usize = 2 + SLOPE.len();
/// Columns within which light and motion vary no more than linearly.
const BLOCK: usize = 64;
/// The scene may be another after the first frames, which the reference was learned from.
const LEARNED: usize = 30;
/// Fewer frames tell no noise.
const LEAST_FRAMES: usize = 12;
/// A line that is further off is no linear function of its shift, px.
const LINEAR_PX: f64 = 1.0;
/// A line so many times more unlike its reference than the usual one does not count.
const UNLIKE: f64 = 2.0;
/// Fewer rows have no median of their groups.
const LEAST_ROWS: usize = 4 * TOGETHER;
/// What must stand out by so many standard deviations: of 1000 sensors without a pattern six are given a small one.
const SURE: f64 = 2.5;
/// Less than this share is no more than what smooths the reference and not the lines: 0.03 in pictures of an ideal sensor.
const LEAST: f64 = 0.04;
/// The texture explains so many times what noise would of the regression.
const SEEN: f64 = 2.0;
/// A pattern beyond so many times the noise's variance leaves nothing to measure.
const MOST: f64 = 30.0;

/// The central difference of tenth order, right half (Fornberg 1988, table 1), and its power: Σ f².
const SLOPE: [f64; 5] = [
    5.0 / 6.0,
    -5.0 / 21.0,
    5.0 / 84.0,
    -5.0 / 504.0,
    1.0 / 1260.0,
];
const SLOPE_POWER: f64 = 1.509_552;

/// Shapes that a row's motion may have: along x and y, each even and in proportion to the place in the block.
const SHAPES: usize = 4;
/// Shapes of light: even, in proportion to the row, and both in proportion to the place.
const LIGHTS: usize = 4;

/// The pattern's variance as a share of the pixels' noise; `None` where none stands out. `frames` begin with those that
/// the tracker's reference was learned from, `rows` of the `part` those that it knows.
pub(super) fn share<P: Picture>(
    frames: &[P],
    part: &Rect,
    rows: Range<usize>,
    tracker: &Tracker<'_>,
) -> Option<f32> {
    let frames = distinct(frames, part);
    let inner = rows.start + EDGE..rows.end.saturating_sub(EDGE);
    if frames.len() < LEAST_FRAMES || part.width < BLOCK || inner.len() < LEAST_ROWS {
        return None;
    }
    let rows = (PIXELS / (frames.len() * part.width)).clamp(LEAST_ROWS, ROWS);
    let rows: Vec<usize> = inner.clone().step_by(inner.len().div_ceil(rows)).collect();
    let groups = rows.chunks(TOGETHER).flat_map(|rows| {
        let mut sums = [Sums::default(), Sums::default()];
        for &row in rows {
            if let Some(reference) = Reference::around(tracker, row) {
                reference.patterns(&frames, part, row, &mut sums);
            }
        }
        sums.map(|sums| sums.told())
    });
    settle(groups.flatten().collect()).map(|share| share as f32)
}

/// What a group of rows tells: the share, and how sure it is (1/variance).
#[derive(Clone, Copy, Debug)]
struct Told {
    share: f64,
    weight: f64,
}

/// The weighted median, where it stands out from 0.
fn settle(mut told: Vec<Told>) -> Option<f64> {
    if told.len() < LEAST_ROWS / TOGETHER {
        return None;
    }
    told.sort_by(|a, b| a.share.total_cmp(&b.share));
    let total: f64 = told.iter().map(|t| t.weight).sum();
    let below = |part: f64| {
        let mut sum = 0.0;
        let at = told.iter().find(|t| {
            sum += t.weight;
            sum >= part * total
        });
        at.map_or(0.0, |t| t.share)
    };
    let median = below(0.5);
    // Half of a normal distribution lies within 0.674 standard deviations; a median's is √(π/2) of a mean's.
    let spread = (below(0.75) - below(0.25)) / (2.0 * 0.674);
    let count = total.powi(2) / told.iter().map(|t| t.weight.powi(2)).sum::<f64>();
    let sd = 1.25 * (spread / count.sqrt()).max(total.sqrt().recip());
    (median > LEAST.max(SURE * sd)).then_some(median.min(MOST))
}

/// A row of the reference and those around it, in pixel values, with their slopes.
struct Reference {
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
    fn around(tracker: &Tracker<'_>, row: usize) -> Option<Self> {
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
    fn patterns<P: Picture>(&self, frames: &[&P], part: &Rect, row: usize, to: &mut [Sums; 2]) {
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
        let learned = seen.iter().take(LEARNED);
        let usual = median(learned.map(|(unlike, ..)| *unlike).collect());
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

/// The regression of a row's pixels on the shifts of the frames.
struct Seen {
    /// α·s' along x and along y, but for the sign.
    regression: [Vec<f64>; 2],
    /// Variance of each pixel over the frames, its motion taken out.
    variance: Vec<f64>,
    /// Variance of the regression for one of a pixel.
    share: [f64; 2],
}

impl Seen {
    fn new(shifts: &[[f64; 2]], lines: &[Vec<f64>], width: usize) -> Option<Self> {
        if shifts.len() < LEAST_FRAMES {
            return None;
        }
        let count = shifts.len() as f64;
        let mean = [0, 1].map(|k| shifts.iter().map(|s| s[k]).sum::<f64>() / count);
        let shifts: Vec<[f64; 2]> = shifts
            .iter()
            .map(|s| [s[0] - mean[0], s[1] - mean[1]])
            .collect();
        let of = |i: usize, j: usize| shifts.iter().map(|s| s[i] * s[j]).sum::<f64>();
        let (uu, uv, vv) = (of(0, 0), of(0, 1), of(1, 1));
        let determinant = uu * vv - uv * uv;
        if determinant.is_nan() || determinant <= 1e-6 * uu * vv {
            return None;
        }
        let inverse = [[vv, -uv], [-uv, uu]].map(|row| row.map(|v| v / determinant));
        let mut sums = vec![[0.0; 4]; width];
        for (line, [u, v]) in lines.iter().zip(&shifts) {
            for (sum, d) in sums.iter_mut().zip(line) {
                sum[0] += d;
                sum[1] += d * d;
                sum[2] -= u * d;
                sum[3] -= v * d;
            }
        }
        let fit = |axis: usize| {
            let of = |sum: &[f64; 4]| inverse[axis][0] * sum[2] + inverse[axis][1] * sum[3];
            sums.iter().map(of).collect::<Vec<f64>>()
        };
        let regression = [fit(0), fit(1)];
        let variance = sums.iter().enumerate().map(|(x, sum)| {
            let explained = regression[0][x] * sum[2] + regression[1][x] * sum[3];
            let left = sum[1] - sum[0] * sum[0] / count - explained;
            left.max(0.0) / (count - 3.0)
        });
        Some(Self {
            variance: variance.collect(),
            regression,
            share: [inverse[0][0], inverse[1][1]],
        })
    }

    /// Variance of the regression in a block.
    fn noise(&self, axis: usize, block: &Range<usize>) -> f64 {
        let variance = &self.variance[block.clone()];
        let seeing = variance.iter().filter(|v| **v > 0.0).count().max(1) as f64;
        self.share[axis] * variance.iter().sum::<f64>() / seeing
    }
}

/// What the blocks of some rows come to.
#[derive(Default)]
struct Sums {
    /// Squares that the reference's slopes explain, and that they leave, noise taken off.
    explained: f64,
    left: f64,
    /// Noise of what is explained, and variance of what is left.
    noise: f64,
    left_variance: f64,
    /// Σ f² times the pixels' variance, and what the noise of the reference itself makes of it.
    filtered: f64,
    own: f64,
}

impl Sums {
    /// The row of the reference and its slopes along x and y, and the columns that see something.
    fn add(
        &mut self,
        target: &[f64],
        ([row, along, down], sees): ([&[f64]; 3], &[f64]),
        noise: f64,
        (variance, frames): (f64, f64),
    ) {
        let count = target.len();
        let seeing = sees.iter().sum::<f64>();
        if seeing < 0.5 * BLOCK as f64 {
            return;
        }
        let half = 0.5 * (count as f64 - 1.0);
        let place = |x: usize| (x as f64 - half) / half;
        let ramp = |shape: &[f64]| (0..).zip(shape).map(|(x, v)| v * place(x)).collect();
        let lights = vec![ramp(sees), sees.to_vec(), row.to_vec(), ramp(row)];
        let lights = rowtone_linear::orthonormal(lights);
        let cleared = |mut shape: Vec<f64>| {
            rowtone_linear::remove(&lights, &mut shape);
            shape
        };
        let target = cleared(target.to_vec());
        let shapes = [along.to_vec(), down.to_vec(), ramp(along), ramp(down)].map(cleared);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut normal = Symmetric::zeros(SHAPES);
        for i in 0..SHAPES {
            for j in 0..=i {
                normal.add(i, j, dot(&shapes[i], &shapes[j]));
            }
        }
        let Some(factor) = normal.factor() else {
            return;
        };
        let right: Vec<f64> = shapes.iter().map(|shape| dot(shape, &target)).collect();
        let c = factor.solve(&right);
        let explained = dot(&c, &right);
        let freedom = seeing - (SHAPES + LIGHTS) as f64;
        self.explained += explained - SHAPES as f64 * noise;
        self.left += dot(&target, &target) - explained - freedom * noise;
        self.noise += SHAPES as f64 * noise;
        self.left_variance += 2.0 * freedom * noise * noise;
        // Their mean square over the block, less that of the noise in them.
        let square = |k: usize| c[k] * c[k] - noise * factor.inverse_column(k)[k];
        let power = square(0) + square(1) + (square(2) + square(3)) / 3.0;
        let filtered = SLOPE_POWER * power * freedom * variance;
        self.filtered += filtered;
        self.own += filtered / frames;
    }

    fn told(&self) -> Option<Told> {
        let all = self.explained + self.left;
        if self.explained < SEEN * self.noise || all <= 0.0 || self.filtered <= 0.0 {
            return None;
        }
        let kept = (self.explained / all).min(1.0);
        // The mean of some frames has noise of its own, which is no pattern.
        let share = (kept * self.left - self.own) / self.filtered;
        let weight = self.filtered.powi(2) / self.left_variance;
        (share.is_finite() && weight.is_finite()).then_some(Told { share, weight })
    }
}

/// The middle one of these; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// The blocks of a row: all but the columns at its ends whose slope is not known, in parts of about [`BLOCK`].
fn blocks(width: usize) -> impl Iterator<Item = Range<usize>> {
    let reach = SLOPE.len() + 1;
    let inner = width.saturating_sub(2 * reach);
    let count = (inner / BLOCK).max(1);
    (0..count).map(move |k| reach + k * inner / count..reach + (k + 1) * inner / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(shares: &[f64]) -> Vec<Told> {
        let weight = 400.0;
        shares.iter().map(|&share| Told { share, weight }).collect()
    }

    #[test]
    fn what_most_rows_agree_on_is_the_pattern() {
        let agreed = [0.5, 0.45, 0.55, 0.52, 0.48, 0.5, 9.0, -4.0];
        let share = settle(told(&agreed)).expect("it stands out");
        assert!((share - 0.5).abs() < 0.05, "{share}");
    }

    #[test]
    fn noise_and_too_little_of_it_are_no_pattern() {
        assert_eq!(settle(told(&[0.1, -0.1, 0.05, -0.06, 0.02, -0.03])), None);
        assert_eq!(settle(told(&[0.5, 0.5, 0.5])), None);
        let smoothed = [0.03; 12];
        assert_eq!(settle(told(&smoothed)), None, "an ideal sensor's");
        let most = settle(told(&[1e6; 8]));
        assert_eq!(most, Some(MOST));
    }

    #[test]
    fn blocks_share_a_row_out_and_spare_its_ends() {
        for width in [64, 96, 128, 640, 1919] {
            let all: Vec<_> = blocks(width).collect();
            assert!(all.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(all[0].start > SLOPE.len() && all[all.len() - 1].end + SLOPE.len() < width);
            assert!(
                all.iter().all(|block| block.len() > LIGHTS + SHAPES),
                "{width}"
            );
        }
    }
}
