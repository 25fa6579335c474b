//! The small methods: one row against its mean row, one function each.
//!
//! | method | idea | source |
//! | --- | --- | --- |
//! | centre of gravity | mean position of what is brighter than the darkest pixel | textbook |
//! | multi-threshold centre | mean position of where the row crosses several grey levels | textbook contour centre |
//! | subset correlation | subsets of 16 px matched by Gauss–Newton | digital image correlation |
//! | template tracking | normalised cross-correlation, a parabola through its top | Lewis 1995 |
//! | phase correlation | peak after Foroosh, or through a Gaussian | Foroosh et al. 2002 |
//! | Lucas–Kanade | one least-squares step of the brightness equation | Lucas and Kanade 1981 |
//! | Horn–Schunck | smooth flow along the row, averaged by slope | Horn and Schunck 1981 |
//! | block matching | least absolute difference, a parabola through its bottom | textbook |

use super::correlate::{PeakFit, PhaseCorrelation};
use super::fourier::C;
use super::{Clip, Method, Shifts};
use crate::linear::dot;

/// Furthest whole-pixel shift that the searches look at.
const REACH: isize = 12;

/// A method that looks at one row at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Classical {
    /// Centre of gravity.
    CentreOfGravity,
    /// Mean of threshold crossings.
    MultiThreshold,
    /// Subsets by Gauss–Newton.
    Subsets,
    /// Normalised cross-correlation.
    Template,
    /// Phase correlation, Foroosh's peak.
    PhaseForoosh,
    /// Phase correlation, Gaussian peak.
    PhaseGaussian,
    /// Lucas–Kanade flow.
    LucasKanade,
    /// Horn–Schunck flow.
    HornSchunck,
    /// Block matching.
    BlockMatching,
}

impl Classical {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::CentreOfGravity,
        Self::MultiThreshold,
        Self::Subsets,
        Self::Template,
        Self::PhaseForoosh,
        Self::PhaseGaussian,
        Self::LucasKanade,
        Self::HornSchunck,
        Self::BlockMatching,
    ];
}

impl Method for Classical {
    fn name(&self) -> &'static str {
        match self {
            Self::CentreOfGravity => "centre of gravity",
            Self::MultiThreshold => "multi-threshold centre",
            Self::Subsets => "subset correlation",
            Self::Template => "template tracking (NCC)",
            Self::PhaseForoosh => "phase correlation, Foroosh",
            Self::PhaseGaussian => "phase correlation, Gaussian",
            Self::LucasKanade => "Lucas-Kanade",
            Self::HornSchunck => "Horn-Schunck",
            Self::BlockMatching => "block matching",
        }
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let mean = clip.mean();
        let correlation = PhaseCorrelation::new(clip.width);
        let one = |n: usize, y: usize| {
            let (row, reference) = (clip.row(n, y), &mean[y * clip.width..(y + 1) * clip.width]);
            match self {
                Self::CentreOfGravity => gravity(row) - gravity(reference),
                Self::MultiThreshold => multi_threshold(row, reference),
                Self::Subsets => subsets(row, reference),
                Self::Template => template(row, reference),
                Self::PhaseForoosh => phase(&correlation, row, reference, PeakFit::Foroosh),
                Self::PhaseGaussian => phase(&correlation, row, reference, PeakFit::Gaussian),
                Self::LucasKanade => lucas_kanade(row, reference),
                Self::HornSchunck => horn_schunck(row, reference),
                Self::BlockMatching => block_matching(row, reference),
            }
        };
        (0..clip.frames.len())
            .map(|n| (0..clip.height).map(|y| one(n, y)).collect())
            .collect()
    }
}

fn gravity(row: &[f64]) -> f64 {
    let low = row.iter().copied().fold(f64::INFINITY, f64::min);
    let weight: f64 = row.iter().map(|v| v - low).sum();
    row.iter()
        .enumerate()
        .map(|(x, v)| x as f64 * (v - low))
        .sum::<f64>()
        / weight
}

/// Where a row crosses `level`, and whether it rises there.
fn crossings(row: &[f64], level: f64) -> Vec<(f64, bool)> {
    (1..row.len())
        .filter(|&x| (row[x - 1] < level) != (row[x] < level))
        .map(|x| {
            (
                x as f64 - 1.0 + (level - row[x - 1]) / (row[x] - row[x - 1]),
                row[x] > row[x - 1],
            )
        })
        .collect()
}

fn multi_threshold(row: &[f64], reference: &[f64]) -> f64 {
    let low = reference.iter().copied().fold(f64::INFINITY, f64::min);
    let high = reference.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut moves = Vec::new();
    for part in [0.3, 0.4, 0.5, 0.6, 0.7] {
        let level = low + part * (high - low);
        let here = crossings(row, level);
        for (place, rises) in crossings(reference, level) {
            let nearest = here
                .iter()
                .filter(|c| c.1 == rises)
                .map(|c| c.0 - place)
                .min_by(|a, b| a.abs().total_cmp(&b.abs()));
            moves.extend(nearest.filter(|d| d.abs() < 3.0));
        }
    }
    if moves.is_empty() {
        f64::NAN
    } else {
        moves.iter().sum::<f64>() / moves.len() as f64
    }
}

/// Slope at each pixel, zero at the ends.
fn slope(row: &[f64]) -> Vec<f64> {
    let last = row.len() - 1;
    (0..row.len())
        .map(|x| {
            if x > 0 && x < last {
                0.5 * (row[x + 1] - row[x - 1])
            } else {
                0.0
            }
        })
        .collect()
}

fn lucas_kanade(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let change: Vec<f64> = row.iter().zip(reference).map(|(a, b)| a - b).collect();
    -dot(&slope, &change) / dot(&slope, &slope)
}

fn horn_schunck(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let smoothness = dot(&slope, &slope) / slope.len() as f64;
    let mut flow = vec![0.0; row.len()];
    let last = row.len() - 1;
    for _ in 0..60 {
        let mean: Vec<f64> = (0..row.len())
            .map(|x| 0.5 * (flow[x.saturating_sub(1)] + flow[(x + 1).min(last)]))
            .collect();
        for x in 0..row.len() {
            let error = slope[x] * mean[x] + row[x] - reference[x];
            flow[x] = mean[x] - slope[x] * error / (smoothness + slope[x] * slope[x]);
        }
    }
    let weights: Vec<f64> = slope.iter().map(|s| s * s).collect();
    dot(&weights, &flow) / weights.iter().sum::<f64>()
}

/// `row` at a place between pixels (linear), the ends held.
fn at(row: &[f64], x: f64) -> f64 {
    let x = x.clamp(0.0, (row.len() - 1) as f64);
    let k = (x as usize).min(row.len() - 2);
    row[k] + (x - k as f64) * (row[k + 1] - row[k])
}

fn subsets(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let (mut sum, mut weight) = (0.0, 0.0);
    for first in (REACH as usize..row.len().saturating_sub(16 + REACH as usize)).step_by(16) {
        let range = first..first + 16;
        let power: f64 = range.clone().map(|x| slope[x] * slope[x]).sum();
        if power <= 0.0 {
            continue;
        }
        let mut shift = 0.0;
        for _ in 0..5 {
            let change: f64 = range
                .clone()
                .map(|x| slope[x] * (at(row, x as f64 + shift) - reference[x]))
                .sum();
            shift = (shift - change / power).clamp(-REACH as f64, REACH as f64);
        }
        sum += power * shift;
        weight += power;
    }
    if weight > 0.0 { sum / weight } else { f64::NAN }
}

/// The best whole shift by `score` (the larger the better) and a parabola through its neighbours.
fn search(score: impl Fn(isize) -> f64) -> f64 {
    let scores: Vec<f64> = (-REACH..=REACH).map(score).collect();
    let top = (0..scores.len())
        .max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
        .unwrap_or(0);
    let whole = top as f64 - REACH as f64;
    if top == 0 || top + 1 == scores.len() {
        return whole;
    }
    let (l, c, r) = (scores[top - 1], scores[top], scores[top + 1]);
    let bend = l - 2.0 * c + r;
    if bend < 0.0 {
        whole + 0.5 * (l - r) / bend
    } else {
        whole
    }
}

/// The middle of the row moved by `shift`, and the middle of the reference.
fn overlap<'a>(row: &'a [f64], reference: &'a [f64], shift: isize) -> (&'a [f64], &'a [f64]) {
    let reach = REACH as usize;
    if row.len() <= 2 * reach {
        return (&[], &[]);
    }
    let count = row.len() - 2 * reach;
    let first = (REACH + shift) as usize;
    (&row[first..first + count], &reference[reach..reach + count])
}

fn template(row: &[f64], reference: &[f64]) -> f64 {
    search(|shift| {
        let (a, b) = overlap(row, reference, shift);
        let count = a.len().max(1) as f64;
        let (ma, mb) = (a.iter().sum::<f64>() / count, b.iter().sum::<f64>() / count);
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for (x, y) in a.iter().zip(b) {
            ab += (x - ma) * (y - mb);
            aa += (x - ma).powi(2);
            bb += (y - mb).powi(2);
        }
        ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
    })
}

fn block_matching(row: &[f64], reference: &[f64]) -> f64 {
    search(|shift| {
        let (a, b) = overlap(row, reference, shift);
        -a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum::<f64>()
    })
}

fn phase(correlation: &PhaseCorrelation, row: &[f64], reference: &[f64], fit: PeakFit) -> f64 {
    let spectrum = |row: &[f64]| {
        let mean = row.iter().sum::<f64>() / row.len() as f64;
        let tapered: Vec<C> = row
            .iter()
            .enumerate()
            .map(|(x, v)| {
                let taper = (std::f64::consts::PI * (x as f64 + 0.5) / row.len() as f64)
                    .sin()
                    .powi(2);
                C::new(taper * (v - mean), 0.0)
            })
            .collect();
        correlation.spectrum(&tapered)
    };
    correlation.shift(&spectrum(row), &spectrum(reference), fit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth row of its own, moved by a known part of a pixel.
    #[test]
    fn each_reads_a_small_shift() {
        let row = |shift: f64| -> Vec<f64> {
            (0..160)
                .map(|x| {
                    let x = f64::from(x) - shift;
                    // Bars that fade out towards both ends, so that nothing comes in or goes out.
                    let fade = (-((x - 80.0) / 25.0).powi(2)).exp();
                    100.0
                        + 60.0 * fade * (0.5 * x).sin()
                        + 40.0 * fade * (0.83 * x + 1.0).sin()
                        + 30.0 * fade
                })
                .collect()
        };
        let truth = [-0.4, 0.0, 0.4, 0.2, -0.2];
        let clip = Clip {
            width: 160,
            height: 1,
            frames: truth.iter().map(|&s| row(s)).collect(),
        };
        for method in Classical::ALL {
            let found: Vec<f64> = method.shifts(&clip).iter().map(|f| f[0]).collect();
            let mean = found.iter().sum::<f64>() / 5.0;
            // Gain of the found shifts on the true ones.
            let gain = found
                .iter()
                .zip(truth)
                .map(|(f, t)| (f - mean) * t)
                .sum::<f64>()
                / dot(&truth, &truth);
            let wide = match method {
                // Known to be coarse: their bias is what the table is about. The centre of gravity weighs
                // everything brighter than the darkest pixel, so a still ground holds it back.
                Classical::CentreOfGravity => 0.95,
                Classical::BlockMatching | Classical::PhaseGaussian | Classical::PhaseForoosh => {
                    0.6
                }
                _ => 0.2,
            };
            assert!((gain - 1.0).abs() < wide, "{}: gain {gain}", method.name());
        }
    }
}
