//! What is at the alias frequency of a strong tone, taken out of every series, as its mean is.
//!
//! Where a tone's shape is none that the model follows (motion that differs along the rows too, a step, an error of a row's
//! scale), what is left of it has images at ±f + k·fps, all of which look alike at one row: as f mod fps. So cos, sin, t·cos
//! and t·sin at the frames' times are projected off each series. No image of a steady tone is left then, whatever its shape;
//! the powers of t take what decays or drifts. A true tone within about 1/T of them is hidden too. The tone itself is fitted
//! without its notch.

use num_complex::Complex32 as Complex;

use super::model::Samples;
use super::rows::{self, NOTCH_PARTS, Notch};
use super::tone::Tone;

impl Samples<'_> {
    /// Makes the notches of those of the tones that have one; the tables are at the tones.
    pub(crate) fn set_notches(&mut self, tones: &[Tone]) {
        self.notches.clear();
        for (i, _) in tones.iter().enumerate().filter(|(_, t)| t.notched) {
            if let Some(notch) = self.notch(i + 1) {
                let _ = self.notches.push(notch);
            }
        }
    }

    fn notch(&self, k: usize) -> Option<Notch> {
        let n = self.frames;
        let means = self.frame_means(k);
        let mean = [means[0], means[1]];
        let mut gram = [[0.0_f32; NOTCH_PARTS]; NOTCH_PARTS];
        for f in 0..n {
            let e = Complex::new(self.frame_re[k * n + f], self.frame_im[k * n + f]);
            let (a, b) = (e - mean[0], e.scale(self.frame_t[f]) - mean[1]);
            let parts = [a.re, a.im, b.re, b.im];
            let w = self.frame_weight[f] / self.total_weight;
            for (row, &p) in gram.iter_mut().zip(&parts) {
                for (entry, &q) in row.iter_mut().zip(&parts) {
                    *entry += w * p * q;
                }
            }
        }
        Some(Notch {
            table: k as u8,
            inverse: inverse(gram)?,
            mean,
        })
    }

    /// Takes all notches out of `row`, which holds the weighted residual of a series; gives by how much that lowers its
    /// weighted sum of squares.
    pub(crate) fn take_notches(&mut self, series: usize) -> f32 {
        let n = self.frames;
        let total = self.series_weight[series];
        let mut lower = 0.0;
        if total <= 0.0 {
            return lower;
        }
        for notch in self.notches.iter() {
            let k = usize::from(notch.table);
            let re = &self.frame_re[k * n..k * n + n];
            let im = &self.frame_im[k * n..k * n + n];
            let row = &mut self.row[..n];
            let own = &mut self.own_re[..n];
            let _ = rows::times(row, &self.frame_t[..n], own);
            let (zero, one) = rows::products(row, own, re, im);
            let sums = [zero.re, zero.im, one.re, one.im];
            let mut parts = [0.0_f32; NOTCH_PARTS];
            for (part, row) in parts.iter_mut().zip(&notch.inverse) {
                *part = row.iter().zip(&sums).map(|(a, s)| a * s).sum::<f32>() / total;
            }
            lower += parts.iter().zip(&sums).map(|(p, s)| p * s).sum::<f32>();
            let g = [
                Complex::new(parts[0], parts[1]),
                Complex::new(parts[2], parts[3]),
            ];
            let mean = (g[0].conj() * notch.mean[0] + g[1].conj() * notch.mean[1]).re;
            let weight = &self.weight[series * n..series * n + n];
            rows::less_notch(row, weight, (re, im), &self.frame_t[..n], g, mean);
        }
        lower
    }
}

/// Inverse of a symmetric positive definite matrix (Gauss and Jordan); `None` where it is all but singular.
fn inverse(mut a: [[f32; NOTCH_PARTS]; NOTCH_PARTS]) -> Option<[[f32; NOTCH_PARTS]; NOTCH_PARTS]> {
    let mut b = [[0.0_f32; NOTCH_PARTS]; NOTCH_PARTS];
    for (i, row) in b.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for i in 0..NOTCH_PARTS {
        let pivot = a[i][i];
        // E and t·E of a frequency near a multiple of half the frame rate have but one phase.
        if pivot.is_nan() || pivot < 1e-5 {
            return None;
        }
        for j in 0..NOTCH_PARTS {
            a[i][j] /= pivot;
            b[i][j] /= pivot;
        }
        for k in 0..NOTCH_PARTS {
            if k != i {
                let factor = a[k][i];
                for j in 0..NOTCH_PARTS {
                    a[k][j] -= factor * a[i][j];
                    b[k][j] -= factor * b[i][j];
                }
            }
        }
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_is_one() {
        let a = [
            [0.5, 0.1, 0.0, 0.02],
            [0.1, 0.4, 0.03, 0.0],
            [0.0, 0.03, 0.05, 0.01],
            [0.02, 0.0, 0.01, 0.04],
        ];
        let b = inverse(a).unwrap();
        for i in 0..NOTCH_PARTS {
            for j in 0..NOTCH_PARTS {
                let sum: f32 = (0..NOTCH_PARTS).map(|k| a[i][k] * b[k][j]).sum();
                let want = if i == j { 1.0 } else { 0.0 };
                assert!((sum - want).abs() < 1e-5);
            }
        }
        assert!(inverse([[1.0; NOTCH_PARTS]; NOTCH_PARTS]).is_none());
    }
}
