//! A fitted candidate against the noise as it is, alone or together with what keeps it from standing out.

use super::detect::{self, Candidate, Candidates};
use super::fit::Fit;
use super::judge::Verdict;
use super::largest::{direction, largest};
use super::model::Samples;
use super::parameters::Model;
use super::phase::Frequency;
use super::residual::Residual;
use super::search::{CLOSEST, PAIR, Search};
use super::tone::Tone;

/// Most tones that are tried together where each keeps the others from standing out.
const TOGETHER: usize = 4;

/// How the tones that are tried compare with the noise.
struct Verdicts {
    all_stand_out: bool,
    one_is_weak: bool,
}

impl Search {
    /// The newest tone of `best`, which `model` has not, stands out of the noise as it is. Where others or their images
    /// keep it from that, the strongest of those are put into `best` too, until all stand out together.
    pub(super) fn stands_out(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        best: &mut Model,
        residual: &mut Residual<'_>,
    ) -> bool {
        let first = model.tones.len();
        let mut shaped = false;
        loop {
            residual.forget();
            let verdicts = self.verdicts(samples, fit, model, best, residual);
            if verdicts.all_stand_out || verdicts.one_is_weak {
                return verdicts.all_stand_out;
            }
            // What a shape over the rows explains stands out with it.
            if best.tones.len() == first + 1 && !shaped {
                shaped = true;
                if self.stand(samples, fit, best, first) {
                    continue;
                }
            }
            let full = best.tones.len() >= self.most_tones.min(first + TOGETHER);
            if full || self.tired(fit) {
                return false;
            }
            let next = self.next_beside(samples, best, first, residual);
            let put = next
                .is_some_and(|c| self.put(samples, fit, best, Tone::steady(c.frequency, c.axis)));
            if !put {
                return false;
            }
        }
    }

    /// What the tones of `best` that `model` has not are beside the noise that all of them leave.
    fn verdicts(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        best: &Model,
        residual: &mut Residual<'_>,
    ) -> Verdicts {
        let first = model.tones.len();
        let alone = best.tones.len() == first + 1;
        let mut verdicts = Verdicts {
            all_stand_out: best.tones.len() > first,
            one_is_weak: false,
        };
        for (i, tone) in best.tones.iter().enumerate().skip(first) {
            let axis = usize::from(tone.shape.orders()[0] == 0);
            residual.look(samples, best, axis);
            let fall = if alone {
                model.squares - best.squares
            } else {
                let regressors = fit.weigh(samples, best);
                let (eta, orbit) = largest(&tone.shape, samples.rows.ends());
                let along = direction(eta, orbit.towards);
                let unit = fit.deviation(&regressors, i, samples.length_s, &along);
                let over = orbit.semi_major_px / unit.amplitude_px;
                over * over
            };
            let verdict = match residual.periodogram() {
                Some(p) => {
                    let alarms = self.alarms(samples, axis);
                    let noise = residual.noise(axis);
                    noise.judge(tone.frequency.hz(), fall, alarms, 1.0, &p)
                }
                None => Verdict::Weak,
            };
            verdicts.all_stand_out &= verdict == Verdict::Tone;
            verdicts.one_is_weak |= verdict == Verdict::Weak;
        }
        verdicts
    }

    /// The strongest of what is left that may keep the tones of `model` from the `first` on from standing out. Of those near
    /// each other no more than two are tried: three take most of what noise has in a few cells.
    fn next_beside(
        &self,
        samples: &mut Samples<'_>,
        model: &Model,
        first: usize,
        residual: &mut Residual<'_>,
    ) -> Option<Candidate> {
        let tried = model.tones.get(first..)?;
        let length_s = samples.length_s;
        let near = |a: Frequency, b: Frequency| b.above(a).abs() * length_s < PAIR;
        let mut found = Candidates::new();
        for axis in (0..samples.axes).rev() {
            residual.look(samples, model, axis);
            let Some(p) = residual.periodogram() else {
                continue;
            };
            let noise = residual.noise(axis);
            detect::candidates(samples, &p, &mut found, |c| {
                let at = c.frequency;
                let beside = tried.iter().filter(|t| near(t.frequency, at));
                let crowded = beside.clone().count() > 1
                    || beside.clone().any(|a| {
                        let mut others = tried.iter().filter(|b| b.frequency != a.frequency);
                        others.any(|b| near(a.frequency, b.frequency))
                    });
                let same = |t: &Tone| at.above(t.frequency).abs() * length_s < CLOSEST;
                crowded
                    || tried.iter().any(same)
                    || !noise.is_worth_a_fit(at.hz(), 0.5 * c.gain, &p)
            });
        }
        found.first().copied()
    }
}
