//! Ghosts: what was taken for a tone may be the image of one that was not found yet.

use super::detect::Candidate;
use super::fit::Fit;
use super::model::Samples;
use super::parameters::Model;
use super::search::{CLOSEST, Search};
use super::tone::Tone;

/// Where the ghosts of a tone are, in frame rates from it.
const GHOSTS: [f32; 4] = [1.0, -1.0, 2.0, -2.0];

/// Power of a tone's ghosts over its own below which they are not tried in its place.
const LOW_GHOST: f32 = 0.15;

impl Search {
    /// Power of a steady tone's largest ghosts over its own; 0 where the window has no single frame rate.
    pub(super) fn ghost(&self, samples: &Samples<'_>) -> f32 {
        self.band
            .fps
            .map_or(0.0, |fps| samples.ghost(fps).max(samples.ghost(2.0 * fps)))
    }

    /// Two candidates lie a multiple of the frame rate apart.
    pub(super) fn ghostly(&self, samples: &Samples<'_>, a: Candidate, b: Candidate) -> bool {
        self.band.fps.is_some_and(|fps| {
            let apart = b.frequency.above(a.frequency);
            let away = apart - fps * libm::roundf(apart / fps);
            away.abs() * samples.length_s < 1.5
        })
    }

    /// Tries each tone's ghosts, k frame rates away, in its place.
    pub(super) fn exchange(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
    ) -> bool {
        let Some(fps) = self.band.fps else {
            return false;
        };
        // With little blank time ghosts are too low to be taken for the tone, even two at one place.
        if self.ghost(samples) < LOW_GHOST {
            return false;
        }
        let mut changed = false;
        for i in 0..model.tones.len() {
            let free = |t: &&Tone| !t.modulated && !t.frozen;
            let tone = model.tones.get(i).filter(free);
            let (Some(axis), false) = (tone.and_then(|t| t.shape.rigid_axis()), self.tired(fit))
            else {
                continue;
            };
            let ghosts = self.ghosts(samples, fit, model, i, fps);
            let Some(mut without) = samples.copy_of(model) else {
                break;
            };
            without.tones.swap_remove(i);
            for candidate in &ghosts {
                let Some(mut trial) = samples.copy_of(&without) else {
                    break;
                };
                if self.put(
                    samples,
                    fit,
                    &mut trial,
                    Tone::steady(candidate.frequency, axis),
                ) && trial.squares < 0.9999 * model.squares
                {
                    model.copy(&trial);
                    changed = true;
                    break;
                }
            }
        }
        changed
    }

    /// Places k frame rates from tone `i` where, without it, the residual holds at least half as much as at its own.
    pub(super) fn ghosts(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &Model,
        i: usize,
        fps: f32,
    ) -> heapless::Vec<Candidate, { GHOSTS.len() }> {
        let mut ghosts = heapless::Vec::new();
        let Some(mut probes) = samples.copy_of(model) else {
            return ghosts;
        };
        let Some(tone) = probes.tones.get_mut(i) else {
            return ghosts;
        };
        let own = tone.frequency;
        let axis = tone.shape.rigid_axis().unwrap_or(0);
        tone.shape.clear();
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
                let _ = probes.tones.push(Tone::steady(frequency, axis));
                let _ = ghosts.push(Candidate {
                    axis,
                    frequency,
                    gain: 0.0,
                });
            }
        }
        if ghosts.is_empty() {
            return ghosts;
        }
        fit.evaluate(samples, &mut probes);
        let here = fit.held(i, axis);
        for (j, ghost) in ghosts.iter_mut().enumerate() {
            ghost.gain = fit.held(first + j, axis);
        }
        ghosts.retain(|g| g.gain > 0.5 * here);
        ghosts
    }
}
