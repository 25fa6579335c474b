//! What moves, of one row: the regression of its pixels on the shifts of the frames.

use std::ops::Range;

use super::LEAST_FRAMES;

/// The regression of a row's pixels on the shifts of the frames.
pub(super) struct Seen {
    /// α·s' along x and along y, but for the sign.
    pub(super) regression: [Vec<f64>; 2],
    /// Variance of each pixel over the frames, its motion taken out.
    variance: Vec<f64>,
    /// Variance of the regression for one of a pixel.
    share: [f64; 2],
}

impl Seen {
    pub(super) fn new(shifts: &[[f64; 2]], lines: &[Vec<f64>], width: usize) -> Option<Self> {
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
    pub(super) fn noise(&self, axis: usize, block: &Range<usize>) -> f64 {
        let variance = &self.variance[block.clone()];
        let seeing = variance.iter().filter(|v| **v > 0.0).count().max(1) as f64;
        self.share[axis] * variance.iter().sum::<f64>() / seeing
    }
}
