//! What a tone does at one row or over all of them, in the words of a report.

use num_complex::Complex32 as Complex;

use super::alias::Scores;
use super::largest::Orbit;
use super::model::Samples;
use super::phase::Frequency;
use super::shape::{Shape, legendre};
use super::tone::Tone;
use crate::math::sqrtf;
use crate::report::{PeakShape, SHAPE_ROWS, ShapeRow};

/// Bands of rows in which it is looked at whether what a shape does not follow is smooth.
const WIDE: usize = 6;

/// Of what is rough, slots hold as much each as bands of them do; of what is smooth, bands hold more, as they are wider. This
/// share of the way between the two is smooth.
const SMOOTH: f32 = 0.5;

/// Bands of rows are believed before the polynomials where those leave more than this chi² for each degree of freedom.
const MISFIT: f32 = 10.0;

/// What turns amplitudes of the fit into those of the object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// What exposure and averaging leave of it, undone, and the motion blur's error; below 0 where they turn it over.
    pub(crate) factor: f32,
    /// From the recording's beginning to the time where the fit has its phase, ns.
    pub(crate) zero_ns: i64,
}

impl Scale {
    /// The amplitude, px, and the phase of a sine from the recording's beginning on, rad.
    pub(crate) fn polar(&self, c: Complex, at: Frequency) -> (f32, f32) {
        use core::f32::consts::{FRAC_PI_2, PI, TAU};
        let begin = at.phase(self.zero_ns) as f32 * (TAU / 4_294_967_296.0);
        let turned = if self.factor < 0.0 { PI } else { 0.0 };
        let phase = FRAC_PI_2 - begin - libm::atan2f(c.im, c.re) + turned;
        let phase = phase - TAU * libm::floorf((phase + PI) / TAU);
        (self.factor.abs() * sqrtf(c.norm_sqr()), phase)
    }
}

/// Motion at a place among the rows, η.
pub(crate) type Place = (f32, Orbit);

/// The motion of bands of rows, each with amplitudes of its own.
pub(crate) type Bands = heapless::Vec<Place, { super::alias::BANDS }>;

impl Samples<'_> {
    /// The bands' own motion at `at`, along those axes that the shape has.
    pub(crate) fn banded(&self, scores: &Scores, at: Frequency, shape: &Shape) -> Bands {
        let orders = shape.orders().map(|o| o.min(1));
        let mut bands = Bands::new();
        for band in self.bands(super::alias::BANDS) {
            let eta = &self.slot_eta[band.clone()];
            let middle = eta.iter().sum::<f32>() / eta.len().max(1) as f32;
            let fit = self.shape_at(scores, at, orders, band);
            let amplitudes = fit.shape.at(&legendre(middle));
            let _ = bands.push((middle, Orbit::of(amplitudes)));
        }
        bands
    }

    /// Whether what a shape leaves in the scores runs smoothly over the rows: then bands of them tell more than polynomials
    /// do. Where motion differs along the rows too it does not: what a row reads depends on its texture.
    pub(crate) fn is_smooth(&self, scores: &Scores, at: Frequency, variance: f32) -> bool {
        let axes = [true, self.axes > 1];
        let count = self.knowing().len();
        let each = |bands: usize| {
            let (gain, numbers) = self.free_gain(scores, at, axes, bands);
            (gain / variance / numbers.max(1.0) - 1.0).max(0.0)
        };
        let (wide, narrow) = (each(WIDE), each(count));
        let broader = count as f32 / WIDE as f32;
        broader > 1.5 && wide > narrow * (1.0 + SMOOTH * (broader - 1.0))
    }

    /// Amplitude along an axis that a tone was not fitted along, and its variance, from the scores of what is left.
    pub(crate) fn beside(
        &self,
        scores: &Scores,
        tone: &Tone,
        axis: usize,
        variance: f32,
    ) -> (f32, f32) {
        let fit = self.shape_at(scores, tone.frequency, [1, 1], self.knowing());
        let [x, y] = fit.shape.at(&legendre(0.0));
        let [xx, xy, yy] = self.information();
        let determinant = xx * yy - xy * xy;
        let own = if axis == 0 { xx } else { yy };
        let other = if axis == 0 { yy } else { xx };
        let information = if other > 0.0 {
            determinant / other
        } else {
            own
        };
        let amplitude = sqrtf(if axis == 0 {
            x.norm_sqr()
        } else {
            y.norm_sqr()
        });
        let variance = 2.0 * variance / (information * scores.plain()).max(f32::MIN_POSITIVE);
        (amplitude, variance)
    }
}

/// Whether bands of rows are to be believed before a shape that leaves so much for each degree of freedom.
pub(crate) fn believe_bands(each: f32, smooth: bool) -> bool {
    each > MISFIT && smooth
}

/// The rows of a report's shape.
pub(crate) fn over_rows(
    samples: &Samples<'_>,
    tone: &Tone,
    bands: Option<&Bands>,
    scale: Scale,
) -> PeakShape {
    let mut shape = PeakShape {
        hz: tone.frequency.hz(),
        ..PeakShape::default()
    };
    let [from, to] = samples.rows.ends();
    for i in 0..SHAPE_ROWS {
        let eta = from + (to - from) * i as f32 / (SHAPE_ROWS - 1) as f32;
        let [x, y] = match bands.and_then(|b| nearest(b, eta)) {
            Some(orbit) => orbit.amplitudes,
            None => tone.shape.at(&legendre(eta)),
        };
        let (x_px, x_phase_rad) = scale.polar(x, tone.frequency);
        let (y_px, y_phase_rad) = scale.polar(y, tone.frequency);
        let _ = shape.rows.push(ShapeRow {
            row: samples.rows.row(eta),
            x_px,
            x_phase_rad,
            y_px,
            y_phase_rad,
        });
    }
    shape
}

fn nearest(bands: &Bands, eta: f32) -> Option<&Orbit> {
    let away = |place: &Place| (place.0 - eta).abs();
    let mut best: Option<&Place> = None;
    for place in bands {
        if best.is_none_or(|b| away(place) < away(b)) {
            best = Some(place);
        }
    }
    best.map(|(_, orbit)| orbit)
}
