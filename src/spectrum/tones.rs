//! What is said of the fitted tones: amplitudes of the object, standard deviations, what is not to be trusted.

use num_complex::Complex32 as Complex;

use super::config::Config;
use super::fit::Fit;
use super::gram::Regressors;
use super::largest::{Orbit, direction, largest};
use super::model::Samples;
use super::motion::{Bands, Scale, believe_bands, over_rows};
use super::parameters::Model;
use super::periodogram::Band;
use super::residual::Residual;
use super::sidebands::{Found, List, name_groups, name_modulations};
use super::smear::Smear;
use super::timebase::Look;
use super::tone::Tone;
use crate::math::sqrtf;
use crate::report::{
    BroadBand, FloorPoint, MAX_FLOOR, MAX_PEAKS, MAX_SHAPES, Motion, Peak, PeakShape,
};
use crate::timeline::{Curvature, Group};

/// Below this share of an amplitude left by exposure and averaging, a tone is not reported: its amplitude would
/// be guessed.
const LEAST_ATTENUATION: f32 = 0.2;

/// A tone of which the amplitude is not known better than this (over its standard deviation) is no peak: it is all
/// but hidden by a multiple of the frame rate.
const LEAST_KNOWN: f32 = 3.0;

/// Tones nearer than this many 1/T to a multiple of the frame rate are ambiguous.
const NEAR_MULTIPLE: f32 = 1.0;

/// A tone of which less than this share is left after the projection is ambiguous.
const KEPT_ENOUGH: f32 = 0.6;

/// Nearer than this many 1/T to an image of a larger tone, a tone is ambiguous.
const AS_IMAGE: f32 = 1.0;

/// From this swing on, px, rows' answers bend so far that harmonics have images ...
const SWING_PX: f32 = 0.7;

/// ... up to this one (the third is as large, but one in eight other tones would be doubted for it) ...
const BENT_HARMONICS: u8 = 2;

/// ... and up to this share of the swing.
const SMALL_SHARE: f32 = 0.05;

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
    /// The motion contradicts the product of frame rate and line time.
    pub timing_contradiction: bool,
    /// What the line time must be if the frame rate is right, µs, where one value fits.
    pub line_time_us_fit: Option<f32>,
    /// What is no tone, against frequency, along x.
    pub noise_floor: heapless::Vec<FloorPoint, MAX_FLOOR>,
    /// Root mean square of the motion that is no tone, px.
    pub other_px_rms: f32,
    /// Broad-band measures of tones and all else; `None` where the camera cannot know.
    pub broad_band: Option<BroadBand>,
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
    /// From the time that is 0 in the fit to the middle of the window, s.
    pub(crate) middle_s: f32,
    /// From the recording's beginning to the time that is 0 in the fit, ns.
    pub(crate) since_begin_ns: i64,
}

/// Shapes over the rows of the peaks that are not rigid.
pub(crate) type Shapes = heapless::Vec<PeakShape, MAX_SHAPES>;

/// What is known of a tone before exposure and averaging are undone, deviations for unit noise.
#[derive(Clone, Debug, Default)]
struct Told {
    semi_major_px: f32,
    unit: f32,
    unit_hz: f32,
    orbit: Orbit,
    /// Amplitude and its deviation along x and y.
    axes: [Option<(f32, f32)>; 2],
    /// Over the noise in the whole window.
    power: f32,
    /// What deviations of the frequency are to be multiplied by.
    stretch: f32,
    rigid: bool,
    bands: Option<Bands>,
}

impl Telling<'_> {
    /// The tones of `model`, those that are asked for and known well enough.
    pub(crate) fn tones(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        (model, plain): (&Model, &Model),
        residual: &mut Residual<'_>,
        shapes: &mut Shapes,
    ) -> Tones {
        let mut tones = Tones::nothing(self.fps);
        // Weights have a mean of one, so this is px² already.
        let variance = model.squares / Fit::freedom(samples, model).max(1.0);
        let noise = sqrtf(variance);
        if noise.is_finite() {
            tones.sample_noise_px = noise;
            tones.row_noise_px = noise * sqrtf(f32::from(self.group.rows_per_sample()));
        }
        let smear = Smear::of(self.group, self.curvature, model);
        let mut list = List::new();
        shapes.clear();
        residual.look_all(samples, model);
        // z is half the power over the window's cells: a one-sided density is 2z·T/N.
        let density = 2.0 * samples.length_s / samples.total_weight.max(1.0);
        tones.noise_floor = residual.noise(0).points(self.band.highest_hz, density);
        tones.other_px_rms = residual.noise(0).other_px_rms();
        self.tell(samples, fit, (model, residual), &smear, (&mut list, shapes));
        if model.has_notches()
            && let Some(mut strong) = samples.copy_of(model)
        {
            strong.free_notched();
            fit.evaluate(samples, &mut strong);
            self.tell(
                samples,
                fit,
                (&strong, residual),
                &smear,
                (&mut list, shapes),
            );
        }
        let unexplained = plain.squares / Fit::freedom(samples, plain).max(1.0);
        let is_told = !list.is_empty();
        self.check_time_base(samples, fit, (plain, unexplained, is_told), &mut tones);
        largest_first(&mut list);
        name_modulations(&mut list, samples.length_s);
        name_groups(&mut list, samples.length_s);
        largest_first(&mut list);
        self.doubt_images(samples.length_s, &mut list);
        tones.more = list.len() > self.config.max_peaks;
        list.truncate(self.config.max_peaks);
        shapes.retain(|s| list.iter().any(|f| f.peak.hz == s.hz));
        for found in &list {
            let _ = tones.peaks.push(found.peak);
            let _ = tones.hz_per_s.push(found.hz_per_s);
        }
        let (low, high) = self.asked_hz();
        tones.hidden = self.band.fps.is_some_and(|fps| {
            let lowest = low.max(self.band.lowest_hz);
            let first = fps * libm::ceilf(lowest / fps).max(1.0);
            first <= high.min(self.band.highest_hz)
        });
        tones
    }

    /// What the motion says of frame rate and line time.
    fn check_time_base(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        (model, variance, is_told): (&Model, f32, bool),
        tones: &mut Tones,
    ) {
        let Some(fps) = self.band.fps else { return };
        let Some(mut plain) = samples.copy_of(model) else {
            return;
        };
        for tone in &mut plain.tones {
            tone.notched = false;
        }
        let look = Look {
            model: &plain,
            variance,
            fps,
            highest_hz: self.band.highest_hz,
            is_told,
        };
        let base = look.check(samples, fit);
        let line_us = self.group.timing().line_time_ps() as f32 * 1e-6;
        tones.timing_contradiction = base.contradiction;
        tones.line_time_us_fit = base.ratio.map(|ratio| ratio * line_us);
    }

    /// The free tones of `model`, with the noise at them.
    fn tell(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        (model, residual): (&Model, &Residual<'_>),
        smear: &Smear<'_>,
        (list, shapes): (&mut List, &mut Shapes),
    ) {
        let (low, high) = self.asked_hz();
        let regressors = fit.weigh(samples, model);
        for (i, tone) in model.tones.iter().enumerate().filter(|(_, t)| !t.frozen) {
            let hz = tone.frequency.hz();
            let attenuation = self.group.attenuation(hz);
            if !(low..=high).contains(&hz) || attenuation < LEAST_ATTENUATION {
                continue;
            }
            let axis = usize::from(tone.shape.orders()[0] == 0);
            let variance = residual.variance(hz, axis);
            let noise = sqrtf(variance);
            let told = self.told(samples, fit, &regressors, (model, i), variance);
            let smeared = smear.correction(told.semi_major_px / attenuation, hz);
            let turned = if self.group.exposed(hz) < 0.0 {
                -1.0
            } else {
                1.0
            };
            let scale = Scale {
                factor: turned * smeared.scale / attenuation,
                zero_ns: self.since_begin_ns,
            };
            // One that changes is no standing deformation, wherever it is.
            let kept = tone.modulated || samples.kept(&samples.frame_means(i + 1)) >= KEPT_ENOUGH;
            let amplitude_px = told.semi_major_px * scale.factor.abs();
            let sd_px = noise * told.unit / attenuation;
            let doubt_px = smeared.doubt * amplitude_px;
            let peak = Peak {
                hz,
                hz_sd: noise * told.unit_hz * told.stretch,
                amplitude_px,
                amplitude_px_sd: sqrtf(sd_px * sd_px + doubt_px * doubt_px),
                snr_db: 10.0 * libm::log10f(told.power.max(1e-9)),
                ambiguous: self.near_multiple(hz, samples.length_s) || !kept || tone.unsure,
                track: 0,
                harmonic: None,
                motion: Some(self.motion(samples, &told, tone, noise, scale)),
            };
            if !is_sound(&peak) {
                continue;
            }
            let slope = tone.chirp / (samples.length_s * samples.length_s);
            // In the middle of the window; the fit knows it in the middle of its samples.
            let mut peak = peak;
            peak.hz += slope * self.middle_s;
            let _ = list.push(Found {
                peak,
                hz_per_s: slope,
                amplitude: told.orbit.amplitudes[axis],
                axis,
            });
            if !told.rigid {
                let _ = shapes.push(over_rows(samples, tone, told.bands.as_ref(), scale));
            }
        }
    }

    /// What is to be told of tone `i` of `model`.
    fn told(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        regressors: &Regressors,
        (model, i): (&Model, usize),
        variance: f32,
    ) -> Told {
        let mut told = Told::default();
        let Some(tone) = model.tones.get(i) else {
            return told;
        };
        let (eta, orbit) = largest(&tone.shape, samples.rows.ends());
        let length_s = samples.length_s;
        let along = |towards: [Complex; 2]| {
            let along = direction(eta, towards);
            let growing = tone.onset.unwrap_or(0.0) * orbit.semi_major_px;
            fit.deviation_growing(regressors, i, length_s, (&along, growing))
        };
        let unit = along(orbit.towards);
        (told.unit, told.unit_hz) = (unit.amplitude_px, unit.hz);
        (told.semi_major_px, told.orbit) = (orbit.semi_major_px, orbit);
        for (axis, c) in orbit.amplitudes.into_iter().enumerate() {
            if tone.shape.orders()[axis] > 0 {
                let size = sqrtf(c.norm_sqr());
                let mut towards = [Complex::new(0.0, 0.0); 2];
                towards[axis] = if size > 0.0 {
                    c.unscale(size)
                } else {
                    Complex::new(1.0, 0.0)
                };
                told.axes[axis] = Some((size, along(towards).amplitude_px));
            }
        }
        told.rigid = tone.shape.orders().iter().all(|&o| o < 2);
        told.power =
            samples.seen_power(&tone.shape, tone.frequency.hz()) / (4.0 * variance).max(1e-30);
        told.stretch = 1.0;
        let still = samples.axes > 1 && told.axes.iter().any(Option::is_none);
        if told.power < STRONG && !still {
            return told;
        }
        let scores = samples.score(model, i, |_| false);
        for axis in 0..samples.axes {
            if told.axes[axis].is_none() {
                let (size, square) = samples.beside(&scores, tone, axis, variance);
                told.axes[axis] = Some((size, sqrtf(square / variance.max(1e-30))));
            }
        }
        let residue = samples.residue(&scores, model, i, variance);
        if told.power >= STRONG && !tone.modulated {
            told.stretch = residue.stretch();
            let smooth = samples.is_smooth(&scores, tone.frequency, variance);
            if believe_bands(residue.each(), smooth) {
                self.believe(samples, model, i, &mut told);
            }
        }
        told
    }

    /// Takes the motion from bands of rows, the largest of them.
    fn believe(&self, samples: &mut Samples<'_>, model: &Model, i: usize, told: &mut Told) {
        let Some(tone) = model.tones.get(i) else {
            return;
        };
        let scores = samples.score(model, i, |j| j == i);
        let bands = samples.banded(&scores, tone.frequency, &tone.shape);
        let mut best: Option<Orbit> = None;
        for (_, orbit) in &bands {
            if best.is_none_or(|b| orbit.semi_major_px > b.semi_major_px) {
                best = Some(*orbit);
            }
        }
        if let Some(orbit) = best {
            for (known, c) in told.axes.iter_mut().zip(orbit.amplitudes) {
                if let Some((size, _)) = known {
                    *size = sqrtf(c.norm_sqr());
                }
            }
            // A band has one of so many parts of the information.
            let wider = sqrtf(bands.len() as f32);
            told.unit = told.unit.max(wider * sqrtf(2.0 / samples.total_weight));
            (told.semi_major_px, told.orbit, told.rigid) = (orbit.semi_major_px, orbit, false);
            told.bands = Some(bands);
        }
    }

    fn motion(
        &self,
        samples: &Samples<'_>,
        told: &Told,
        tone: &Tone,
        noise: f32,
        scale: Scale,
    ) -> Motion {
        let phase = |axis: usize| scale.polar(told.orbit.amplitudes[axis], tone.frequency).1;
        let size = |axis: usize| told.axes[axis].map(|(size, _)| size * scale.factor.abs());
        let sd = |axis: usize| told.axes[axis].map(|(_, unit)| unit * noise * scale.factor.abs());
        let lean = samples.lean;
        let of = |axis: usize, value: Option<f32>| value.filter(|_| lean.is_none() && axis < 2);
        Motion {
            x_px: of(0, size(0)),
            x_px_sd: of(0, sd(0)),
            y_px: of(1, size(1)),
            y_px_sd: of(1, sd(1)),
            phase_rad: phase(0),
            y_phase_rad: of(1, size(1)).map(|_| phase(1)),
            across_rad: lean.map(|[x, y]| libm::atan2f(y, x)),
            decay_s: tone
                .onset
                .map(|_| samples.length_s / (-tone.growth).max(1e-6)),
            hz_per_s: (tone.modulated && tone.onset.is_none())
                .then(|| tone.chirp / (samples.length_s * samples.length_s)),
            modulation: None,
            spread_hz: None,
            rigid: told.rigid,
        }
    }

    /// What is at an image of a larger tone may be that one's, or a tone of its own; beside a swing of the order of a
    /// pixel so may what is small at an image of its harmonics: a row's answer bends in a way of its own.
    fn doubt_images(&self, length_s: f32, list: &mut [Found]) {
        let Some(fps) = self.band.fps else { return };
        for i in 1..list.len() {
            let (larger, rest) = list.split_at_mut(i);
            let Some(Found { peak, .. }) = rest.first_mut() else {
                return;
            };
            peak.ambiguous |= larger.iter().any(|Found { peak: other, .. }| {
                let bent = other.amplitude_px > SWING_PX
                    && peak.amplitude_px < SMALL_SHARE * other.amplitude_px;
                let harmonics = if bent { BENT_HARMONICS } else { 1 };
                (1..=harmonics)
                    .map(|m| f32::from(m) * other.hz)
                    .flat_map(|hz| [peak.hz - hz, peak.hz + hz])
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
fn largest_first(list: &mut [Found]) {
    for end in 1..list.len() {
        for i in (0..end).rev() {
            if list[i].peak.amplitude_px >= list[i + 1].peak.amplitude_px {
                break;
            }
            list.swap(i, i + 1);
        }
    }
}
