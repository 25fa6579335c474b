//! The small positive definite system of the joint fit, solved in place.

/// Largest system, unknowns: sixteen rigid tones and the shapes of a few, more where memory is cheap.
pub(crate) const MOST: usize = if cfg!(feature = "many-unknowns") {
    160
} else {
    64
};

/// Entries of the packed lower triangle of the largest system.
pub(crate) const PACKED: usize = MOST * (MOST + 1) / 2;

/// Where row `i`, column `j ≤ i` is in the packed lower triangle.
pub(crate) const fn at(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// A symmetric positive definite matrix, scaled to a unit diagonal, then factored.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    packed: [f32; PACKED],
    scale: [f32; MOST],
    unknowns: usize,
}

impl Normal {
    pub(crate) const fn new() -> Self {
        Self {
            packed: [0.0; PACKED],
            scale: [0.0; MOST],
            unknowns: 0,
        }
    }

    /// Starts anew with this many unknowns (at most [`MOST`]), all entries zero.
    pub(crate) fn clear(&mut self, unknowns: usize) {
        self.unknowns = unknowns.min(MOST);
        let used = at(self.unknowns, 0);
        self.packed[..used].fill(0.0);
    }

    /// Adds to row `i`, column `j ≤ i`; outside the matrix nothing happens.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f32) {
        if i < self.unknowns && j <= i {
            self.packed[at(i, j)] += value;
        }
    }

    /// Factors in place. A direction the data know nothing of (less than `1e-5` of its own size is left
    /// once the others are taken away) is frozen: it gets no step and an infinite variance.
    pub(crate) fn factor(&mut self) {
        let n = self.unknowns;
        for i in 0..n {
            let d = self.packed[at(i, i)];
            self.scale[i] = if d > 0.0 && d.is_finite() {
                1.0 / crate::math::sqrtf(d)
            } else {
                0.0
            };
        }
        for i in 0..n {
            for j in 0..=i {
                self.packed[at(i, j)] *= self.scale[i] * self.scale[j];
            }
        }
        for j in 0..n {
            let mut left = self.packed[at(j, j)];
            for k in 0..j {
                let l = self.packed[at(j, k)];
                left -= l * l;
            }
            let pivot = if self.scale[j] > 0.0 && left > 1e-5 {
                crate::math::sqrtf(left)
            } else {
                f32::INFINITY
            };
            self.packed[at(j, j)] = pivot;
            for i in j + 1..n {
                let mut sum = self.packed[at(i, j)];
                for k in 0..j {
                    sum -= self.packed[at(i, k)] * self.packed[at(j, k)];
                }
                self.packed[at(i, j)] = if pivot.is_finite() { sum / pivot } else { 0.0 };
            }
        }
    }

    /// Solves for `b` in place, after [`Normal::factor`].
    pub(crate) fn solve(&self, b: &mut [f32; MOST]) {
        let n = self.unknowns;
        for i in 0..n {
            let mut sum = b[i] * self.scale[i];
            for k in 0..i {
                sum -= self.packed[at(i, k)] * b[k];
            }
            b[i] = sum / self.packed[at(i, i)];
        }
        for i in (0..n).rev() {
            let mut sum = b[i];
            for k in i + 1..n {
                sum -= self.packed[at(k, i)] * b[k];
            }
            b[i] = sum / self.packed[at(i, i)];
        }
        for i in 0..n {
            b[i] *= self.scale[i];
        }
    }

    /// The variance of `direction`·unknowns for unit noise: direction' · inverse · direction.
    pub(crate) fn variance(&self, direction: &[f32; MOST]) -> f32 {
        let n = self.unknowns;
        let mut y = [0.0_f32; MOST];
        let mut sum_of_squares = 0.0;
        for i in 0..n {
            let mut sum = direction[i] * self.scale[i];
            for k in 0..i {
                sum -= self.packed[at(i, k)] * y[k];
            }
            let pivot = self.packed[at(i, i)];
            if pivot.is_infinite() && direction[i] != 0.0 {
                return f32::INFINITY;
            }
            y[i] = sum / pivot;
            sum_of_squares += y[i] * y[i];
        }
        sum_of_squares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_small_system() {
        let mut normal = Normal::new();
        normal.clear(3);
        let a = [[4.0, 1.0, 0.5], [1.0, 3.0, -1.0], [0.5, -1.0, 200.0]];
        for (i, row) in a.iter().enumerate() {
            for (j, &v) in row.iter().enumerate().take(i + 1) {
                normal.add(i, j, v);
            }
        }
        normal.factor();
        let x = [1.0, -2.0, 0.25];
        let mut b = [0.0; MOST];
        for i in 0..3 {
            b[i] = (0..3).map(|j| a[i][j] * x[j]).sum();
        }
        normal.solve(&mut b);
        for i in 0..3 {
            assert!((b[i] - x[i]).abs() < 1e-5);
        }
    }

    #[test]
    fn what_the_data_do_not_know_is_frozen() {
        let mut normal = Normal::new();
        normal.clear(2);
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            normal.add(i, j, 1.0);
        }
        normal.factor();
        let mut b = [0.0; MOST];
        b[0] = 2.0;
        b[1] = 2.0;
        normal.solve(&mut b);
        assert!((b[0] - 2.0).abs() < 1e-6 && b[1] == 0.0);
    }
}
