//! Small dense linear algebra: just what the least-squares fits of this package need.

/// A symmetric matrix of side `n`, row by row, only the lower triangle used.
#[derive(Clone, Debug)]
pub struct Symmetric {
    n: usize,
    a: Vec<f64>,
}

impl Symmetric {
    /// All zeros.
    pub fn zeros(n: usize) -> Self {
        Self {
            n,
            a: vec![0.0; n * n],
        }
    }

    /// Side of the matrix.
    pub fn side(&self) -> usize {
        self.n
    }

    /// Element in row `i`, column `j`.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i >= j { (i, j) } else { (j, i) };
        self.a[i * self.n + j]
    }

    /// Adds `value` to element (`i`, `j`) and to its mirror image.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = if i >= j { (i, j) } else { (j, i) };
        self.a[i * self.n + j] += value;
    }

    /// Adds `weight`·v·vᵀ.
    pub fn add_outer(&mut self, v: &[f64], weight: f64) {
        for (i, &vi) in v.iter().enumerate() {
            if vi != 0.0 {
                let scale = vi * weight;
                let row = &mut self.a[i * self.n..i * self.n + i + 1];
                for (slot, &vj) in row.iter_mut().zip(v) {
                    *slot += scale * vj;
                }
            }
        }
    }

    /// Cholesky factor, or `None` where the matrix is not positive definite.
    pub fn factor(&self) -> Option<Cholesky> {
        let n = self.n;
        let mut l = self.a.clone();
        for i in 0..n {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
                let rest = l[i * n + j] - dot;
                if i == j {
                    if rest.is_nan() || rest <= 1e-13 * self.a[i * n + i].abs() {
                        return None;
                    }
                    l[i * n + i] = rest.sqrt();
                } else {
                    l[i * n + j] = rest / l[j * n + j];
                }
            }
        }
        Some(Cholesky { n, l })
    }
}

/// The factor L of a positive definite matrix L·Lᵀ.
#[derive(Clone, Debug)]
pub struct Cholesky {
    n: usize,
    l: Vec<f64>,
}

impl Cholesky {
    /// Solves (L·Lᵀ)·x = `b`.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.n;
        let mut x = b.to_vec();
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| self.l[i * n + k] * x[k]).sum();
            x[i] = (x[i] - dot) / self.l[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| self.l[k * n + i] * x[k]).sum();
            x[i] = (x[i] - dot) / self.l[i * n + i];
        }
        x
    }

    /// bᵀ·(L·Lᵀ)⁻¹·b.
    pub fn inverse_form(&self, b: &[f64]) -> f64 {
        let n = self.n;
        let mut x = b.to_vec();
        for i in 0..n {
            let solved = dot(&self.l[i * n..i * n + i], &x[..i]);
            x[i] = (x[i] - solved) / self.l[i * n + i];
        }
        dot(&x, &x)
    }

    /// Column `j` of the inverse.
    pub fn inverse_column(&self, j: usize) -> Vec<f64> {
        let mut unit = vec![0.0; self.n];
        unit[j] = 1.0;
        self.solve(&unit)
    }
}

/// Makes columns orthonormal by Gram–Schmidt, done twice. A column that the earlier ones explain is dropped.
pub fn orthonormal(columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for mut column in columns {
        let before = norm(&column);
        for _ in 0..2 {
            remove(&basis, &mut column);
        }
        let after = norm(&column);
        if after > 1e-9 * before && after > 0.0 {
            column.iter_mut().for_each(|v| *v /= after);
            basis.push(column);
        }
    }
    basis
}

/// Takes from `v` all that the orthonormal `basis` explains.
pub fn remove(basis: &[Vec<f64>], v: &mut [f64]) {
    for q in basis {
        let share = dot(q, v);
        for (value, &qi) in v.iter_mut().zip(q) {
            *value -= share * qi;
        }
    }
}

/// Inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Euclidean length.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Middle value; the mean of the two middle ones for an even count, 0 for none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// The value that half of the others are not above: of an even count the upper of the two in the middle; 0 for none.
pub fn upper_median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upper_median_is_one_of_the_values() {
        assert_eq!(upper_median(&[]), 0.0);
        assert_eq!(upper_median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(upper_median(&[4.0, 1.0, 2.0, 3.0]), 3.0);
    }

    #[test]
    fn solves_and_refuses() {
        let mut m = Symmetric::zeros(2);
        m.add_outer(&[1.0, 2.0], 1.0);
        assert!(m.factor().is_none(), "rank one");
        m.add_outer(&[0.0, 1.0], 3.0);
        let x = m.factor().unwrap().solve(&[5.0, 16.0]);
        // [5 16]·x, x = [1 2].
        assert!((m.factor().unwrap().inverse_form(&[5.0, 16.0]) - 37.0).abs() < 1e-9);
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12);
        assert_eq!(m.at(0, 1), m.at(1, 0));
    }

    #[test]
    fn basis_drops_what_is_explained() {
        let basis = orthonormal(vec![vec![1.0, 1.0], vec![2.0, 2.0], vec![1.0, 0.0]]);
        assert_eq!(basis.len(), 2);
        assert!(dot(&basis[0], &basis[1]).abs() < 1e-12);
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0]), 2.5);
    }
}
