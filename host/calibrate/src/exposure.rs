//! How long a row is exposed: the width of the dark-to-bright transition of the stripes.
//!
//! A light that is switched, averaged over the exposure, is a trapezoid: its ramps last as long as the exposure,
//! as long as that is shorter than both the bright and the dark part. All frames are folded by phase and a
//! trapezoid is fitted, bent by a tone curve: pictures are seldom linear in the light. From there a least-squares fit
//! of all rows (Gauss and Newton, damped) gives the width and its standard deviation.
//!
//! An exposure of E and an on-time of D make the same trapezoid as an exposure of D and an on-time of E: only what is
//! known of the light's duty cycle decides. Where the light never shows fully dark, nothing is said.

use super::fit::Fit;
use super::simplex::minimum;
use super::uncertainty;
use rowtone_linear::{Symmetric, median};

/// Bins that one period is folded into.
const BINS: usize = 512;

/// Exponents of the tone curve that are believed: a camera that writes linear values has 1.
const TONES: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// The duty cycle is known to this part of the shorter of on-time and off-time.
const DUTY_TOLERANCE: f64 = 0.1;
/// Where black is cut off, a dark row's mean is not known to better than this: rounding hides it.
const LEAST_CUT_OFF: f64 = 0.3;
/// Steps of the last fit.
const STEPS: usize = 12;
/// Half of what a parameter is moved by to see what it does.
const SMALL: f64 = 1e-5;

/// The transition between dark and bright, in periods of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Its width.
    pub periods: f64,
    /// Standard deviation of that.
    pub sd: f64,
    /// From half way up to half way down.
    pub bright: f64,
}

impl Ramp {
    /// The exposure under a light that is on for `duty` of its period.
    ///
    /// # Errors
    /// The two widths that are seen, one of them the exposure, where `duty` is neither: (ramp, bright or dark part).
    pub fn exposure(&self, duty: f64) -> Result<f64, (f64, f64)> {
        // What the light does for the shorter time, and how long that is in the picture.
        let (short, seen) = if duty <= 0.5 {
            (duty, self.bright)
        } else {
            (1.0 - duty, 1.0 - self.bright)
        };
        let is_short = |width: f64| (width - short).abs() <= DUTY_TOLERANCE * short;
        if is_short(seen) {
            Ok(self.periods)
        } else if is_short(self.periods) {
            Ok(seen)
        } else {
            Err((self.periods, seen))
        }
    }
}

/// Phase of the rise, duty, width of the ramps, and the tone curve 1 − (1 − xᵃ)ᵇ: its a and b.
type Shape = [f64; 5];

/// Mean and count of the values in a bin.
type Bins = [(f64, f64)];

/// Fits the trapezoid; `None` where it does not determine the exposure.
///
/// With b fixed at 1 (a power law) and with both exponents free; the two widths differ by what the unknown tone curve
/// is good for, and that goes into the standard deviation. So does what lies between the dark rows and `black`, the value
/// that pixels were cut off at: noise that is cut off makes dark rows brighter than they are, and ramps shorter.
pub fn ramp(rows: &[Vec<f64>], fit: &Fit, black: Option<f64>) -> Option<Ramp> {
    let bins = fold(rows, fit);
    let start = first_guess(&bins);
    let [power, free] = [0.0, 5.0].map(|b| {
        let shape = fit_shape(&bins, fit, start, b)?;
        refined(rows, fit, &bins, shape, b > 0.0)
    });
    let ((power, _), (free, levels)) = (power?, free?);
    let periods = 0.5 * (power.periods + free.periods);
    let (dark, bright) = unnormalised(fit, levels);
    let cut_off = black.map_or(0.0, |black| {
        (dark - black).max(LEAST_CUT_OFF) / (bright - dark)
    });
    Some(Ramp {
        periods,
        sd: power
            .sd
            .max(free.sd)
            .hypot(0.5 * (power.periods - free.periods))
            .hypot(cut_off * periods),
        bright: free.bright,
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
fn fit_shape(bins: &Bins, fit: &Fit, start: Shape, shoulder: f64) -> Option<Shape> {
    let cost = |p: &Shape| trapezoid_cost(bins, p).0;
    let mut found = start;
    // A simplex may flatten out on the way; started again it does not.
    for size in [0.03, 0.01, 0.003] {
        let sides = [1.0, 1.0, 1.0, 5.0, shoulder].map(|s| s * size);
        found = minimum(cost, found, sides);
    }
    let [_, duty, width, _, _] = found;
    let levels = trapezoid_cost(bins, &found).1;
    if !(0.0..1.0).contains(&duty) || width <= 0.0 {
        return None;
    }
    // Ramps as long as the on-time or the off-time: which is the exposure cannot be told.
    if width > 0.8 * duty.min(1.0 - duty) || levels[1] <= levels[0] {
        return None;
    }
    // The dark part must be dark: otherwise other light, or an exposure of more than a period, is in the picture.
    let (dark, bright) = unnormalised(fit, levels);
    (dark <= 0.3 * bright).then_some(found)
}

/// A row of a frame, for the last fit.
struct Cell {
    frame: usize,
    row: usize,
    phase: f64,
    value: f64,
    offset: f64,
    gain: f64,
}

/// Shape, level of the dark part and height of the bright one over it: all that the last fit changes.
type All = [f64; 7];

/// The least-squares fit of all rows themselves, from `shape`; b of the tone curve only where it is `free`.
fn refined(
    rows: &[Vec<f64>],
    fit: &Fit,
    bins: &Bins,
    shape: Shape,
    free: bool,
) -> Option<(Ramp, [f64; 2])> {
    let cells: Vec<Cell> = cells(rows, fit).collect();
    let levels = trapezoid_cost(bins, &shape).1;
    let [phase, duty, width, tone, shoulder] = shape;
    let start = [
        phase,
        duty,
        width,
        tone,
        shoulder,
        levels[0],
        levels[1] - levels[0],
    ];
    let moves: &[usize] = if free {
        &[0, 1, 2, 3, 4, 5, 6]
    } else {
        &[0, 1, 2, 3, 5, 6]
    };
    let at = |p: &All, cell: &Cell| {
        let x = trapezoid((cell.phase - p[0]).rem_euclid(1.0), p[1], p[2]);
        cell.offset + cell.gain * (p[5] + p[6] * bent(x, p[3], p[4]))
    };
    let rss = |p: &All| -> f64 { cells.iter().map(|c| (c.value - at(p, c)).powi(2)).sum() };
    let slopes = |p: &All, cell: &Cell| -> Vec<f64> {
        let slope = |&k: &usize| {
            let side = |by: f64| {
                let mut near = *p;
                near[k] += by;
                at(&near, cell)
            };
            (side(SMALL) - side(-SMALL)) / (2.0 * SMALL)
        };
        moves.iter().map(slope).collect()
    };
    let normal = |p: &All| {
        let mut normal = Symmetric::zeros(moves.len());
        let mut right = vec![0.0; moves.len()];
        for cell in &cells {
            let line = slopes(p, cell);
            let residual = cell.value - at(p, cell);
            normal.add_outer(&line, 1.0);
            right
                .iter_mut()
                .zip(&line)
                .for_each(|(r, s)| *r += s * residual);
        }
        (normal, right)
    };
    let (mut found, mut least) = (start, rss(&start));
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let (equations, right) = normal(&found);
        let mut damped = equations.clone();
        for k in 0..moves.len() {
            damped.add(k, k, damping * equations.at(k, k) + f64::MIN_POSITIVE);
        }
        let step = damped.factor()?.solve(&right);
        let mut next = found;
        moves.iter().zip(&step).for_each(|(&k, by)| next[k] += by);
        let possible = next[1] > 0.0
            && next[1] < 1.0
            && next[2] > 0.0
            && TONES.contains(&next[3])
            && TONES.contains(&next[4]);
        let next_rss = if possible { rss(&next) } else { f64::INFINITY };
        if next_rss < least {
            let gained = (least - next_rss) / least;
            (found, least) = (next, next_rss);
            damping *= 0.1;
            if gained < 1e-9 {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    let column = normal(&found).0.factor()?.inverse_column(2);
    let height = fit.gain.len();
    let [mut influence, mut residual] =
        [(); 2].map(|()| vec![vec![0.0; height]; fit.residual.len()]);
    for cell in &cells {
        let left = cell.value - at(&found, cell);
        let weight: f64 = column
            .iter()
            .zip(slopes(&found, cell))
            .map(|(a, b)| a * b)
            .sum();
        residual[cell.frame][cell.row] = left;
        influence[cell.frame][cell.row] = weight * left;
    }
    let ramp = Ramp {
        periods: found[2],
        sd: uncertainty::variance(&influence, &residual).max(0.0).sqrt(),
        bright: found[1],
    };
    Some((ramp, [found[5], found[5] + found[6]]))
}

/// What the last fit uses: rows that are lit, and not left out.
fn cells<'a>(rows: &'a [Vec<f64>], fit: &'a Fit) -> impl Iterator<Item = Cell> + 'a {
    let centre = 0.5 * (fit.gain.len() as f64 - 1.0);
    let typical = median(&fit.gain);
    let frames = rows.iter().enumerate().take(fit.residual.len());
    let all = frames.flat_map(|(n, frame)| frame.iter().enumerate().map(move |(y, v)| (n, y, *v)));
    all.filter_map(move |(n, y, value)| {
        let gain = fit.gain[y];
        let lit = !gain.is_nan() && gain >= 0.2 * typical && fit.residual[n][y] != 0.0;
        lit.then(|| Cell {
            frame: n,
            row: y,
            phase: (fit.model.per_row * (y as f64 - centre) + fit.model.phases[n]).rem_euclid(1.0),
            value,
            offset: fit.offset[y],
            gain,
        })
    })
}

/// Normalised light against phase: (mean, count) of every bin.
fn fold(rows: &[Vec<f64>], fit: &Fit) -> Vec<(f64, f64)> {
    let mut bins = vec![(0.0, 0.0); BINS];
    for cell in cells(rows, fit) {
        let bin = &mut bins[((cell.phase * BINS as f64) as usize).min(BINS - 1)];
        bin.0 += (cell.value - cell.offset) / cell.gain;
        bin.1 += 1.0;
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

#[cfg(test)]
mod tests {
    use super::Ramp;

    /// An exposure of 0.2 under a light that is on for 0.1 of the period, and one of 0.1 under 0.2: the same picture.
    #[test]
    fn only_the_duty_cycle_tells_exposure_and_on_time_apart() {
        let seen = |periods, bright| Ramp {
            periods,
            sd: 1e-3,
            bright,
        };
        assert_eq!(seen(0.1, 0.2).exposure(0.1), Ok(0.2));
        assert_eq!(seen(0.1, 0.2).exposure(0.2), Ok(0.1));
        assert_eq!(seen(0.1, 0.2).exposure(0.5), Err((0.1, 0.2)));
        assert_eq!(seen(0.1, 0.48).exposure(0.5), Ok(0.1));
        assert_eq!(seen(0.1, 0.53).exposure(0.5), Ok(0.1));
        // On for most of the period: its dark part shows.
        assert_eq!(seen(0.1, 0.8).exposure(0.8), Ok(0.1));
        let long = seen(0.2, 0.7).exposure(0.8).unwrap();
        assert!((long - 0.3).abs() < 1e-12);
    }
}
