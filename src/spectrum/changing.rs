//! Tones that change within the window: what no steady tone explains may be one that speeds up or dies away.

use super::detect::{self, Candidates};
use super::fit::Fit;
use super::judge::Verdict;
use super::model::Samples;
use super::parameters::Model;
use super::residual::Residual;
use super::search::{BESIDE, Barred, STEPS, Search};
use super::tone::Tone;

/// Power over the quietest noise from which on a tone that is spread over many cells is looked for.
const SPREAD: f32 = 20.0;

/// A changing tone is so many times what it leaves beside it: five numbers take most of what noise has in a few cells.
const CHANGING: f32 = 100.0;

/// What trying many ways in which a tone may change gains of noise alone, in its variances.
const TRIED: f32 = 8.0;

impl Search {
    /// A tone that changes much is spread over so many cells that it does not stand out in any: the highest place of the residual is tried as one. Says whether `model` has it now.
    pub(super) fn spread_out(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        residual: &mut Residual<'_>,
        barred: &Barred,
    ) -> bool {
        let full = model.tones.len() >= self.most_tones || self.tired(fit);
        if residual.is_white() || full {
            return false;
        }
        let mut highest = Candidates::new();
        let length_s = samples.length_s;
        for axis in (0..samples.axes).rev() {
            residual.look(samples, model, axis);
            if let Some(p) = residual.periodogram() {
                let quietest = residual.noise(axis).floor.quietest();
                detect::candidates(samples, &p, &mut highest, |c| {
                    0.5 * c.gain < SPREAD * quietest
                        || self.is_barred(length_s, barred, c)
                        || self.is_notched(length_s, model, c.frequency)
                });
            }
        }
        let Some(highest) = highest.first().copied() else {
            return false;
        };
        let Some(mut best) = samples.copy_of(model) else {
            return false;
        };
        let start = Tone::steady(highest.frequency, highest.axis);
        if !self.put(samples, fit, &mut best, start) {
            return false;
        }
        let found = self.changes(samples, fit, model, &mut best, residual);
        if found {
            model.copy(&best);
        } else {
            residual.forget();
        }
        found
    }

    /// The first tone of `best` that `model` has not, stands out of the noise if it changes within the window. Then it is
    /// the only one in `best` besides those of `model`.
    pub(super) fn changes(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        best: &mut Model,
        residual: &mut Residual<'_>,
    ) -> bool {
        let first = model.tones.len();
        let Some(steady) = best.tones.get(first).copied() else {
            return false;
        };
        let axis = usize::from(steady.shape.orders()[0] == 0);
        let held = 0.25 * samples.seen_power(&steady.shape, steady.frequency.hz());
        let low = held < SPREAD * residual.noise(axis).floor.quietest();
        if low || self.tired(fit) || !residual.may_try_changing() {
            return false;
        }
        best.copy(model);
        if best.tones.push(steady).is_err() {
            return false;
        }
        let length_s = samples.length_s;
        let (away, chirp) = residual.ramp(samples, model, (steady.frequency, axis));
        let start = steady.frequency.plus(away / length_s);
        let struck = residual.struck(samples, model, (steady.frequency, axis));
        let changing = |at| Tone {
            modulated: true,
            ..Tone::steady(at, axis)
        };
        let hit = struck.map(|struck| Tone {
            growth: struck.growth,
            onset: Some(struck.onset),
            ..changing(steady.frequency)
        });
        let starts = [
            Some(changing(steady.frequency)),
            Some(Tone {
                chirp,
                ..changing(start)
            }),
            hit,
        ];
        let mut least: Option<f32> = None;
        for start in starts.into_iter().flatten() {
            if self.tired(fit) {
                break;
            }
            let Some(mut trial) = samples.copy_of(model) else {
                break;
            };
            let _ = trial.tones.push(start);
            fit.refine(samples, &mut trial, STEPS);
            if start.onset.is_some() {
                for _ in 0..2 {
                    residual.place_onset(samples, &mut trial);
                    fit.refine(samples, &mut trial, STEPS);
                }
            }
            let stayed = trial
                .tones
                .last()
                .is_some_and(|t| t.frequency.above(start.frequency).abs() * length_s < BESIDE);
            let sound = stayed && self.sound(samples, &trial);
            if sound && least.is_none_or(|least| trial.squares < least) {
                least = Some(trial.squares);
                best.copy(&trial);
            }
        }
        least.is_some() && self.judged(samples, model, best, residual) == Verdict::Tone
    }

    /// What the newest tone of `best`, a changing one that `model` has not, is beside the noise that both leave.
    fn judged(
        &self,
        samples: &mut Samples<'_>,
        model: &Model,
        best: &Model,
        residual: &mut Residual<'_>,
    ) -> Verdict {
        residual.forget();
        let Some(tone) = best.tones.last() else {
            return Verdict::Weak;
        };
        let axis = usize::from(tone.shape.orders()[0] == 0);
        residual.look(samples, best, axis);
        let Some(p) = residual.periodogram() else {
            return Verdict::Weak;
        };
        let (hz, noise) = (tone.frequency.hz(), residual.noise(axis));
        let fall = model.squares - best.squares - 2.0 * TRIED * noise.at(hz, None);
        noise.judge(hz, fall, self.alarms(samples, axis), CHANGING, &p)
    }
}
