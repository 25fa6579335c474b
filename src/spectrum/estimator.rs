//! The computing side: a window in, tones out.

use super::broadband::{self, Given};
use super::config::{Config, ConfigError};
use super::fit::Fit;
use super::fourier::MAX_GRID;
use super::judge::Noise;
use super::load::Loaded;
use super::model::{Samples, TABLE_ROWS};
use super::parameters::Model;
use super::periodogram::Band;
use super::residual::Residual;
use super::search::Search;
use super::smear::Smear;
use super::storage::EstimatorStorage;
use super::tones::{Shapes, Telling, Tones};
use super::window::{SampleBuffer, WindowMark, skew_unit_ns};
use crate::math::since;
use crate::report::{MAX_PEAKS, PeakShape};
use crate::timeline::Group;

/// Fits tones to windows.
#[derive(Debug)]
pub struct Estimator<'a> {
    config: Config,
    group: Group,
    storage: EstimatorStorage<'a>,
    mark: WindowMark,
    loaded: Loaded,
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
        self.mark = WindowMark::default();
        self.loaded = Loaded::default();
        self.storage.workspace.shapes.clear();
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
    pub(crate) fn frame_capacity(&self) -> usize {
        let s = &self.storage;
        s.samples
            .frame_capacity(usize::from(self.group.slots()))
            .min(s.frame_ns.len())
            .min(s.frame_rows.len() / super::storage::FRAME_ROWS)
            .min(s.frame_phasors.len() / 4)
    }

    fn slot_capacity(&self) -> usize {
        let s = &self.storage;
        let channels = s.samples.channels(usize::from(self.group.slots()));
        s.slot_ns
            .len()
            .min(s.slot_rows.len() / super::storage::slot_rows(channels))
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
        self.storage.workspace.fit.passes
    }

    /// How the peaks of the last window run over the rows that are not rigid.
    pub fn shapes(&self) -> &[PeakShape] {
        &self.storage.workspace.shapes
    }

    /// The window loaded last.
    pub const fn mark(&self) -> &WindowMark {
        &self.mark
    }

    /// Takes a window: `column(i)` is the column of frame i of `mark.frames` in `from`, whose rows are `stride` apart.
    pub(crate) fn load(
        &mut self,
        mark: WindowMark,
        from: &SampleBuffer<'_>,
        stride: usize,
        column: impl Fn(usize) -> usize,
    ) {
        let frames = usize::from(mark.frames).min(self.frame_capacity());
        self.mark = mark;
        self.loaded = Loaded::take(&mut self.storage, &self.group, frames, from, stride, column);
    }

    /// Fits tones to the loaded window, once: its samples are used up.
    pub fn tones(&mut self) -> Tones {
        let l = self.loaded;
        self.storage.workspace.shapes.clear();
        if l.frames < 2 || l.count < 8 || l.total_weight <= 0.0 {
            return Tones::nothing(l.fps);
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
        let (mut samples, grid, work) = view(&mut self.storage, &l, &self.group);
        let mut residual = Residual::new(&samples, band, grid, work.noise);
        let (fit, model, plain) = (work.fit, work.model, work.plain);
        let outcome = search.run(&mut samples, fit, model, plain, &mut residual);
        let mut tones = Telling {
            config: &self.config,
            group: &self.group,
            band,
            fps: l.fps,
            curvature: self.mark.curvature,
            middle_s: {
                let (start_ns, end_ns) = (self.mark.start_ns, self.mark.end_ns);
                let middle_ns = start_ns.saturating_add(since(end_ns, start_ns) / 2);
                since(middle_ns, l.zero_ns) as f32 * 1e-9
            },
            since_begin_ns: since(l.zero_ns, self.mark.origin_ns),
        }
        .tones(
            &mut samples,
            fit,
            (model, plain),
            &mut residual,
            work.shapes,
        );
        tones.more |= outcome.more;
        if !self.config.broad_band {
            return tones;
        }
        let (grid, noise) = residual.into_parts();
        let given = Given {
            group: &self.group,
            fps: l.fps,
            smear: Smear::of(&self.group, self.mark.curvature, model),
            noise,
        };
        tones.broad_band = broadband::measure(&mut samples, model, grid, &given);
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

/// What the fit works in, apart.
struct Work<'s> {
    fit: &'s mut Fit,
    model: &'s mut Model,
    plain: &'s mut Model,
    noise: &'s mut [Noise; 2],
    shapes: &'s mut Shapes,
}

/// The loaded window as the passes see it, the grid, and what the fit works in.
fn view<'s>(
    storage: &'s mut EstimatorStorage<'_>,
    l: &Loaded,
    group: &Group,
) -> (Samples<'s>, &'s mut [f32], Work<'s>) {
    let frames = l.frames;
    let slots = usize::from(group.slots());
    let work = &mut *storage.workspace;
    let mut rows = storage.frame_rows.chunks_exact_mut(frames);
    let mut row = || rows.next().unwrap_or_default();
    let (frame_t, frame_weight, scratch, row_t, own_re, own_im) =
        (row(), row(), row(), row(), row(), row());
    let (slot_t, rest) = storage.slot_rows.split_at_mut(slots);
    let series = storage.samples.channels(slots) * slots;
    let (slot_eta, rest) = rest.split_at_mut(slots);
    let (series_weight, rest) = rest.split_at_mut(series);
    let (score_re, score_im) = rest.split_at_mut(series);
    let half = storage.frame_phasors.len() / 2;
    let (frame_re, frame_im) = storage.frame_phasors.split_at_mut(half);
    let half = storage.slot_phasors.len() / 2;
    let (slot_re, slot_im) = storage.slot_phasors.split_at_mut(half);
    frame_re[..frames].fill(1.0);
    frame_im[..frames].fill(0.0);
    slot_re[..slots].fill(1.0);
    slot_im[..slots].fill(0.0);
    let mut samples = Samples {
        frames,
        slots,
        channels: storage.samples.channels(slots),
        axes: storage.samples.channels(slots),
        lean: None,
        shift_px: storage.samples.shift_px,
        weight: storage.samples.weight,
        skew: storage.samples.skew,
        skew_ns: l.skewed.then_some(skew_unit_ns(group) as f32),
        frame_ns: storage.frame_ns,
        frame_t,
        frame_weight,
        slot_ns: storage.slot_ns,
        slot_t,
        slot_eta,
        rows: l.rows,
        couplings: storage.samples.couplings,
        series_weight,
        score_re,
        score_im,
        spread: storage.samples.spread,
        even: group.even_spread(),
        frame_re,
        frame_im,
        slot_re,
        slot_im,
        row: scratch,
        row_t,
        own_re,
        own_im,
        notches: heapless::Vec::new(),
        total_weight: l.total_weight,
        count: l.count,
        length_s: l.length_s,
        spares: &work.spares,
    };
    samples.lean();
    let work = Work {
        fit: &mut work.fit,
        model: &mut work.model,
        plain: &mut work.plain,
        noise: &mut work.noise,
        shapes: &mut work.shapes,
    };
    (samples, storage.grid, work)
}
