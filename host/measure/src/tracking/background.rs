//! Subtracting the camera's own motion, which a still part of the picture shows.
//!
//! Row by row: the background's row was exposed at the same time and says what the camera did then, as
//! fast as it may shake. Its noise is added, white like the row's own; a smoother background would be
//! quieter but would leave noise of a colour that looks like vibration.

use rowtone::timeline::Displacement;

/// A row without a background of its own takes the nearest one that is no further away, ns.
const REACH_NS: i64 = 300_000;

/// Rows of a rolling shutter whose informations are added up where both axes are measured: a single row may lean.
const PLANAR_ROWS: usize = 5;

/// What the background did at one time: to the right and downwards, px, and the covariance of that, px².
struct Moment {
    time_ns: i64,
    px: [f32; 2],
    covariance_px2: [f32; 3],
}

/// Subtracts the background's motion from each row. Rows that have no background near them are dropped.
/// Both slices belong to one frame and are in order of time.
pub fn subtract(rows: &mut Vec<Displacement>, background: &[Displacement]) {
    // Rows of one time are one: with a global shutter that is the whole background.
    let groups: Vec<&[Displacement]> = background.chunk_by(|a, b| a.time_ns == b.time_ns).collect();
    let planar = background.iter().any(|row| row.vertical.is_some());
    let moments: Vec<Moment> = if planar {
        let half = PLANAR_ROWS / 2;
        let moment = |k: usize| {
            let near = &groups[k.saturating_sub(half)..(k + half + 1).min(groups.len())];
            both_axes(groups[k][0].time_ns, near)
        };
        (0..groups.len()).filter_map(moment).collect()
    } else {
        groups.iter().map(|rows| along_rows(rows)).collect()
    };
    let mut at = 0;
    rows.retain_mut(|row| {
        let away = |k: usize| moments.get(k).map(|m| (m.time_ns - row.time_ns).abs());
        while away(at + 1).is_some_and(|next| away(at).is_some_and(|here| next <= here)) {
            at += 1;
        }
        let Some(moment) = moments
            .get(at)
            .filter(|_| away(at).is_some_and(|away| away <= REACH_NS))
        else {
            return false;
        };
        moment.take_off(row);
        true
    });
}

fn along_rows(rows: &[Displacement]) -> Moment {
    let information: f32 = rows.iter().map(|b| b.information_per_px2).sum();
    let sum: f32 = rows
        .iter()
        .map(|b| b.information_per_px2 * b.shift_px)
        .sum();
    Moment {
        time_ns: rows[0].time_ns,
        px: [sum / information, 0.0],
        covariance_px2: [information.recip(), 0.0, 0.0],
    }
}

/// From the scores and informations of these rows; `None` where their edges all lean one way.
fn both_axes(time_ns: i64, groups: &[&[Displacement]]) -> Option<Moment> {
    let (mut j, mut s) = ([0.0f64; 3], [0.0f64; 2]);
    for row in groups.iter().copied().flatten() {
        let v = row.vertical.unwrap_or_default();
        let (first, second) = (
            f64::from(row.information_per_px2),
            f64::from(v.information_per_px2),
        );
        let k = f64::from(v.coupling);
        let along = first * f64::from(row.shift_px);
        j = [
            j[0] + first,
            j[1] + k * first,
            j[2] + k * k * first + second,
        ];
        s = [
            s[0] + along,
            s[1] + k * along + second * f64::from(v.shift_px),
        ];
    }
    let determinant = j[0] * j[2] - j[1] * j[1];
    let known = determinant > 1e-3 * j[0] * j[2];
    let x = (j[2] * s[0] - j[1] * s[1]) / determinant;
    let y = (j[0] * s[1] - j[1] * s[0]) / determinant;
    known.then(|| Moment {
        time_ns,
        px: [x as f32, y as f32],
        covariance_px2: [j[2], -j[1], j[0]].map(|v| (v / determinant) as f32),
    })
}

impl Moment {
    fn take_off(&self, row: &mut Displacement) {
        let ([x, y], [xx, xy, yy]) = (self.px, self.covariance_px2);
        let k = row.vertical.map_or(0.0, |v| v.coupling);
        row.shift_px -= x + k * y;
        let more = xx + k * (2.0 * xy + k * yy);
        if row.information_per_px2 > 0.0 {
            row.information_per_px2 = (row.information_per_px2.recip() + more).recip();
        }
        if let Some(v) = &mut row.vertical
            && v.information_per_px2 > 0.0
        {
            v.shift_px -= y;
            v.information_per_px2 = (v.information_per_px2.recip() + yy).recip();
        }
    }
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
