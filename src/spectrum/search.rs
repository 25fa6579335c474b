//! One more tone at a time, until the next is no more than noise would be.

use microfft::Complex32 as Complex;

use super::alarm;
use super::detect::{self, Band, Candidate, LEAST_KEPT};
use super::fit::{Fit, Model};
use super::model::{Samples, Tone};

/// Refinement steps of a trial and of the final fit.
const STEPS: u32 = 8;

/// Tones nearer than this are one, turns a window length.
const CLOSEST: f32 = 0.7;

/// Where the ghosts of a tone are, in frame rates from it.
const GHOSTS: [f32; 4] = [1.0, -1.0, 2.0, -2.0];

/// How the search is to be done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    pub(crate) band: Band,
    pub(crate) most_tones: usize,
    pub(crate) false_alarm: f32,
}

/// What a search ended with.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// A further tone was above the false-alarm level but there was no room for it.
    pub(crate) more: bool,
}

impl Search {
    /// Fits tones to the samples, into `model`.
    pub(crate) fn run(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        grid: &mut [f32],
    ) -> Outcome {
        *model = Model::new();
        fit.refine(samples, model, 2);
        let mut outcome = Outcome::default();
        // Each round adds, exchanges or drops a tone; the bound only guards against going round in circles.
        for _ in 0..3 * self.most_tones + 3 {
            if self.add(samples, fit, model, grid, &mut outcome) {
                continue;
            }
            let exchanged = self.exchange(samples, fit, model);
            let dropped = self.drop_weak(samples, fit, model);
            if !exchanged && !dropped {
                break;
            }
        }
        fit.refine(samples, model, STEPS);
        outcome
    }

    /// Share by which a tone must lower the sum of squares.
    fn threshold(&self, samples: &Samples<'_>, tones: &[Tone]) -> f32 {
        // T_e = √(4π·var t) = 1.023 T for samples spread evenly.
        let widths = (self.band.highest_hz - self.band.lowest_hz) * samples.length_s * 1.023;
        alarm::threshold(self.false_alarm, widths, Fit::freedom(samples, tones) - 3.0)
    }

    fn add(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        grid: &mut [f32],
        outcome: &mut Outcome,
    ) -> bool {
        if Fit::freedom(samples, &model.tones) < 6.0 {
            return false;
        }
        let candidates = detect::candidates(samples, model, grid, self.band);
        let Some(first) = candidates.first().copied() else {
            return false;
        };
        let share = self.threshold(samples, &model.tones);
        if first.gain < 0.4 * share * model.squares {
            return false;
        }
        if model.tones.len() >= self.most_tones {
            outcome.more |= first.gain > share * model.squares;
            return false;
        }
        let mut best: Option<Model> = None;
        for candidate in candidates.iter().filter(|c| c.gain > 0.5 * first.gain) {
            let Some(trial) = self.try_tone(samples, fit, model, candidate) else {
                continue;
            };
            if best.as_ref().is_none_or(|b| trial.squares < b.squares) {
                best = Some(trial);
            }
        }
        match best {
            Some(best) if model.squares - best.squares > share * best.squares => {
                *model = best;
                true
            }
            _ => false,
        }
    }

    fn try_tone(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        candidate: &Candidate,
    ) -> Option<Model> {
        let mut trial = model.clone();
        trial.tones.push(Tone::steady(candidate.frequency)).ok()?;
        fit.refine(samples, &mut trial, STEPS);
        self.sound(samples, &trial).then_some(trial)
    }

    /// Every tone is within the band, not hidden, and apart from the others.
    fn sound(&self, samples: &Samples<'_>, model: &Model) -> bool {
        let length_s = samples.length_s;
        model.tones.iter().enumerate().all(|(i, tone)| {
            let hz = tone.frequency.hz();
            let apart = model
                .tones
                .iter()
                .take(i)
                .all(|other| tone.frequency.above(other.frequency).abs() * length_s > CLOSEST);
            let within = hz > 0.5 * self.band.lowest_hz && hz < 1.02 * self.band.highest_hz;
            apart && within && samples.kept(&samples.frame_means(i + 1)) > LEAST_KEPT
        })
    }

    /// Tries each tone's ghosts, k frame rates away, in its place.
    fn exchange(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &mut Model) -> bool {
        let Some(fps) = self.band.fps else {
            return false;
        };
        let mut changed = false;
        for i in 0..model.tones.len() {
            let ghosts = self.ghosts(samples, fit, model, i, fps);
            let mut without = model.clone();
            without.tones.swap_remove(i);
            for candidate in &ghosts {
                if let Some(trial) = self.try_tone(samples, fit, &without, candidate)
                    && trial.squares < 0.9999 * model.squares
                {
                    *model = trial;
                    changed = true;
                    break;
                }
            }
        }
        changed
    }

    /// Places k frame rates from tone `i` where, without it, the residual holds at least half as much as at its own.
    fn ghosts(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        i: usize,
        fps: f32,
    ) -> heapless::Vec<Candidate, { GHOSTS.len() }> {
        let mut ghosts = heapless::Vec::new();
        let mut probes = model.clone();
        let Some(tone) = probes.tones.get_mut(i) else {
            return ghosts;
        };
        let own = tone.frequency;
        tone.amplitude = Complex::new(0.0, 0.0);
        tone.modulated = false;
        let first = probes.tones.len();
        for k in GHOSTS {
            let frequency = own.plus(k * fps);
            let hz = frequency.hz();
            let within = hz > self.band.lowest_hz && hz < self.band.highest_hz;
            let free = model
                .tones
                .iter()
                .all(|t| t.frequency.above(frequency).abs() * samples.length_s > CLOSEST);
            if within && free && first + ghosts.len() < samples.most_tones() {
                let _ = probes.tones.push(Tone::steady(frequency));
                let _ = ghosts.push(Candidate {
                    frequency,
                    gain: 0.0,
                });
            }
        }
        if ghosts.is_empty() {
            return ghosts;
        }
        fit.evaluate(samples, &mut probes);
        let here = fit.held(i);
        for (j, ghost) in ghosts.iter_mut().enumerate() {
            ghost.gain = fit.held(first + j);
        }
        ghosts.retain(|g| g.gain > 0.5 * here);
        ghosts
    }

    /// Drops tones that no longer lower the sum of squares enough beside the others.
    fn drop_weak(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &mut Model) -> bool {
        let share = self.threshold(samples, &model.tones);
        let regressors = fit.weigh(samples, model);
        let mut weakest: Option<(usize, f32)> = None;
        for (i, tone) in model.tones.iter().enumerate() {
            let sd = fit
                .deviation(&regressors, model, i, samples.length_s)
                .amplitude_px;
            let gain = tone.amplitude.norm_sqr() / (sd * sd);
            if weakest.is_none_or(|(_, g)| gain < g) {
                weakest = Some((i, gain));
            }
        }
        match weakest {
            Some((i, gain)) if gain < 0.7 * share * model.squares => {
                model.tones.remove(i);
                fit.refine(samples, model, STEPS);
                true
            }
            _ => false,
        }
    }
}
