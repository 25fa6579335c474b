//! Subtracting the camera's own motion, which a still part of the picture shows.
//!
//! Row by row: the background's row was exposed at the same time and says what the camera did then, as
//! fast as it may shake. Its noise is added, white like the row's own; a smoother background would be
//! quieter but would leave noise of a colour that looks like vibration.

use rowtone::timeline::Displacement;

/// A row without a background of its own takes the nearest one that is no further away, ns.
const REACH_NS: i64 = 300_000;

/// Subtracts the background's motion from each row. Rows that have no background near them are dropped.
/// Both slices belong to one frame and are in order of time.
pub fn subtract(rows: &mut Vec<Displacement>, background: &[Displacement]) {
    // Rows of one time are one: with a global shutter that is the whole background.
    let moments: Vec<(i64, f32, f32)> = background
        .chunk_by(|a, b| a.time_ns == b.time_ns)
        .map(|rows| {
            let information: f32 = rows.iter().map(|b| b.information_per_px2).sum();
            let sum: f32 = rows
                .iter()
                .map(|b| b.information_per_px2 * b.shift_px)
                .sum();
            (rows[0].time_ns, sum / information, information)
        })
        .collect();
    let mut at = 0;
    rows.retain_mut(|row| {
        let away = |k: usize| moments.get(k).map(|m| (m.0 - row.time_ns).abs());
        while away(at + 1).is_some_and(|next| away(at).is_some_and(|here| next <= here)) {
            at += 1;
        }
        let Some(&(_, shift_px, information)) = moments
            .get(at)
            .filter(|_| away(at).is_some_and(|away| away <= REACH_NS))
        else {
            return false;
        };
        row.shift_px -= shift_px;
        row.information_per_px2 = (row.information_per_px2.recip() + information.recip()).recip();
        true
    });
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
            vertical: None,
        }
    }

    #[test]
    fn each_row_loses_what_the_background_did_at_its_time() {
        let time = |r: u16| i64::from(r) * 55_000;
        let shake = |r: u16| f32::from(r % 7) * 0.1;
        // Three rows of the background could not be measured.
        let background: Vec<_> = (0..240)
            .filter(|r| !(100..103).contains(r))
            .map(|r| row(r, time(r), shake(r), 1e3))
            .collect();
        let mut rows: Vec<_> = (0..240)
            .map(|r| row(r, time(r), shake(r) + 0.01, 4e3))
            .collect();
        subtract(&mut rows, &background);
        assert_eq!(rows.len(), 240);
        for row in rows.iter().filter(|r| !(100..103).contains(&r.row)) {
            assert!((row.shift_px - 0.01).abs() < 1e-6, "{row:?}");
            assert!((row.information_per_px2 - 800.0).abs() < 0.1, "{row:?}");
        }
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
