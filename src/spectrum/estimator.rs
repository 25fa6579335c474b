//! The computing side: a window in, tones out.

use super::config::{Config, ConfigError};
use super::detect::Band;
use super::fit::{Fit, Model};
use super::model::{Samples, TABLE_ROWS};
use super::search::Search;
use super::storage::{EstimatorStorage, MAX_GRID};
use super::window::{WindowMark, pack_weight, skew_unit_ns, unpack_weight};
use crate::report::{MAX_PEAKS, Peak};
use crate::timeline::Group;

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

/// Fits tones to windows.
#[derive(Debug)]
pub struct Estimator<'a> {
    config: Config,
    group: Group,
    storage: EstimatorStorage<'a>,
    fit: Fit,
    model: Model,
    mark: WindowMark,
    loaded: Loaded,
}

/// What [`Estimator::load`] worked out of a window.
#[derive(Clone, Copy, Debug, Default)]
struct Loaded {
    frames: usize,
    skewed: bool,
    total_weight: f32,
    count: u32,
    length_s: f32,
    fps: f32,
    steady_rate: bool,
}

impl<'a> Estimator<'a> {
    /// # Errors
    /// [`ConfigError`] when the config cannot be used or the storage does not hold two frames and one tone.
    pub fn new(
        config: Config,
        group: Group,
        storage: EstimatorStorage<'a>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        let estimator = Self {
            config,
            group,
            storage,
            fit: Fit::new(),
            model: Model::new(0),
            mark: WindowMark::default(),
            loaded: Loaded::default(),
        };
        estimator.check_storage()?;
        Ok(estimator)
    }

    /// Begins anew with another config, in the same memory and in place.
    ///
    /// # Errors
    /// As [`Estimator::new`]; then nothing has changed.
    pub fn restart(&mut self, config: Config, group: Group) -> Result<(), ConfigError> {
        config.check()?;
        let before = core::mem::replace(&mut self.group, group);
        if let Err(error) = self.check_storage() {
            self.group = before;
            return Err(error);
        }
        self.config = config;
        self.model = Model::new(0);
        self.mark = WindowMark::default();
        self.loaded = Loaded::default();
        Ok(())
    }

    fn check_storage(&self) -> Result<(), ConfigError> {
        let slots = usize::from(self.group.slots());
        let needs = [
            ("frames", 2, self.frame_capacity()),
            ("slots", slots, self.slot_capacity()),
            ("tones", 1, self.tone_capacity()),
            ("grid", 64, self.storage.grid.len()),
        ];
        for (part, needs, holds) in needs {
            if holds < needs {
                return Err(ConfigError::Storage { part, needs, holds });
            }
        }
        Ok(())
    }

    /// Frames a window may have.
    pub fn frame_capacity(&self) -> usize {
        let s = &self.storage;
        s.samples
            .frame_capacity(usize::from(self.group.slots()))
            .min(s.frame_ns.len())
            .min(s.frame_rows.len() / super::storage::FRAME_ROWS)
            .min(s.frame_phasors.len() / 4)
    }

    fn slot_capacity(&self) -> usize {
        let s = &self.storage;
        s.slot_ns
            .len()
            .min(s.slot_rows.len() / super::storage::SLOT_ROWS)
            .min(s.slot_phasors.len() / 4)
    }

    /// Tones that can be fitted at once.
    fn tone_capacity(&self) -> usize {
        let s = &self.storage;
        let frames = self.frame_capacity().max(1);
        let slots = usize::from(self.group.slots()).max(1);
        let rows = (s.frame_phasors.len() / (2 * frames)).min(s.slot_phasors.len() / (2 * slots));
        rows.min(TABLE_ROWS).saturating_sub(1)
    }

    /// What is looked for.
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// The groups of rows.
    pub const fn group(&self) -> &Group {
        &self.group
    }

    /// Passes over the samples that the last window took: what its cost is proportional to.
    pub const fn passes(&self) -> u32 {
        self.fit.passes
    }

    /// The window loaded last.
    pub const fn mark(&self) -> &WindowMark {
        &self.mark
    }

    /// Takes a window: `frame(i)` is the column of frame i of `mark.frames` in `from`, whose rows are `stride` apart.
    pub(crate) fn load(
        &mut self,
        mark: WindowMark,
        from: &super::window::SampleBuffer<'_>,
        stride: usize,
        column: impl Fn(usize) -> usize,
    ) {
        let slots = usize::from(self.group.slots());
        let frames = usize::from(mark.frames).min(self.frame_capacity());
        self.mark = mark;
        let to = &mut self.storage.samples;
        let mut skewed = false;
        for slot in 0..slots {
            for i in 0..frames {
                let (a, b) = (slot * stride + column(i), slot * frames + i);
                to.shift_px[b] = from.shift_px.get(a).copied().unwrap_or(0.0);
                to.weight[b] = from.weight.get(a).copied().unwrap_or(0);
                to.skew[b] = from.skew.get(a).copied().unwrap_or(0);
                if to.weight[b] == 0 {
                    to.shift_px[b] = 0.0;
                    to.skew[b] = 0;
                }
            }
        }
        for i in 0..frames {
            to.frames[i] = from.frames.get(column(i)).copied().unwrap_or_default();
        }
        self.normalise(frames, slots);
        self.place(frames, slots, &mut skewed);
        self.loaded.skewed = skewed;
        self.loaded.frames = frames;
        self.rate(frames);
    }

    /// Weights to a mean of one: their sums stay within an `f32`.
    fn normalise(&mut self, frames: usize, slots: usize) {
        let weight = &mut self.storage.samples.weight[..frames * slots];
        let mut count = 0_u32;
        let mut sum = 0.0;
        for &w in weight.iter().filter(|&&w| w > 0) {
            sum += unpack_weight(w) * 1e-20;
            count += 1;
        }
        let mean = sum / count.max(1) as f32;
        let scale = if mean > 0.0 { 1e-20 / mean } else { 0.0 };
        for w in weight.iter_mut() {
            // A sample far beyond all others would be all that counts; and one far below, nothing.
            *w = pack_weight(unpack_weight(*w) * scale);
        }
        self.loaded.count = count;
    }

    /// Times of frames and slots, their weights.
    fn place(&mut self, frames: usize, slots: usize, skewed: &mut bool) {
        let s = &mut self.storage;
        let (frame_t, rest) = s.frame_rows.split_at_mut(frames);
        let frame_weight = &mut rest[..frames];
        let (slot_t, rest) = s.slot_rows.split_at_mut(slots);
        let slot_weight = &mut rest[..slots];
        frame_weight.fill(0.0);
        let unit = skew_unit_ns(&self.group);
        let (mut late, mut total) = (0.0_f32, 0.0_f32);
        for slot in 0..slots {
            let (mut sum, mut skew_sum) = (0.0, 0.0);
            for i in 0..frames {
                let w = unpack_weight(s.samples.weight[slot * frames + i]);
                sum += w;
                skew_sum += w * f32::from(s.samples.skew[slot * frames + i]);
                frame_weight[i] += w;
            }
            slot_weight[slot] = sum;
            let skew = if sum > 0.0 {
                libm::roundf(skew_sum / sum) as i16
            } else {
                0
            };
            // The slot's usual skew goes into its own time; only what differs from frame to frame stays.
            for i in 0..frames {
                let at = slot * frames + i;
                if s.samples.weight[at] > 0 {
                    let left = s.samples.skew[at].saturating_sub(skew);
                    s.samples.skew[at] = left;
                    *skewed |= left.unsigned_abs() > 16;
                }
            }
            s.slot_ns[slot] = self.group.middle_ns(slot as u16) + i64::from(skew) * unit;
            late += sum * s.slot_ns[slot] as f32;
            total += sum;
        }
        let middle = if total > 0.0 {
            (late / total) as i64
        } else {
            0
        };
        let first = s.samples.frames[..frames].iter().map(|f| f.start_ns).min();
        let last = s.samples.frames[..frames].iter().map(|f| f.start_ns).max();
        let (first, last) = (first.unwrap_or(0), last.unwrap_or(0));
        let begin = first.saturating_add(s.slot_ns.first().copied().unwrap_or(0));
        let end = last.saturating_add(s.slot_ns[..slots].last().copied().unwrap_or(0));
        let span_ns = end.saturating_sub(begin).max(1);
        let center = begin.saturating_add(span_ns / 2).saturating_sub(middle);
        self.loaded.length_s = span_ns as f32 * 1e-9;
        self.loaded.total_weight = total;
        for i in 0..frames {
            s.frame_ns[i] = s.samples.frames[i].start_ns.saturating_sub(center);
            frame_t[i] = s.frame_ns[i] as f32 / span_ns as f32;
        }
        for slot in 0..slots {
            s.slot_ns[slot] -= middle;
            slot_t[slot] = s.slot_ns[slot] as f32 / span_ns as f32;
        }
    }

    /// The frame rate from frame numbers and times, and whether the window has a single one.
    fn rate(&mut self, frames: usize) {
        let marks = &self.storage.samples.frames[..frames];
        self.loaded.fps = 0.0;
        self.loaded.steady_rate = false;
        let (Some(a), Some(b)) = (marks.first(), marks.last()) else {
            return;
        };
        let periods = b.number.wrapping_sub(a.number) as i32;
        let span = b.start_ns.saturating_sub(a.start_ns);
        if periods <= 0 || span <= 0 {
            return;
        }
        let period_ns = span / i64::from(periods);
        let slack = (period_ns / 8).max(1);
        self.loaded.fps = (f64_free_rate(periods, span)).max(0.0);
        self.loaded.steady_rate = marks.iter().all(|m| {
            let n = i64::from(m.number.wrapping_sub(a.number));
            let expected = (i128::from(span) * i128::from(n) / i128::from(periods)) as i64;
            (m.start_ns.saturating_sub(a.start_ns) - expected).abs() < slack
        });
    }

    /// Fits tones to the loaded window.
    pub fn tones(&mut self) -> Tones {
        let mut tones = Tones {
            fps: self.loaded.fps,
            ..Tones::default()
        };
        let l = self.loaded;
        if l.frames < 2 || l.count < 8 || l.total_weight <= 0.0 {
            return tones;
        }
        let band = self.band();
        let search = Search {
            band,
            most_tones: self
                .tone_capacity()
                .min(self.config.max_peaks + 4)
                .min(MAX_PEAKS),
            false_alarm: self.config.false_alarm,
            most_passes: self.config.max_passes,
        };
        let (mut samples, grid) = view(&mut self.storage, &l, &self.group);
        let outcome = search.run(&mut samples, &mut self.fit, &mut self.model, grid);
        tones.more = outcome.more;
        let freedom = Fit::freedom(&samples, &self.model).max(1.0);
        let scale = self.model.squares / freedom;
        // Weights have a mean of one, so this is px² already.
        tones.sample_noise_px = libm::sqrtf(scale);
        tones.row_noise_px =
            tones.sample_noise_px * libm::sqrtf(f32::from(self.group.rows_per_sample()));
        if !tones.sample_noise_px.is_finite() {
            tones.sample_noise_px = 0.0;
            tones.row_noise_px = 0.0;
        }
        let regressors = self.fit.weigh(&mut samples, &self.model);
        let low = self.config.min_hz.unwrap_or(0.0);
        let high = self.config.max_hz.unwrap_or(f32::INFINITY);
        let mut list: heapless::Vec<(Peak, f32), MAX_PEAKS> = heapless::Vec::new();
        for (i, tone) in self.model.tones.iter().enumerate() {
            let hz = tone.frequency.hz();
            let attenuation = self.group.attenuation(hz);
            if !(low..=high).contains(&hz) || attenuation < LEAST_ATTENUATION {
                continue;
            }
            let amplitude = libm::sqrtf(tone.amplitude.norm_sqr());
            let unit = self
                .fit
                .deviation(&regressors, &self.model, i, samples.length_s);
            let kept = samples.kept(&samples.frame_means(i + 1));
            let noise = libm::sqrtf(scale);
            let power = samples.total_weight * amplitude * amplitude / (4.0 * scale).max(1e-30);
            let near = band.fps.is_some_and(|fps| {
                let away = hz - fps * libm::roundf(hz / fps);
                away.abs() * samples.length_s < NEAR_MULTIPLE
            });
            let peak = Peak {
                hz,
                hz_sd: noise * unit.hz,
                amplitude_px: amplitude / attenuation,
                amplitude_px_sd: noise * unit.amplitude_px / attenuation,
                snr_db: 10.0 * libm::log10f(power.max(1e-9)),
                ambiguous: near || kept < KEPT_ENOUGH,
                track: 0,
                harmonic: None,
            };
            let known = peak.amplitude_px > LEAST_KNOWN * peak.amplitude_px_sd;
            let sound = known
                && peak.hz_sd.is_finite()
                && peak.amplitude_px.is_finite()
                && peak.amplitude_px_sd.is_finite();
            if sound {
                let slope = tone.chirp / (samples.length_s * samples.length_s);
                let _ = list.push((peak, slope));
            }
        }
        largest_first(&mut list);
        tones.more |= list.len() > self.config.max_peaks;
        list.truncate(self.config.max_peaks);
        for (peak, slope) in &list {
            let _ = tones.peaks.push(*peak);
            let _ = tones.hz_per_s.push(*slope);
        }
        tones.hidden = band.fps.is_some_and(|fps| {
            let lowest = low.max(band.lowest_hz);
            let first = fps * libm::ceilf(lowest / fps).max(1.0);
            first <= high.min(band.highest_hz)
        });
        tones
    }

    /// What can be told apart in the loaded window.
    fn band(&self) -> Band {
        let l = &self.loaded;
        let spacing_s = self.group.spacing_ns() as f32 * 1e-9;
        let limit = if self.group.slots() > 1 {
            0.49 / spacing_s
        } else {
            0.49 * l.fps
        };
        let grid = self.storage.grid.len().min(MAX_GRID) as f32;
        let highest_hz = limit.min(0.4 * grid / (1.1 * l.length_s));
        Band {
            lowest_hz: (1.0 / l.length_s).min(0.5 * highest_hz),
            highest_hz,
            fps: (l.steady_rate && self.group.slots() > 1).then_some(l.fps),
        }
    }
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

/// Periods a second; both above 0.
fn f64_free_rate(periods: i32, span_ns: i64) -> f32 {
    periods as f32 / (span_ns as f32 * 1e-9)
}

fn view<'s>(
    storage: &'s mut EstimatorStorage<'_>,
    l: &Loaded,
    group: &Group,
) -> (Samples<'s>, &'s mut [f32]) {
    let frames = l.frames;
    let slots = usize::from(group.slots());
    let mut rows = storage.frame_rows.chunks_exact_mut(frames);
    let mut row = || rows.next().unwrap_or_default();
    let (frame_t, frame_weight, scratch, row_t, own_re, own_im) =
        (row(), row(), row(), row(), row(), row());
    let (slot_t, rest) = storage.slot_rows.split_at_mut(slots);
    let half = storage.frame_phasors.len() / 2;
    let (frame_re, frame_im) = storage.frame_phasors.split_at_mut(half);
    let half = storage.slot_phasors.len() / 2;
    let (slot_re, slot_im) = storage.slot_phasors.split_at_mut(half);
    frame_re[..frames].fill(1.0);
    frame_im[..frames].fill(0.0);
    slot_re[..slots].fill(1.0);
    slot_im[..slots].fill(0.0);
    let samples = Samples {
        frames,
        slots,
        shift_px: storage.samples.shift_px,
        weight: storage.samples.weight,
        skew: storage.samples.skew,
        skew_ns: l.skewed.then_some(skew_unit_ns(group) as f32),
        frame_ns: storage.frame_ns,
        frame_t,
        frame_weight,
        slot_ns: storage.slot_ns,
        slot_t,
        slot_weight: &mut rest[..slots],
        frame_re,
        frame_im,
        slot_re,
        slot_im,
        row: scratch,
        row_t,
        own_re,
        own_im,
        total_weight: l.total_weight,
        count: l.count,
        length_s: l.length_s,
    };
    (samples, storage.grid)
}
