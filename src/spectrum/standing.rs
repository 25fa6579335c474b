//! A tone strong enough to show it is given its shape over the rows, at the multiple of the frame rate where it stands.
//!
//! Weak tones are found under the rigid model, which is the most sensitive; a tone whose rows do not move alike is then found
//! at any of its images. What the rows say at the alias frequency ([`super::alias`]) is one for all of them. A vibration's
//! shape stands: it is real but for one phase. Of all multiples k that one is taken where the shape explains most with a
//! standing shape.

use super::alias::{Scores, ShapeFit};
use super::fit::Fit;
use super::gram::Regressors;
use super::model::Samples;
use super::order::Grown;
use super::parameters::Model;
use super::phase::Frequency;
use super::search::Search;
use super::shape::{ORDERS, Shape};
use super::tone::Tone;

/// Steps to refine with a shape.
pub(super) const STEPS: u32 = 12;

/// Of what the shape gains over the rigid one, no more than this share is lost where it has to stand: else it travels, or
/// two tones are there.
const TRAVELS: f32 = 0.25;

/// A loss of no more than this many noise variances is noise.
const LOSS_BY_NOISE: f32 = 12.0;

/// A multiple that explains this share of the best one's, and is no more noise variances behind than [`APART`], is not told
/// from it.
const ALIKE: f32 = 0.95;

/// See [`ALIKE`].
const APART: f32 = 50.0;

/// What is this near to an image of a tone is at its alias frequency, turns a window length.
pub(super) const AS_IMAGE: f32 = 1.0;

/// A further number has to explain so many noise variances more.
pub(super) const A_NUMBER: f32 = 4.0;

/// Fewest slots that tell of a shape.
const FEWEST_SLOTS: usize = 4;

/// A shape is kept where it lowers the sum of squares by so many noise variances.
const WORTH: f32 = 16.0;

/// A multiple of the frame rate and what stands there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Multiple {
    pub(super) at: Frequency,
    pub(super) value: f32,
}

impl Search {
    /// Gives tone `i` a shape where its rows ask for one, perhaps at another multiple of the frame rate. Says whether `model`
    /// has changed.
    pub(crate) fn stand(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        i: usize,
    ) -> bool {
        let Some(tone) = model.tones.get(i).copied() else {
            return false;
        };
        if tone.modulated
            || tone.notched
            || samples.knowing().len() < FEWEST_SLOTS
            || self.tired(fit)
        {
            return false;
        }
        let variance = model.squares / Fit::freedom(samples, model).max(1.0);
        model.tabulate(samples);
        let scores = samples.score(model, i, |j| j == i);
        fit.passes = fit.passes.saturating_add(1);
        let here = samples.grow(&scores, tone.frequency, variance);
        // At an image nothing low fits, and growth has to beat what is left: that alone would not tell.
        if !here.residual.is_more_than_noise() && here.fit.shape.orders() == tone.shape.orders() {
            return false;
        }
        // What leaks from a tone near it that was not found yet is not the same at all times.
        fit.passes = fit.passes.saturating_add(1);
        let (even, changing) = samples.steadiness(model, i, variance);
        if changing > even.max(2.0) {
            return false;
        }
        let (best, second) = self.best_multiples(samples, &scores, tone.frequency);
        let Some(best) = best else { return false };
        let grown = samples.grow(&scores, best.at, variance);
        let (at, shape) = if stands(&grown, variance) {
            (best.at, grown.fit.shape)
        } else {
            // It travels, or two tones are there: still it may be along both axes.
            (tone.frequency, here.rigid.shape)
        };
        if shape.orders() == tone.shape.orders() && at == tone.frequency {
            return false;
        }
        let unsure = second.is_some_and(|s| {
            s.value > ALIKE * best.value && best.value - s.value < APART * variance
        });
        let Some(mut trial) = samples.copy_of(model) else {
            return false;
        };
        if let Some(tone) = trial.tones.get_mut(i) {
            tone.shape = shape;
            tone.frequency = at;
            tone.unsure = unsure;
            if at.hz() < 0.0 {
                tone.frequency = at.mirrored();
                tone.shape = tone.shape.conjugate();
            }
        }
        if !Regressors::have_room(&trial.tones, samples.axes) {
            return false;
        }
        let axes = shape.orders().map(|o| o > 0);
        let bends = shape.orders() != axes.map(usize::from);
        fit.refine(samples, &mut trial, STEPS);
        let better =
            model.squares - trial.squares > WORTH * variance && self.sound(samples, &trial);
        if !better {
            return false;
        }
        // The scores are still those of the tone.
        if bends
            && let Some(pair) = self.best_pair(samples, &scores, tone.frequency, axes)
            && self.are_two(samples, fit, (model, i), pair, (&trial, axes), variance)
        {
            return false;
        }
        model.copy(&trial);
        true
    }

    /// The frequency that frames cannot tell from this one where a standing shape explains most, and the next.
    pub(super) fn best_multiples(
        &self,
        samples: &Samples<'_>,
        scores: &Scores,
        frequency: Frequency,
    ) -> (Option<Multiple>, Option<Multiple>) {
        let axes = [true, samples.axes > 1];
        let all = samples.knowing();
        let most = (all.len().saturating_sub(1) / 2 + 1).min(ORDERS);
        let (mut best, mut second): (Option<Multiple>, Option<Multiple>) = (None, None);
        for at in self.multiples(frequency) {
            let orders = axes.map(|moves| if moves { most } else { 0 });
            let ShapeFit { gain, loss, .. } = samples.shape_at(scores, at, orders, all.clone());
            let value = gain - loss;
            if best.is_none_or(|b| value > b.value) {
                second = best;
                best = Some(Multiple { at, value });
            } else if second.is_none_or(|s| value > s.value) {
                second = Some(Multiple { at, value });
            }
        }
        (best, second)
    }

    /// Two rigid tones at the alias frequency that explain most.
    fn best_pair(
        &self,
        samples: &Samples<'_>,
        scores: &Scores,
        frequency: Frequency,
        axes: [bool; 2],
    ) -> Option<[Frequency; 2]> {
        let all = || self.multiples(frequency).enumerate();
        let mut best: Option<([Frequency; 2], f32)> = None;
        for (i, a) in all() {
            for (_, b) in all().take(i) {
                let gain = samples.pair_gain(scores, [a, b], axes);
                if best.is_none_or(|(_, g)| gain > g) {
                    best = Some(([a, b], gain));
                }
            }
        }
        best.map(|(pair, _)| pair)
    }

    /// Two rigid tones explain what tone `i` of `model` does with fewer numbers than the shape it has in `shaped`, or better.
    fn are_two(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        (model, i): (&Model, usize),
        pair: [Frequency; 2],
        (shaped, axes): (&Model, [bool; 2]),
        variance: f32,
    ) -> bool {
        let Some(mut two) = samples.copy_of(model) else {
            return false;
        };
        let rigid = |at: Frequency| {
            let at = if at.hz() < 0.0 { at.mirrored() } else { at };
            Tone {
                shape: Shape::of_orders(usize::from(axes[0]), usize::from(axes[1])),
                ..Tone::steady(at, 0)
            }
        };
        let Some(tone) = two.tones.get_mut(i) else {
            return false;
        };
        *tone = rigid(pair[0]);
        if two.tones.len() >= samples.most_tones() || two.tones.push(rigid(pair[1])).is_err() {
            return false;
        }
        fit.refine(samples, &mut two, STEPS);
        let more = A_NUMBER * variance * (numbers(&two) - numbers(shaped));
        two.squares + more < shaped.squares && self.sound(samples, &two)
    }

    /// All frequencies that frames cannot tell from this one, within the band; those of mirror images are negative.
    fn multiples(&self, frequency: Frequency) -> impl Iterator<Item = Frequency> + use<> {
        let (low, high) = (self.band.lowest_hz, self.band.highest_hz);
        let fps = self.band.fps.unwrap_or(0.0);
        let most = if fps > 0.0 {
            ((high + frequency.hz()) / fps) as i32 + 1
        } else {
            0
        };
        (-most..=most).filter_map(move |k| {
            let at = frequency.plus(k as f32 * fps);
            (k == 0 || (low..=high).contains(&at.hz().abs())).then_some(at)
        })
    }

    /// Whether something at `at` is hidden by a notch.
    pub(crate) fn is_notched(&self, length_s: f32, model: &Model, at: Frequency) -> bool {
        let notched = model.tones.iter().filter(|t| t.notched);
        notched
            .into_iter()
            .any(|t| self.images(length_s, at, t.frequency))
    }

    /// Whether `a` is at an image of `b`: a multiple of the frame rate from it or from its mirror image.
    pub(crate) fn is_image(&self, samples: &Samples<'_>, a: Frequency, b: Frequency) -> bool {
        let near = a.above(b).abs() * samples.length_s < AS_IMAGE;
        !near && self.images(samples.length_s, a, b)
    }

    /// The same, or at `b` itself.
    fn images(&self, length_s: f32, a: Frequency, b: Frequency) -> bool {
        let Some(fps) = self.band.fps else {
            return false;
        };
        [a.above(b), a.hz() + b.hz()].iter().any(|apart| {
            let away = apart - fps * libm::roundf(apart / fps);
            away.abs() * length_s < AS_IMAGE
        })
    }
}

/// Numbers that are fitted to the tones of a model.
pub(super) fn numbers(model: &Model) -> f32 {
    let of = |t: &Tone| 2 * t.shape.count() + 1;
    model.tones.iter().map(of).sum::<usize>() as f32
}

/// The shape is real but for one phase along either axis, as far as noise lets it tell.
pub(super) fn stands(grown: &Grown, variance: f32) -> bool {
    let bent = grown.fit.gain - grown.rigid.gain;
    let limit = TRAVELS * bent;
    grown.fit.loss < limit.max(LOSS_BY_NOISE * variance * grown.residual.each().max(1.0))
}
