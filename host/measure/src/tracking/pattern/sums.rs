//! What the reference's slopes explain of what moves, and what they leave over.

use rowtone_linear::Symmetric;

use super::{BLOCK, SLOPE_POWER, Told};

/// The texture explains so many times what noise would of the regression.
const SEEN: f64 = 2.0;
/// Shapes that a row's motion may have: along x and y, each even and in proportion to the place in the block.
pub(super) const SHAPES: usize = 4;
/// Shapes of light: even, in proportion to the row, and both in proportion to the place.
pub(super) const LIGHTS: usize = 4;

/// What the blocks of some rows come to.
#[derive(Default)]
pub(super) struct Sums {
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
    pub(super) fn add(
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

    pub(super) fn told(&self) -> Option<Told> {
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
