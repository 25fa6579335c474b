//! A handful of linear equations, for one tone's shape at one frequency.

use super::shape::BASIS;

/// Unknowns: the real and imaginary parts of a shape's coefficients.
pub(crate) const SMALL: usize = 2 * BASIS;

/// A direction of which less than this share of its own size is left is taken for unknown: it gets 0.
const KNOWN: f32 = 1e-5;

/// A symmetric positive definite system of `unknowns` equations.
#[derive(Clone, Debug)]
pub(crate) struct Small {
    rows: [[f32; SMALL]; SMALL],
    unknowns: usize,
}

impl Small {
    /// All zero.
    pub(crate) fn new(unknowns: usize) -> Self {
        Self {
            rows: [[0.0; SMALL]; SMALL],
            unknowns: unknowns.min(SMALL),
        }
    }

    /// Adds to row `i`, column `j`; only `j ≤ i` counts.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f32) {
        if let Some(entry) = self.rows.get_mut(i).and_then(|r| r.get_mut(j)) {
            *entry += value;
        }
    }

    /// The solution for the right side `b` (Cholesky in place).
    pub(crate) fn solve(mut self, b: &[f32; SMALL]) -> [f32; SMALL] {
        let n = self.unknowns;
        let mut x = *b;
        for j in 0..n {
            let own = self.rows[j][j];
            let mut left = own;
            for k in 0..j {
                left -= self.rows[j][k] * self.rows[j][k];
            }
            let pivot = if left > KNOWN * own && own.is_finite() {
                crate::math::sqrtf(left)
            } else {
                f32::INFINITY
            };
            self.rows[j][j] = pivot;
            for i in j + 1..n {
                let mut sum = self.rows[i][j];
                for k in 0..j {
                    sum -= self.rows[i][k] * self.rows[j][k];
                }
                self.rows[i][j] = if pivot.is_finite() { sum / pivot } else { 0.0 };
            }
        }
        for i in 0..n {
            for k in 0..i {
                x[i] -= self.rows[i][k] * x[k];
            }
            x[i] /= self.rows[i][i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] -= self.rows[k][i] * x[k];
            }
            x[i] /= self.rows[i][i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_knows_and_leaves_the_rest() {
        let a = [[4.0, 1.0, 2.0], [1.0, 3.0, 0.5], [2.0, 0.5, 1.0]];
        // The third is half the first: only one of both can be told.
        let mut small = Small::new(3);
        for (i, row) in a.iter().enumerate() {
            for (j, &v) in row.iter().enumerate().take(i + 1) {
                small.add(i, j, v);
            }
        }
        let mut b = [0.0; SMALL];
        let x = [1.0, -2.0, 0.0];
        for i in 0..3 {
            b[i] = (0..3).map(|j| a[i][j] * x[j]).sum();
        }
        let got = small.solve(&b);
        for i in 0..3 {
            assert!((got[i] - x[i]).abs() < 1e-5, "{got:?}");
        }
    }
}
