//! Gaps filled by an autoregressive model of the signal (Janssen, Veldhuis and Vries, IEEE Trans. ASSP 34, 1986).
//!
//! Two steps take turns: the model's coefficients from the signal as it stands (autocorrelation, Levinson), then the
//! missing samples that leave the model the least to explain: a banded system of linear equations. The signal is
//! worked on in overlapping blocks, in which it may count as stationary.

use super::simple;
use rowtone_linear::dot;

/// Samples in a block, at least: an eighth of a second at 8 kHz, in which speech changes little.
const BLOCK: usize = 1024;
/// Turns.
const TURNS: usize = 6;
/// Order of the model: more than one pitch period of speech. Half of the known samples where they are few.
const ORDER: usize = 192;

/// Fills the missing samples.
pub fn fill(samples: &[Option<f64>]) -> Vec<f64> {
    let mut filled = simple::linear(samples);
    let longest = simple::gaps(samples)
        .iter()
        .map(|(a, b)| b - a)
        .max()
        .unwrap_or(0);
    if longest == 0 {
        return filled;
    }
    // A gap must not be most of a block.
    let size = BLOCK.max(4 * longest);
    let mut start = 0;
    while start < samples.len() {
        let end = (start + size).min(samples.len());
        let known: Vec<bool> = samples[start..end].iter().map(Option::is_some).collect();
        // Half a block of context on the left is done already.
        let block = fill_block(&filled[start..end], &known);
        let from = if start == 0 { 0 } else { size / 4 };
        if let Some(block) = block {
            filled[start + from.min(end - start)..end]
                .copy_from_slice(&block[from.min(end - start)..]);
        }
        if end == samples.len() {
            break;
        }
        start += size / 2;
    }
    filled
}

/// One block, from a first guess. `None` where there is too little to go by.
fn fill_block(guess: &[f64], known: &[bool]) -> Option<Vec<f64>> {
    let missing: Vec<usize> = (0..guess.len()).filter(|&i| !known[i]).collect();
    let order = ORDER
        .min(guess.len() / 4)
        .min((guess.len() - missing.len()) / 2);
    if missing.is_empty() || order < 2 {
        return None;
    }
    let known_count = (guess.len() - missing.len()) as f64;
    let mean = (0..guess.len())
        .filter(|&i| known[i])
        .map(|i| guess[i])
        .sum::<f64>()
        / known_count;
    let mut signal: Vec<f64> = guess.iter().map(|v| v - mean).collect();
    for _ in 0..TURNS {
        let model = levinson(&autocorrelation(&signal, order))?;
        // b(l) = Σ a(k) a(k + l): what the energy of the model's error makes of two samples l apart.
        let couple: Vec<f64> = (0..=order)
            .map(|l| dot(&model[..=order - l], &model[l..]))
            .collect();
        let right: Vec<f64> = missing
            .iter()
            .map(|&i| {
                let first = i.saturating_sub(order);
                let last = (i + order).min(signal.len() - 1);
                -(first..=last)
                    .filter(|&j| known[j])
                    .map(|j| couple[i.abs_diff(j)] * signal[j])
                    .sum::<f64>()
            })
            .collect();
        let solved = solve_banded(&missing, &couple, right)?;
        for (&i, value) in missing.iter().zip(solved) {
            signal[i] = value;
        }
    }
    signal.iter_mut().for_each(|v| *v += mean);
    Some(signal)
}

/// Biased autocorrelation for lags 0 to `order`, a breath of white noise added so that the model exists.
fn autocorrelation(signal: &[f64], order: usize) -> Vec<f64> {
    let mut lags: Vec<f64> = (0..=order)
        .map(|l| dot(&signal[l..], &signal[..signal.len() - l]))
        .collect();
    lags[0] = lags[0] * (1.0 + 1e-9) + f64::MIN_POSITIVE;
    lags
}

/// Levinson's recursion: coefficients 1, a(1), … of the error filter.
fn levinson(lags: &[f64]) -> Option<Vec<f64>> {
    let mut model = vec![1.0];
    let mut error = lags[0];
    for k in 1..lags.len() {
        if error <= 0.0 || !error.is_finite() {
            return None;
        }
        let reflection = -model
            .iter()
            .enumerate()
            .map(|(i, a)| a * lags[k - i])
            .sum::<f64>()
            / error;
        model.push(0.0);
        let reversed: Vec<f64> = model.iter().rev().copied().collect();
        model
            .iter_mut()
            .zip(&reversed)
            .for_each(|(a, r)| *a += reflection * r);
        error *= 1.0 - reflection * reflection;
    }
    Some(model)
}

/// Solves Σ_j couple(|m_i − m_j|)·x_j = right_i; couples beyond the last are zero, so the matrix is a band about its
/// diagonal (Cholesky within the band).
fn solve_banded(positions: &[usize], couple: &[f64], mut right: Vec<f64>) -> Option<Vec<f64>> {
    let count = positions.len();
    // First column of each row that is not zero.
    let first: Vec<usize> = (0..count)
        .map(|i| positions.partition_point(|&p| p + couple.len() <= positions[i]))
        .collect();
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(count);
    for i in 0..count {
        let mut row = vec![0.0; i - first[i] + 1];
        for j in first[i]..=i {
            let from = first[i].max(first[j]);
            let a = couple[positions[i] - positions[j]];
            let other: &[f64] = if j == i {
                &[]
            } else {
                &rows[j][from - first[j]..j - first[j]]
            };
            let own = &row[from - first[i]..j - first[i]];
            if j == i {
                let rest = a - dot(own, own);
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                row[j - first[i]] = rest.sqrt();
            } else {
                row[j - first[i]] = (a - dot(own, other)) / rows[j][j - first[j]];
            }
        }
        rows.push(row);
    }
    for i in 0..count {
        let sum = dot(&rows[i][..i - first[i]], &right[first[i]..i]);
        right[i] = (right[i] - sum) / rows[i][i - first[i]];
    }
    for i in (0..count).rev() {
        right[i] /= rows[i][i - first[i]];
        let value = right[i];
        for (slot, factor) in right[first[i]..i].iter_mut().zip(&rows[i]) {
            *slot -= factor * value;
        }
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levinson_finds_a_known_model() {
        // x(n) = 0.9 x(n-1) − 0.5 x(n-2) + noise has these correlations (Yule–Walker).
        let r1 = 0.9 / 1.5;
        let r2 = 0.9 * r1 - 0.5;
        let model = levinson(&[1.0, r1, r2]).unwrap();
        assert!(
            (model[1] + 0.9).abs() < 1e-12 && (model[2] - 0.5).abs() < 1e-12,
            "{model:?}"
        );
    }

    #[test]
    fn the_band_is_solved_as_the_full_matrix_would_be() {
        let positions = [3, 4, 5, 9, 10, 30];
        let couple = [2.0, -0.9, 0.3];
        let truth = [1.0, -2.0, 0.5, 3.0, -1.0, 0.25];
        let right = (0..6)
            .map(|i| {
                (0..6)
                    .map(|j| {
                        couple
                            .get(usize::abs_diff(positions[i], positions[j]))
                            .unwrap_or(&0.0)
                            * truth[j]
                    })
                    .sum()
            })
            .collect();
        let solved = solve_banded(&positions, &couple, right).unwrap();
        for (a, b) in solved.iter().zip(truth) {
            assert!((a - b).abs() < 1e-12, "{solved:?}");
        }
    }
}
