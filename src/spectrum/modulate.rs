//! Tones whose frequency or amplitude changes within the window.

use super::fit::Fit;
use super::model::Samples;
use super::parameters::Model;
use super::phase::Frequency;
use super::search::{BESIDE, STEPS, Search};
use super::tone::Tone;

/// Fastest change of frequency tried, turns a window length squared.
const MOST_CHIRP: f32 = 4.0;

/// Changes of frequency from which a changing tone is refined.
const CHIRPS: [f32; 7] = [
    0.0,
    0.3 * MOST_CHIRP,
    -0.3 * MOST_CHIRP,
    0.65 * MOST_CHIRP,
    -0.65 * MOST_CHIRP,
    MOST_CHIRP,
    -MOST_CHIRP,
];

impl Search {
    /// A tone that changes within the window has others beside it in a steady model. Where what is `beside` is near a
    /// larger tone, and that one's frequency and amplitude changing instead lowers the sum of squares by more than `share`,
    /// this is what `with` becomes: the model with a further tone there. Without one, where none could be put, `model` does.
    pub(super) fn modulate(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        model: &mut Model,
        with: Option<&mut Model>,
        beside: Frequency,
        share: f32,
    ) -> bool {
        let length_s = samples.length_s;
        let near = |tone: &Tone| beside.above(tone.frequency) * length_s;
        let Some(i) = model.tones.iter().position(|t| near(t).abs() < BESIDE) else {
            return false;
        };
        let so_far = with.as_deref().unwrap_or(model);
        let (Some(old), Some(a)) = (model.tones.get(i), so_far.tones.get(i)) else {
            return false;
        };
        let pa = a.shape.power();
        let further = so_far.tones.get(model.tones.len());
        let pb = further.map_or(0.0, |b| b.shape.power());
        let center = old
            .frequency
            .plus(pb / (pa + pb) * beside.above(a.frequency));
        let (to_beat, once) = (so_far.squares, further.is_none());
        for chirp in CHIRPS {
            if self.tired(fit) {
                break;
            }
            let Some(mut trial) = samples.copy_of(model) else {
                break;
            };
            match trial.tones.get_mut(i) {
                Some(tone) if tone.frozen => break,
                Some(tone) if !tone.modulated && chirp == 0.0 => tone.modulated = true,
                Some(tone) if !tone.modulated => {
                    tone.shape.clear();
                    *tone = Tone {
                        modulated: true,
                        chirp,
                        shape: tone.shape,
                        ..Tone::steady(center, 0)
                    };
                }
                _ => break,
            }
            fit.refine(samples, &mut trial, STEPS);
            let stayed = trial.tones.get(i).is_some_and(|tone| {
                tone.chirp.abs() < 2.0 * MOST_CHIRP
                    && (tone.frequency.above(center) * length_s).abs() < BESIDE
            });
            if stayed && to_beat - trial.squares > share * trial.squares {
                let sound = self.sound(samples, &trial);
                if sound {
                    with.unwrap_or(model).copy(&trial);
                }
                return sound;
            }
            if once {
                break;
            }
        }
        false
    }
}
