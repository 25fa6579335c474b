//! What the rows of a group know of the motion along the columns: sums of their scores and informations.

use super::Vertical;

/// Sums over the rows of a group. With the first measurement A = x + κ·y of a row, its information I, and the second B = y
/// with its information I', the row's 2x2 information is (I, κ·I; κ·I, κ²·I + I') and its score along the columns
/// κ·I·A + I'·B.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VerticalSums {
    /// There are such rows.
    any: bool,
    /// Σ κ·I and Σ κ·I·row, 1/px².
    cross: [f32; 2],
    /// Σ κ²·I + I' and the same times the row, 1/px².
    along: [f32; 2],
    /// Σ κ·I·A + I'·B, 1/px.
    score: f32,
}

/// A second measurement that knows less than this share of what it would know if the first were known is rounding.
const LEAST_SHARE: f32 = 1e-5;

impl VerticalSums {
    /// A row of the group, so many rows after its first.
    #[inline(always)]
    pub(super) fn add(&mut self, row: u16, shift_px: f32, information_per_px2: f32, v: &Vertical) {
        let cross = v.coupling * information_per_px2;
        let along = v.coupling * cross + v.information_per_px2;
        let row = f32::from(row);
        self.any = true;
        self.cross[0] += cross;
        self.cross[1] += cross * row;
        self.along[0] += along;
        self.along[1] += along * row;
        self.score += cross * shift_px + v.information_per_px2 * v.shift_px;
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        !self.any
    }

    /// Mean row, weighted by what the rows know of y where x is known.
    pub(super) fn mean_row(&self) -> Option<f32> {
        (self.along[0] > 0.0).then(|| self.along[1] / self.along[0])
    }

    /// The group's. `weighted_shift_px`: Σ I·A; `information_per_px2`: Σ I; `mean_row`: where the time of the sample is;
    /// `line_ns`: from row to row.
    pub(super) fn settle(
        &self,
        weighted_shift_px: f32,
        information_per_px2: f32,
        mean_row: f32,
        line_ns: f32,
    ) -> Vertical {
        let ([cross, cross_row], [along, along_row]) = (self.cross, self.along);
        let known = information_per_px2 > 0.0;
        let per_information = if known {
            1.0 / information_per_px2
        } else {
            0.0
        };
        let coupling = cross * per_information;
        let own = along - coupling * cross;
        // Σ κ·I and Σ κ²·I + I', each times how much later its row is than the sample.
        let cross_later = cross_row - mean_row * cross;
        let along_later = along_row - mean_row * along;
        let vertical = Vertical {
            coupling,
            coupling_delay_ns: cross_later * per_information * line_ns,
            ..Vertical::default()
        };
        let sure = own > LEAST_SHARE * along;
        let shift_px = (self.score - coupling * weighted_shift_px) / own;
        if !sure || !(own + shift_px).is_finite() {
            return vertical;
        }
        Vertical {
            shift_px,
            information_per_px2: own,
            delay_ns: (along_later - coupling * cross_later) / own * line_ns,
            ..vertical
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that know (κ, I, I'), and what they see of a motion that is (x, y) with the sample and goes on at (dx, dy) a row.
    const ROWS: [(f32, f32, f32); 6] = [
        (0.5, 900.0, 400.0),
        (-1.2, 300.0, 900.0),
        (0.1, 2500.0, 20.0),
        (4.0, 10.0, 300.0),
        (0.0, 0.0, 700.0),
        (-0.4, 1200.0, 0.0),
    ];

    fn group(x: [f32; 2], y: [f32; 2]) -> (f32, f32, Vertical) {
        let all: f32 = ROWS.iter().map(|r| r.1).sum();
        let mean: f32 = (0u8..)
            .zip(ROWS)
            .map(|(k, r)| f32::from(k) * r.1)
            .sum::<f32>()
            / all;
        let (mut sums, mut weighted) = (VerticalSums::default(), 0.0);
        for (k, (coupling, information, own)) in (0u16..).zip(ROWS) {
            let later = f32::from(k) - mean;
            let down = y[0] + y[1] * later;
            let shift = x[0] + x[1] * later + coupling * down;
            weighted += information * shift;
            let vertical = Vertical {
                shift_px: down,
                information_per_px2: own,
                coupling,
                ..Vertical::default()
            };
            sums.add(k, shift, information, &vertical);
        }
        (weighted / all, all, sums.settle(weighted, all, mean, 1.0))
    }

    #[test]
    fn a_motion_that_all_rows_share_comes_out_along_both_axes() {
        let (shift, information, vertical) = group([0.3, 0.0], [-0.2, 0.0]);
        let planar = vertical.solve(shift, information).unwrap();
        assert!((planar.px[0] - 0.3).abs() < 1e-5 && (planar.px[1] + 0.2).abs() < 1e-5);
        // The inverse of the sum of all rows' informations.
        let j = ROWS.iter().fold([0.0; 3], |j, &(k, i, own)| {
            [j[0] + i, j[1] + k * i, j[2] + k * k * i + own]
        });
        let det = j[0] * j[2] - j[1] * j[1];
        for (got, want) in planar
            .covariance_px2
            .iter()
            .zip([j[2] / det, -j[1] / det, j[0] / det])
        {
            assert!((got / want - 1.0).abs() < 1e-4, "{got} {want}");
        }
    }

    #[test]
    fn what_a_motion_does_within_the_group_is_told() {
        // A = x + κ·y + delay_κ·ẏ and B = y + delay·ẏ + I/I'·delay_κ·ẋ.
        let (x, y) = ([0.3, 0.02], [-0.2, -0.05]);
        let (shift, information, v) = group(x, y);
        let first = x[0] + v.coupling * y[0] + v.coupling_delay_ns * y[1];
        assert!((shift - first).abs() < 1e-5, "{shift} {first}");
        let share = information / v.information_per_px2;
        let second = y[0] + v.delay_ns * y[1] + share * v.coupling_delay_ns * x[1];
        assert!(
            (v.shift_px - second).abs() < 1e-5,
            "{} {second}",
            v.shift_px
        );
    }

    #[test]
    fn edges_that_all_lean_alike_tell_one_direction() {
        let mut sums = VerticalSums::default();
        let mut weighted = 0.0;
        for row in 0..8u16 {
            let information = 100.0 + 37.0 * f32::from(row);
            let vertical = Vertical {
                coupling: 0.7,
                ..Vertical::default()
            };
            sums.add(row, 0.123, information, &vertical);
            weighted += information * 0.123;
        }
        let v = sums.settle(weighted, weighted / 0.123, 3.5, 1.0);
        assert_eq!(
            (v.shift_px, v.information_per_px2, v.delay_ns),
            (0.0, 0.0, 0.0)
        );
        assert!((v.coupling - 0.7).abs() < 1e-5);
        assert!(v.solve(0.123, 2000.0).is_none());
    }

    #[test]
    fn edges_along_the_rows_tell_nothing_of_x() {
        let mut sums = VerticalSums::default();
        for row in 0..4 {
            let vertical = Vertical {
                shift_px: 0.5,
                information_per_px2: 10.0,
                ..Vertical::default()
            };
            sums.add(row, 0.0, 0.0, &vertical);
        }
        let v = sums.settle(0.0, 0.0, sums.mean_row().unwrap(), 1.0);
        assert_eq!(
            (v.shift_px, v.information_per_px2, v.coupling, v.delay_ns),
            (0.5, 40.0, 0.0, 0.0)
        );
    }
}
