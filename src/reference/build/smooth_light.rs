//! Coefficients that do not see light which changes smoothly along a row.
//!
//! A shadow's soft edge, or a second lamp that flickers, makes a row brighter at one end than at the other. The
//! filters along the rows hardly see that; the derivative across them has all low frequencies of the row and would
//! take it for a motion. So h is made orthogonal not only to 1 and to the row itself, but to every function that is
//! linear between a few places along the row:
//!
//! ```text
//! h ← h − w·(Σ α_k·Λ_k + β·r)    with    Σ h·Λ_k = 0  and  Σ h·r = 0,
//! ```
//!
//! Λ_k the hat that is 1 at place k and 0 at all others: the normal equations of least squares with weights w. The
//! matrix of the hats has three diagonals. What h² / w loses is information; where a row would lose too much of it (one
//! that runs along edges is itself little more than smooth light), it is made orthogonal to 1 and r alone.

/// Places from the first column to the last, both included, at most.
const PLACES: usize = 5;

/// Columns from one place to the next at least: nearer ones would take the texture's own low frequencies too.
const APART: usize = 96;

/// So small a share of a hat's fair share of the weight is added to its own, so that a masked part divides by no zero.
const LEAST_SHARE: f32 = 1e-4;

/// At least this share of the information is kept, or smooth light is not taken off.
const LEAST_KEPT: f32 = 0.8;

/// What is left of the row beside the hats must be this share of it, or there is no β.
const LEAST_LEFT: f32 = 1e-3;

/// Weighted moments of h and the row r with the hats.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SmoothLight {
    /// Σ w·Λ_k², Σ w·Λ_k·Λ_{k+1}, Σ w·Λ_k·r, Σ h·Λ_k; what it is multiplied by after [`SmoothLight::solve`].
    own: [f32; PLACES],
    next: [f32; PLACES],
    row: [f32; PLACES],
    h: [f32; PLACES],
    /// Σ w·r², Σ h·r, Σ h²/w.
    row_square: f32,
    h_row: f32,
    h_square: f32,
    /// α_k and β.
    alpha: [f32; PLACES],
    beta: f32,
}

/// The place to the left of a column, and how far on to the next one it is, 0 to 1.
#[inline(always)]
fn place(x: usize, width: usize) -> (usize, f32) {
    let last = width.saturating_sub(1).max(1);
    let parts = (width / APART).clamp(1, PLACES - 1);
    let scaled = x.min(last) * parts;
    let left = (scaled / last).min(parts - 1);
    (left, (scaled - left * last) as f32 / last as f32)
}

fn along(a: &[f32; PLACES], b: &[f32; PLACES]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl SmoothLight {
    /// Adds column `x` of `width`: its weight, the row's value less its mean, and h.
    pub(super) fn add(&mut self, x: usize, width: usize, [w, r, h]: [f32; 3]) {
        let (left, t) = place(x, width);
        for (k, hat) in [(left, 1.0 - t), (left + 1, t)] {
            let wide = w * hat;
            self.own[k] += wide * hat;
            self.row[k] += wide * r;
            self.h[k] += h * hat;
        }
        self.next[left] += w * (1.0 - t) * t;
        self.row_square += w * r * r;
        self.h_row += h * r;
        if w > 0.0 {
            self.h_square += h * h / w;
        }
    }

    /// α and β, from all columns of so many.
    pub(super) fn solve(&mut self, width: usize) {
        let total: f32 = self.own.iter().sum();
        let least = (total * LEAST_SHARE / PLACES as f32).max(f32::MIN_POSITIVE);
        for own in &mut self.own {
            *own += least;
        }
        let (of_row, of_h) = (self.divide(self.row), self.divide(self.h));
        let beta = self.beta(along(&self.row, &of_row), along(&self.row, &of_h));
        let mut alpha = of_h;
        for (alpha, row) in alpha.iter_mut().zip(of_row) {
            *alpha -= beta * row;
        }
        // The same with one hat over all, to see what the others cost.
        let own: f32 = self.own.iter().sum::<f32>() + 2.0 * self.next.iter().sum::<f32>();
        let (row, h): (f32, f32) = (self.row.iter().sum(), self.h.iter().sum());
        let even_beta = self.beta(row * row / own, row * h / own);
        let even_alpha = (h - even_beta * row) / own;
        let kept = self.h_square - along(&alpha, &self.h) - beta * self.h_row;
        let even_kept = self.h_square - even_alpha * h - even_beta * self.h_row;
        // A row with room for no place between its ends is told by itself: what is smooth in it is most of it.
        let wide = width >= 2 * APART;
        (self.alpha, self.beta) = if wide && kept > LEAST_KEPT * even_kept {
            (alpha, beta)
        } else {
            ([even_alpha; PLACES], even_beta)
        };
    }

    /// β, from what of Σ w·r² and of Σ h·r the hats explain.
    fn beta(&self, of_square: f32, of_h: f32) -> f32 {
        let left = self.row_square - of_square;
        if left > LEAST_LEFT * self.row_square {
            (self.h_row - of_h) / left
        } else {
            0.0
        }
    }

    /// M⁻¹·v for the hats' matrix M, by elimination from the first to the last and back (Thomas).
    fn divide(&self, v: [f32; PLACES]) -> [f32; PLACES] {
        let (mut own, mut v) = (self.own, v);
        for k in 1..PLACES {
            let factor = self.next[k - 1] / own[k - 1];
            own[k] -= factor * self.next[k - 1];
            v[k] -= factor * v[k - 1];
        }
        for k in (0..PLACES).rev() {
            let beyond = match k + 1 < PLACES {
                true => self.next[k] * v[k + 1],
                false => 0.0,
            };
            v[k] = (v[k] - beyond) / own[k];
        }
        v
    }

    /// What h loses at column `x` for each unit of weight.
    #[inline(always)]
    pub(super) fn at(&self, x: usize, width: usize, r: f32) -> f32 {
        let (left, t) = place(x, width);
        self.alpha[left] + t * (self.alpha[left + 1] - self.alpha[left]) + self.beta * r
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    /// What is taken off makes h orthogonal to every function that is linear between the places, and to the row.
    #[test]
    fn what_is_left_sees_no_smooth_light() {
        for width in [192_usize, 320] {
            let r: Vec<f32> = (0..width)
                .map(|x| 30.0 * libm::sinf(x as f32 * 0.7))
                .collect();
            let w: Vec<f32> = (0..width)
                .map(|x| {
                    if x % 11 == 3 {
                        0.0
                    } else {
                        0.5 + (x % 5) as f32 * 0.1
                    }
                })
                .collect();
            let h: Vec<f32> = (0..width)
                .map(|x| w[x] * (libm::cosf(x as f32 * 1.9) + 0.2 - 0.1 * x as f32 / width as f32))
                .collect();
            let mut light = SmoothLight::default();
            for x in 0..width {
                light.add(x, width, [w[x], r[x], h[x]]);
            }
            light.solve(width);
            let new: Vec<f32> = (0..width)
                .map(|x| h[x] - w[x] * light.at(x, width, r[x]))
                .collect();
            let last = (width - 1) as f32;
            let seen = |f: &dyn Fn(f32) -> f32, h: &[f32]| -> f32 {
                h.iter()
                    .enumerate()
                    .map(|(x, h)| h * f(x as f32 / last))
                    .sum()
            };
            let size: f32 = h.iter().map(|h| h.abs()).sum();
            let ramp = |x: f32| x;
            // 1 at the second of the four places of 320 columns.
            let tent = |x: f32| match width {
                320 => 1.0 - (3.0 * x - 1.0).abs().min(1.0),
                _ => 1.0 - x,
            };
            for f in [&(|_: f32| 1.0_f32) as &dyn Fn(f32) -> f32, &ramp, &tent] {
                // The ridge of 1e-4 leaves as small a share.
                assert!(
                    seen(f, &new).abs() < 3e-4 * size,
                    "{width}: {}",
                    seen(f, &new)
                );
                assert!(seen(f, &h).abs() > 1e-2 * size, "{width}: {}", seen(f, &h));
            }
            let own: f32 = new.iter().zip(&r).map(|(h, r)| h * r).sum();
            assert!(own.abs() < 1e-2 * size, "{width}: {own}");
        }
    }

    #[test]
    fn nothing_known_takes_nothing_off() {
        let mut light = SmoothLight::default();
        for x in 0..40 {
            light.add(x, 40, [0.0, 5.0, 0.0]);
        }
        light.solve(40);
        assert_eq!(light.at(17, 40, 5.0), 0.0);
    }
}
