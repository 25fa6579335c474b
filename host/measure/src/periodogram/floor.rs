//! The level of noise around each frequency.
//!
//! Noise of one level gives squares that are spread exponentially; what stands out is no noise, and counts as three times
//! the level at most.

use rowtone_linear::median;

/// A band is so many cells wide, and this share of its frequency.
const LEAST_CELLS: f64 = 6.0;
const SHARE: f64 = 0.08;

/// Squares above so many times the level count as so many.
const CUT: f64 = 3.0;

/// What that leaves of the mean: 1 − e⁻³.
const KEPT: f64 = 0.950_213;

/// Frequencies nearer than this to a multiple of the frame rate hold less noise, since the slots' means were taken off:
/// cells.
const NOTCH_CELLS: f64 = 1.25;

/// Mean square of the noise at each of these frequencies, of squares of amplitudes there. `fps` is 0 where there is one sample
/// a frame.
pub(super) fn levels(hz: &[f64], squares: &[f64], window_s: f64, fps: f64) -> Vec<f64> {
    let (Some(&low), Some(&high)) = (hz.first(), hz.last()) else {
        return Vec::new();
    };
    let mut knots: Vec<(f64, f64)> = Vec::new();
    let mut from = low;
    while from <= high {
        let wide = (LEAST_CELLS / window_s).max(SHARE * from);
        // What is left at the upper end joins the last band.
        let to = if from + 1.5 * wide > high {
            f64::INFINITY
        } else {
            from + wide
        };
        let first = hz.partition_point(|&hz| hz < from);
        let last = hz.partition_point(|&hz| hz < to);
        let inside = || hz[first..last].iter().zip(&squares[first..last]);
        let away = inside().filter(|&(&hz, _)| !is_notched(hz, window_s, fps));
        let mut known: Vec<f64> = away.map(|(_, &square)| square).collect();
        if 4 * known.len() < last - first {
            known = inside().map(|(_, &square)| square).collect();
        }
        knots.push((0.5 * (from + to.min(high)), level(&known)));
        from = to;
    }
    between(hz, &knots)
}

fn is_notched(hz: f64, window_s: f64, fps: f64) -> bool {
    fps > 0.0 && (hz - fps * (hz / fps).round()).abs() * window_s < NOTCH_CELLS
}

/// The mean of squares, without what stands out.
fn level(squares: &[f64]) -> f64 {
    let mut level = median(squares) / std::f64::consts::LN_2;
    for _ in 0..6 {
        let cut = squares.iter().map(|&s| s.min(CUT * level));
        level = cut.sum::<f64>() / squares.len().max(1) as f64 / KEPT;
    }
    level
}

/// Straight lines between the bands' middles, and level beyond the first and the last.
fn between(hz: &[f64], knots: &[(f64, f64)]) -> Vec<f64> {
    let at = |hz: f64| {
        let after = knots.partition_point(|knot| knot.0 < hz);
        match (after.checked_sub(1).map(|i| knots[i]), knots.get(after)) {
            (Some((h0, a)), Some(&(h1, b))) => a + (b - a) * (hz - h0) / (h1 - h0),
            (Some((_, a)), None) => a,
            (None, Some(&(_, b))) => b,
            (None, None) => 0.0,
        }
    };
    hz.iter().map(|&hz| at(hz)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone_chance::{Chance, XorShiftStar};

    /// 8 exponential squares of mean 2 a cell of 1 Hz, alike in fours as neighbours are, and a tone.
    #[test]
    fn noise_has_its_level_beside_a_tone() {
        let mut dice = XorShiftStar(5);
        let hz: Vec<f64> = (0..8000).map(|i| f64::from(i) / 8.0 + 1.0).collect();
        let mut square = 0.0;
        let squares: Vec<f64> = (0..8000)
            .map(|i| {
                if i % 4 == 0 {
                    square = -2.0 * dice.unit().max(1e-300).ln();
                }
                if (3990..4010).contains(&i) {
                    1e6
                } else {
                    square
                }
            })
            .collect();
        let floor = levels(&hz, &squares, 1.0, 0.0);
        let mean = floor.iter().sum::<f64>() / 8000.0;
        // 2000 independent squares: a deviation of 2.2 %, and 4 of them; the tone adds 0.5 %.
        assert!((mean / 2.0 - 1.0).abs() < 0.1, "{mean}");
        // 40 Hz around the tone hold 80: 11 %, the tone 7 %.
        let there = floor[4000];
        assert!(there > 1.2 && there < 3.2, "{there}");
    }

    #[test]
    fn nothing_has_no_level() {
        assert!(levels(&[], &[], 1.0, 60.0).is_empty());
        assert_eq!(levels(&[3.0], &[2.0], 1.0, 60.0).len(), 1);
    }
}
