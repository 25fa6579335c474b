//! How long a row is exposed: the width of the dark-to-bright transition of the stripes.
//!
//! A light that is switched, averaged over the exposure, is a trapezoid: its ramps last as long as the exposure,
//! as long as that is shorter than both the bright and the dark part. All frames are folded by phase and a
//! trapezoid is fitted. Where the light never shows fully dark or fully bright the exposure cannot be told from
//! the light's own on-time, and nothing is said.

use super::fit::Fit;
use crate::linear::median;

/// Bins that one period is folded into.
const BINS: usize = 512;

/// Exposure in periods of the light, and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Width of the transition, periods.
    pub periods: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Share of the period in which the light is on.
    pub duty: f64,
}

/// Fits the trapezoid; `None` where it does not determine the exposure.
pub fn ramp(rows: &[Vec<f64>], fit: &Fit) -> Option<Ramp> {
    let bins = fold(rows, fit);
    let cost = |p: &[f64; 3]| trapezoid_cost(&bins, p).0;
    let mut best = ([0.0; 3], f64::INFINITY);
    for phase in 0..16 {
        for duty in [0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9] {
            for width in [0.02, 0.06, 0.15, 0.3, 0.45] {
                let p = [phase as f64 / 16.0, duty, width];
                let c = cost(&p);
                if c < best.1 {
                    best = (p, c);
                }
            }
        }
    }
    let found = nelder_mead(cost, best.0, [0.03, 0.05, 0.03]);
    let [_, duty, width] = found;
    let (rss, levels) = trapezoid_cost(&bins, &found);
    if !(0.0..1.0).contains(&duty) || width <= 0.0 {
        return None;
    }
    // Ramps as long as the on-time or the off-time: that is the light's width, not the exposure's.
    if width > 0.8 * duty.min(1.0 - duty) || levels[1] <= levels[0] {
        return None;
    }
    // The dark part must be dark: otherwise other light, or an exposure of more than a period, is in the picture.
    let (dark, bright) = unnormalised(fit, levels);
    if dark > 0.3 * bright {
        return None;
    }
    let used = bins.iter().filter(|b| b.1 > 0.0).count();
    let total: f64 = bins.iter().map(|b| b.1).sum();
    let noise = rss / (used.saturating_sub(5)).max(1) as f64;
    // Curvature of the cost along the width, the other parameters refitted.
    let step = (0.05 * width).max(2e-3);
    let along = |w: f64| {
        nelder_mead(
            |p| trapezoid_cost(&bins, &[p[0], p[1], w]).0,
            [found[0], found[1], w],
            [0.003, 0.003, 0.0],
        )
    };
    let refit = |w: f64| {
        let p = along(w);
        trapezoid_cost(&bins, &[p[0], p[1], w]).0
    };
    let bend = (refit(width + step) - 2.0 * rss + refit(width - step)) / (step * step);
    let sampling = fit.model.per_row / 12.0_f64.sqrt() / (total / BINS as f64).sqrt().max(1.0);
    if bend <= 0.0 {
        return None;
    }
    Some(Ramp {
        periods: width,
        sd: (2.0 * noise / bend).sqrt().hypot(sampling),
        duty,
    })
}

/// Normalised light against phase: (mean, count) of every bin.
fn fold(rows: &[Vec<f64>], fit: &Fit) -> Vec<(f64, f64)> {
    let centre = 0.5 * (fit.gain.len() as f64 - 1.0);
    let typical = median(&fit.gain);
    let mut bins = vec![(0.0, 0.0); BINS];
    for (n, frame) in rows.iter().enumerate().take(fit.residual.len()) {
        for (y, &value) in frame.iter().enumerate() {
            let gain = fit.gain[y];
            if gain.is_nan() || gain < 0.2 * typical || fit.residual[n][y] == 0.0 {
                continue;
            }
            let phase =
                (fit.model.per_row * (y as f64 - centre) + fit.model.phases[n]).rem_euclid(1.0);
            let bin = &mut bins[((phase * BINS as f64) as usize).min(BINS - 1)];
            bin.0 += (value - fit.offset[y]) / gain;
            bin.1 += 1.0;
        }
    }
    for bin in &mut bins {
        if bin.1 > 0.0 {
            bin.0 /= bin.1;
        }
    }
    bins
}

/// Levels of the trapezoid in units of the picture, at a typical row.
fn unnormalised(fit: &Fit, levels: [f64; 2]) -> (f64, f64) {
    let (offset, gain) = (median(&fit.offset), median(&fit.gain));
    (offset + gain * levels[0], offset + gain * levels[1])
}

/// Height of a trapezoid at `phase`: rises from 0 over `width` from phase 0, falls over `width` from `duty`.
fn trapezoid(phase: f64, duty: f64, width: f64) -> f64 {
    let ramp = |x: f64| {
        if width > 0.0 {
            (x / width).clamp(0.0, 1.0)
        } else {
            f64::from(x >= 0.0)
        }
    };
    // The rise of the next period may begin before the fall of this one has ended, and the other way round.
    ramp(phase) - ramp(phase - duty) + ramp(phase + 1.0) - ramp(phase + 1.0 - duty)
        + ramp(phase - 1.0)
        - ramp(phase - 1.0 - duty)
}

/// Weighted sum of squares of the best levels, and those levels (dark, bright).
fn trapezoid_cost(bins: &[(f64, f64)], &[phase, duty, width]: &[f64; 3]) -> (f64, [f64; 2]) {
    if !(0.0..=1.0).contains(&duty) || !(0.0..=1.0).contains(&width) {
        return (f64::INFINITY, [0.0, 0.0]);
    }
    let (mut n, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (i, &(value, weight)) in bins.iter().enumerate() {
        let x = trapezoid(
            ((i as f64 + 0.5) / BINS as f64 - phase).rem_euclid(1.0),
            duty,
            width,
        );
        n += weight;
        sx += weight * x;
        sy += weight * value;
        sxx += weight * x * x;
        sxy += weight * x * value;
        syy += weight * value * value;
    }
    let det = n * sxx - sx * sx;
    if det <= 1e-12 * n * n {
        return (f64::INFINITY, [0.0, 0.0]);
    }
    let slope = (n * sxy - sx * sy) / det;
    // Upside down, with the other duty cycle, the same shape would come out.
    if slope <= 0.0 {
        return (f64::INFINITY, [0.0, 0.0]);
    }
    let level = (sy - slope * sx) / n;
    (
        (syy - level * sy - slope * sxy).max(0.0),
        [level, level + slope],
    )
}

/// Nelder and Mead's simplex in three dimensions.
fn nelder_mead(cost: impl Fn(&[f64; 3]) -> f64, start: [f64; 3], size: [f64; 3]) -> [f64; 3] {
    let mut simplex: Vec<([f64; 3], f64)> = (0..4)
        .map(|i| {
            let mut p = start;
            if i > 0 {
                p[i - 1] += size[i - 1];
            }
            (p, cost(&p))
        })
        .collect();
    for _ in 0..160 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let worst = simplex[3];
        let centre: [f64; 3] =
            std::array::from_fn(|k| simplex[..3].iter().map(|s| s.0[k]).sum::<f64>() / 3.0);
        let at = |t: f64| {
            let p: [f64; 3] = std::array::from_fn(|k| centre[k] + t * (centre[k] - worst.0[k]));
            (p, cost(&p))
        };
        let reflected = at(1.0);
        let next = if reflected.1 < simplex[0].1 {
            let further = at(2.0);
            if further.1 < reflected.1 {
                further
            } else {
                reflected
            }
        } else if reflected.1 < simplex[2].1 {
            reflected
        } else {
            at(-0.5)
        };
        if next.1 < worst.1 {
            simplex[3] = next;
        } else {
            let best = simplex[0].0;
            for vertex in &mut simplex[1..] {
                let p: [f64; 3] = std::array::from_fn(|k| 0.5 * (vertex.0[k] + best[k]));
                *vertex = (p, cost(&p));
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}
