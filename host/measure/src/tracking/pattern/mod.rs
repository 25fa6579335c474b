//! The sensor's fixed pattern, told from texture by the motion.
//!
//! No two pixels of a sensor have quite the same gain and offset (EMVA 1288: PRNU, DSNU; some 0.5 to 1 % of gain). In the
//! reference that looks like texture, but it does not move with the picture: a line that has moved by u differs from
//! its reference by −u·s', s being the surface alone, while the reference's slope is r' = s' + n' with the
//! pattern n. Least squares with r' find κ·u with κ = Σ s'²/Σ r'²: on a surface of little contrast half of the motion.
//!
//! s' is seen where the motion is: the regression of each pixel on the shifts of the frames is −α·s', whatever
//! the scale α of the shifts. For these the rows beside are asked, whose pattern and noise are their own.
//! A fit of r' (along both axes, with a gradient of the amplitude along the row: a part that turns) to α·s' leaves
//! Σ α²·s'²·(1 − κ) over, beyond the noise of the regression, and explains κ times Σ α²·s'². From both follows the
//! pattern's variance n² = κ·left/Σ f², f being the filter that was fitted: what is taken for texture. (With one shape this
//! is exact, whatever the spectra: Σ r'² = Σ s'² + n²·Σ f².)
//!
//! Rows are asked one by one, and their weighted median counts: an edge between two parts, a hot pixel or a
//! hand spoil some.

mod line;
mod reference;
mod sums;

use std::ops::Range;

use rowtone::tracker::Tracker;
use rowtone_clip::Rect;

use self::reference::{EDGE, Reference};
use self::sums::Sums;
use super::codec::distinct;
use super::region::Picture;

/// Rows that are asked, and as how many each time.
const ROWS: usize = 64;
const TOGETHER: usize = 4;
/// Pixels that are looked at, of all frames together: fewer rows of many large frames are asked.
const PIXELS: usize = 4 << 20;
/// Columns within which light and motion vary no more than linearly.
const BLOCK: usize = 64;
/// Fewer frames tell no noise.
const LEAST_FRAMES: usize = 12;
/// Fewer rows have no median of their groups.
const LEAST_ROWS: usize = 4 * TOGETHER;
/// What must stand out by so many standard deviations: of 1000 sensors without a pattern six are given a small one.
const SURE: f64 = 2.5;
/// Less than this share is no more than what smooths the reference and not the lines: 0.03 in pictures of an ideal sensor.
const LEAST: f64 = 0.04;
/// A pattern beyond so many times the noise's variance leaves nothing to measure.
const MOST: f64 = 30.0;

/// The central difference of tenth order, right half (Fornberg 1988, table 1), and its power: Σ f².
const SLOPE: [f64; 5] = [
    5.0 / 6.0,
    -5.0 / 21.0,
    5.0 / 84.0,
    -5.0 / 504.0,
    1.0 / 1260.0,
];
const SLOPE_POWER: f64 = 1.509_552;

/// The pattern's variance as a share of the pixels' noise; `None` where none stands out. `frames` begin with those that
/// the tracker's reference was learned from, `rows` of the `part` those that it knows.
pub(super) fn share<P: Picture>(
    frames: &[P],
    part: &Rect,
    rows: Range<usize>,
    tracker: &Tracker<'_>,
) -> Option<f32> {
    let frames = distinct(frames, part);
    let inner = rows.start + EDGE..rows.end.saturating_sub(EDGE);
    if frames.len() < LEAST_FRAMES || part.width < BLOCK || inner.len() < LEAST_ROWS {
        return None;
    }
    let rows = (PIXELS / (frames.len() * part.width)).clamp(LEAST_ROWS, ROWS);
    let rows: Vec<usize> = inner.clone().step_by(inner.len().div_ceil(rows)).collect();
    let groups = rows.chunks(TOGETHER).flat_map(|rows| {
        let mut sums = [Sums::default(), Sums::default()];
        for &row in rows {
            if let Some(reference) = Reference::around(tracker, row) {
                reference.patterns(&frames, part, row, &mut sums);
            }
        }
        sums.map(|sums| sums.told())
    });
    settle(groups.flatten().collect()).map(|share| share as f32)
}

/// What a group of rows tells: the share, and how sure it is (1/variance).
#[derive(Clone, Copy, Debug)]
struct Told {
    share: f64,
    weight: f64,
}

/// The weighted median, where it stands out from 0.
fn settle(mut told: Vec<Told>) -> Option<f64> {
    if told.len() < LEAST_ROWS / TOGETHER {
        return None;
    }
    told.sort_by(|a, b| a.share.total_cmp(&b.share));
    let total: f64 = told.iter().map(|t| t.weight).sum();
    let below = |part: f64| {
        let mut sum = 0.0;
        let at = told.iter().find(|t| {
            sum += t.weight;
            sum >= part * total
        });
        at.map_or(0.0, |t| t.share)
    };
    let median = below(0.5);
    // Half of a normal distribution lies within 0.674 standard deviations; a median's is √(π/2) of a mean's.
    let spread = (below(0.75) - below(0.25)) / (2.0 * 0.674);
    let count = total.powi(2) / told.iter().map(|t| t.weight.powi(2)).sum::<f64>();
    let sd = 1.25 * (spread / count.sqrt()).max(total.sqrt().recip());
    (median > LEAST.max(SURE * sd)).then_some(median.min(MOST))
}

/// The blocks of a row: all but the columns at its ends whose slope is not known, in parts of about [`BLOCK`].
fn blocks(width: usize) -> impl Iterator<Item = Range<usize>> {
    let reach = SLOPE.len() + 1;
    let inner = width.saturating_sub(2 * reach);
    let count = (inner / BLOCK).max(1);
    (0..count).map(move |k| reach + k * inner / count..reach + (k + 1) * inner / count)
}

#[cfg(test)]
mod tests {
    use super::sums::{LIGHTS, SHAPES};
    use super::*;

    fn told(shares: &[f64]) -> Vec<Told> {
        let weight = 400.0;
        shares.iter().map(|&share| Told { share, weight }).collect()
    }

    #[test]
    fn what_most_rows_agree_on_is_the_pattern() {
        let agreed = [0.5, 0.45, 0.55, 0.52, 0.48, 0.5, 9.0, -4.0];
        let share = settle(told(&agreed)).expect("it stands out");
        assert!((share - 0.5).abs() < 0.05, "{share}");
    }

    #[test]
    fn noise_and_too_little_of_it_are_no_pattern() {
        assert_eq!(settle(told(&[0.1, -0.1, 0.05, -0.06, 0.02, -0.03])), None);
        assert_eq!(settle(told(&[0.5, 0.5, 0.5])), None);
        let smoothed = [0.03; 12];
        assert_eq!(settle(told(&smoothed)), None, "an ideal sensor's");
        let most = settle(told(&[1e6; 8]));
        assert_eq!(most, Some(MOST));
    }

    #[test]
    fn blocks_share_a_row_out_and_spare_its_ends() {
        for width in [64, 96, 128, 640, 1919] {
            let all: Vec<_> = blocks(width).collect();
            assert!(all.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(all[0].start > SLOPE.len() && all[all.len() - 1].end + SLOPE.len() < width);
            assert!(
                all.iter().all(|block| block.len() > LIGHTS + SHAPES),
                "{width}"
            );
        }
    }
}
