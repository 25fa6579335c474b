//! Rows of a recording that a codec has been at, weighed by what they do.
//!
//! What a row states of its own noise comes from its pixels. In compressed video that is far too little: predicted
//! blocks hold still and jump, blank parts creep, and a row without much texture may lock to something else. But where
//! all rows of a frame are exposed at once they show about the same motion: a cubic polynomial along each axis, fitted to them so that single ones cannot pull
//! it (iteratively reweighted least squares, with Cauchy's weights). How much further each row is from it than a frame
//! before, as a rule, is that row's noise, for what moves otherwise moves steadily; and a row that is five times further for
//! once counts for next to nothing.

use rowtone::timeline::Displacement;
use rowtone_linear::Symmetric;

/// Coefficients along each axis, and together.
const ORDERS: usize = 4;
const UNKNOWNS: usize = 2 * ORDERS;
/// A coefficient more asks for so many rows more.
const ROWS_A_COEFFICIENT: usize = 10;
/// Rounds of reweighting.
const ROUNDS: usize = 6;
/// Beyond so many standard deviations a row is off.
const OFF_SD: f64 = 5.0;
/// Cauchy's weight is a half at so many.
const HALF_SD: f64 = 2.4;
/// What a row's scatter is taken for before it was seen, px, and the share of it that the newest frame has at least.
const UNSEEN_PX: f64 = 0.3;
const NEWEST: f64 = 0.01;
/// No row is surer than this, px²; what is known of a band before, 1/px²: it moves by a pixel or so.
const LEAST_PX2: f64 = 1e-6;
const BEFORE: f64 = 1.0;
/// A row that is off keeps this share of what it knows, at the place where the others are.
const NOTHING: f32 = 1e-4;

/// What one measurement of a row did in the frames before.
#[derive(Clone, Copy, Debug)]
struct Habit {
    /// Half of the mean square of how much further it was than a frame before, px².
    jumps_px2: f64,
    /// How far it was, px.
    off_px: f64,
}

/// How the rows of a part keep to where the others lead.
#[derive(Debug)]
pub(super) struct Vet {
    rows: Vec<[Habit; 2]>,
    frames: f64,
}

/// One measurement of a row: what it says of the unknowns.
struct Said {
    /// Its place among those given, and in the part.
    given: usize,
    row: usize,
    axis: usize,
    design: [f64; UNKNOWNS],
    px: f64,
    information: f64,
}

impl Vet {
    /// Of a part with so many rows.
    pub(super) fn new(rows: usize) -> Self {
        let unseen = Habit {
            jumps_px2: UNSEEN_PX * UNSEEN_PX,
            off_px: 0.0,
        };
        Self {
            rows: vec![[unseen; 2]; rows],
            frames: 0.0,
        }
    }

    /// Gives the rows of a frame the informations that they have earned, and those that are off for once the place where
    /// the others are.
    pub(super) fn weigh(&mut self, rows: &mut [Displacement]) {
        let said = self.said(rows);
        let Some(motion) = self.motion(&said, rows.len()) else {
            return;
        };
        self.frames += 1.0;
        let share = NEWEST.max(1.0 / (self.frames + 1.0));
        for said in &said {
            said.settle(&motion, share, &mut self.rows[said.row][said.axis], rows);
        }
    }

    fn said(&self, rows: &[Displacement]) -> Vec<Said> {
        let middle = 0.5 * self.rows.len() as f64;
        let mut said = Vec::with_capacity(2 * rows.len());
        for (given, row) in rows.iter().enumerate() {
            let place = (f64::from(row.row) - middle) / middle.max(1.0);
            let powers = [1.0, place, place * place, place * place * place];
            let v = row.vertical.unwrap_or_default();
            for (axis, px, information, [right, down]) in [
                (0, row.shift_px, row.information_per_px2, [1.0, v.coupling]),
                (1, v.shift_px, v.information_per_px2, [0.0, 1.0]),
            ] {
                let (right, down) = (f64::from(right), f64::from(down));
                if information > 0.0 && px.is_finite() && usize::from(row.row) < self.rows.len() {
                    said.push(Said {
                        given,
                        row: row.row.into(),
                        axis,
                        design: std::array::from_fn(|k| {
                            [right, down][k / ORDERS] * powers[k % ORDERS]
                        }),
                        px: px.into(),
                        information: information.into(),
                    });
                }
            }
        }
        said
    }

    /// Where they lead.
    fn motion(&self, said: &[Said], rows: usize) -> Option<[f64; UNKNOWNS]> {
        let orders = (rows / ROWS_A_COEFFICIENT).clamp(1, ORDERS);
        let mut motion = self.start(said)?;
        for _ in 0..ROUNDS {
            let mut normal = Symmetric::zeros(UNKNOWNS);
            let mut right = [0.0; UNKNOWNS];
            // Orders that so few rows do not tell stay out.
            let before = |k: usize| if k % ORDERS < orders { BEFORE } else { 1e12 };
            (0..UNKNOWNS).for_each(|k| normal.add(k, k, before(k)));
            for said in said {
                let off = said.px - dot(&said.design, &motion);
                let weight = 1.0
                    / (said.variance(&self.rows[said.row][said.axis])
                        + off * off / (HALF_SD * HALF_SD));
                normal.add_outer(&said.design, weight);
                for (right, design) in right.iter_mut().zip(&said.design) {
                    *right += weight * said.px * design;
                }
            }
            motion.copy_from_slice(&normal.factor()?.solve(&right));
        }
        Some(motion)
    }

    /// All rows alike: medians.
    fn start(&self, said: &[Said]) -> Option<[f64; UNKNOWNS]> {
        let mut motion = [0.0; UNKNOWNS];
        let median = |axis: usize, motion: &[f64; UNKNOWNS]| {
            let mut px: Vec<(f64, f64)> = (said.iter().filter(|s| s.axis == axis))
                .map(|s| {
                    let down = s.design[ORDERS] * motion[ORDERS];
                    let px = if axis == 0 { s.px - down } else { s.px };
                    (px, 1.0 / s.variance(&self.rows[s.row][axis]))
                })
                .collect();
            px.sort_by(|a, b| a.0.total_cmp(&b.0));
            let half = 0.5 * px.iter().map(|(_, w)| w).sum::<f64>();
            let mut sum = 0.0;
            let mut above = px.iter().filter(|(_, w)| {
                sum += w;
                sum >= half
            });
            above.next().map(|(px, _)| *px)
        };
        let down = median(1, &motion);
        motion[ORDERS] = down.unwrap_or(0.0);
        let right = median(0, &motion);
        motion[0] = right.unwrap_or(0.0);
        (down.is_some() || right.is_some()).then_some(motion)
    }
}

impl Said {
    fn variance(&self, habit: &Habit) -> f64 {
        habit.jumps_px2.max(LEAST_PX2) + 1.0 / self.information
    }

    /// Notes how far it is off, and gives its row what it has earned.
    fn settle(
        &self,
        motion: &[f64; UNKNOWNS],
        share: f64,
        habit: &mut Habit,
        rows: &mut [Displacement],
    ) {
        let (variance, before) = (self.variance(habit), *habit);
        let expected = dot(&self.design, motion);
        let jump2 = (self.px - expected - before.off_px).powi(2);
        let most = OFF_SD * OFF_SD * 2.0 * variance;
        habit.jumps_px2 += share * (0.5 * jump2.min(most) - habit.jumps_px2);
        let row = &mut rows[self.given];
        let (place, known) = match (self.axis, &mut row.vertical) {
            (1, Some(v)) => (&mut v.shift_px, &mut v.information_per_px2),
            _ => (&mut row.shift_px, &mut row.information_per_px2),
        };
        let information = (1.0 / variance) as f32;
        if jump2 > most {
            (*place, *known) = ((expected + before.off_px) as f32, NOTHING * information);
        } else {
            habit.off_px = self.px - expected;
            *known = information;
        }
    }
}

fn dot(a: &[f64; UNKNOWNS], b: &[f64; UNKNOWNS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::timeline::Vertical;

    const ROWS: u16 = 100;

    /// What a row makes of frame `k`, whose object moves by (x, y): the upper third is blank and reads whatever it likes.
    fn row(row: u16, k: u32, x: f32, y: f32) -> Displacement {
        let chance = |seed: u32| {
            let hash = (k * 131 + u32::from(row) * 7 + seed).wrapping_mul(2_654_435_761);
            (hash >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let blank = row < ROWS / 3;
        let (size, coupling) = (if blank { 30.0 } else { 0.02 }, 2.0 * chance(0));
        Displacement {
            frame: k,
            row,
            time_ns: i64::from(k) * 1_000_000,
            shift_px: x + coupling * y + size * chance(1),
            information_per_px2: 1e4,
            vertical: Some(Vertical {
                shift_px: y + size * chance(2),
                information_per_px2: 1e4,
                coupling,
                ..Vertical::default()
            }),
        }
    }

    #[test]
    fn rows_that_read_what_they_like_count_for_next_to_nothing() {
        let mut vet = Vet::new(ROWS.into());
        for k in 0..60 {
            let (x, y) = ((k as f32 * 0.4).sin(), 0.5 * (k as f32 * 0.3).cos());
            let mut rows: Vec<Displacement> = (0..ROWS).map(|r| row(r, k, x, y)).collect();
            let before = rows[80];
            vet.weigh(&mut rows);
            if k < 20 {
                continue;
            }
            assert_eq!(rows.len(), usize::from(ROWS), "none is left out");
            let knows = |rows: &[Displacement]| -> f32 {
                rows.iter().map(|row| row.information_per_px2).sum()
            };
            let (blank, rest) = rows.split_at(usize::from(ROWS / 3));
            assert!(knows(blank) < 1e-3 * knows(rest), "{k}");
            // What is right stays as it was.
            assert_eq!(rows[80].shift_px, before.shift_px, "{k}");
        }
    }

    #[test]
    fn a_row_that_is_off_for_once_is_put_where_the_others_are() {
        let mut vet = Vet::new(ROWS.into());
        for k in 0..40 {
            let x = (k as f32 * 0.4).sin();
            let mut rows: Vec<Displacement> = (0..ROWS).map(|r| row(r, k, x, 0.0)).collect();
            if k == 30 {
                rows[70].shift_px += 43.0;
            }
            vet.weigh(&mut rows);
            let row = &rows[70];
            assert!(k < 10 || (row.shift_px - x).abs() < 0.1, "{k}: {row:?}");
            assert_eq!(row.information_per_px2 < 1.0, k == 30, "{k}: {row:?}");
        }
    }
}
