//! Methods that move the reference until it fits: subsets, template, blocks.

use super::slope;

/// Furthest whole-pixel shift that the searches look at.
const REACH: isize = 12;

/// `row` at a place between pixels (linear), the ends held.
fn at(row: &[f64], x: f64) -> f64 {
    let x = x.clamp(0.0, (row.len() - 1) as f64);
    let k = (x as usize).min(row.len() - 2);
    row[k] + (x - k as f64) * (row[k + 1] - row[k])
}

/// Subsets of 16 px matched by Gauss–Newton, averaged by their slope's power, px.
pub(super) fn subsets(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let (mut sum, mut weight) = (0.0, 0.0);
    for first in (REACH as usize..row.len().saturating_sub(16 + REACH as usize)).step_by(16) {
        let range = first..first + 16;
        let power: f64 = range.clone().map(|x| slope[x] * slope[x]).sum();
        if power <= 0.0 {
            continue;
        }
        let mut shift = 0.0;
        for _ in 0..5 {
            let change: f64 = range
                .clone()
                .map(|x| slope[x] * (at(row, x as f64 + shift) - reference[x]))
                .sum();
            shift = (shift - change / power).clamp(-REACH as f64, REACH as f64);
        }
        sum += power * shift;
        weight += power;
    }
    if weight > 0.0 { sum / weight } else { f64::NAN }
}

/// The best whole shift by `score` (the larger the better) and a parabola through its neighbours.
fn search(score: impl Fn(isize) -> f64) -> f64 {
    let scores: Vec<f64> = (-REACH..=REACH).map(score).collect();
    let top = (0..scores.len())
        .max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
        .unwrap_or(0);
    let whole = top as f64 - REACH as f64;
    if top == 0 || top + 1 == scores.len() {
        return whole;
    }
    let (l, c, r) = (scores[top - 1], scores[top], scores[top + 1]);
    let bend = l - 2.0 * c + r;
    if bend < 0.0 {
        whole + 0.5 * (l - r) / bend
    } else {
        whole
    }
}

/// The middle of the row moved by `shift`, and the middle of the reference.
fn overlap<'a>(row: &'a [f64], reference: &'a [f64], shift: isize) -> (&'a [f64], &'a [f64]) {
    let reach = REACH as usize;
    if row.len() <= 2 * reach {
        return (&[], &[]);
    }
    let count = row.len() - 2 * reach;
    let first = (REACH + shift) as usize;
    (&row[first..first + count], &reference[reach..reach + count])
}

/// Normalised cross-correlation, a parabola through its top, px.
pub(super) fn template(row: &[f64], reference: &[f64]) -> f64 {
    search(|shift| {
        let (a, b) = overlap(row, reference, shift);
        let count = a.len().max(1) as f64;
        let (ma, mb) = (a.iter().sum::<f64>() / count, b.iter().sum::<f64>() / count);
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for (x, y) in a.iter().zip(b) {
            ab += (x - ma) * (y - mb);
            aa += (x - ma).powi(2);
            bb += (y - mb).powi(2);
        }
        ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
    })
}

/// Least absolute difference, a parabola through its bottom, px.
pub(super) fn block_matching(row: &[f64], reference: &[f64]) -> f64 {
    search(|shift| {
        let (a, b) = overlap(row, reference, shift);
        -a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bars, gain};
    use super::*;

    #[test]
    fn subsets_converge_beyond_one_step() {
        let found = gain(subsets);
        assert!((found - 1.0).abs() < 0.02, "{found}");
        let far = subsets(&bars(1.7), &bars(0.0));
        assert!((far - 1.7).abs() < 0.1, "{far}");
    }

    #[test]
    fn a_template_is_found_under_another_light() {
        let found = gain(template);
        assert!((found - 1.0).abs() < 0.1, "{found}");
        for shift in [-9.0, 3.0, 11.0] {
            let lit: Vec<f64> = bars(shift).iter().map(|v| 0.5 * v + 30.0).collect();
            let found = template(&lit, &bars(0.0));
            assert!((found - shift).abs() < 1e-6 + 0.02, "{found} for {shift}");
        }
    }

    #[test]
    fn blocks_are_found_to_a_pixel_and_pulled_to_it_between() {
        for shift in [-9.0, 0.0, 11.0] {
            let found = block_matching(&bars(shift), &bars(0.0));
            assert!((found - shift).abs() < 0.02, "{found} for {shift}");
        }
        // A parabola is the wrong shape for absolute differences: less than the truth, always.
        let found = gain(block_matching);
        assert!((0.4..0.98).contains(&found), "{found}");
    }

    #[test]
    fn rows_too_short_to_search_say_zero_or_nothing() {
        let row = [1.0, 3.0, 2.0, 5.0, 4.0, 4.0, 1.0, 0.0];
        assert!(subsets(&row, &row).is_nan());
        for found in [template(&row, &row), block_matching(&row, &row)] {
            assert!(found.abs() <= REACH as f64, "{found}");
        }
    }
}
