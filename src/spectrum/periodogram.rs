//! How much power the residual holds against frequency.
//!
//! The weighted residual is spread on an even grid (two points a sample, linearly) and transformed. A
//! place's power z is half of what a tone there would take off the weighted sum of squares, but for the
//! share c(f) that the removal of the slots' offsets leaves of it: white noise gives an exponential
//! distribution whose mean is the variance of a sample of average weight, a tone of amplitude A gives
//! A²N/4. There are one to three places in a cell, which is one over the window's length.

use super::fourier::{MAX_GRID, energies};
use super::model::Samples;
use super::parameters::Model;
use crate::math::sin;

/// What is searched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    pub(crate) lowest_hz: f32,
    pub(crate) highest_hz: f32,
    /// Frame rate, where the window has a single one.
    pub(crate) fps: Option<f32>,
}

impl Band {
    /// How far `hz` is from the nearest multiple of the frame rate, Hz; infinitely where there is no single one.
    pub(crate) fn away_from_multiple(&self, hz: f32) -> f32 {
        self.fps.map_or(f32::INFINITY, |fps| {
            (hz - fps * libm::roundf(hz / fps)).abs()
        })
    }
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

/// Where the places of a periodogram are, apart from the memory that holds them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    count: usize,
    bin_hz: f32,
    length_s: f32,
    band: Band,
    axis: usize,
}

impl Places {
    /// Fills `grid` with the periodogram of what `model` leaves of the samples along x, or of what those along y hold
    /// beside it; `None` where it is too small for a transform or nothing is known along that axis.
    pub(crate) fn fill(
        samples: &mut Samples<'_>,
        model: &Model,
        grid: &mut [f32],
        band: Band,
        axis: usize,
    ) -> Option<Self> {
        let g = Grid::over(samples.length_s, band.highest_hz, grid.len());
        let points = grid.get_mut(..g.points)?;
        model.tabulate(samples);
        let information = spread(samples, model, points, g, axis);
        if information <= 0.0 {
            return None;
        }
        energies(points)?;
        let bin_hz = g.bin_hz();
        let count = ((band.highest_hz / bin_hz) as usize + 2).min(g.points / 2);
        for (b, z) in points.iter_mut().enumerate().take(count) {
            *z /= information * g.kernel(b as f32 * bin_hz);
        }
        Some(Self {
            count,
            bin_hz,
            length_s: samples.length_s,
            band,
            axis,
        })
    }

    /// Along x or along y, 0 or 1.
    pub(crate) const fn axis(&self) -> usize {
        self.axis
    }

    /// What they hold.
    pub(crate) fn of<'g>(&self, grid: &'g [f32]) -> Option<Periodogram<'g>> {
        Some(Periodogram {
            z: grid.get(..self.count)?,
            bin_hz: self.bin_hz,
            length_s: self.length_s,
            band: self.band,
            axis: self.axis,
        })
    }
}

/// Power of the residual of a model against frequency.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Periodogram<'g> {
    /// z at multiples of `bin_hz`, px², not divided by c(f).
    pub(crate) z: &'g [f32],
    pub(crate) bin_hz: f32,
    /// Length of the window, s.
    pub(crate) length_s: f32,
    pub(crate) band: Band,
    /// 0 along x, 1 along y.
    pub(crate) axis: usize,
}

impl Periodogram<'_> {
    /// Places in a cell.
    pub(crate) fn places(&self) -> f32 {
        1.0 / (self.bin_hz * self.length_s)
    }

    /// The places from `low_hz` to `high_hz`, within what there is.
    pub(crate) fn between(&self, low_hz: f32, high_hz: f32) -> core::ops::Range<usize> {
        let last = self.z.len();
        let place = |hz: f32| ((hz.max(0.0) / self.bin_hz + 0.5) as usize).min(last);
        place(low_hz)..place(high_hz)
    }

    /// z at place `b` over c(f), or `None` where the removal of the offsets leaves too little to say.
    pub(crate) fn level(&self, b: usize) -> Option<f32> {
        let z = *self.z.get(b)?;
        let away = self.band.away_from_multiple(b as f32 * self.bin_hz) * self.length_s;
        if away >= 1.0 {
            return Some(z);
        }
        if away < HIDDEN {
            return None;
        }
        let x = core::f32::consts::PI * away;
        let sinc = sin(x) / x;
        Some(z / (1.0 - sinc * sinc))
    }

    /// So near a multiple of the frame rate that it is hidden in part.
    pub(crate) fn is_hidden(&self, hz: f32) -> bool {
        self.band.away_from_multiple(hz) * self.length_s < 1.2
    }

    /// The largest z of the places within half a cell of `hz`, of either sign.
    pub(crate) fn largest_near(&self, hz: f32) -> f32 {
        let reach = 0.5 / self.length_s;
        let near = self.between(hz.abs() - reach, hz.abs() + reach + self.bin_hz);
        near.filter_map(|b| self.z.get(b))
            .fold(0.0, |a, &z| a.max(z))
    }
}

/// Nearer than so many cells to a multiple of the frame rate less than two fifths of a tone's power are left.
const HIDDEN: f32 = 0.5;

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
