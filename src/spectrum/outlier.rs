//! Single samples far off all others: a lost lock is no noise.
//!
//! One sample of 5 px among thousands that are known to 0.02 px lifts the noise at all frequencies. What is
//! beyond five standard deviations (told by the median, which outliers do not move) is left out where the
//! same rows of the frames before and after are not: a blow stays for more than a frame. Each axis is judged by its own
//! median: a swing along x is no outlier because nothing moves along y.

use core::ops::Range;

use super::model::Samples;
use super::parameters::Model;
use super::window::unpack_weight;

/// Beyond so many standard deviations: one of two million samples of Gaussian noise.
const FAR: f32 = 5.0;

/// The median of a Gaussian's sizes, in standard deviations.
const MEDIAN: f32 = 0.6745;

/// Where more than this share of the samples is far off they are no outliers.
const MOST: f32 = 0.05;

/// Rounds: what is left out no longer pulls at its series' mean.
const ROUNDS: u32 = 2;

/// Leaves the samples out that are far off what `model` says, with `sizes` as working memory; gives how many.
pub(crate) fn leave_out(samples: &mut Samples<'_>, model: &Model, sizes: &mut [f32]) -> u32 {
    let mut left_out = 0;
    for channel in 0..samples.channels {
        let series = channel * samples.slots..(channel + 1) * samples.slots;
        for _ in 0..ROUNDS {
            model.tabulate(samples);
            let Some((limit, count)) = limit(samples, model, sizes, series.clone()) else {
                break;
            };
            let found = sweep(samples, model, limit, (series.clone(), false));
            if found == 0 || found as f32 > MOST * count as f32 {
                break;
            }
            sweep(samples, model, limit, (series.clone(), true));
            left_out += found;
        }
    }
    left_out
}

/// The size that a sample's residual over its deviation has at most, if it is no outlier, and how many samples these
/// series have.
fn limit(
    samples: &mut Samples<'_>,
    model: &Model,
    sizes: &mut [f32],
    of: Range<usize>,
) -> Option<(f32, u32)> {
    let (n, mut used, mut count) = (samples.frames, 0, 0);
    // A few thousand tell the median as well.
    let every = (samples.count as usize / sizes.len().max(1)) + 1;
    for series in of {
        if samples.series_weight[series] <= 0.0 {
            continue;
        }
        samples.residual(series, &model.tones, &model.drift);
        let weights = samples.weight.get(series * n..(series + 1) * n);
        let known = |w: &&u16| **w > 0;
        count += weights.unwrap_or_default().iter().filter(known).count() as u32;
        for i in (series % every..n).step_by(every) {
            let w = unpack_weight(samples.weight[series * n + i]);
            if w > 0.0 && used < sizes.len() {
                sizes[used] = samples.row[i].abs() / crate::math::sqrtf(w);
                used += 1;
            }
        }
    }
    let sizes = sizes.get(..used).filter(|s| s.len() >= 32)?;
    let largest = sizes.iter().copied().fold(0.0, f32::max);
    let (mut low, mut high) = (0.0, largest);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let below = sizes.iter().filter(|&&s| s < middle).count();
        if 2 * below < used {
            low = middle;
        } else {
            high = middle;
        }
    }
    let limit = FAR * high / MEDIAN;
    (limit.is_finite() && limit > 0.0 && largest > limit).then_some((limit, count))
}

/// Counts the outliers and, if `leave`, leaves them out.
fn sweep(
    samples: &mut Samples<'_>,
    model: &Model,
    limit: f32,
    (of, leave): (Range<usize>, bool),
) -> u32 {
    let (n, mut found) = (samples.frames, 0);
    for series in of {
        if samples.series_weight[series] <= 0.0 {
            continue;
        }
        samples.residual(series, &model.tones, &model.drift);
        for i in 0..n {
            let far = |samples: &Samples<'_>, i: usize| {
                // Of one that is left out the residual is still in the row, so that those beside it are judged as they were.
                let w = unpack_weight(samples.weight[series * n + i]);
                samples.row[i].abs() > limit * crate::math::sqrtf(w)
            };
            let beside = i > 0 && far(samples, i - 1) || i + 1 < n && far(samples, i + 1);
            if !far(samples, i) || beside {
                continue;
            }
            found += 1;
            if leave {
                let w = unpack_weight(samples.weight[series * n + i]);
                samples.weight[series * n + i] = 0;
                samples.shift_px[series * n + i] = 0.0;
                samples.series_weight[series] = (samples.series_weight[series] - w).max(0.0);
                samples.frame_weight[i] = (samples.frame_weight[i] - w).max(0.0);
                samples.total_weight = (samples.total_weight - w).max(f32::MIN_POSITIVE);
                samples.count = samples.count.saturating_sub(1);
            }
        }
    }
    found
}
