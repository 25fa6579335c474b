//! Optical flow of one row: Lucas–Kanade and Horn–Schunck.

use super::slope;
use rowtone_linear::dot;

/// One least-squares step of the brightness equation over the whole row, px.
pub(super) fn lucas_kanade(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let change: Vec<f64> = row.iter().zip(reference).map(|(a, b)| a - b).collect();
    -dot(&slope, &change) / dot(&slope, &slope)
}

/// Flow that is smooth along the row (60 rounds), averaged by slope, px. Ends are held.
pub(super) fn horn_schunck(row: &[f64], reference: &[f64]) -> f64 {
    let slope = slope(reference);
    let smoothness = dot(&slope, &slope) / slope.len() as f64;
    let mut flow = vec![0.0; row.len()];
    let last = row.len() - 1;
    for _ in 0..60 {
        let mean: Vec<f64> = (0..row.len())
            .map(|x| 0.5 * (flow[x.saturating_sub(1)] + flow[(x + 1).min(last)]))
            .collect();
        for x in 0..row.len() {
            let error = slope[x] * mean[x] + row[x] - reference[x];
            flow[x] = mean[x] - slope[x] * error / (smoothness + slope[x] * slope[x]);
        }
    }
    let weights: Vec<f64> = slope.iter().map(|s| s * s).collect();
    dot(&weights, &flow) / weights.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bars, gain};
    use super::*;

    #[test]
    fn lucas_kanade_reads_small_shifts_and_misses_large_ones() {
        let found = gain(lucas_kanade);
        assert!((found - 1.0).abs() < 0.15, "{found}");
        // The brightness equation is a straight line through the reference: it ends after a part of a period.
        let far = lucas_kanade(&bars(5.0), &bars(0.0));
        assert!((far - 5.0).abs() > 2.0, "{far}");
    }

    #[test]
    fn horn_schunck_reads_small_shifts() {
        let found = gain(horn_schunck);
        assert!((found - 1.0).abs() < 0.15, "{found}");
    }

    #[test]
    fn a_plain_row_says_nothing() {
        assert!(lucas_kanade(&[5.0; 40], &[5.0; 40]).is_nan());
        assert!(horn_schunck(&[5.0; 40], &[5.0; 40]).is_nan());
    }
}
