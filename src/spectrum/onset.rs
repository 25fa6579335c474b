//! When a tone was struck, to one sample.
//!
//! A tone with an onset is nothing before it, so what it takes off the sum of squares is a sum over the
//! samples after it: each gains 2·w·x·m − w·m² of it, x what is left without the tone, m what the tone
//! would be there. The onset is where the sum of all gains from there on is most.

use super::model::Samples;
use super::parameters::Model;
use super::window::unpack_weight;

/// The onset is looked for so many frames before and after where it is.
const FRAMES: usize = 1;

/// Moves the onset of the last tone of `model` to where it explains most, with `gains` as working memory.
pub(crate) fn place(samples: &mut Samples<'_>, model: &mut Model, gains: &mut [f32]) {
    let Some((tone, others)) = model.tones.split_last() else {
        return;
    };
    let (n, slots) = (samples.frames, samples.slots);
    let Some(onset) = tone.onset.filter(|_| n > 0 && slots > 0) else {
        return;
    };
    let within = |t: &f32| *t + samples.slot_t[slots - 1] < onset;
    let frame = samples.frame_t[..n]
        .iter()
        .take_while(|t| within(t))
        .count();
    let (from, to) = (frame.saturating_sub(FRAMES), (frame + FRAMES + 1).min(n));
    let Some(gains) = gains.get_mut(..(to - from.min(to)) * slots) else {
        return;
    };
    gains.fill(0.0);
    let mut early = *tone;
    early.onset = Some(samples.frame_t[from.min(n - 1)] + samples.slot_t[0] - 1e-6);
    // The shape is as it was at the onset: moved back with it.
    let moved = early.onset.unwrap_or(onset) - onset;
    let scale = libm::expf((early.growth * moved).clamp(-20.0, 20.0));
    for (i, other) in others.iter().enumerate() {
        samples.tabulate(i + 1, other);
    }
    samples.set_notches(others);
    for series in 0..samples.series() {
        if samples.series_weight[series] <= 0.0 {
            continue;
        }
        let slot = series % slots;
        samples.residual(series, others, &model.drift);
        samples.own_phasors(&early, slot);
        let c = samples
            .sight(series)
            .seen(&early.shape, early.frequency.hz())
            .scale(scale);
        for i in from..to {
            let m = c.re * samples.own_re[i] + c.im * samples.own_im[i];
            let w = unpack_weight(samples.weight[series * n + i]);
            gains[(i - from) * slots + slot] += m * (2.0 * samples.row[i] - w * m);
        }
    }
    // From the last sample on back.
    let (mut sum, mut most, mut first) = (0.0, 0.0, None);
    for (i, &gain) in gains.iter().enumerate().rev() {
        sum += gain;
        if sum > most {
            (most, first) = (sum, Some(i));
        }
    }
    let Some(first) = first else { return };
    let time = |i: usize| samples.frame_t[from + i / slots] + samples.slot_t[i % slots];
    let spacing = (samples.slot_t[slots - 1] - samples.slot_t[0]) / slots.max(2) as f32;
    let placed = time(first) - 0.5 * spacing;
    if let Some(tone) = model.tones.last_mut() {
        let scale = libm::expf((tone.growth * (placed - onset)).clamp(-20.0, 20.0));
        tone.onset = Some(placed);
        for j in tone.shape.fitted() {
            tone.shape.change(j, |c| *c = c.scale(scale));
        }
    }
}
