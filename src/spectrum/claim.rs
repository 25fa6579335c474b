//! What is found at an image of a larger tone: a part of its shape, a tone of its own, or what no shape of it follows.

use super::fit::Fit;
use super::model::Samples;
use super::parameters::Model;
use super::search::Search;
use super::standing::{A_NUMBER, AS_IMAGE, STEPS, numbers, stands};
use super::tone::Tone;

/// A shape is tried in earnest where it explains this share of what two tones do.
const NEARLY: f32 = 0.98;

/// What changes within the window by no more than this share of what does not is taken for steady.
const STEADY: f32 = 0.3;

impl Search {
    /// The newest tone may be what a larger one's shape leaves at its alias frequency. Then it is tried as that; and where the
    /// larger one's rows hold more still than both tones explain, it goes, and so does all that is there.
    pub(crate) fn claim(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &mut Model) {
        let Some((newest, older)) = model.tones.split_last() else {
            return;
        };
        let power = newest.shape.power();
        let larger = older.iter().position(|t| {
            t.shape.power() > power && self.is_image(samples, newest.frequency, t.frequency)
        });
        let Some(image) = larger else { return };
        let i = self.largest_of_images(samples, model, image);
        if i == image && self.is_shape(samples, fit, model, i) {
            let variance = model.squares / Fit::freedom(samples, model).max(1.0);
            let Some(mut without) = samples.copy_of(model) else {
                return;
            };
            without.tones.pop();
            fit.refine(samples, &mut without, STEPS);
            if self.stand(samples, fit, &mut without, i)
                && without.squares
                    < model.squares + A_NUMBER * variance * (numbers(model) - numbers(&without))
            {
                model.copy(&without);
                return;
            }
        }
        if self.is_misfit(samples, fit, model, i, true) {
            self.give_notch(samples, fit, model, i);
        }
    }

    /// The largest of tone `i` and those at whose images it is: what is left there is that one's.
    fn largest_of_images(&self, samples: &Samples<'_>, model: &Model, i: usize) -> usize {
        let (mut largest, mut at) = (i, model.tones.get(i).copied());
        for (j, t) in model.tones.iter().enumerate() {
            let larger = |own: Tone| {
                t.shape.power() > own.shape.power()
                    && self.is_image(samples, t.frequency, own.frequency)
            };
            if at.is_some_and(larger) {
                (largest, at) = (j, Some(*t));
            }
        }
        largest
    }

    /// A shape of tone `i` may explain what the newest one does too.
    fn is_shape(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &Model, i: usize) -> bool {
        let last = model.tones.len().saturating_sub(1);
        let (Some(tone), Some(newest)) = (model.tones.get(i), model.tones.get(last)) else {
            return false;
        };
        let variance = model.squares / Fit::freedom(samples, model).max(1.0);
        model.tabulate(samples);
        fit.passes = fit.passes.saturating_add(1);
        let scores = samples.score(model, i, |j| j == i || j == last);
        let Some(best) = self.best_multiples(samples, &scores, tone.frequency).0 else {
            return false;
        };
        let grown = samples.grow(&scores, best.at, variance);
        let fps = self.band.fps.unwrap_or(1.0);
        let turns = newest.frequency.above(tone.frequency) / fps;
        let mirrored = (turns - libm::roundf(turns)).abs() * fps * samples.length_s > AS_IMAGE;
        let at = if mirrored {
            newest.frequency.mirrored()
        } else {
            newest.frequency
        };
        let pair = samples.pair_gain(&scores, [tone.frequency, at], [true, samples.axes > 1]);
        // The pair's frequencies are not quite those of its scores.
        stands(&grown, variance) && grown.fit.gain > NEARLY * pair
    }

    /// At the end of the search: gives a notch to a tone of which something smaller was found at its images, and which leaves
    /// more there still. Says whether there was one.
    pub(crate) fn notch_misfit(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
    ) -> bool {
        for i in 0..model.tones.len() {
            let Some(tone) = model.tones.get(i).copied() else {
                return false;
            };
            let power = tone.shape.power();
            let imaged = model.tones.iter().any(|t| {
                t.shape.power() < power && self.is_image(samples, t.frequency, tone.frequency)
            });
            let is_largest = self.largest_of_images(samples, model, i) == i;
            if tone.notched || !imaged || !is_largest || self.tired(fit) {
                continue;
            }
            if self.is_misfit(samples, fit, model, i, false) {
                self.give_notch(samples, fit, model, i);
                return true;
            }
        }
        false
    }

    /// All tones at the alias frequency of tone `i` leave more there than noise; if asked for, as much at all times.
    fn is_misfit(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        i: usize,
        steadily: bool,
    ) -> bool {
        let variance = model.squares / Fit::freedom(samples, model).max(1.0);
        let Some(at) = model.tones.get(i).map(|t| t.frequency) else {
            return false;
        };
        model.tabulate(samples);
        fit.passes = fit.passes.saturating_add(1);
        let scores = samples.score(model, i, |_| false);
        let mut left = samples.residue(&scores, model, i, variance);
        for tone in &model.tones {
            if self.is_image(samples, tone.frequency, at) {
                left.freedom -= 2.0 * tone.shape.count() as f32;
            }
        }
        if !left.is_more_than_noise() {
            return false;
        }
        if !steadily {
            return true;
        }
        // What leaks from a tone near it that was not found yet is not the same at all times.
        fit.passes = fit.passes.saturating_add(1);
        let (even, changing) = samples.steadiness(model, i, variance);
        changing - 1.0 < STEADY * (even - 1.0)
    }

    /// Gives tone `i` a notch; what was found at its images goes.
    fn give_notch(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &mut Model, i: usize) {
        let Some(tone) = model.tones.get_mut(i) else {
            return;
        };
        (tone.notched, tone.frozen) = (true, true);
        let own = tone.frequency;
        let mut at = 0;
        while at < model.tones.len() {
            let image = model.tones.get(at).is_some_and(|t| {
                t.frequency != own && !t.notched && self.is_image(samples, t.frequency, own)
            });
            if image {
                model.tones.remove(at);
            } else {
                at += 1;
            }
        }
        fit.refine(samples, model, STEPS);
    }
}
