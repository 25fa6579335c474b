//! How long a row is exposed: the width of the dark-to-bright transition of the stripes.
//!
//! A light that is switched, averaged over the exposure, is a trapezoid: its ramps last as long as the exposure,
//! as long as that is shorter than both the bright and the dark part. All frames are folded by phase and a
//! trapezoid is fitted, bent by a tone curve: pictures are seldom linear in the light. Where the light never shows
//! fully dark or fully bright the exposure cannot be told from the light's own on-time, and nothing is said.

use super::fit::Fit;
use super::simplex::minimum;
use crate::linear::median;

/// Bins that one period is folded into.
const BINS: usize = 512;

/// Exponents of the tone curve that are believed: a camera that writes linear values has 1.
const TONES: std::ops::RangeInclusive<f64> = 0.4..=2.5;

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

/// Phase of the rise, duty, width of the ramps, and the tone curve 1 − (1 − xᵃ)ᵇ: its a and b.
type Shape = [f64; 5];

/// Mean and count of the values in a bin.
type Bins = [(f64, f64)];

/// Fits the trapezoid; `None` where it does not determine the exposure.
///
/// With b fixed at 1 (a power law) and with both exponents free; the two widths differ by what the unknown tone curve
/// is good for, and that goes into the standard deviation.
pub fn ramp(rows: &[Vec<f64>], fit: &Fit) -> Option<Ramp> {
    let bins = fold(rows, fit);
    let start = first_guess(&bins);
    let [power, free] = [0.0, 5.0].map(|b| fit_shape(&bins, fit, start, b));
    let (power, free) = (power?, free?);
    Some(Ramp {
        periods: 0.5 * (power.periods + free.periods),
        sd: power
            .sd
            .max(free.sd)
            .hypot(0.5 * (power.periods - free.periods)),
        duty: free.duty,
    })
}

/// The best of a grid, over coarse bins.
fn first_guess(bins: &Bins) -> Shape {
    let coarse: Vec<(f64, f64)> = bins
        .chunks(4)
        .map(|four| {
            let count: f64 = four.iter().map(|b| b.1).sum();
            let sum: f64 = four.iter().map(|b| b.0 * b.1).sum();
            (sum / count.max(1.0), count)
        })
        .collect();
    let mut best = ([0.0; 5], f64::INFINITY);
    for phase in 0..32 {
        for duty in 1..20 {
            for width in [0.01, 0.03, 0.06, 0.1, 0.15, 0.22, 0.3, 0.4] {
                let p = [
                    f64::from(phase) / 32.0,
                    f64::from(duty) / 20.0,
                    width,
                    1.0,
                    1.0,
                ];
                let c = trapezoid_cost(&coarse, &p).0;
                if c < best.1 {
                    best = (p, c);
                }
            }
        }
    }
    best.0
}

/// From `start`; `shoulder` is the simplex's size along b, in units of that along the phase.
fn fit_shape(bins: &Bins, fit: &Fit, start: Shape, shoulder: f64) -> Option<Ramp> {
    let cost = |p: &Shape| trapezoid_cost(bins, p).0;
    let mut found = start;
    // A simplex may flatten out on the way; started again it does not.
    for size in [0.03, 0.01, 0.003] {
        let sides = [1.0, 1.0, 1.0, 5.0, shoulder].map(|s| s * size);
        found = minimum(cost, found, sides);
    }
    let [_, duty, width, _, _] = found;
    let (rss, levels) = trapezoid_cost(bins, &found);
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
    let noise = rss / (used.saturating_sub(7)).max(1) as f64;
    // Curvature of the cost along the width, the other parameters refitted.
    let step = (0.05 * width).max(2e-3);
    let refit = |w: f64| {
        let at = |p: &Shape| cost(&[p[0], p[1], w, p[3], p[4]]);
        let mut p = [found[0], found[1], w, found[3], found[4]];
        for size in [0.003, 0.001] {
            p = minimum(
                at,
                p,
                [1.0, 1.0, 0.0, 10.0, 2.0 * shoulder].map(|s| s * size),
            );
        }
        at(&p)
    };
    let bend = (refit(width + step) - 2.0 * rss + refit(width - step)) / (step * step);
    let sampling = fit.model.per_row / 12.0_f64.sqrt() / (total / BINS as f64).sqrt().max(1.0);
    (bend > 0.0).then(|| Ramp {
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

/// The tone curve.
fn bent(x: f64, tone: f64, shoulder: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 || (tone, shoulder) == (1.0, 1.0) {
        return x.clamp(0.0, 1.0);
    }
    1.0 - (1.0 - x.powf(tone)).powf(shoulder)
}

/// Weighted sum of squares of the best levels, and those levels (dark, bright).
fn trapezoid_cost(bins: &Bins, &[phase, duty, width, tone, shoulder]: &Shape) -> (f64, [f64; 2]) {
    if !(0.0..=1.0).contains(&duty)
        || !(0.0..=1.0).contains(&width)
        || !TONES.contains(&tone)
        || !TONES.contains(&shoulder)
    {
        return (f64::INFINITY, [0.0, 0.0]);
    }
    let (mut n, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (i, &(value, weight)) in bins.iter().enumerate() {
        let place = (i as f64 + 0.5) / bins.len() as f64;
        let x = bent(
            trapezoid((place - phase).rem_euclid(1.0), duty, width),
            tone,
            shoulder,
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
