//! The joint fit: offsets, drift and all tones at once, refined together (Gauss–Newton).

use num_complex::Complex32 as Complex;

use super::cholesky::{MOST, Normal};
use super::gram::{Regressors, Unknown};
use super::model::{Moments, POWERS, Samples, Tone};
use crate::report::MAX_PEAKS;

/// Furthest a frequency may move in one step, turns a window length.
const LONGEST_STEP: f32 = 0.3;

/// A tone grows or dies away by no more than e to this power in a window.
const MOST_GROWTH: f32 = 8.0;

/// A step that lowers the sum of squares by less than this many noise variances is the last.
const ENOUGH: f32 = 0.3;

/// After a step that lowers it by less than this many, the matrix need not be made again.
const SOON: f32 = 1000.0;

/// What is fitted to a window.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) tones: heapless::Vec<Tone, MAX_PEAKS>,
    /// Slow drift: px a window length, px a window length squared.
    pub(crate) drift: [f32; 2],
    /// How many powers of t the drift has, 0 to 2.
    pub(crate) drift_powers: usize,
    /// Weighted sum of squares of what is left.
    pub(crate) squares: f32,
}

impl Model {
    pub(crate) const fn new(drift_powers: usize) -> Self {
        Self {
            tones: heapless::Vec::new(),
            drift: [0.0; 2],
            drift_powers,
            squares: 0.0,
        }
    }
}

/// How sure a tone is, for unit noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deviation {
    pub(crate) hz: f32,
    pub(crate) amplitude_px: f32,
}

/// Working memory of the fit.
#[derive(Debug)]
pub(crate) struct Fit {
    normal: Normal,
    moments: [Moments; MAX_PEAKS],
    unknowns: [f32; MOST],
    /// Passes over the samples so far.
    pub(crate) passes: u32,
}

impl Fit {
    pub(crate) const fn new() -> Self {
        Self {
            normal: Normal::new(),
            moments: [[Complex::new(0.0, 0.0); POWERS]; MAX_PEAKS],
            unknowns: [0.0; MOST],
            passes: 0,
        }
    }

    /// Degrees of freedom of the residual.
    pub(crate) fn freedom(samples: &Samples<'_>, model: &Model) -> f32 {
        let slots = samples.slot_weight[..samples.slots]
            .iter()
            .filter(|&&w| w > 0.0)
            .count();
        let fitted: usize = model
            .tones
            .iter()
            .map(|t| if t.modulated { 5 } else { 3 })
            .sum();
        samples.count as f32 - (slots + model.drift_powers + fitted) as f32
    }

    /// How much of the residual of the last pass is at tone `i` (squared).
    pub(crate) fn held(&self, i: usize) -> f32 {
        self.moments.get(i).map_or(0.0, |m| m[0].norm_sqr())
    }

    /// The residual of `model` and its moments.
    pub(crate) fn evaluate(&mut self, samples: &mut Samples<'_>, model: &mut Model) -> [f32; 2] {
        for (i, tone) in model.tones.iter().enumerate() {
            samples.tabulate(i + 1, tone);
        }
        self.passes = self.passes.saturating_add(1);
        let (squares, slow) = samples.pass(&model.tones, model.drift, &mut self.moments);
        model.squares = squares;
        slow
    }

    /// Moves `model` to the least weighted sum of squares; leaves the tables and the normal matrix there.
    pub(crate) fn refine(&mut self, samples: &mut Samples<'_>, model: &mut Model, steps: u32) {
        let freedom = Self::freedom(samples, model).max(1.0);
        let mut best: Option<Model> = None;
        let mut shorter = 1.0;
        let mut last_gain = f32::INFINITY;
        let mut current = false;
        for step in 0..=steps {
            let slow = self.evaluate(samples, model);
            if let Some(best) = &best
                && model.squares.partial_cmp(&(best.squares * 1.0001))
                    != Some(core::cmp::Ordering::Less)
            {
                // Too far: back, and half as far from there. The step is still in `unknowns`.
                *model = best.clone();
                shorter *= 0.5;
                if shorter < 0.1 || step == steps {
                    self.evaluate(samples, model);
                    return;
                }
                let regressors = Regressors::of(&model.tones, model.drift_powers);
                self.apply(model, &regressors, shorter, samples.length_s);
                continue;
            }
            if step == steps {
                return;
            }
            let regressors = Regressors::of(&model.tones, model.drift_powers);
            let settled = !model.tones.iter().any(|t| t.amplitude.norm_sqr() == 0.0);
            // Near the end the matrix hardly changes: it serves as long as each step gains much less than the one before.
            if !current {
                samples.normal(&regressors, &model.tones, &mut self.normal);
                self.normal.factor();
            }
            let gradient = self.gradient(&regressors, slow);
            self.unknowns = gradient;
            self.normal.solve(&mut self.unknowns);
            let gain: f32 = gradient
                .iter()
                .zip(&self.unknowns)
                .take(regressors.list().len())
                .map(|(g, u)| g * u)
                .sum();
            if !gain.is_finite() {
                return;
            }
            let noise = model.squares / freedom;
            if settled && gain < ENOUGH * noise {
                // So near, the sum of squares is the parabola that it is taken for: no need to look.
                self.apply(model, &regressors, 1.0, samples.length_s);
                model.squares -= gain.max(0.0);
                return;
            }
            current =
                settled && gain < SOON * noise.max(1e-4 * last_gain) && gain < 0.1 * last_gain;
            last_gain = gain;
            best = Some(model.clone());
            shorter = 1.0;
            self.apply(model, &regressors, 1.0, samples.length_s);
        }
    }

    fn gradient(&self, regressors: &Regressors, slow: [f32; 2]) -> [f32; MOST] {
        let mut gradient = [0.0; MOST];
        for (g, (r, _)) in gradient.iter_mut().zip(regressors.list()) {
            let power = usize::from(r.power);
            *g = match usize::from(r.table) {
                0 => slow[(power.max(1) - 1).min(1)],
                k => (r.factor.conj() * self.moments[k - 1][power.min(POWERS - 1)]).re,
            };
        }
        gradient
    }

    fn apply(&self, model: &mut Model, regressors: &Regressors, share: f32, length_s: f32) {
        for ((r, unknown), &value) in regressors.list().iter().zip(&self.unknowns) {
            let change = share * value;
            if r.table == 0 {
                model.drift[(usize::from(r.power).max(1) - 1).min(1)] += change;
                continue;
            }
            let Some(tone) = model.tones.get_mut(usize::from(r.table) - 1) else {
                continue;
            };
            match unknown {
                Unknown::Drift => {}
                Unknown::Re => tone.amplitude.re += change,
                Unknown::Im => tone.amplitude.im += change,
                Unknown::Frequency => {
                    let turns = change.clamp(-LONGEST_STEP, LONGEST_STEP);
                    tone.frequency = tone.frequency.plus(turns / length_s);
                }
                Unknown::Chirp => tone.chirp += change.clamp(-1.0, 1.0),
                Unknown::Growth => {
                    tone.growth = (tone.growth + change).clamp(-MOST_GROWTH, MOST_GROWTH);
                }
            }
        }
    }

    /// Prepares [`Fit::deviation`]; leaves the tables at `model`.
    pub(crate) fn weigh(&mut self, samples: &mut Samples<'_>, model: &Model) -> Regressors {
        for (i, tone) in model.tones.iter().enumerate() {
            samples.tabulate(i + 1, tone);
        }
        let regressors = Regressors::of(&model.tones, model.drift_powers);
        samples.normal(&regressors, &model.tones, &mut self.normal);
        self.normal.factor();
        regressors
    }

    /// Standard deviations of tone `i` for unit noise, after [`Fit::weigh`].
    pub(crate) fn deviation(
        &self,
        regressors: &Regressors,
        model: &Model,
        i: usize,
        length_s: f32,
    ) -> Deviation {
        let amplitude = model
            .tones
            .get(i)
            .map_or(Complex::new(1.0, 0.0), |t| t.amplitude);
        let size = amplitude.norm_sqr();
        let along = if size > 0.0 {
            amplitude.unscale(crate::math::sqrtf(size))
        } else {
            Complex::new(1.0, 0.0)
        };
        let (mut of_hz, mut of_amplitude) = ([0.0; MOST], [0.0; MOST]);
        for (j, (r, unknown)) in regressors.list().iter().enumerate() {
            if usize::from(r.table) != i + 1 {
                continue;
            }
            match unknown {
                Unknown::Re => of_amplitude[j] = along.re,
                Unknown::Im => of_amplitude[j] = along.im,
                Unknown::Frequency => of_hz[j] = 1.0 / length_s,
                _ => {}
            }
        }
        Deviation {
            hz: crate::math::sqrtf(self.normal.variance(&of_hz)),
            amplitude_px: crate::math::sqrtf(self.normal.variance(&of_amplitude)),
        }
    }
}

/// How many powers of t the drift has: fewer where there are few frames.
pub(crate) fn drift_powers(samples: &Samples<'_>) -> usize {
    match samples.frames {
        0..=2 => 0,
        3 => 1,
        _ => 2,
    }
}
