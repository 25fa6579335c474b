//! Whether the stripes' own period is the light's: every second or third may differ from its neighbours.

use super::Refusal;
use super::fit::{Fit, Problem};
use super::model::Model;
use std::f64::consts::TAU;

/// A fundamental weaker than this part of what was taken for it is not believed.
const LEAST_SHARE: f64 = 0.08;

/// Refuses where every second or third stripe differs from its neighbours: the fundamental is then lower.
///
/// Flashes that fail at random differ too, but at every fraction of the stripes' frequency alike: a true fundamental
/// must stand out from what lies between 1/5 and 4/5 of it.
///
/// # Errors
/// [`Refusal::Subharmonic`].
pub(super) fn check(problem: &Problem<'_>, fit: &Fit, limit: usize) -> Result<(), Refusal> {
    let periods = fit.model.per_row * fit.gain.len() as f64;
    for divisor in [2usize, 3] {
        if periods / (divisor as f64) < 2.0 {
            continue;
        }
        let kept = fit.model.harmonics.len().min(limit / divisor).clamp(1, 8);
        let mut start = fit.model.clone();
        start.harmonics.truncate(kept);
        let Some(alone) = problem.fit(&start, 4) else {
            continue;
        };
        // The pattern again, its fundamental now the `divisor`th harmonic: amplitudes relative to that one.
        let mut residual = alone.residual.clone();
        for (frame, used) in residual.iter_mut().zip(&problem.used) {
            for (y, value) in frame.iter_mut().enumerate() {
                *value = if used[y] && alone.gain[y].is_finite() {
                    *value / alone.gain[y]
                } else {
                    0.0
                };
            }
        }
        let power = |ratio: f64| coherent(&residual, &alone.model, ratio);
        let orders = (1..divisor).map(|order| order as f64 / divisor as f64);
        let strongest = orders.map(power).fold(0.0, f64::max);
        let elsewhere = {
            // Between the fractions that are asked for, and a period of the frame away from each.
            let clear = (1.5 / periods).min(0.12);
            let fractions: Vec<f64> = (4..=16)
                .map(|k| f64::from(k) / 20.0)
                .filter(|r| {
                    [1.0 / 3.0, 0.5, 2.0 / 3.0]
                        .iter()
                        .all(|f: &f64| (r - f).abs() > clear)
                })
                .collect();
            fractions.iter().map(|&r| power(r)).sum::<f64>() / fractions.len().max(1) as f64
        };
        // The powers of single frames scatter as exponentials do; those of many frames average out.
        let chance = 1.0 + 7.0 / (residual.len() as f64).sqrt();
        let share = 2.0 * (strongest - elsewhere).max(0.0).sqrt();
        if share > LEAST_SHARE && strongest > chance * elsewhere {
            return Err(Refusal::Subharmonic { divisor, share });
        }
    }
    Ok(())
}

/// Power of a component at `ratio` times the fundamental, mean over the frames (each with its own phase).
fn coherent(residual: &[Vec<f64>], model: &Model, ratio: f64) -> f64 {
    let height = residual[0].len();
    let centre = 0.5 * (height as f64 - 1.0);
    let mut power = 0.0;
    for frame in residual {
        let (mut re, mut im) = (0.0, 0.0);
        for (y, &value) in frame.iter().enumerate() {
            let (s, c) = (TAU * ratio * model.per_row * (y as f64 - centre)).sin_cos();
            re += value * c;
            im += value * s;
        }
        power += (re * re + im * im) / (height as f64).powi(2);
    }
    power / residual.len() as f64
}
