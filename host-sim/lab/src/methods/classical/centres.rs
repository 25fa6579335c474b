//! Methods that look for where something bright is: centre of gravity, threshold crossings, contour.

/// Mean position of what is brighter than the darkest pixel, px.
pub(super) fn gravity(row: &[f64]) -> f64 {
    let low = row.iter().copied().fold(f64::INFINITY, f64::min);
    let weight: f64 = row.iter().map(|v| v - low).sum();
    row.iter()
        .enumerate()
        .map(|(x, v)| x as f64 * (v - low))
        .sum::<f64>()
        / weight
}

/// Where a row crosses `level`, and whether it rises there.
fn crossings(row: &[f64], level: f64) -> Vec<(f64, bool)> {
    (1..row.len())
        .filter(|&x| (row[x - 1] < level) != (row[x] < level))
        .map(|x| {
            (
                x as f64 - 1.0 + (level - row[x - 1]) / (row[x] - row[x - 1]),
                row[x] > row[x - 1],
            )
        })
        .collect()
}

/// Mean move of the row's crossings of five grey levels; NaN where there is none within 3 px.
pub(super) fn multi_threshold(row: &[f64], reference: &[f64]) -> f64 {
    let low = reference.iter().copied().fold(f64::INFINITY, f64::min);
    let high = reference.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut moves = Vec::new();
    for part in [0.3, 0.4, 0.5, 0.6, 0.7] {
        let level = low + part * (high - low);
        let here = crossings(row, level);
        for (place, rises) in crossings(reference, level) {
            let nearest = here
                .iter()
                .filter(|c| c.1 == rises)
                .map(|c| c.0 - place)
                .min_by(|a, b| a.abs().total_cmp(&b.abs()));
            moves.extend(nearest.filter(|d| d.abs() < 3.0));
        }
    }
    if moves.is_empty() {
        f64::NAN
    } else {
        moves.iter().sum::<f64>() / moves.len() as f64
    }
}

/// Both edges of the longest run above half of the reference's range, to parts of a pixel; the run must overlap
/// `near`. `None` where no run has both its edges in the row.
fn contour(row: &[f64], level: f64, near: Option<[f64; 2]>) -> Option<[f64; 2]> {
    crossings(row, level)
        .windows(2)
        .filter(|pair| pair[0].1 && !pair[1].1)
        .map(|pair| [pair[0].0, pair[1].0])
        .filter(|run| near.is_none_or(|near| run[0] < near[1] && near[0] < run[1]))
        .max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}

/// Move of the middle of the brightest object's contour (textbook contour centre, one row of it): the mean of where
/// its two edges cross half of the reference's range. NaN where the row has no such object.
pub(super) fn contour_centre(row: &[f64], reference: &[f64]) -> f64 {
    let low = reference.iter().copied().fold(f64::INFINITY, f64::min);
    let high = reference.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let level = 0.5 * (low + high);
    let middle = |run: [f64; 2]| 0.5 * (run[0] + run[1]);
    contour(reference, level, None)
        .and_then(|home| Some(middle(contour(row, level, Some(home))?) - middle(home)))
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bars, gain};
    use super::*;

    /// A soft-edged bar from 60 to 90 px on a black ground.
    fn bar(shift: f64) -> Vec<f64> {
        let edge = |x: f64| 0.5 + 0.5 * libm::erf(x / 2.0);
        (0..160)
            .map(|x| f64::from(x) - shift)
            .map(|x| 200.0 * edge(x - 60.0) * edge(90.0 - x))
            .collect()
    }

    #[test]
    fn the_centre_of_gravity_is_right_on_a_black_ground_and_held_back_by_a_still_one() {
        for shift in [-5.3, 0.2, 7.7] {
            assert!((gravity(&bar(shift)) - gravity(&bar(0.0)) - shift).abs() < 1e-3);
        }
        // A still object of equal weight beside it halves the motion.
        let two = |shift: f64| -> Vec<f64> {
            let still = bar(0.0);
            let mut row = bar(shift);
            row.extend(still);
            row
        };
        let moved = gravity(&two(1.0)) - gravity(&two(0.0));
        assert!((moved - 0.5).abs() < 1e-3, "{moved}");
    }

    #[test]
    fn threshold_crossings_follow_bars() {
        let found = gain(multi_threshold);
        assert!((found - 1.0).abs() < 0.03, "{found}");
        assert!((multi_threshold(&bar(1.3), &bar(0.0)) - 1.3).abs() < 0.02);
        assert!(multi_threshold(&[7.0; 160], &bar(0.0)).is_nan());
    }

    #[test]
    fn the_contours_middle_follows_the_object() {
        for shift in [-9.6, -0.25, 0.4, 12.0] {
            let found = contour_centre(&bar(shift), &bar(0.0));
            assert!((found - shift).abs() < 0.02, "{found} for {shift}");
        }
        // A brighter lamp makes the object wider on both sides: the middle stays.
        let brighter: Vec<f64> = bar(0.4).iter().map(|v| 1.2 * v).collect();
        assert!((contour_centre(&brighter, &bar(0.0)) - 0.4).abs() < 0.02);
        // Nothing, and an object that is cut off by the picture's edge.
        assert!(contour_centre(&[7.0; 160], &bar(0.0)).is_nan());
        assert!(contour_centre(&bar(90.0), &bar(90.0)).is_nan());
    }

    #[test]
    fn of_many_objects_the_widest_is_followed() {
        let found = contour_centre(&bars(0.3), &bars(0.0));
        assert!((found - 0.3).abs() < 0.05, "{found}");
    }
}
