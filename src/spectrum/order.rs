//! How many coefficients a tone's shape needs: an F test against what is left with more.

use super::alias::{BANDS, Scores, ShapeFit};
use super::model::Samples;
use super::parameters::Model;
use super::phase::Frequency;
use super::shape::ORDERS;

/// One-sided deviate of the standard normal distribution that noise exceeds once in 10 000 times.
const RARE: f32 = 3.72;

/// The same, once in 100.
const SELDOM: f32 = 2.33;

/// A shape, and how well it does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grown {
    pub(crate) fit: ShapeFit,
    /// The same in all rows, along the same axes.
    pub(crate) rigid: ShapeFit,
    /// Chi² for each degree of freedom of what is left at the alias frequency, over what noise leaves; and how many there are.
    pub(crate) residual: Residue,
}

/// Chi² of what bands of rows hold beyond a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Residue {
    pub(crate) chi2: f32,
    pub(crate) freedom: f32,
}

impl Residue {
    /// For each degree of freedom; 1 where there are none.
    pub(crate) fn each(&self) -> f32 {
        if self.freedom > 0.0 {
            self.chi2 / self.freedom
        } else {
            1.0
        }
    }

    /// By how much deviations are to be stretched: by the root of what is left for each degree of freedom where noise leaves
    /// so much in no more than one of 100.
    pub(crate) fn stretch(&self) -> f32 {
        if self.exceeds(SELDOM) {
            crate::math::sqrtf(self.each().max(1.0))
        } else {
            1.0
        }
    }

    /// Noise leaves so much in no more than one of 10 000 (Wilson and Hilferty 1931).
    pub(crate) fn is_more_than_noise(&self) -> bool {
        self.exceeds(RARE)
    }

    /// More than a one-sided deviate of the standard normal distribution.
    fn exceeds(&self, deviate: f32) -> bool {
        if self.freedom <= 0.0 {
            return false;
        }
        let spread = 2.0 / (9.0 * self.freedom);
        let root = 1.0 - spread + deviate * crate::math::sqrtf(spread);
        self.each() > root * root * root
    }
}

/// Whether an F of `d1` and `d2` degrees of freedom is larger than one of 10 000 is (Paulson 1942).
pub(crate) fn is_rare(f: f32, d1: f32, d2: f32) -> bool {
    // Not true of what is no number.
    let large = f > 1.0;
    if !large || d1 < 1.0 || d2 < 1.0 {
        return false;
    }
    let root = libm::cbrtf(f);
    let (a, b) = (2.0 / (9.0 * d1), 2.0 / (9.0 * d2));
    let deviate = ((1.0 - b) * root - (1.0 - a)) / crate::math::sqrtf(b * root * root + a);
    deviate > RARE
}

impl Samples<'_> {
    /// What the tones of `model` leave at the alias frequency of tone `i`, of which these are the scores.
    pub(crate) fn residue(
        &self,
        scores: &Scores,
        model: &Model,
        i: usize,
        variance: f32,
    ) -> Residue {
        let Some(tone) = model.tones.get(i) else {
            return Residue {
                chi2: 0.0,
                freedom: 0.0,
            };
        };
        let axes = [true, self.axes > 1];
        let (gain, numbers) = self.free_gain(scores, tone.frequency, axes, BANDS);
        Residue {
            chi2: gain / variance,
            freedom: numbers - 2.0 * tone.shape.count() as f32,
        }
    }

    /// The shape at `at` that the scores ask for, along those axes that move: an axis without which the others do as well
    /// counts as still.
    pub(crate) fn grow(&self, scores: &Scores, at: Frequency, variance: f32) -> Grown {
        let along = |axes| self.grow_along(scores, at, axes, variance);
        let x = along([true, false]);
        if self.axes < 2 {
            return x;
        }
        let (y, both) = (along([false, true]), along([true, true]));
        let needs = |one: &Grown| {
            let numbers = |g: &Grown| 2.0 * g.fit.shape.count() as f32;
            let d1 = (numbers(&both) - numbers(one)).max(2.0);
            let gained = (both.fit.gain - one.fit.gain) / (d1 * variance);
            let f = gained / both.residual.each().max(1.0);
            is_rare(f, d1, both.residual.freedom)
        };
        let mut best = match (needs(&y), needs(&x)) {
            (true, true) => return both,
            (true, false) => x,
            (false, true) => y,
            (false, false) if x.fit.gain >= y.fit.gain => x,
            (false, false) => y,
        };
        let count = |g: &Grown| 2.0 * g.fit.shape.count() as f32;
        best.residual = Residue {
            chi2: both.residual.chi2 + (both.fit.gain - best.fit.gain) / variance,
            freedom: both.residual.freedom + count(&both) - count(&best),
        };
        best
    }

    /// The shape at `at` that the scores ask for: its order grows from 0 while the gain is more than what the higher order
    /// still leaves (never against the noise alone: then orders would grow on whatever the model lacks), looking two
    /// orders ahead. `axes`: those that move. `variance`: the noise's.
    fn grow_along(&self, scores: &Scores, at: Frequency, axes: [bool; 2], variance: f32) -> Grown {
        let all = self.knowing();
        let most = all.len().saturating_sub(1) / 2;
        let (free, numbers) = self.free_gain(scores, at, axes, BANDS);
        let per_order = 2.0 * axes.iter().filter(|a| **a).count() as f32;
        let fit = |order: usize| {
            let orders = axes.map(|moves| if moves { order + 1 } else { 0 });
            self.shape_at(scores, at, orders, all.clone())
        };
        let residue = |gain: f32, order: usize| Residue {
            chi2: (free - gain).max(0.0) / variance,
            freedom: numbers - per_order * (order + 1) as f32,
        };
        let rigid = fit(0);
        let (mut order, mut best) = (0, rigid);
        while order + 1 < ORDERS.min(most + 1) {
            let mut grown = false;
            for ahead in [1, 2] {
                let higher = order + ahead;
                if higher >= ORDERS.min(most + 1) {
                    break;
                }
                let trial = fit(higher);
                let still = residue(trial.gain, higher);
                let d1 = per_order * ahead as f32;
                let gained = (trial.gain - best.gain) / (d1 * variance);
                let f = gained / still.each().max(1.0);
                if still.freedom >= 2.0 && is_rare(f, d1, still.freedom) {
                    (order, best, grown) = (higher, trial, true);
                    break;
                }
            }
            if !grown {
                break;
            }
        }
        Grown {
            fit: best,
            rigid,
            residual: residue(best.gain, order),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the F and chi² distributions (R: `qf(1e-4, d1, d2, lower = FALSE)`, `qchisq`).
    #[test]
    fn the_limits_are_those_of_the_distributions() {
        for (d1, d2, limit) in [
            (2.0, 20.0, 15.12),
            (2.0, 100.0, 10.11),
            (4.0, 20.0, 10.02),
            (6.0, 1e4, 4.65),
        ] {
            assert!(!is_rare(0.92 * limit, d1, d2), "{d1} {d2}");
            assert!(is_rare(1.08 * limit, d1, d2), "{d1} {d2}");
        }
        for (freedom, limit) in [(4.0, 23.51), (20.0, 52.39), (100.0, 161.32)] {
            let chi2 = |x: f32| Residue {
                chi2: x * limit,
                freedom,
            };
            assert!(
                !chi2(0.97).is_more_than_noise() && chi2(1.03).is_more_than_noise(),
                "{freedom}"
            );
        }
    }
}
