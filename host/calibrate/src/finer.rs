//! Whether a finer pattern lies over the stripes: room light that flickers at 120 Hz over an LED's own 1920 Hz makes two,
//! and the coarser one taken for the light's would tell a line time 16 times too short.

use super::fit::Fit;
use super::search::{candidates, periodogram};
use super::stripes::{Stripes, find};
use rowtone_linear::{median, orthonormal, remove};

/// The finer pattern has at least so many stripes to one of the coarser.
const LEAST_RATIO: f64 = 3.0;
/// Its amplitude against the coarser pattern's, at least,
const LEAST_SHARE: f64 = 0.1;
/// and its power over the median of what the fit leaves.
const STANDS_OUT: f64 = 30.0;

/// Stripes a row of a finer pattern in what the fit leaves.
pub(super) fn pattern(fit: &Fit) -> Option<f64> {
    let height = fit.gain.len() as f64;
    let (step, power) = periodogram(&fit.residual);
    let least = LEAST_RATIO * fit.model.per_row;
    let per_row = *candidates(step, &power, least, 1).first()?;
    let peak = *power.get((per_row / step).round() as usize)?;
    // The periodogram's taper has a mean of a half.
    let amplitude = 4.0 * (peak / fit.residual.len() as f64).sqrt() / height;
    let finite: Vec<f64> = fit.gain.iter().copied().filter(|g| g.is_finite()).collect();
    let is_one = peak > STANDS_OUT * median(&power) && amplitude > LEAST_SHARE * median(&finite);
    is_one.then_some(per_row)
}

/// The strongest pattern of the rows themselves and the strongest that is finer, stripes a row.
pub(super) fn over_a_coarser(rows: &[Vec<f64>]) -> Option<(f64, f64)> {
    let height = rows.first().map_or(0, Vec::len);
    if height < 16 {
        return None;
    }
    let line: Vec<f64> = (0..height)
        .map(|y| y as f64 - 0.5 * height as f64)
        .collect();
    let basis = orthonormal(vec![vec![1.0; height], line]);
    let changes = |row: &Vec<f64>| {
        let mut changes = row.clone();
        remove(&basis, &mut changes);
        changes
    };
    let (step, power) = periodogram(&rows.iter().map(changes).collect::<Vec<_>>());
    let coarser = *candidates(step, &power, 0.6 / height as f64, 1).first()?;
    let finer = *candidates(step, &power, LEAST_RATIO * coarser, 1).first()?;
    let peak = *power.get((finer / step).round() as usize)?;
    (peak > STANDS_OUT * median(&power)).then_some((coarser, finer))
}

/// The finer stripes alone: what is slower than one of them is taken out by a mean over one stripe, twice, which leaves
/// the stripes themselves as they are.
pub(super) fn alone(rows: &[Vec<f64>], per_row: f64, most_harmonics: usize) -> Option<Stripes> {
    let half = 0.5 / per_row;
    let fine = |frame: &Vec<f64>| {
        let slow = mean_over(&mean_over(frame, half), half);
        let level = frame.iter().sum::<f64>() / frame.len() as f64;
        let values = frame.iter().zip(&slow);
        values.map(|(v, s)| v - s + level).collect()
    };
    let fine: Vec<Vec<f64>> = rows.iter().map(fine).collect();
    let stripes = find(&fine, most_harmonics).ok()?;
    let off = stripes.fit.model.per_row / per_row - 1.0;
    (off.abs() < 0.05).then_some(stripes)
}

/// The mean over `half` rows on either side, the last rows in part; fewer at the edges, as many on both sides.
fn mean_over(values: &[f64], half: f64) -> Vec<f64> {
    let count = values.len();
    (0..count)
        .map(|y| {
            let reach = half.min(y as f64 + 0.5).min((count - y) as f64 - 0.5);
            let whole = (reach - 0.5).floor().max(0.0) as usize;
            let part = (reach - 0.5 - whole as f64).max(0.0);
            let mut sum: f64 = values[y - whole..=y + whole].iter().sum();
            if part > 0.0 && y > whole && y + whole + 1 < count {
                sum += part * (values[y - whole - 1] + values[y + whole + 1]);
                return sum / (1.0 + 2.0 * (whole as f64 + part));
            }
            sum / (1 + 2 * whole) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_over_one_stripe_leaves_none_of_it() {
        let wave = |y: usize| (std::f64::consts::TAU * y as f64 / 12.4).sin();
        let values: Vec<f64> = (0..200).map(|y| 5.0 + wave(y)).collect();
        let smooth = mean_over(&values, 6.2);
        assert!(smooth[20..180].iter().all(|v| (v - 5.0).abs() < 0.01));
    }
}
