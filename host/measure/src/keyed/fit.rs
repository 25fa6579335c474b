//! Tones fitted together to the rows of key frames.

use std::f64::consts::TAU;

use rowtone_linear::{Cholesky, Symmetric};

use super::data::Data;

/// What is known of a tone's motion: cosine and sine along x, then along y, px, and their covariance, px².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Orbit {
    pub(super) px: [f64; 4],
    pub(super) covariance: [[f64; 4]; 4],
}

impl Orbit {
    /// The semi-major axis, px, and its sd.
    pub(super) fn amplitude(&self) -> (f64, f64) {
        let [a, b, c, d] = self.px;
        // |u|² over time is p + q·cos(2ωt + …): the largest is √(p + q).
        let p = 0.5 * (a * a + b * b + c * c + d * d);
        let (re, im) = (0.5 * (a * a - b * b + c * c - d * d), a * b + c * d);
        let q = re.hypot(im);
        let size = (p + q).sqrt();
        if size <= 0.0 {
            return (0.0, self.covariance[0][0].sqrt());
        }
        // Where in its turn it is furthest: cos and sin of that moment, and the direction.
        let half = 0.5 * im.atan2(re);
        let (cos, sin) = (half.cos(), half.sin());
        let (x, y) = (a * cos + b * sin, c * cos + d * sin);
        let gradient = [x * cos, x * sin, y * cos, y * sin].map(|v| v / size);
        (size, self.deviation(&gradient))
    }

    /// Amplitude along one axis, px, its sd, and the phase of a·sin(2πft + phase), rad.
    pub(super) fn along(&self, axis: usize) -> (f64, f64, f64) {
        let (c, s) = (self.px[2 * axis], self.px[2 * axis + 1]);
        let size = c.hypot(s);
        let mut gradient = [0.0; 4];
        gradient[2 * axis] = if size > 0.0 { c / size } else { 1.0 };
        gradient[2 * axis + 1] = if size > 0.0 { s / size } else { 0.0 };
        (size, self.deviation(&gradient), c.atan2(s))
    }

    fn deviation(&self, gradient: &[f64; 4]) -> f64 {
        let mut variance = 0.0;
        for (g, row) in gradient.iter().zip(&self.covariance) {
            variance += g * row.iter().zip(gradient).map(|(c, h)| c * h).sum::<f64>();
        }
        variance.max(0.0).sqrt()
    }
}

/// Tones of these frequencies, fitted together.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) orbits: Vec<Orbit>,
    /// By how much they lower χ², in units of the noise given.
    pub(super) chi2: f64,
    /// What is left of each datum, px.
    pub(super) residual: Vec<f64>,
}

/// Columns of a tone in the data, the weighted mean of each place taken off; four, or two where only x is known.
pub(super) fn columns(data: &Data, hz: f64, level: bool) -> Vec<Vec<f64>> {
    let n = if data.planar { 4 } else { 2 };
    let mut columns = vec![Vec::with_capacity(data.all.len()); n];
    for datum in &data.all {
        let (sin, cos) = (TAU * (hz * datum.t_s).fract()).sin_cos();
        let along = if datum.axis == 0 { 1.0 } else { 0.0 };
        let down = if datum.axis == 0 { datum.coupling } else { 1.0 };
        columns[0].push(along * cos);
        columns[1].push(along * sin);
        if n == 4 {
            columns[2].push(down * cos);
            columns[3].push(down * sin);
        }
    }
    if level {
        columns
            .iter_mut()
            .for_each(|column| take_means(data, column));
    }
    columns
}

/// Takes the weighted mean of each place off.
pub(super) fn take_means(data: &Data, values: &mut [f64]) {
    let mut sums = vec![(0.0, 0.0); data.places];
    for (datum, v) in data.all.iter().zip(values.iter()) {
        sums[datum.place].0 += datum.weight * v;
        sums[datum.place].1 += datum.weight;
    }
    for (datum, v) in data.all.iter().zip(values.iter_mut()) {
        let (sum, weight) = sums[datum.place];
        *v -= sum / weight;
    }
}

/// The design of some tones and its normal matrix, to which others are added to try them.
pub(super) struct Design<'a> {
    data: &'a Data,
    /// 1/(stated variance · scatter) of each datum.
    weights: Vec<f64>,
    columns: Vec<Vec<f64>>,
    px: Vec<f64>,
    /// Rows of the normal matrix up to the diagonal, and the right side.
    normal: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl<'a> Design<'a> {
    /// Of the data with their means off. `scatter`: times of the stated noise, for either axis.
    pub(super) fn new(data: &'a Data, scatter: [f64; 2]) -> Self {
        let mut px: Vec<f64> = data.all.iter().map(|datum| datum.px).collect();
        take_means(data, &mut px);
        let weights = data
            .all
            .iter()
            .map(|d| d.weight / scatter[d.axis])
            .collect();
        Self {
            data,
            weights,
            columns: Vec::new(),
            px,
            normal: Vec::new(),
            right: Vec::new(),
        }
    }

    /// The same with another noise.
    pub(super) fn reweigh(&mut self, scatter: [f64; 2]) {
        for (weight, d) in self.weights.iter_mut().zip(&self.data.all) {
            *weight = d.weight / scatter[d.axis];
        }
        self.normal.clear();
        self.right.clear();
        self.tabulate();
    }

    /// Adds a tone.
    pub(super) fn push(&mut self, hz: f64) {
        self.columns.extend(columns(self.data, hz, true));
        self.tabulate();
    }

    /// Brings the normal matrix up to the columns.
    fn tabulate(&mut self) {
        for i in self.normal.len()..self.columns.len() {
            let pairs = self.columns[i].iter().zip(&self.weights);
            let weighted: Vec<f64> = pairs.map(|(c, w)| c * w).collect();
            let with = |column: &Vec<f64>| rowtone_linear::dot(&weighted, column);
            self.normal
                .push(self.columns[..=i].iter().map(with).collect());
            self.right.push(rowtone_linear::dot(&weighted, &self.px));
        }
    }

    /// Takes the last tone off again.
    pub(super) fn pop(&mut self) {
        let n = if self.data.planar { 4 } else { 2 };
        let left = self.columns.len().saturating_sub(n);
        self.columns.truncate(left);
        self.normal.truncate(left);
        self.right.truncate(left);
    }

    fn factor(&self) -> Option<Cholesky> {
        let mut normal = Symmetric::zeros(self.normal.len());
        for (i, row) in self.normal.iter().enumerate() {
            row.iter()
                .enumerate()
                .for_each(|(j, &v)| normal.add(i, j, v));
        }
        normal.factor()
    }

    /// By how much all tones lower χ²; 0 where they cannot be told apart.
    pub(super) fn chi2(&self) -> f64 {
        let lowered = |factor: Cholesky| factor.inverse_form(&self.right);
        self.factor().map_or(0.0, lowered)
    }

    /// Fits all tones; `None` where they cannot be told apart.
    pub(super) fn fit(&self) -> Option<Fitted> {
        let n = self.columns.len();
        let factor = self.factor()?;
        let solved = factor.solve(&self.right);
        let mut residual = self.px.clone();
        for (column, a) in self.columns.iter().zip(&solved) {
            residual
                .iter_mut()
                .zip(column)
                .for_each(|(r, c)| *r -= a * c);
        }
        let each = if self.data.planar { 4 } else { 2 };
        let orbits = (0..n / each).map(|k| {
            let mut orbit = Orbit::default();
            for i in 0..each {
                orbit.px[i] = solved[k * each + i];
                let column = factor.inverse_column(k * each + i);
                orbit.covariance[i][..each].copy_from_slice(&column[k * each..(k + 1) * each]);
            }
            orbit
        });
        Some(Fitted {
            orbits: orbits.collect(),
            chi2: rowtone_linear::dot(&self.right, &solved),
            residual,
        })
    }
}
