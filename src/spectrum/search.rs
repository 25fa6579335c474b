//! One more tone at a time, until the next is no more than noise would be.

use super::alarm;
use super::detect::{self, Candidate, Candidates};
use super::fit::{Fit, drift_powers};
use super::largest::{direction, largest};
use super::model::Samples;
use super::parameters::Model;
use super::periodogram::Band;
use super::phase::Frequency;
use super::residual::Residual;
use super::tone::Tone;

/// Refinement steps of a trial and of the final fit.
pub(super) const STEPS: u32 = 12;

/// Tones nearer than this are one, turns a window length.
pub(super) const CLOSEST: f32 = 0.5;

/// What is this near to a ghost's place is the ghost, turns a window length.
const AS_GHOST: f32 = 1.0;

/// What is no steady tone may have ghosts of so many times the power that a steady one's would have.
const UNLIKE_A_TONE: f32 = 4.0;

/// With fewer frames, a drift is fitted only where it is seen.
const FEW_FRAMES: usize = 16;

/// A drift that lowers the sum of squares by more than this many noise variances is seen.
const DRIFT_SEEN: f32 = 9.0;

/// Starts near a multiple of the frame rate, turns a window length from it.
const NEARER: [f32; 4] = [0.15, -0.15, 0.04, -0.04];

/// A fitted tone keeps at least this share of its energy in the projection.
const LEAST_KEPT: f32 = 3e-5;

/// A tone this near a larger one may come of its changing within the window, turns a window length.
pub(super) const BESIDE: f32 = 6.0;

/// Tones this near each other, turns a window length, are near enough to be noise in a few cells.
pub(super) const PAIR: f32 = 8.0;

/// So many tones near one are noise in a few cells, or one that changes.
const CLUSTER: usize = 3;

/// So many tones are found before what is left is given up as noise.
const FEW_TONES: usize = 3;

/// Where samples know both axes: how much of the false alarms is for tones along x, so that next to nothing is lost of those.
const ALONG_X: f32 = 0.9;

/// Places at which nothing could be put, or where noise explains what is there, that are remembered.
const MOST_BARRED: usize = 12;

/// Where the residual holds more than noise but no tone can be put: too near another, or slower than the window can tell.
pub(super) struct Barred {
    places: heapless::Vec<Candidate, MOST_BARRED>,
    /// Power that ghosts may have over that of where they come from.
    ghost: f32,
}

/// How the search is to be done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    pub(crate) band: Band,
    pub(crate) most_tones: usize,
    pub(crate) false_alarm: f32,
    pub(crate) most_passes: u32,
}

/// What a search ended with.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// A further tone was above the false-alarm level but there was no room for it, or too much is left that is no tone.
    pub(crate) more: bool,
}

impl Search {
    /// Fits tones to the samples, into `model`; into `plain` as if the noise were white, unless that is hopeless.
    pub(crate) fn run(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        plain: &mut Model,
        residual: &mut Residual<'_>,
    ) -> Outcome {
        fit.passes = 0;
        model.clear(drift_powers(samples));
        fit.refine(samples, model, 2);
        residual.leave_outliers_out(samples, model);
        // Where tones explain all but white noise, no floor is asked for.
        let mut outcome = self.search(samples, fit, model, residual);
        residual.look_all(samples, model);
        let hopeless = residual.is_hopeless();
        plain.copy(model);
        if !residual.is_white() || self.crowded(samples, model) {
            residual.begin_again();
            let rest = self.most_passes.saturating_sub(fit.passes);
            let again = Self {
                most_passes: fit.passes + rest.max(self.most_passes / 2),
                ..*self
            };
            outcome = again.search(samples, fit, model, residual);
        }
        fit.refine(samples, model, STEPS);
        if model.has_notches() {
            if let Some(mut strong) = samples.copy_of(model) {
                strong.free_notched();
                fit.refine(samples, &mut strong, STEPS);
                model.take_free(&strong);
            }
            fit.refine(samples, model, STEPS);
        }
        if samples.frames < FEW_FRAMES {
            self.drop_drift(samples, fit, model);
        }
        if hopeless || !residual.is_strict() {
            plain.copy(model);
        }
        outcome
    }

    /// Adds, exchanges and drops tones while that explains more, from none on.
    fn search(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        residual: &mut Residual<'_>,
    ) -> Outcome {
        let mut outcome = Outcome::default();
        model.clear(drift_powers(samples));
        fit.refine(samples, model, 2);
        // Each round adds, exchanges or drops a tone; the bound only guards against going round in circles.
        for _ in 0..3 * self.most_tones + 3 {
            if self.add(samples, fit, model, residual, &mut outcome) {
                self.claim(samples, fit, model);
                self.stand(samples, fit, model, model.tones.len().saturating_sub(1));
                residual.forget();
                continue;
            }
            if self.tired(fit) || residual.is_hopeless() {
                break;
            }
            let exchanged = self.exchange(samples, fit, model);
            let dropped = self.drop_weak(samples, fit, model, residual);
            let mut stood = false;
            for i in 0..model.tones.len() {
                // Among more tones than there is room for, what a tone leaves is as likely another's.
                stood |= !outcome.more && self.stand(samples, fit, model, i);
            }
            let notched = self.notch_misfit(samples, fit, model);
            if !exchanged && !dropped && !stood && !notched {
                break;
            }
            residual.forget();
        }
        outcome
    }

    /// Some tones are so near each other that together they may be noise in a few cells.
    fn crowded(&self, samples: &Samples<'_>, model: &Model) -> bool {
        let tones = model.tones.iter().enumerate();
        let near =
            |a: &Tone, b: &Tone| a.frequency.above(b.frequency).abs() * samples.length_s < PAIR;
        tones
            .into_iter()
            .any(|(i, a)| model.tones.iter().take(i).any(|b| near(a, b)))
    }

    /// In few frames a drift and a tone near a multiple of the frame rate are hard to tell apart: a drift that
    /// explains no more than noise would is taken for none.
    fn drop_drift(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &mut Model) {
        let freedom = Fit::freedom(samples, model).max(1.0);
        for powers in 0..model.drift_powers {
            let Some(mut trial) = samples.copy_of(model) else {
                break;
            };
            trial.drift_powers = powers;
            trial.drift = [[0.0; 2]; 2];
            fit.refine(samples, &mut trial, STEPS);
            let worse = (trial.squares - model.squares) / model.squares * freedom;
            if worse < DRIFT_SEEN && self.sound(samples, &trial) {
                model.copy(&trial);
                return;
            }
        }
        fit.refine(samples, model, 1);
    }

    /// The passes are used up, but for the last refinement.
    pub(super) fn tired(&self, fit: &Fit) -> bool {
        fit.passes.saturating_add(STEPS) > self.most_passes
    }

    /// T_e = √(4π·var t) = 1.023 T for samples spread evenly, times the band.
    fn widths(&self, samples: &Samples<'_>) -> f32 {
        (self.band.highest_hz - self.band.lowest_hz) * samples.length_s * 1.023
    }

    /// The share of windows of noise that may report a tone along `axis`, and in how many widths of a peak it may be.
    pub(super) fn alarms(&self, samples: &Samples<'_>, axis: usize) -> (f32, f32) {
        let alarms = match (samples.axes, axis) {
            (1, _) => self.false_alarm,
            (_, 0) => ALONG_X * self.false_alarm,
            _ => (1.0 - ALONG_X) * self.false_alarm,
        };
        (alarms, self.widths(samples))
    }

    /// Share by which a tone along `axis` must lower the sum of squares of white noise.
    fn threshold(&self, samples: &Samples<'_>, model: &Model, axis: usize) -> f32 {
        let (alarms, widths) = self.alarms(samples, axis);
        alarm::threshold(alarms, widths, Fit::freedom(samples, model) - 3.0)
    }

    fn add(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        residual: &mut Residual<'_>,
        outcome: &mut Outcome,
    ) -> bool {
        if Fit::freedom(samples, model) < 6.0 {
            return false;
        }
        let mut barred = Barred {
            places: heapless::Vec::new(),
            ghost: UNLIKE_A_TONE * self.ghost(samples),
        };
        loop {
            let candidates = self.candidates(samples, model, &barred, residual);
            let Some(first) = candidates.first().copied() else {
                return !residual.takes_white()
                    && self.spread_out(samples, fit, model, residual, &barred);
            };
            let share = self.threshold(samples, model, first.axis);
            if self.is_noise(model, first, residual) {
                residual.give_up();
                return false;
            }
            let white = residual.takes_white();
            if white && first.gain < 0.4 * share * model.squares {
                return false;
            }
            if model.tones.len() >= self.most_tones || self.tired(fit) {
                outcome.more |= first.gain > share * model.squares;
                return false;
            }
            let before = barred.places.len();
            let Some(mut best) = samples.copy_of(model) else {
                return false;
            };
            if self.put_best(samples, fit, model, &mut best, &candidates, &mut barred) {
                if model.squares - best.squares < 2.0 * share * best.squares {
                    // Tones near each other are slow to settle: what they gain by it is not the new one's.
                    if white && model.squares - best.squares <= share * best.squares {
                        return false;
                    }
                    fit.refine(samples, model, STEPS);
                }
                let accepted = if white {
                    model.squares - best.squares > share * best.squares
                } else {
                    self.stands_out(samples, fit, model, &mut best, residual)
                        || self.changes(samples, fit, model, &mut best, residual)
                };
                if accepted {
                    if let Some(newest) = best.tones.last() {
                        let at = newest.frequency;
                        self.modulate(samples, fit, model, Some(&mut best), at, 0.0);
                    }
                    model.copy(&best);
                    return true;
                }
                if white || residual.refuse() || barred.places.push(first).is_err() {
                    return false;
                }
                residual.forget();
                continue;
            }
            // What no further tone explains may come of one's changing.
            if before == 0 && self.modulate(samples, fit, model, None, first.frequency, share) {
                return true;
            }
            if barred.places.is_full() {
                outcome.more = true;
                return false;
            }
        }
    }

    /// The largest peaks of the residual along any axis that are worth a fit.
    fn candidates(
        &self,
        samples: &mut Samples<'_>,
        model: &Model,
        barred: &Barred,
        residual: &mut Residual<'_>,
    ) -> Candidates {
        let mut found = Candidates::new();
        let length_s = samples.length_s;
        let white = !residual.is_strict();
        for axis in (0..samples.axes).rev() {
            residual.look(samples, model, axis);
            let Some(p) = residual.periodogram() else {
                continue;
            };
            let noise = residual.noise(axis);
            detect::candidates(samples, &p, &mut found, |c| {
                self.is_barred(length_s, barred, c)
                    || self.is_notched(length_s, model, c.frequency)
                    || !(white || noise.is_worth_a_fit(c.frequency.hz(), 0.5 * c.gain, &p))
            });
        }
        found
    }

    /// Some tones have been found and the strongest of what is left does not stand out of it: it is not tones.
    fn is_noise(&self, model: &Model, strongest: Candidate, residual: &Residual<'_>) -> bool {
        let noise = residual.noise(strongest.axis);
        let early = model.tones.len() < FEW_TONES || residual.is_strict() || noise.is_white();
        let p = residual.periodogram().filter(|p| p.axis == strongest.axis);
        let near =
            |a: &Tone, b: &Tone| a.frequency.above(b.frequency).abs() * residual.length_s() < PAIR;
        let cluster = |a: &Tone| model.tones.iter().filter(|b| near(a, b)).count() >= CLUSTER;
        let (at, power) = (strongest.frequency.hz(), 0.5 * strongest.gain);
        let hopeless = || p.is_some_and(|p| !noise.is_worth_a_fit(at, power, &p));
        !early && (model.tones.iter().any(cluster) || hopeless())
    }

    /// Makes `best` the model with the candidate that explains most, as a further tone, and says whether there is one. Those
    /// that cannot be put anywhere are barred.
    fn put_best(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        best: &mut Model,
        candidates: &[Candidate],
        barred: &mut Barred,
    ) -> bool {
        let Some(first) = candidates.first() else {
            return false;
        };
        let mut found = false;
        for candidate in candidates {
            // Rivals of the first are its ghosts, or it is theirs; others only count where these come to nothing.
            let rival =
                candidate.gain > 0.5 * first.gain && self.ghostly(samples, *first, *candidate);
            if (found && !rival) || self.is_barred(samples.length_s, barred, *candidate) {
                continue;
            }
            let mut put = false;
            let starts = self.starts(samples, candidate.frequency);
            for at in starts {
                if self.tired(fit) {
                    return found;
                }
                let Some(mut trial) = samples.copy_of(model) else {
                    return found;
                };
                let start = Tone::steady(at, candidate.axis);
                if self.put(samples, fit, &mut trial, start) {
                    put = true;
                    if !found || trial.squares < best.squares {
                        best.copy(&trial);
                        found = true;
                    }
                }
            }
            if !put && !found {
                let _ = barred.places.push(*candidate);
            }
        }
        found
    }

    /// Nothing can be put at this place, or it is no more than a ghost of what is at such a place: a multiple of the frame
    /// rate from it or from its mirror image.
    pub(super) fn is_barred(&self, length_s: f32, barred: &Barred, candidate: Candidate) -> bool {
        let at = candidate.frequency;
        barred.places.iter().any(|place| {
            let apart = [at.above(place.frequency), at.hz() + place.frequency.hz()];
            apart.iter().any(|apart| {
                let k = self.band.fps.map_or(0.0, |fps| libm::roundf(apart / fps));
                let away = apart - k * self.band.fps.unwrap_or(0.0);
                let low = k == 0.0 || candidate.gain < barred.ghost * place.gain;
                low && away.abs() * length_s < AS_GHOST
            })
        })
    }

    /// Where to refine a candidate from. Near a multiple of the frame rate a tone looks much like one as far on the
    /// multiple's other side, or nearer to it and larger, and no small steps lead from one to the other.
    fn starts(
        &self,
        samples: &Samples<'_>,
        frequency: Frequency,
    ) -> heapless::Vec<Frequency, { 2 + NEARER.len() }> {
        let mut starts = heapless::Vec::new();
        // There is room for all of them.
        let _ = starts.push(frequency);
        let Some(fps) = self.band.fps else {
            return starts;
        };
        let hz = frequency.hz();
        let away = hz - fps * libm::roundf(hz / fps);
        if away.abs() * samples.length_s < 1.0 {
            let _ = starts.push(frequency.plus(-2.0 * away));
            for turns in NEARER {
                let _ = starts.push(frequency.plus(turns / samples.length_s - away));
            }
        }
        starts
    }

    /// Puts a further tone into `model`; it may be there.
    pub(super) fn put(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        start: Tone,
    ) -> bool {
        if model.tones.push(start).is_err() {
            return false;
        }
        fit.refine(samples, model, STEPS);
        self.sound(samples, model)
    }

    /// Every tone is within the band, not hidden, and apart from the others.
    pub(super) fn sound(&self, samples: &Samples<'_>, model: &Model) -> bool {
        let length_s = samples.length_s;
        model.tones.iter().enumerate().all(|(i, tone)| {
            let hz = tone.frequency.hz();
            let apart = model
                .tones
                .iter()
                .take(i)
                .all(|other| tone.frequency.above(other.frequency).abs() * length_s > CLOSEST);
            let within = hz > 0.5 * self.band.lowest_hz && hz < 1.02 * self.band.highest_hz;
            apart
                && within
                && (tone.modulated || samples.kept(&samples.frame_means(i + 1)) > LEAST_KEPT)
        })
    }

    /// Drops tones that no longer lower the sum of squares enough beside the others.
    fn drop_weak(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        residual: &mut Residual<'_>,
    ) -> bool {
        if residual.is_strict() {
            residual.look_all(samples, model);
        }
        let regressors = fit.weigh(samples, model);
        let mut weakest: Option<(usize, f32)> = None;
        let steady = |t: &Tone| !t.frozen && t.onset.is_none();
        for (i, tone) in model.tones.iter().enumerate().filter(|(_, t)| steady(t)) {
            let (eta, orbit) = largest(&tone.shape, samples.rows.ends());
            let along = direction(eta, orbit.towards);
            let unit = fit.deviation(&regressors, i, samples.length_s, &along);
            let over = orbit.semi_major_px / unit.amplitude_px;
            let axis = usize::from(tone.shape.orders()[0] == 0);
            let needed = if residual.takes_white() {
                self.threshold(samples, model, axis) * model.squares
            } else {
                let alarms = self.alarms(samples, axis);
                let noise = residual.noise(axis);
                noise.needed(tone.frequency.hz(), alarms, None)
            };
            let gain = over * over / needed;
            if weakest.is_none_or(|(_, g)| gain < g) {
                weakest = Some((i, gain));
            }
        }
        match weakest {
            Some((i, gain)) if gain < 0.7 => {
                model.tones.remove(i);
                fit.refine(samples, model, STEPS);
                true
            }
            _ => false,
        }
    }
}
