//! The joint fit: offsets, drift and all tones at once, refined together (Gauss–Newton).

use num_complex::Complex32 as Complex;

use super::cholesky::{MOST, Normal};
use super::gram::{Regressor, Regressors, Unknown};
use super::model::{Moments, NO_MOMENTS, POWERS, Samples};
use super::parameters::{Drift, Model};
use super::shape::{BASIS, CONSTANTS};
use super::tone::Tone;
use crate::report::MAX_PEAKS;

/// Furthest a frequency may move in one step, turns a window length.
const LONGEST_STEP: f32 = 0.3;

/// A tone grows or dies away by no more than e to this power in a window.
const MOST_GROWTH: f32 = 8.0;

/// What was struck dies away by no more than e to this power in a window.
const MOST_DECAY: f32 = 400.0;

/// A step that lowers the sum of squares by less than this many noise variances is the last.
const ENOUGH: f32 = 0.3;

/// After a step that lowers it by less than this many, the matrix need not be made again.
const SOON: f32 = 1000.0;

/// How sure a tone is, for unit noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deviation {
    pub(crate) hz: f32,
    pub(crate) amplitude_px: f32,
}

/// Working memory of the fit.
#[derive(Clone, Debug)]
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
            moments: [NO_MOMENTS; MAX_PEAKS],
            unknowns: [0.0; MOST],
            passes: 0,
        }
    }

    /// Degrees of freedom of the residual.
    pub(crate) fn freedom(samples: &Samples<'_>, model: &Model) -> f32 {
        let offsets = samples.series_weight[..samples.series()]
            .iter()
            .filter(|&&w| w > 0.0)
            .count();
        let fitted: usize = model
            .tones
            .iter()
            .map(|t| 2 * t.shape.count() + if t.modulated { 3 } else { 1 })
            .sum();
        let drift = samples.axes * model.drift_powers;
        let notches = 4 * offsets * model.tones.iter().filter(|t| t.notched).count();
        samples.count as f32 - (offsets + drift + fitted + notches) as f32
    }

    /// How much of the residual of the last pass is at tone `i`, the same in all rows along `axis` (squared).
    pub(crate) fn held(&self, i: usize, axis: usize) -> f32 {
        let constant = CONSTANTS[axis.min(1)];
        self.moments
            .get(i)
            .map_or(0.0, |m| m[constant][0].norm_sqr())
    }

    /// The residual of `model` and its moments.
    pub(crate) fn evaluate(&mut self, samples: &mut Samples<'_>, model: &mut Model) -> Drift {
        model.tabulate(samples);
        self.passes = self.passes.saturating_add(1);
        let (squares, slow) = samples.pass(&model.tones, &model.drift, &mut self.moments);
        model.squares = squares;
        slow
    }

    /// Moves `model` to the least weighted sum of squares; leaves the tables and the normal matrix there.
    pub(crate) fn refine(&mut self, samples: &mut Samples<'_>, model: &mut Model, steps: u32) {
        let freedom = Self::freedom(samples, model).max(1.0);
        let Some(mut best) = samples.copy_of(model) else {
            return;
        };
        // There is a step to go back from.
        let mut stepped = false;
        let mut shorter = 1.0;
        let mut last_gain = f32::INFINITY;
        let mut current = false;
        for step in 0..=steps {
            let slow = self.evaluate(samples, model);
            let too_far = stepped
                && model.squares.partial_cmp(&(best.squares * 1.0001))
                    != Some(core::cmp::Ordering::Less);
            if too_far {
                // Back, and half as far from there. The step is still in `unknowns`.
                model.copy(&best);
                shorter *= 0.5;
                if shorter < 0.1 || step == steps {
                    self.evaluate(samples, model);
                    return;
                }
            } else if step == steps {
                return;
            }
            let regressors = Regressors::of(&model.tones, model.drift_powers, samples.axes);
            if too_far {
                self.apply(model, &regressors, shorter, samples.length_s);
                continue;
            }
            let settled = !model.tones.iter().any(|t| t.shape.is_zero());
            // Near the end the matrix hardly changes: it serves as long as each step gains much less than the one before.
            if !current {
                samples.normal(&regressors, &model.tones, &mut self.normal);
                self.normal.factor();
            }
            let gradient = self.gradient(&regressors, &model.tones, &slow);
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
            best.copy(model);
            stepped = true;
            shorter = 1.0;
            self.apply(model, &regressors, 1.0, samples.length_s);
        }
    }

    fn gradient(&self, regressors: &Regressors, tones: &[Tone], slow: &Drift) -> [f32; MOST] {
        let mut gradient = [0.0; MOST];
        for (g, (r, _)) in gradient.iter_mut().zip(regressors.list()) {
            let power = usize::from(r.power);
            let Some(i) = usize::from(r.table).checked_sub(1) else {
                *g = slow[axis_of(r)][(power.max(1) - 1).min(1)];
                continue;
            };
            let moments = self.moments.get(i).unwrap_or(&NO_MOMENTS);
            let product = |j: usize| {
                let share = r.share(tones.get(i), j);
                (share.conj() * moments[j][power.min(POWERS - 1)]).re
            };
            *g = match (r.column, tones.get(i)) {
                (Some(column), _) => product(usize::from(column)),
                (None, Some(tone)) => tone.shape.fitted().map(product).sum(),
                (None, None) => 0.0,
            };
        }
        gradient
    }

    fn apply(&self, model: &mut Model, regressors: &Regressors, share: f32, length_s: f32) {
        for ((r, unknown), &value) in regressors.list().iter().zip(&self.unknowns) {
            let change = share * value;
            if r.table == 0 {
                model.drift[axis_of(r)][(usize::from(r.power).max(1) - 1).min(1)] += change;
                continue;
            }
            let Some(tone) = model.tones.get_mut(usize::from(r.table) - 1) else {
                continue;
            };
            let column = usize::from(r.column.unwrap_or(0));
            match unknown {
                Unknown::Drift => {}
                Unknown::Re => tone.shape.change(column, |c| c.re += change),
                Unknown::Im => tone.shape.change(column, |c| c.im += change),
                Unknown::Frequency => {
                    let turns = change.clamp(-LONGEST_STEP, LONGEST_STEP);
                    tone.frequency = tone.frequency.plus(turns / length_s);
                }
                Unknown::Chirp => tone.chirp += change.clamp(-1.0, 1.0),
                Unknown::Growth => match tone.onset {
                    None => tone.growth = (tone.growth + change).clamp(-MOST_GROWTH, MOST_GROWTH),
                    Some(onset) => {
                        // It grows from its onset on, the regressor from the middle of the window.
                        let before = tone.growth;
                        tone.growth = (before + change).clamp(-MOST_DECAY, 0.0);
                        let size = (1.0 + (tone.growth - before) * onset).clamp(0.3, 3.0);
                        for j in tone.shape.fitted() {
                            tone.shape.change(j, |c| *c = c.scale(size));
                        }
                    }
                },
            }
        }
    }

    /// Prepares [`Fit::deviation`]; leaves the tables at `model`.
    pub(crate) fn weigh(&mut self, samples: &mut Samples<'_>, model: &Model) -> Regressors {
        model.tabulate(samples);
        let regressors = Regressors::of(&model.tones, model.drift_powers, samples.axes);
        samples.normal(&regressors, &model.tones, &mut self.normal);
        self.normal.factor();
        regressors
    }

    /// Standard deviations of tone `i` for unit noise, after [`Fit::weigh`]: of its frequency, and of the amplitude that is
    /// the sum over its coefficients of Re(conj(direction)·c).
    pub(crate) fn deviation(
        &self,
        regressors: &Regressors,
        i: usize,
        length_s: f32,
        direction: &Direction,
    ) -> Deviation {
        self.deviation_growing(regressors, i, length_s, (direction, 0.0))
    }

    /// The same of an amplitude that changes by `growing` where the tone's growth changes by one.
    pub(crate) fn deviation_growing(
        &self,
        regressors: &Regressors,
        i: usize,
        length_s: f32,
        (direction, growing): (&Direction, f32),
    ) -> Deviation {
        let (mut of_hz, mut of_amplitude) = ([0.0; MOST], [0.0; MOST]);
        for (j, (r, unknown)) in regressors.list().iter().enumerate() {
            if usize::from(r.table) != i + 1 {
                continue;
            }
            let along = direction[usize::from(r.column.unwrap_or(0)).min(BASIS - 1)];
            match unknown {
                Unknown::Re => of_amplitude[j] = along.re,
                Unknown::Im => of_amplitude[j] = along.im,
                Unknown::Frequency => of_hz[j] = 1.0 / length_s,
                Unknown::Growth => of_amplitude[j] = growing,
                _ => {}
            }
        }
        Deviation {
            hz: crate::math::sqrtf(self.normal.variance(&of_hz)),
            amplitude_px: crate::math::sqrtf(self.normal.variance(&of_amplitude)),
        }
    }
}

/// The axis that a regressor of the drift is along.
fn axis_of(regressor: &Regressor) -> usize {
    usize::from(usize::from(regressor.column.unwrap_or(0)) == CONSTANTS[1])
}

/// What an amplitude's change is in the changes of the coefficients.
pub(crate) type Direction = [Complex; BASIS];

/// How many powers of t the drift has: fewer where there are few frames.
pub(crate) fn drift_powers(samples: &Samples<'_>) -> usize {
    match samples.frames {
        0..=2 => 0,
        3 => 1,
        _ => 2,
    }
}
