//! How sure the stripes a row are, from what the fit leaves.
//!
//! The error of ν is a weighted sum of the noise: its variance is that of Σ u ("sandwich"), u = weight · residual /
//! (1 − leverage): what the value would be off from a fit without it, as in a jackknife ("HC3", MacKinnon and White 1985).
//! The edges of the stripes tell ν, few values lie on them, and the fit follows those more closely than others.
//! Two estimates of it are put together:
//!
//! - over neighbouring rows: Σ u² and the products of rows as far apart as the residuals are really correlated, which
//!   is read off their autocorrelation (Politis 2003). It has hundreds of degrees of freedom, but sees only what
//!   hangs together over a few rows;
//! - between frames: the scatter of each frame's own Σ u. It sees everything that differs from frame to frame, but has
//!   only frames − 1 degrees of freedom. With ten frames error over standard deviation would follow Student's t with 9,
//!   whose rms is √(9/7) = 1.13 even if the variance is right on average.
//!
//! They are averaged by their degrees of freedom, those of the rows counted as no more than [`ROWS_COUNT_FOR`], so
//! that the scatter between frames has the last word in a long recording.

use rowtone_linear::dot;

/// Degrees of freedom that the estimate over rows counts for.
const ROWS_COUNT_FOR: f64 = 12.0;
/// Residuals are correlated over no more than this part of the frame: over more, an estimate would rest on few pieces.
const MOST_LAGS: usize = 16;
/// Fewer degrees of freedom than this are taken for this many.
const LEAST_FREEDOM: f64 = 4.0;
/// Lags in a row that must be insignificant.
const SILENT_LAGS: usize = 5;

/// Variance of the sum of `influence`, `[frame][row]`; `residual` (0 where a value was left out) tells how far rows hang
/// together. What the fit itself has taken from the residuals is made up for in `influence` already.
pub(super) fn variance(influence: &[Vec<f64>], residual: &[Vec<f64>]) -> f64 {
    let height = residual.first().map_or(0, Vec::len);
    let lags = correlated_lags(residual, height / MOST_LAGS);
    let over_rows = rows(influence, lags);
    let frames = influence.len() as f64;
    if frames < 2.0 {
        return over_rows * students(freedom(influence, lags), lags);
    }
    let between: f64 = influence
        .iter()
        .map(|f| f.iter().sum::<f64>().powi(2))
        .sum::<f64>()
        * frames
        / (frames - 1.0);
    (ROWS_COUNT_FOR * over_rows + (frames - 1.0) * between) / (ROWS_COUNT_FOR + frames - 1.0)
}

/// The last lag at which the residuals are correlated: [`SILENT_LAGS`] after it are within what chance does.
fn correlated_lags(residual: &[Vec<f64>], most: usize) -> usize {
    let count = residual
        .iter()
        .flatten()
        .filter(|r| **r != 0.0)
        .count()
        .max(2) as f64;
    let power = product(residual, 0);
    // Politis's threshold, 2·√(log10 n / n).
    let chance = 2.0 * (count.log10() / count).sqrt() * power;
    let significant = |lag: usize| product(residual, lag).abs() > chance;
    let mut last = 0;
    for lag in 1..=most {
        if significant(lag) {
            last = lag;
        } else if lag >= last + SILENT_LAGS {
            break;
        }
    }
    last
}

/// Sum of the products of values `lag` rows apart, over all frames.
fn product(series: &[Vec<f64>], lag: usize) -> f64 {
    series
        .iter()
        .filter(|f| f.len() > lag)
        .map(|f| dot(&f[lag..], &f[..f.len() - lag]))
        .sum()
}

/// By how much the variance must be larger for error over deviation to have a mean square of 1: it follows Student's t.
/// Not where rows tell one by one: there are hundreds of them.
fn students(freedom: f64, lags: usize) -> f64 {
    let free = freedom.max(LEAST_FREEDOM);
    if lags == 0 { 1.0 } else { free / (free - 2.0) }
}

/// Degrees of freedom of [`rows`]: as many as the values that count, less where a product's weights reach over several.
fn freedom(influence: &[Vec<f64>], last: usize) -> f64 {
    let (mut square, mut fourth) = (0.0, 0.0);
    for u in influence.iter().flatten() {
        square += u * u;
        fourth += u.powi(4);
    }
    // Of normal values that all count alike this is their number.
    let values = 3.0 * square * square / fourth.max(f64::MIN_POSITIVE);
    let weights: f64 = (1..=2 * last)
        .map(|lag| (2.0 - lag as f64 / last as f64).min(1.0).powi(2))
        .sum();
    values / (1.0 + 2.0 * weights)
}

/// Variance of the sum: products up to `last` apart count fully, then ever less up to twice that (a flat top).
fn rows(influence: &[Vec<f64>], last: usize) -> f64 {
    let white = product(influence, 0);
    let mut sum = white;
    for lag in 1..=2 * last {
        let weight = (2.0 - lag as f64 / last as f64).min(1.0);
        sum += 2.0 * weight * product(influence, lag);
    }
    // The estimate can come out negative; that neighbours cancel is not believed.
    sum.max(white)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(frames: usize, rows: usize, smooth: usize) -> Vec<Vec<f64>> {
        let mut chance = rowtone_chance::Quick(7);
        let mut uniform = || chance.unit() - 0.5;
        (0..frames)
            .map(|_| {
                let white: Vec<f64> = (0..rows + smooth).map(|_| uniform()).collect();
                white
                    .windows(smooth)
                    .take(rows)
                    .map(|w| w.iter().sum())
                    .collect()
            })
            .collect()
    }

    #[test]
    fn white_noise_hangs_together_over_no_rows() {
        assert_eq!(correlated_lags(&noise(4, 300, 1), 75), 0);
    }

    /// White values count one by one; where products of rows up to four apart count, for far fewer.
    #[test]
    fn rows_that_hang_together_tell_less() {
        let white = noise(1, 300, 1);
        // Uniform values have a fourth moment of 1.8 times the square of their variance, not 3.
        let all = freedom(&white, 0);
        assert!((all / 500.0 - 1.0).abs() < 0.1, "{all}");
        let weights = 1.0 + 2.0 * (4.0 + 0.5625 + 0.25 + 0.0625);
        let few = freedom(&white, 4);
        assert!((few * weights / all - 1.0).abs() < 1e-9);
        assert_eq!(students(few, 0), 1.0);
        assert!((students(few, 4) - few / (few - 2.0)).abs() < 1e-12);
        assert_eq!(students(0.5, 4), 2.0);
    }

    /// The sum of 300 running sums of 4 has nearly 16 times the variance of the sum of 300 white values.
    #[test]
    fn smoothed_noise_counts_as_what_it_is() {
        let smooth = noise(8, 300, 4);
        let lags = correlated_lags(&smooth, 75);
        assert!((2..=6).contains(&lags), "{lags}");
        let found = rows(&smooth, lags) / (8.0 * 300.0 / 12.0);
        assert!((11.0..21.0).contains(&found), "{found}");
    }
}
