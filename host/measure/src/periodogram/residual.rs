//! What is left of a window along one axis when its steady tones are taken off.

use std::f64::consts::{PI, TAU};

use rowtone::report::{Peak, Report};
use rowtone::timeline::Sample;
use rowtone_linear::Symmetric;

/// Samples less sure than this are not taken, px.
const WORST_SD_PX: f64 = 0.5;

/// Keeps the normal equations solvable where two tones cannot be told apart, a share of each column's own power.
const RIDGE: f64 = 1e-9;

/// A window's samples along one axis: slots' means and steady tones taken off, under Hann's window.
#[derive(Clone, Debug)]
pub(super) struct Residual {
    /// Times after the first sample of all, s.
    pub(super) times_s: Vec<f64>,
    /// What is left, px, times the sample's weight; the weights add up to 1.
    pub(super) weighed_px: Vec<f64>,
    /// All rows of a frame are one sample.
    pub(super) one_a_frame: bool,
}

/// The axis's shift of a sample, px, and 1/variance, 1/px², where it is known well enough.
fn shift(sample: &Sample, axis: usize) -> Option<(f64, f64)> {
    let (px, information) = (sample.shift_px, sample.information_per_px2);
    let (px, variance) = match sample.vertical {
        None if axis == 0 => (px, 1.0 / information),
        None => return None,
        Some(v) => {
            let sure = v.information_per_px2 * (WORST_SD_PX * WORST_SD_PX) as f32 > 1.0;
            match v.solve(px, information).filter(|_| sure) {
                Some(planar) => (planar.px[axis], planar.covariance_px2[2 * axis]),
                // Upright edges tell of x whatever y is: taken to be within a pixel or so.
                None if axis == 0 => (px, 1.0 / information + v.coupling * v.coupling),
                None => return None,
            }
        }
    };
    let (px, variance) = (f64::from(px), f64::from(variance));
    let sure = px.is_finite() && variance > 0.0 && variance < WORST_SD_PX * WORST_SD_PX;
    sure.then_some((px, 1.0 / variance))
}

/// A tone that has one amplitude and one frequency for the whole window, so that a fit takes it off.
pub(super) fn is_steady(peak: &Peak) -> bool {
    let unsteady = |m: &rowtone::report::Motion| {
        m.decay_s.is_some() || m.hz_per_s.is_some() || m.spread_hz.is_some()
    };
    !peak.motion.as_ref().is_some_and(unsteady)
}

impl Residual {
    /// Along axis 0, x, or 1, y; `None` where nothing is known along it.
    pub(super) fn new(window: &[Sample], report: &Report, axis: usize) -> Option<Self> {
        let origin_ns = window.first()?.time_ns;
        let length_s = f64::from(report.window_s);
        let last_ns = window.last()?.time_ns;
        let lead_s = (0.5 * (length_s - (last_ns - origin_ns) as f64 * 1e-9)).max(0.0);
        let mut of = Samples::default();
        for sample in window {
            if let Some((px, information)) = shift(sample, axis) {
                of.times_s.push((sample.time_ns - origin_ns) as f64 * 1e-9);
                of.slots.push(sample.slot.into());
                of.weights.push(information);
                of.px.push(px);
            }
        }
        if 2 * of.px.len() < window.len() {
            return None;
        }
        of.settle();
        for peak in report.peaks.iter().filter(|peak| is_steady(peak)) {
            let rigid = peak.motion.as_ref().is_none_or(|m| m.rigid);
            of.add_tone(peak.hz.into(), rigid);
        }
        let mut left = of.without_tones();
        let mut total = 0.0;
        for ((px, w), t) in left.iter_mut().zip(&of.weights).zip(&of.times_s) {
            let taper = (PI * ((lead_s + t) / length_s).clamp(0.0, 1.0)).sin();
            let w = w * taper * taper;
            *px *= w;
            total += w;
        }
        left.iter_mut().for_each(|px| *px /= total);
        let one_a_frame = of.slots.iter().all(|&slot| slot == 0);
        (total > 0.0).then_some(Self {
            one_a_frame,
            times_s: of.times_s,
            weighed_px: left,
        })
    }
}

/// Samples of one axis, and columns of what is to be taken off them.
#[derive(Clone, Debug, Default)]
struct Samples {
    times_s: Vec<f64>,
    slots: Vec<usize>,
    weights: Vec<f64>,
    px: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Samples {
    /// Makes weights of the informations, and takes the slots' means off.
    fn settle(&mut self) {
        let total: f64 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|w| *w /= total);
        let mut px = std::mem::take(&mut self.px);
        self.remove_means(&mut px);
        self.px = px;
    }

    /// Subtracts each slot's weighted mean: where a row's reference lies, nobody knows.
    fn remove_means(&self, values: &mut [f64]) {
        let slots = self.slots.iter().max().map_or(0, |&slot| slot + 1);
        let mut sums = vec![(0.0, 0.0); slots];
        for ((value, w), &slot) in values.iter().zip(&self.weights).zip(&self.slots) {
            sums[slot].0 += w * value;
            sums[slot].1 += w;
        }
        for (value, &slot) in values.iter_mut().zip(&self.slots) {
            let (sum, weight) = sums[slot];
            if weight > 0.0 {
                *value -= sum / weight;
            }
        }
    }

    /// A tone's columns; of one that varies over the rows, its slope and its bend as well.
    fn add_tone(&mut self, hz: f64, rigid: bool) {
        let half = 0.5 * self.slots.iter().max().map_or(1.0, |&s| s.max(1) as f64);
        for power in 0..if rigid { 1 } else { 3 } {
            for wave in [f64::cos, f64::sin] {
                let each = self.times_s.iter().zip(&self.slots);
                let mut column: Vec<f64> = each
                    .map(|(t, &slot)| (slot as f64 / half - 1.0).powi(power) * wave(TAU * hz * t))
                    .collect();
                self.remove_means(&mut column);
                self.columns.push(column);
            }
        }
    }

    /// The samples less what of the columns fits them best.
    fn without_tones(&self) -> Vec<f64> {
        let mut left = self.px.clone();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let pairs = a.iter().zip(b).zip(&self.weights);
            pairs.map(|((a, b), w)| a * b * w).sum()
        };
        let mut normal = Symmetric::zeros(self.columns.len());
        for (i, a) in self.columns.iter().enumerate() {
            for (j, b) in self.columns.iter().enumerate().take(i + 1) {
                let ridge = if i == j { 1.0 + RIDGE } else { 1.0 };
                normal.add(i, j, ridge * product(a, b));
            }
        }
        let right: Vec<f64> = self.columns.iter().map(|a| product(a, &self.px)).collect();
        // Tones that are all hidden between frames leave nothing to solve, and nothing to take off.
        if let Some(factor) = normal.factor() {
            for (column, factor) in self.columns.iter().zip(factor.solve(&right)) {
                for (left, value) in left.iter_mut().zip(column) {
                    *left -= factor * value;
                }
            }
        }
        left
    }
}
