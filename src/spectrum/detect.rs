//! Where in the residual a further tone may be: the largest peaks of its periodogram.
//!
//! Each is compared by the energy that a tone there would have left after the projection: divided by c(f).
//! This only proposes; whether a tone is there is decided by the joint fit with exact times.

use super::model::Samples;
use super::periodogram::Periodogram;
use super::phase::Frequency;
use crate::math::cos_sin;

/// Candidates of one search.
pub(crate) const CANDIDATES: usize = 4;

/// Where less than this share of a tone is left after the projection, noise is not divided by it; such a tone shows
/// beside the multiple of the frame rate that hides it.
const LEAST_KEPT: f32 = 0.03;

/// Nearer than this many 1/T to a multiple of the frame rate, what the projection leaves is looked at.
const NEAR_MULTIPLE: f32 = 1.2;

/// Where a tone may be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Along x, 0, or along y, 1.
    pub(crate) axis: usize,
    pub(crate) frequency: Frequency,
    /// About by how much it would lower the weighted sum of squares.
    pub(crate) gain: f32,
}

/// Candidates, the largest first.
pub(crate) type Candidates = heapless::Vec<Candidate, CANDIDATES>;

/// Adds to `found` the largest peaks of the residual along one axis that are not `barred`. Below the band they are given
/// too: they may have ghosts in it.
pub(crate) fn candidates(
    samples: &Samples<'_>,
    p: &Periodogram<'_>,
    found: &mut Candidates,
    barred: impl Fn(Candidate) -> bool,
) {
    let (bin_hz, band) = (p.bin_hz, p.band);
    let first = 1;
    let last = ((band.highest_hz / bin_hz) as usize).min(p.z.len().saturating_sub(2));
    if first > last {
        return;
    }
    let (mut here, mut after) = (p.z[first - 1], p.z[first]);
    // No peak lower than this can be a candidate any more: a parabola's vertex is at most an eighth above its highest
    // point.
    let mut too_low = 0.0;
    let near_bins = band.fps.map(|fps| {
        let reach = NEAR_MULTIPLE / samples.length_s + bin_hz;
        (bin_hz / fps, reach / fps)
    });
    for b in first..=last {
        let before = here;
        here = after;
        after = p.z[b + 1];
        // Written so that a NaN is no peak.
        if !(here > before && here >= after) {
            continue;
        }
        let may_be_near = near_bins.is_some_and(|(turns, reach)| {
            let at = b as f32 * turns;
            (at - (at + 0.5) as i32 as f32).abs() < reach
        });
        if here < too_low * if may_be_near { LEAST_KEPT } else { 1.0 } {
            continue;
        }
        let (shift, height) = parabola(before, here, after);
        let hz = (b as f32 + shift) * bin_hz;
        let mut gain = 2.0 * height;
        let least = found.last().map_or(0.0, |c: &Candidate| c.gain);
        let near = band.fps.is_some_and(|fps| {
            let away = hz - fps * libm::roundf(hz / fps);
            away.abs() * samples.length_s < NEAR_MULTIPLE
        });
        if near {
            if found.is_full() && gain < least * LEAST_KEPT {
                continue;
            }
            let kept = kept_at(samples, hz);
            if kept < LEAST_KEPT {
                continue;
            }
            gain /= kept;
        }
        let candidate = Candidate {
            axis: p.axis,
            frequency: Frequency::from_hz(b as f32 * bin_hz).plus(shift * bin_hz),
            gain,
        };
        if !barred(candidate) {
            insert(found, candidate);
        }
        if found.is_full() {
            too_low = found.last().map_or(0.0, |c| c.gain / (2.0 * 1.125));
        }
    }
}

/// Share of a tone's energy left after the projection, from the frames' own times.
pub(crate) fn kept_at(samples: &Samples<'_>, hz: f32) -> f32 {
    let frequency = Frequency::from_hz(hz);
    let (mut re, mut im) = (0.0, 0.0);
    for (&ns, &w) in samples
        .frame_ns
        .iter()
        .zip(samples.frame_weight.iter())
        .take(samples.frames)
    {
        let (c, s) = cos_sin(frequency.phase(ns));
        re += w * c;
        im += w * s;
    }
    let total = samples.total_weight * samples.total_weight;
    (1.0 - (re * re + im * im) / total).clamp(0.0, 1.0)
}

fn insert(found: &mut heapless::Vec<Candidate, CANDIDATES>, candidate: Candidate) {
    if found.is_full() {
        if found.last().is_some_and(|c| c.gain >= candidate.gain) {
            return;
        }
        found.pop();
    }
    let place = found
        .iter()
        .position(|c| c.gain < candidate.gain)
        .unwrap_or(found.len());
    // There is room: the list was shortened above.
    let _ = found.insert(place, candidate);
}

/// Vertex of the parabola through three heights one apart, and its height.
fn parabola(before: f32, here: f32, after: f32) -> (f32, f32) {
    let bend = before - 2.0 * here + after;
    if bend >= 0.0 {
        return (0.0, here);
    }
    let shift = (0.5 * (before - after) / bend).clamp(-0.5, 0.5);
    (shift, here - 0.25 * (before - after) * shift)
}
