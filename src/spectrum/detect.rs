//! Where in the residual a further tone may be: a periodogram on an even grid.
//!
//! The weighted residual is spread on the grid (two points a sample, linearly), transformed, and each bin is
//! compared by the energy that a tone there would have left after the projection: divided by the kernel of the
//! spreading and by c(f). This only proposes; whether a tone is there is decided by the joint fit with exact times.

use super::fit::Model;
use super::fourier::energies;
use super::model::Samples;
use super::phase::Frequency;
use super::storage::MAX_GRID;
use crate::math::{cos_sin, sin};

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

/// The grid: `step_s` between points, `points` a power of two.
#[derive(Clone, Copy, Debug)]
struct Grid {
    points: usize,
    step_s: f32,
}

impl Grid {
    fn over(length_s: f32, highest_hz: f32, most: usize) -> Self {
        let wanted = 1.5 * length_s * highest_hz / 0.36;
        let mut points = 64;
        while points * 2 <= most.min(MAX_GRID) && (points as f32) < wanted {
            points *= 2;
        }
        Self {
            points,
            step_s: (0.36 / highest_hz).max(1.1 * length_s / points as f32),
        }
    }

    fn bin_hz(&self) -> f32 {
        1.0 / (self.points as f32 * self.step_s)
    }

    /// What the linear spreading leaves of a tone's energy.
    fn kernel(&self, hz: f32) -> f32 {
        let x = core::f32::consts::PI * hz * self.step_s;
        if x < 1e-3 {
            return 1.0;
        }
        let sinc = sin(x) / x;
        (sinc * sinc) * (sinc * sinc)
    }
}

/// What is searched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    pub(crate) lowest_hz: f32,
    pub(crate) highest_hz: f32,
    /// Frame rate, where the window has a single one.
    pub(crate) fps: Option<f32>,
}

/// The largest peaks of the residual that are not `barred`, the largest first. Below the band they are given too: they may
/// have ghosts in it.
pub(crate) fn candidates(
    samples: &mut Samples<'_>,
    model: &Model,
    grid: &mut [f32],
    band: Band,
    barred: impl Fn(Candidate) -> bool,
) -> heapless::Vec<Candidate, CANDIDATES> {
    let mut found = heapless::Vec::new();
    let g = Grid::over(samples.length_s, band.highest_hz, grid.len());
    let Some(points) = grid.get_mut(..g.points) else {
        return found;
    };
    model.tabulate(samples);
    for axis in 0..samples.axes {
        let information = spread(samples, model, points, g, axis);
        if information > 0.0 {
            let scale = 2.0 / information;
            along(
                samples,
                points,
                (g, band),
                (axis, scale),
                &barred,
                &mut found,
            );
        }
    }
    found
}

/// The same along one axis, of the `points` of the grid; `scale`: what makes a gain of an energy.
fn along(
    samples: &Samples<'_>,
    points: &mut [f32],
    (g, band): (Grid, Band),
    (axis, scale): (usize, f32),
    barred: impl Fn(Candidate) -> bool,
    found: &mut heapless::Vec<Candidate, CANDIDATES>,
) {
    let Some(bins) = energies(points) else {
        return;
    };
    let bin_hz = g.bin_hz();
    let first = 1;
    let last = ((band.highest_hz / bin_hz) as usize).min(bins.len().saturating_sub(2));
    if first > last {
        return;
    }
    let (mut here, mut after) = (bins[first - 1], bins[first]);
    // No peak lower than this can be a candidate any more: the kernel only falls with frequency, and a parabola's
    // vertex is at most an eighth above its highest point.
    let mut too_low = 0.0;
    let most = 1.125 * scale / g.kernel(last as f32 * bin_hz);
    let near_bins = band.fps.map(|fps| {
        let reach = NEAR_MULTIPLE / samples.length_s + bin_hz;
        (bin_hz / fps, reach / fps)
    });
    for b in first..=last {
        let before = here;
        here = after;
        after = bins[b + 1];
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
        let mut gain = scale * height / g.kernel(hz);
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
            axis,
            frequency: Frequency::from_hz(b as f32 * bin_hz).plus(shift * bin_hz),
            gain,
        };
        if !barred(candidate) {
            insert(found, candidate);
        }
        if found.is_full() {
            too_low = found.last().map_or(0.0, |c| c.gain / most);
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

/// Spreads the scores along x, or what those along y hold beside them, on the grid; gives their information.
fn spread(
    samples: &mut Samples<'_>,
    model: &Model,
    points: &mut [f32],
    g: Grid,
    axis: usize,
) -> f32 {
    let [xx, xy, yy] = samples.information();
    if xx <= 0.0 && axis == 0 {
        return 0.0;
    }
    let mean = if xx > 0.0 { xy / xx } else { 0.0 };
    points.fill(0.0);
    let scale = samples.length_s / g.step_s;
    let middle = 0.5 * g.points as f32;
    let last = g.points - 2;
    for series in 0..samples.series() {
        let sight = samples.sight(series);
        let share = match axis {
            0 => sight.of_drift(0),
            _ => sight.of_drift(1) - mean * sight.of_drift(0),
        };
        if samples.series_weight[series] <= 0.0 || share == 0.0 {
            continue;
        }
        let slot = series % samples.slots;
        samples.residual(series, &model.tones, &model.drift);
        let t = samples.slot_t[slot];
        for (&x, &frame_t) in samples
            .row
            .iter()
            .zip(samples.frame_t.iter())
            .take(samples.frames)
        {
            let at = (frame_t + t) * scale + middle;
            let cell = (at as usize).min(last);
            let further = (at - cell as f32).clamp(0.0, 1.0);
            let x = share * x;
            points[cell] += x * (1.0 - further);
            points[cell + 1] += x * further;
        }
    }
    if axis == 0 { xx } else { yy - mean * xy }
}
