//! Subtracting the camera's own motion, which a still part of the picture shows.
//!
//! The background's rows are noisy too, and the camera, heavier than what it looks at, moves more
//! slowly. So its motion at a row is read off a parabola that is fitted to the background's rows within
//! [`REACH_NS`] of it, weighted by information: that keeps the noise of one row out of the result and
//! follows a camera's motion to some 150 Hz.

use rowtone::timeline::Displacement;

/// How far before and after a row the background's rows count, ns.
const REACH_NS: i64 = 1_500_000;

/// Subtracts the background's motion from each row. Rows that have no background near them are dropped.
/// Both slices belong to one frame and are in order of time.
pub fn subtract(rows: &mut Vec<Displacement>, background: &[Displacement]) {
    let mut from = 0;
    let mut to = 0;
    rows.retain_mut(|row| {
        while background
            .get(to)
            .is_some_and(|b| b.time_ns <= row.time_ns + REACH_NS)
        {
            to += 1;
        }
        while from < to && background[from].time_ns < row.time_ns - REACH_NS {
            from += 1;
        }
        let Some((shift_px, information)) = parabola_at(row.time_ns, &background[from..to]) else {
            return false;
        };
        row.shift_px -= shift_px;
        row.information_per_px2 = (row.information_per_px2.recip() + information.recip()).recip();
        true
    });
}

/// The value at `time_ns` of a weighted parabola through `rows`, and its information. A mean where the
/// rows do not carry a parabola, `None` where there are none.
fn parabola_at(time_ns: i64, rows: &[Displacement]) -> Option<(f32, f32)> {
    let mut s = [0.0_f64; 5];
    let mut b = [0.0_f64; 3];
    for row in rows {
        let x = (row.time_ns - time_ns) as f64 / REACH_NS as f64;
        let mut w = f64::from(row.information_per_px2);
        for (k, s) in s.iter_mut().enumerate() {
            *s += w;
            if let Some(b) = b.get_mut(k) {
                *b += w * f64::from(row.shift_px);
            }
            w *= x;
        }
    }
    if s[0] <= 0.0 {
        return None;
    }
    // The value at x = 0 is the first unknown of the normal equations; its variance the first element
    // of the inverse (Cramer's rule).
    let minor = s[2] * s[4] - s[3] * s[3];
    let det =
        s[0] * minor - s[1] * (s[1] * s[4] - s[2] * s[3]) + s[2] * (s[1] * s[3] - s[2] * s[2]);
    if det <= 1e-9 * s[0].powi(3) {
        return Some(((b[0] / s[0]) as f32, s[0] as f32));
    }
    let value =
        b[0] * minor - b[1] * (s[1] * s[4] - s[2] * s[3]) + b[2] * (s[1] * s[3] - s[2] * s[2]);
    Some(((value / det) as f32, (det / minor) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(row: u16, time_ns: i64, shift_px: f32, information_per_px2: f32) -> Displacement {
        Displacement {
            frame: 0,
            row,
            time_ns,
            shift_px,
            information_per_px2,
        }
    }

    /// 240 rows of 55 µs, shaken at 31.2 Hz with 0.3 px.
    fn shake(time_ns: i64) -> f32 {
        0.3 * (std::f64::consts::TAU * 31.2 * time_ns as f64 * 1e-9).sin() as f32
    }

    #[test]
    fn a_slow_shake_goes_and_the_rows_stay() {
        let time = |r: u16| i64::from(r) * 55_000;
        let background: Vec<_> = (0..240)
            .map(|r| row(r, time(r), shake(time(r)), 1e3))
            .collect();
        let mut rows: Vec<_> = (0..240)
            .map(|r| row(r, time(r), shake(time(r)) + 0.01, 4e3))
            .collect();
        subtract(&mut rows, &background);
        assert_eq!(rows.len(), 240);
        for row in &rows {
            assert!((row.shift_px - 0.01).abs() < 0.003, "{row:?}");
            // Rows at the ends lean on one side only.
            assert!(row.information_per_px2 > 1.3e3, "{row:?}");
        }
        // In the middle, some 54 rows stand behind each value.
        assert!(rows[120].information_per_px2 > 3.3e3);
    }

    #[test]
    fn all_rows_at_once_are_one_mean() {
        let background = [row(0, 0, 0.2, 1.0), row(1, 0, 0.4, 3.0)];
        let mut rows = vec![row(0, 0, 1.0, 4.0)];
        subtract(&mut rows, &background);
        assert!((rows[0].shift_px - 0.65).abs() < 1e-6);
        assert!((rows[0].information_per_px2 - 2.0).abs() < 1e-6);
    }

    #[test]
    fn without_background_a_row_is_not_known() {
        let mut rows = vec![row(0, 0, 1.0, 4.0)];
        subtract(&mut rows, &[row(9, 3_000_000, 0.0, 1.0)]);
        assert!(rows.is_empty());
    }
}
