//! Flashes that failed: stripes unlike the others are left out of the fit.

use super::Refusal;
use super::fit::{Fit, Problem};
use crate::linear::median;

/// Most rounds of leaving out and fitting again.
const ROUNDS: usize = 6;
/// A stripe is left out when its residual is so many times that of most...
const OUT_OF_PROPORTION: f64 = 4.0;
/// ...and this part of the stripes' amplitude: below it, it may be the wave form that is not met.
const LEAST_SHARE: f64 = 0.05;

/// One period of one frame: frame, first row, row after the last.
type Stripe = (usize, usize, usize);

/// Leaves out of `problem` what does not fit and fits again, until the choice stands: the first fit is bent by the
/// failed flashes, so that it neither sees all of them nor only them. Returns how many stripes are left out, of how many.
///
/// # Errors
/// What `refit` says.
pub(super) fn leave_out(
    problem: &mut Problem<'_>,
    fit: &mut Fit,
    refit: impl Fn(&Problem<'_>, &Fit) -> Result<Fit, Refusal>,
) -> Result<(usize, usize), Refusal> {
    let mut counts = (0, 0);
    for _ in 0..ROUNDS {
        let stripes = stripes(fit);
        let out = unlike(problem, fit, &stripes);
        counts = (out.len(), stripes.len());
        let mut used: Vec<Vec<bool>> = problem.rows.iter().map(|f| vec![true; f.len()]).collect();
        for (n, first, end) in out {
            used[n][first..end].fill(false);
        }
        // More is left out than can be right: the caller refuses.
        if used == problem.used || 2 * counts.0 > counts.1 {
            break;
        }
        problem.used = used;
        *fit = refit(problem, fit)?;
    }
    Ok(counts)
}

/// All stripes, from dark to dark.
fn stripes(fit: &Fit) -> Vec<Stripe> {
    let height = fit.gain.len();
    let centre = 0.5 * (height as f64 - 1.0);
    let mut stripes = Vec::new();
    for (n, phase) in fit.model.phases.iter().enumerate() {
        let number = |y: usize| (fit.model.per_row * (y as f64 - centre) + phase).round();
        let mut first = 0;
        for y in 1..=height {
            if y == height || number(y) != number(first) {
                stripes.push((n, first, y));
                first = y;
            }
        }
    }
    stripes
}

fn unlike(problem: &Problem<'_>, fit: &Fit, stripes: &[Stripe]) -> Vec<Stripe> {
    let centre = 0.5 * (fit.gain.len() as f64 - 1.0);
    // Also of what was left out before: it may come back.
    let residual = |n: usize, y: usize| {
        let wave = fit.model.wave(fit.model.psi(n, y as f64 - centre));
        problem.rows[n][y] - fit.offset[y] - fit.gain[y] * wave
    };
    let rms: Vec<f64> = stripes
        .iter()
        .map(|&(n, first, end)| {
            let known = (first..end).filter(|&y| fit.gain[y].is_finite());
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), y| {
                (sum + residual(n, y).powi(2), count + 1.0)
            });
            if count > 0.0 {
                (sum / count).sqrt()
            } else {
                f64::NAN
            }
        })
        .collect();
    let limit = (OUT_OF_PROPORTION * median(&rms)).max(LEAST_SHARE * median(&fit.gain).abs());
    stripes
        .iter()
        .zip(&rms)
        .filter(|(_, rms)| **rms > limit)
        .map(|(stripe, _)| *stripe)
        .collect()
}
