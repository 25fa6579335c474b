//! What is said of the fitted tones: amplitudes of the object, standard deviations, what is not to be trusted.

use super::config::Config;
use super::detect::Band;
use super::fit::{Fit, Model};
use super::largest::{direction, largest};
use super::model::Samples;
use super::smear::Smear;
use crate::report::{MAX_PEAKS, Peak};
use crate::timeline::{Curvature, Group};

/// Below this share of an amplitude left by exposure and averaging, a tone is not reported: its amplitude would
/// be guessed.
const LEAST_ATTENUATION: f32 = 0.15;

/// A tone of which the amplitude is not known better than this (over its standard deviation) is no peak: it is all
/// but hidden by a multiple of the frame rate.
const LEAST_KNOWN: f32 = 3.0;

/// Tones nearer than this many 1/T to a multiple of the frame rate are ambiguous.
const NEAR_MULTIPLE: f32 = 1.0;

/// A tone of which less than this share is left after the projection is ambiguous.
const KEPT_ENOUGH: f32 = 0.6;

/// Nearer than this many 1/T to an image of a larger tone, a tone is ambiguous.
const AS_IMAGE: f32 = 1.0;

/// From this power over the noise on it is looked at what a tone's shape leaves at its alias frequency: 20 dB.
const STRONG: f32 = 100.0;

/// What was found in a window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tones {
    /// The tones, the largest amplitude first. Not yet tracked.
    pub peaks: heapless::Vec<Peak, MAX_PEAKS>,
    /// Change of frequency over time of each peak, Hz/s; 0 where a steady tone explains it.
    pub hz_per_s: heapless::Vec<f32, MAX_PEAKS>,
    /// There were more tones than fit.
    pub more: bool,
    /// A vibration at a multiple of the frame rate would not be seen.
    pub hidden: bool,
    /// Frame rate, Hz; 0 with less than two frames.
    pub fps: f32,
    /// Standard deviation of a sample of average weight, px.
    pub sample_noise_px: f32,
    /// Standard deviation of one row, px.
    pub row_noise_px: f32,
}

impl Tones {
    /// A window in which nothing can be found.
    pub(crate) fn nothing(fps: f32) -> Self {
        Self {
            fps,
            ..Self::default()
        }
    }
}

/// What must be known to tell of a fitted model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Telling<'a> {
    pub(crate) config: &'a Config,
    pub(crate) group: &'a Group,
    pub(crate) band: Band,
    pub(crate) fps: f32,
    pub(crate) curvature: Curvature,
}

impl Telling<'_> {
    /// The tones of `model`, those that are asked for and known well enough.
    pub(crate) fn tones(&self, samples: &mut Samples<'_>, fit: &mut Fit, model: &Model) -> Tones {
        let mut tones = Tones::nothing(self.fps);
        // Weights have a mean of one, so this is px² already.
        let variance = model.squares / Fit::freedom(samples, model).max(1.0);
        let noise = crate::math::sqrtf(variance);
        if noise.is_finite() {
            tones.sample_noise_px = noise;
            tones.row_noise_px =
                noise * crate::math::sqrtf(f32::from(self.group.rows_per_sample()));
        }
        let smear = Smear::of(self.group, self.curvature, model);
        let mut list: heapless::Vec<(Peak, f32), MAX_PEAKS> = heapless::Vec::new();
        self.tell(samples, fit, (model, variance), &smear, &mut list);
        if model.has_notches() {
            let mut strong = model.without_notches();
            fit.evaluate(samples, &mut strong);
            self.tell(samples, fit, (&strong, variance), &smear, &mut list);
        }
        largest_first(&mut list);
        self.doubt_images(samples.length_s, &mut list);
        tones.more = list.len() > self.config.max_peaks;
        list.truncate(self.config.max_peaks);
        for (peak, slope) in &list {
            let _ = tones.peaks.push(*peak);
            let _ = tones.hz_per_s.push(*slope);
        }
        let (low, high) = self.asked_hz();
        tones.hidden = self.band.fps.is_some_and(|fps| {
            let lowest = low.max(self.band.lowest_hz);
            let first = fps * libm::ceilf(lowest / fps).max(1.0);
            first <= high.min(self.band.highest_hz)
        });
        tones
    }

    /// The free tones of `model`, with the noise's variance.
    fn tell(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        (model, variance): (&Model, f32),
        smear: &Smear<'_>,
        list: &mut heapless::Vec<(Peak, f32), MAX_PEAKS>,
    ) {
        let noise = crate::math::sqrtf(variance);
        let (low, high) = self.asked_hz();
        let regressors = fit.weigh(samples, model);
        for (i, tone) in model.tones.iter().enumerate().filter(|(_, t)| !t.frozen) {
            let hz = tone.frequency.hz();
            let attenuation = self.group.attenuation(hz);
            if !(low..=high).contains(&hz) || attenuation < LEAST_ATTENUATION {
                continue;
            }
            let (eta, orbit) = largest(&tone.shape);
            let amplitude = orbit.semi_major_px;
            let along = direction(eta, &orbit);
            let unit = fit.deviation(&regressors, i, samples.length_s, &along);
            // One that changes is no standing deformation, wherever it is.
            let kept = tone.modulated || samples.kept(&samples.frame_means(i + 1)) >= KEPT_ENOUGH;
            let power = samples.total_weight * tone.shape.power() / (4.0 * variance).max(1e-30);
            let amplitude_px = amplitude / attenuation;
            let sd_px = noise * unit.amplitude_px / attenuation;
            let doubt = if power > STRONG {
                samples.residue(model, i, variance).stretch()
            } else {
                1.0
            };
            let smeared = smear.correction(amplitude_px, hz);
            let doubt_px = smeared.doubt * amplitude_px;
            let peak = Peak {
                hz,
                hz_sd: noise * unit.hz * doubt,
                amplitude_px: amplitude_px * smeared.scale,
                amplitude_px_sd: crate::math::sqrtf(sd_px * sd_px + doubt_px * doubt_px),
                snr_db: 10.0 * libm::log10f(power.max(1e-9)),
                ambiguous: self.near_multiple(hz, samples.length_s) || !kept || tone.unsure,
                track: 0,
                harmonic: None,
            };
            if is_sound(&peak) {
                let slope = tone.chirp / (samples.length_s * samples.length_s);
                let _ = list.push((peak, slope));
            }
        }
    }

    /// What is at an image of a larger tone may be that one's, or a tone of its own.
    fn doubt_images(&self, length_s: f32, list: &mut [(Peak, f32)]) {
        let Some(fps) = self.band.fps else { return };
        for i in 1..list.len() {
            let (larger, rest) = list.split_at_mut(i);
            let Some((peak, _)) = rest.first_mut() else {
                return;
            };
            peak.ambiguous |= larger.iter().any(|(other, _)| {
                [peak.hz - other.hz, peak.hz + other.hz]
                    .iter()
                    .any(|apart| {
                        let k = libm::roundf(apart / fps);
                        k != 0.0 && (apart - k * fps).abs() * length_s < AS_IMAGE
                    })
            });
        }
    }

    /// Lowest and highest frequency that is reported.
    fn asked_hz(&self) -> (f32, f32) {
        let low = self.config.min_hz.unwrap_or(0.0);
        let high = self.config.max_hz.unwrap_or(f32::INFINITY);
        (low, high)
    }

    fn near_multiple(&self, hz: f32, length_s: f32) -> bool {
        self.band.fps.is_some_and(|fps| {
            let away = hz - fps * libm::roundf(hz / fps);
            away.abs() * length_s < NEAR_MULTIPLE
        })
    }
}

/// All of its numbers are numbers, and its amplitude is known.
fn is_sound(peak: &Peak) -> bool {
    peak.amplitude_px > LEAST_KNOWN * peak.amplitude_px_sd
        && peak.hz_sd.is_finite()
        && peak.amplitude_px.is_finite()
        && peak.amplitude_px_sd.is_finite()
}

/// Insertion: there are sixteen at most, and the library's sort is 2 KiB of flash.
fn largest_first(list: &mut [(Peak, f32)]) {
    for end in 1..list.len() {
        for i in (0..end).rev() {
            if list[i].0.amplitude_px >= list[i + 1].0.amplitude_px {
                break;
            }
            list.swap(i, i + 1);
        }
    }
}
