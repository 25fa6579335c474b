//! How well the displacement of a row can be known at all.
//!
//! A row of pixels `r(x)` with independent noise of variance `var(x)` bounds the standard deviation
//! of every unbiased estimate of its displacement: σ ≥ 1/√(Σ r'(x)²/var(x)) (Cramér–Rao; noise
//! normal, its own dependence on d left out). Here `r` is the noise-free row at rest under steady
//! light, in DN, and `var` has shot noise, read noise and quantisation.

use std::ops::Range;

use serde::Serialize;

use super::camera::Camera;

/// The bound of every row in short, px.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrlbStats {
    /// Half of the rows with texture are below.
    pub median_px: f64,
    /// A tenth of them are below.
    pub p10_px: f64,
    /// Nine tenths of them are below.
    pub p90_px: f64,
    /// The best row.
    pub best_px: f64,
    /// The worst row that has any texture.
    pub worst_px: f64,
    /// Rows that know nothing: no texture, black, saturated, or no part of them moves.
    pub blind_rows: u32,
}

/// The bound of each row, px; `None` where nothing can be known.
pub fn row_bounds_px(camera: &Camera) -> Vec<Option<f64>> {
    (0..camera.config().sensor.rows)
        .map(|row| row_bound_px(camera, row))
        .collect()
}

fn row_bound_px(camera: &Camera, row: u32) -> Option<f64> {
    let information = information_per_px2(camera, row, camera.config().moving_cols(row)?);
    // Less than this is the rounding of the texture, not texture.
    (information > 1e-4).then(|| 1.0 / information.sqrt())
}

/// Fisher information of some columns of a row about its displacement, 1/px².
pub fn information_per_px2(camera: &Camera, row: u32, cols: Range<u32>) -> f64 {
    pixels(camera, row, cols)
        .map(|p| p.right_dn * p.right_dn / p.variance_dn2)
        .sum()
}

/// What a pixel tells: how its value changes with the picture's motion, and its noise.
struct Pixel {
    /// Change of its value to the right, DN/px.
    right_dn: f64,
    /// Change of its value downwards, DN/px.
    down_dn: f64,
    /// Variance of its value, DN².
    variance_dn2: f64,
}

/// The pixels of a row that are neither white nor dead nor hot.
fn pixels(camera: &Camera, row: u32, cols: Range<u32>) -> impl Iterator<Item = Pixel> + '_ {
    let config = camera.config();
    let disturbed = &config.disturbances;
    let unlit = disturbed.saturated_rows.contains(&row) || disturbed.black_rows.contains(&row);
    let cols = if unlit { 0..0 } else { cols };
    let (y, first) = (camera.texture_row(row), cols.start);
    let cols = cols.start as usize..cols.end as usize;
    let levels = camera.texture().row(y, cols.clone(), 0.0);
    let right = camera.texture().slope(y, cols.clone());
    let down = camera.texture().slope_down(y, cols);
    let white = config.sensor.white_dn();
    let (all, rows) = (config.sensor.cols as usize, config.sensor.rows as usize);
    let uneven = config.light.at_place(all, row as usize, rows);
    let hot: Vec<u32> = camera.pattern().hot(row).collect();
    let slopes = right.into_iter().zip(down);
    (first..)
        .zip(levels.into_iter().zip(slopes))
        .filter_map(move |(x, (level, (right, down)))| {
            let light = uneven.as_ref().map_or(1.0, |f| f(x as usize));
            let level = light as f32 * level;
            let blind = level >= 1.0 || disturbed.dead_cols.contains(&x) || hot.contains(&x);
            (!blind).then(|| Pixel {
                right_dn: f64::from(right) * light * white,
                down_dn: f64::from(down) * light * white,
                variance_dn2: camera.pixels().variance_dn2(level),
            })
        })
}

/// Fisher information of some columns of a row about the displacement along both axes, 1/px²: of
/// u, of v, and what they share (motion on both axes, as in a 2x2 matrix).
pub fn information_of_both(camera: &Camera, row: u32, cols: Range<u32>) -> [f64; 3] {
    let mut both = [0.0; 3];
    for pixel in pixels(camera, row, cols) {
        let Pixel {
            right_dn,
            down_dn,
            variance_dn2,
        } = pixel;
        both[0] += right_dn * right_dn / variance_dn2;
        both[1] += down_dn * down_dn / variance_dn2;
        both[2] += right_dn * down_dn / variance_dn2;
    }
    both
}

/// Least standard deviation of u and of v that any estimator of both can reach from one row, px;
/// `None` for an axis of which the row tells nothing by itself.
pub fn row_bounds_of_both_px(camera: &Camera, row: u32) -> [Option<f64>; 2] {
    let Some(cols) = camera.config().moving_cols(row) else {
        return [None; 2];
    };
    let [uu, vv, uv] = information_of_both(camera, row, cols);
    let left = |own: f64, other: f64| own - if other > 0.0 { uv * uv / other } else { 0.0 };
    [left(uu, vv), left(vv, uu)]
        .map(|information| (information > 1e-4).then(|| 1.0 / information.sqrt()))
}

/// Median over the rows of [`row_bounds_of_both_px`], px; `None` for an axis of which less than half
/// of the rows tell something.
pub fn medians_of_both_px(camera: &Camera) -> [Option<f64>; 2] {
    let rows = camera.config().sensor.rows;
    let bounds: Vec<_> = (0..rows)
        .map(|row| row_bounds_of_both_px(camera, row))
        .collect();
    [0, 1].map(|axis| {
        let mut known: Vec<f64> = bounds.iter().map(|b| b[axis].unwrap_or(f64::MAX)).collect();
        known.sort_by(f64::total_cmp);
        known
            .get(known.len() / 2)
            .copied()
            .filter(|&px| px < f64::MAX)
    })
}

/// The bounds in short; `None` when no row knows anything.
pub fn stats(bounds: &[Option<f64>]) -> Option<CrlbStats> {
    let mut known: Vec<f64> = bounds.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    let at = |share: f64| {
        known
            .get(((known.len() as f64 - 1.0).max(0.0) * share).round() as usize)
            .copied()
    };
    Some(CrlbStats {
        median_px: at(0.5)?,
        p10_px: at(0.1)?,
        p90_px: at(0.9)?,
        best_px: at(0.0)?,
        worst_px: at(1.0)?,
        blind_rows: (bounds.len() - known.len()) as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, Scene};

    /// Fisher information from its definition: how fast the distribution of the pixels changes with
    /// d, by a numerical derivative of the means over a finite shift.
    #[test]
    fn the_bound_is_the_curvature_of_the_likelihood() {
        for scene in [
            Scene::Speckle { grain_px: 2.0 },
            Scene::Bar { width_px: 30.0 },
            Scene::Photo { sky: 0.2 },
        ] {
            let mut config = Config {
                scene,
                background_cols: 9,
                ..Config::default()
            };
            (config.sensor.rows, config.disturbances.dead_cols) = (12, vec![50]);
            let camera = Camera::new(config).expect("good");
            for row in 4..12 {
                let at = |d| camera.texture().row(row, 9..128, d);
                let (left, here, right) = (at(-1e-2), at(0.0), at(1e-2));
                let mut information = 0.0;
                for x in (0..119).filter(|x| x + 9 != 50) {
                    let slope = 255.0 * f64::from(left[x] - right[x]) / 2e-2;
                    let e_per_dn = 9600.0 / 255.0;
                    let mean_dn = 255.0 * f64::from(here[x]);
                    let var = mean_dn / e_per_dn + (20.0 / e_per_dn).powi(2) + 1.0 / 12.0;
                    information += slope * slope / var;
                }
                let want = 1.0 / information.sqrt();
                let got = row_bound_px(&camera, row as u32).expect("textured");
                assert!((got / want - 1.0).abs() < 1e-3, "{got} {want}");
            }
        }
    }

    #[test]
    fn rows_without_texture_know_nothing() {
        let mut config = Config {
            scene: Scene::Photo { sky: 0.5 },
            ..Config::default()
        };
        config.disturbances.black_rows = vec![290];
        let camera = Camera::new(config).expect("good");
        let bounds = row_bounds_px(&camera);
        assert!(bounds[..130].iter().all(Option::is_none) && bounds[290].is_none());
        assert!(bounds[170..290].iter().all(Option::is_some));
        let stats = stats(&bounds).expect("half of it is land");
        assert!(
            stats.blind_rows > 130
                && stats.best_px < stats.median_px
                && stats.median_px < stats.worst_px
        );
        assert_eq!(super::stats(&[None, None]), None);
    }
}
