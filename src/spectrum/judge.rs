//! Whether a fitted tone stands out of the noise as it is, and not only out of white noise.
//!
//! All tests are against the residual after the fit. `fall` is how much a tone lowers the weighted sum of
//! squares; half of it compares with a periodogram's z.

use super::alarm;
use super::floor::{ALIKE, ALIKE_UNFITTED, Floor};
use super::images::Images;
use super::periodogram::Periodogram;
use crate::report::{FloorPoint, MAX_FLOOR};

/// Before a fit, what is less than so many times the floor is not tried.
const WORTH_A_FIT: f32 = 7.5;

/// Cells on either side of a peak, beyond its own, where a tone of that height has little.
const SIDE_LOBES: (f32, f32) = (1.5, 6.0);

/// Before a fit, what is less than so many times what images may be is not tried.
const OVER_IMAGES: f32 = 2.0;

/// Images are asked for where they may be more than so many times the floor.
const SEEN_IMAGES: f32 = 3.0;

/// A tone is so many times what images may be.
const SURE_OVER_IMAGES: f32 = 3.0;

/// Around a tone, cells on either side, and how many times the floor they must hold to count as it.
const AROUND: [(f32, f32); 2] = [(6.0, 2.27), (14.0, 1.72)];

/// Beside a tone, from and to how many cells from it other peaks of narrow noise are looked for.
const BESIDE: (f32, f32) = (0.75, 6.0);

/// Beyond so many cells a peak counts a tenth.
const NEAR: f32 = 3.0;

/// Another peak of so many times the quietest floor may be of narrow noise.
const NARROW_PEAK: f32 = 9.0;

/// So may places up to 2.75 cells away whose mean is so many times the quietest floor.
const NARROW_MEAN: (f32, f32) = (2.75, 2.6);

/// How a tone compares with the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It stands out.
    Tone,
    /// Noise is as high in more than one window of a thousand.
    Weak,
    /// It may be the image of what is elsewhere.
    Image,
    /// It may be a peak of noise that fills a few cells, or of its neighbours.
    Narrow,
}

/// What is known of a window's noise.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// As told apart after a fit.
    pub(crate) floor: Floor,
    /// As told apart before one.
    coarse: Floor,
    images: Images,
    /// RSS/ν of the model it was measured for, px².
    white: f32,
    freedom: f32,
}

impl Noise {
    /// Nothing measured yet: all zeros.
    pub(crate) const fn new() -> Self {
        Self {
            floor: Floor::new(),
            coarse: Floor::new(),
            images: Images::new(),
            white: 0.0,
            freedom: 0.0,
        }
    }

    /// How strong images are in this window.
    pub(crate) const fn images_mut(&mut self) -> &mut Images {
        &mut self.images
    }

    /// Measures the floor of a model's residual, whose weighted sum of squares and degrees of freedom are given.
    pub(crate) fn measure(&mut self, p: &Periodogram<'_>, squares: f32, freedom: f32) {
        self.freedom = freedom.max(1.0);
        self.white = squares / self.freedom;
        self.floor.measure(p);
        self.floor.merge(ALIKE);
        self.coarse.segments.clone_from(&self.floor.segments);
        self.coarse.merge(ALIKE_UNFITTED);
    }

    /// The same in place of what is not known: white.
    pub(crate) fn assume_white(&mut self, squares: f32, freedom: f32) {
        self.freedom = freedom.max(1.0);
        self.white = squares / self.freedom;
        self.floor.segments.clear();
        self.coarse.segments.clear();
    }

    /// One level for all frequencies, before a fit.
    pub(crate) fn is_white(&self) -> bool {
        self.floor.is_white()
    }

    /// A peak of so much power z at `hz` is worth a fit.
    pub(crate) fn is_worth_a_fit(&self, hz: f32, z: f32, p: &Periodogram<'_>) -> bool {
        let Some(segment) = self.coarse.at(hz) else {
            return true;
        };
        // A strong tone's own side lobes fill its band.
        let (around, _) = mean_around(p, hz, SIDE_LOBES);
        if z < WORTH_A_FIT * segment.level.min(around) {
            return false;
        }
        if p.is_hidden(hz) {
            return true;
        }
        let images = self.images.at(hz, p);
        images < segment.level || z > OVER_IMAGES * images
    }

    /// The floor from low to high frequency: amplitude densities, the square of which is z times `density`.
    pub(crate) fn points(
        &self,
        highest_hz: f32,
        density: f32,
    ) -> heapless::Vec<FloorPoint, MAX_FLOOR> {
        let point = |to_hz, level: f32| FloorPoint {
            to_hz,
            px_per_sqrt_hz: crate::math::sqrtf(level * density),
        };
        let mut points = heapless::Vec::new();
        if self.is_white() {
            let _ = points.push(point(highest_hz, self.white));
            return points;
        }
        for s in &self.floor.segments {
            let here = point(s.to_hz, s.level);
            // The highest segments share the last point where there are more.
            if points.push(here).is_err()
                && let Some(last) = points.last_mut()
            {
                *last = here;
            }
        }
        points
    }

    /// Root mean square of what the samples hold beyond the quietest part of the floor, px.
    pub(crate) fn other_px_rms(&self) -> f32 {
        if self.is_white() {
            return 0.0;
        }
        crate::math::sqrtf((self.white - self.floor.quietest()).max(0.0))
    }

    /// Level of its quietest part, px².
    pub(crate) fn quietest(&self) -> f32 {
        if self.is_white() {
            self.white
        } else {
            self.floor.quietest()
        }
    }

    /// What noise of the level at `hz` has there, and of how many cells that is known.
    fn level(&self, hz: f32, p: Option<&Periodogram<'_>>) -> (f32, f32) {
        let Some(segment) = self.floor.at(hz) else {
            return (self.white, 0.5 * self.freedom);
        };
        let (mut level, mut cells) = (segment.level, segment.cells);
        for (reach, times) in AROUND {
            let Some(p) = p else { break };
            let (mean, around) = mean_around(p, hz, (1.0, reach));
            if mean > times * segment.level && mean > level {
                (level, cells) = (mean, around);
            }
        }
        (level, cells)
    }

    /// The noise at `hz` as deviations are stated against it, px².
    pub(crate) fn at(&self, hz: f32, p: Option<&Periodogram<'_>>) -> f32 {
        self.level(hz, p).0
    }

    /// By how much a tone at `hz` must lower the sum of squares.
    pub(crate) fn needed(
        &self,
        hz: f32,
        (false_alarm, widths): (f32, f32),
        p: Option<&Periodogram<'_>>,
    ) -> f32 {
        let (level, cells) = self.level(hz, p);
        2.0 * cells * level * alarm::threshold(false_alarm, widths, 2.0 * cells)
    }

    /// What a tone at `hz` is that lowers the sum of squares by `fall`; `p` is of what is left. Beside others it is
    /// `least_ratio` times as high at least.
    pub(crate) fn judge(
        &self,
        hz: f32,
        fall: f32,
        alarms: (f32, f32),
        least_ratio: f32,
        p: &Periodogram<'_>,
    ) -> Verdict {
        let z = 0.5 * fall;
        if fall <= self.needed(hz, alarms, None) {
            return Verdict::Weak;
        }
        if self.is_white() {
            return Verdict::Tone;
        }
        if fall <= self.needed(hz, alarms, Some(p)) {
            return Verdict::Narrow;
        }
        let images = self.images.at(hz, p);
        if images > SEEN_IMAGES * self.at(hz, Some(p)) && z < SURE_OVER_IMAGES * images {
            return Verdict::Image;
        }
        if self.may_be_narrow(hz, z, least_ratio, p) {
            return Verdict::Narrow;
        }
        Verdict::Tone
    }

    fn may_be_narrow(&self, hz: f32, z: f32, least_ratio: f32, p: &Periodogram<'_>) -> bool {
        let cell_hz = 1.0 / p.length_s;
        let (mut largest, mut sum, mut squares) = (0.0_f32, 0.0, 0.0);
        for b in p.between(hz - BESIDE.1 * cell_hz, hz + BESIDE.1 * cell_hz) {
            let Some(here) = p.level(b) else { continue };
            sum += here;
            squares += here * here;
            let away = (b as f32 * p.bin_hz - hz).abs() * p.length_s;
            if away >= BESIDE.0 {
                largest = largest.max(if away > NEAR { 0.1 * here } else { here });
            }
        }
        let quietest = self.floor.quietest();
        let (mean, _) = mean_around(p, hz, (BESIDE.0, NARROW_MEAN.0));
        if largest <= NARROW_PEAK * quietest && mean <= NARROW_MEAN.1 * quietest {
            return false;
        }
        let cells = 2.0 * sum * sum / (squares * p.places()).max(f32::MIN_POSITIVE);
        // What is no number may be narrow.
        let stands_out = z > exceeded(cells).max(least_ratio) * largest;
        !stands_out
    }
}

/// How many times the next largest peak the largest of noise in `cells` cells is in one window of ten thousand.
fn exceeded(cells: f32) -> f32 {
    let n = cells.max(2.0);
    // Stirling: n! to a part in a thousand.
    let factorial =
        n * (libm::logf(n) - 1.0) + 0.5 * libm::logf(core::f32::consts::TAU * n) + 1.0 / (12.0 * n);
    let ratio = libm::expf((factorial + 9.21) / (n - 1.0)) - 0.5 * n;
    ratio.clamp(6.0, 100.0)
}

/// Mean z of the places from `from` to `to` cells on either side of `hz`, and how many cells they are.
fn mean_around(p: &Periodogram<'_>, hz: f32, (from, to): (f32, f32)) -> (f32, f32) {
    let reach = to / p.length_s;
    let (mut sum, mut count) = (0.0, 0.0_f32);
    for b in p.between(hz - reach, hz + reach) {
        let away = (b as f32 * p.bin_hz - hz).abs() * p.length_s;
        if let Some(z) = p.level(b).filter(|_| away >= from) {
            sum += z;
            count += 1.0;
        }
    }
    (sum / count.max(1.0), count / p.places())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_cells_ask_for_more() {
        assert!((exceeded(5.0) - 30.6).abs() < 0.5, "{}", exceeded(5.0));
        assert!((exceeded(12.0) - 8.2).abs() < 0.3, "{}", exceeded(12.0));
        assert_eq!(exceeded(2.0), 100.0);
        assert_eq!(exceeded(60.0), 6.0);
    }
}
