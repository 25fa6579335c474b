//! Flashes that failed: stripes unlike the others are left out of the fit; of few stripes, by a start that they have not bent.

use super::Refusal;
use super::fit::{Fit, Problem};
use super::model::Background;
use rowtone_linear::median;

/// Most rounds of leaving out and fitting again.
const ROUNDS: usize = 6;
/// A stripe is left out when its residual is so many times that of most...
const OUT_OF_PROPORTION: f64 = 4.0;
/// ...and this part of the stripes' amplitude: below it, it may be the wave form that is not met.
const LEAST_SHARE: f64 = 0.05;

/// Up to so many stripes the search for a start is exhaustive.
const FEW_STRIPES: usize = 60;
/// This part of few stripes may be left out of the start: no more is allowed in the end either.
const TRIMMED: f64 = 0.3;

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

/// A start for few stripes that failed flashes have not bent: the stripes whose leaving out helps most are left out of
/// `problem`, one at a time, as many as may fail (least trimmed squares, Rousseeuw 1984, by elimination).
///
/// One failed flash of 17 pulls a fit of everything so far towards itself that it no longer looks out of proportion.
/// [`leave_out`] takes back what was left out without need.
pub(super) fn trim(problem: &mut Problem<'_>, fit: &mut Fit) {
    let stripes = stripes(fit);
    if stripes.len() > FEW_STRIPES {
        return;
    }
    // A stiff picture: one that bends would bend to the dark stripes.
    let mut stiff = problem.clone();
    stiff.background = Background::Smooth(1);
    let mut model = fit.model.clone();
    let most = (TRIMMED * stripes.len() as f64) as usize;
    let mut left = stripes;
    for _ in 0..most {
        let without = |stripe: &Stripe| {
            let mut less = stiff.clone();
            less.used[stripe.0][stripe.1..stripe.2].fill(false);
            let fit = less.fit(&model, 3)?;
            Some((fit.rss / fit.count as f64, *stripe, fit.model))
        };
        let Some((_, (n, first, end), next)) = left
            .iter()
            .filter_map(without)
            .min_by(|a, b| a.0.total_cmp(&b.0))
        else {
            return;
        };
        stiff.used[n][first..end].fill(false);
        left.retain(|s| *s != (n, first, end));
        model = next;
    }
    let mut trimmed = problem.clone();
    trimmed.used = stiff.used;
    if let Some(start) = trimmed.fit(&model, 8) {
        *problem = trimmed;
        *fit = start;
    }
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
    // Also of what was left out before: it may come back. In a single frame nothing else tells of its rows.
    let [offset, gain] = [&fit.offset, &fit.gain].map(|values| match problem.background {
        Background::Smooth(_) => across_gaps(values),
        Background::PerRow => values.clone(),
    });
    let residual = |n: usize, y: usize| {
        let wave = fit.model.wave(fit.model.psi(n, y as f64 - centre));
        problem.rows[n][y] - offset[y] - gain[y] * wave
    };
    let rms: Vec<f64> = stripes
        .iter()
        .map(|&(n, first, end)| {
            let known = (first..end).filter(|&y| gain[y].is_finite());
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
    let limit = (OUT_OF_PROPORTION * median(&rms)).max(LEAST_SHARE * median(&gain).abs());
    stripes
        .iter()
        .zip(&rms)
        .filter(|(_, rms)| **rms > limit)
        .map(|(stripe, _)| *stripe)
        .collect()
}

/// Straight lines where a value is not finite, level before the first and after the last that is.
fn across_gaps(values: &[f64]) -> Vec<f64> {
    let mut filled = values.to_vec();
    let known: Vec<usize> = (0..values.len())
        .filter(|&y| values[y].is_finite())
        .collect();
    for (y, slot) in filled.iter_mut().enumerate() {
        let next = known.partition_point(|&k| k < y);
        *slot = match (next.checked_sub(1).map(|i| known[i]), known.get(next)) {
            (_, Some(&k)) if k == y => values[y],
            (Some(a), Some(&b)) => {
                let share = (y - a) as f64 / (b - a) as f64;
                values[a] + share * (values[b] - values[a])
            }
            (Some(k), None) | (None, Some(&k)) => values[k],
            (None, None) => f64::NAN,
        };
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::across_gaps;

    #[test]
    fn gaps_are_bridged_and_ends_level() {
        let gap = f64::NAN;
        let filled = across_gaps(&[gap, 2.0, gap, gap, 8.0, gap]);
        assert_eq!(filled, [2.0, 2.0, 4.0, 6.0, 8.0, 8.0]);
        assert!(across_gaps(&[gap]).iter().all(|v| v.is_nan()));
    }
}
