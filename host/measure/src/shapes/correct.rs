//! What a tile's amplitude owes to its texture and to the size of the motion, made good.

use num_complex::Complex64;
use rowtone::shape::TileTexture;

use super::fit::{Estimate, Inverse};
use super::pass::TileBlocks;

/// Takes off what a motion that varies over a tile leaves in its scores beside its mean: the texture does not tell of all
/// places of the tile alike, nor does it keep the axes apart everywhere. The slopes of the motion are those between
/// neighbours.
pub(super) fn centred(sums: &TileBlocks, all: &mut [Estimate]) {
    let (columns, rows) = (sums.grid.columns(), sums.grid.rows());
    let px: Vec<[Complex64; 2]> = all.iter().map(|estimate| estimate.px).collect();
    let side = sums.grid.tile_px() as f64;
    for (tile, estimate) in all.iter_mut().enumerate() {
        let places = [
            (1, tile % columns, columns),
            (columns, tile / columns, rows),
        ];
        // Along each direction the slope of both axes, px a px.
        let slopes = places.map(|(stride, at, count)| {
            [0, 1].map(|axis| {
                let value = |to: usize| px[tile + to * stride - at * stride][axis];
                let step = |from: usize| value(from + 1) - value(from);
                // At the picture's edge the two steps behind each other.
                let [a, b] = match at {
                    _ if count < 3 => return Complex64::default(),
                    0 => [step(0), step(1)],
                    _ if at + 1 == count => [step(at - 1), step(at - 2)],
                    _ => [step(at - 1), step(at)],
                };
                Complex64::new(limited(a.re, b.re), limited(a.im, b.im)) / side
            })
        });
        let texture = &sums.tiles[tile];
        let score = [0, 1].map(|i| {
            let mut score = Complex64::default();
            for (j, moments) in texture.moments[i].iter().enumerate() {
                for (moment, slope) in moments.iter().zip(&slopes) {
                    score += slope[j] * f64::from(*moment);
                }
            }
            score
        });
        let off = Inverse::of(texture).solve(score);
        for (px, off) in estimate.px.iter_mut().zip(off) {
            *px -= off;
        }
    }
}

/// The mean of two steps, and no more than twice the smaller one; 0 where they go opposite ways: so an edge of a part stays
/// one (van Leer 1977, the monotonized central limiter).
fn limited(a: f64, b: f64) -> f64 {
    if a * b <= 0.0 {
        return 0.0;
    }
    let mean = 0.5 * (a + b);
    let most = 2.0 * a.abs().min(b.abs());
    mean.signum() * mean.abs().min(most)
}

/// Largest argument of [`blurred`] squared that is made good.
const MOST_BLURRED: f64 = 2.5;

/// Makes good that a motion blurs the mean picture, whose slopes are smaller then: a wave of k rad/px that swings by A px
/// shows 2·J₁(kA) of its slope where the mean picture has J₀(kA)·kA. What the other axis adds depends on the phase between.
pub(super) fn unblurred(texture: &TileTexture, px: [Complex64; 2]) -> [Complex64; 2] {
    let [x, y] = [0, 1].map(|axis| {
        let own = f64::from(texture.response[axis][axis]);
        let waves = f64::from(texture.bend[axis]);
        if own > 0.0 {
            (waves / own).clamp(0.0, 2.5)
        } else {
            0.0
        }
    });
    let mut true_px = px;
    for _ in 0..8 {
        let [a, b] = true_px;
        let (own_a, own_b) = (a.norm_sqr(), b.norm_sqr());
        let product = own_a * own_b;
        let together = if product > 0.0 {
            (a * b.conj()).re.powi(2) / product
        } else {
            0.0
        };
        let cross = (1.0 + 2.0 * together) / 3.0;
        let turned = [x * (own_a + cross * own_b), y * (own_b + cross * own_a)];
        for ((true_px, px), turned) in true_px.iter_mut().zip(px).zip(turned) {
            *true_px = px / blurred(turned.min(MOST_BLURRED));
        }
    }
    true_px
}

/// 2·J₁(z)/(z·J₀(z)) of z squared, by the series of both.
fn blurred(squared: f64) -> f64 {
    let quarter = 0.25 * squared;
    let (mut zero, mut one, mut term) = (0.0, 0.0, 1.0);
    for k in 0..12 {
        zero += term;
        one += term / f64::from(k + 1);
        term *= -quarter / f64::from((k + 1) * (k + 1));
    }
    one / zero
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_its_edge_and_a_slope_its_mean() {
        assert_eq!(limited(0.1, 0.2), 0.15000000000000002);
        assert_eq!(limited(-0.1, -0.5), -0.2);
        assert_eq!([limited(0.0, 0.3), limited(-0.1, 0.3)], [0.0; 2]);
    }

    #[test]
    fn a_wave_that_swings_far_is_told_at_its_size() {
        // J0(1) = 0.765198, J1(1) = 0.440051 (Abramowitz & Stegun, table 9.1).
        assert!((blurred(1.0) - 2.0 * 0.440_051 / 0.765_198).abs() < 1e-6);
        // Waves of 0.6 rad/px; of 1 px, so much is seen as the mean picture's slopes would have it.
        let mut texture = TileTexture::default();
        texture.response = [[100.0, 0.0], [0.0, 100.0]];
        texture.bend = [36.0, 36.0];
        let seen = [Complex64::new(blurred(0.36), 0.0), Complex64::default()];
        let [x, y] = unblurred(&texture, seen);
        assert!((x.re - 1.0).abs() < 1e-4 && y.norm() == 0.0, "{x}");
    }
}
