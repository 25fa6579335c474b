//! The computing side: a window handed over becomes a report.

use crate::math::since;
use crate::report::{PeakShape, Report};
use crate::spectrum::{
    Config, ConfigError, Estimator, EstimatorStorage, Follower, SampleBuffer, Tones, WindowMark,
    name_harmonics,
};
use crate::timeline::Group;

/// Makes reports of windows.
#[derive(Debug)]
pub struct Reporter<'a> {
    estimator: Estimator<'a>,
    follower: Follower,
    last_end_ns: Option<i64>,
}

impl<'a> Reporter<'a> {
    /// # Errors
    /// [`ConfigError`] when the config cannot be used or the storage is too small.
    pub fn new(
        config: Config,
        group: Group,
        storage: EstimatorStorage<'a>,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            estimator: Estimator::new(config, group, storage)?,
            follower: Follower::new(),
            last_end_ns: None,
        })
    }

    /// Begins anew with another config, in the same memory and in place.
    ///
    /// # Errors
    /// As [`Reporter::new`]; then nothing has changed.
    pub fn restart(&mut self, config: Config, group: Group) -> Result<(), ConfigError> {
        self.estimator.restart(config, group)?;
        self.follower = Follower::new();
        self.last_end_ns = None;
        Ok(())
    }

    /// Passes over the samples that the last window took: what its cost is proportional to.
    pub const fn passes(&self) -> u32 {
        self.estimator.passes()
    }

    pub(crate) fn load(
        &mut self,
        mark: WindowMark,
        from: &SampleBuffer<'_>,
        stride: usize,
        column: impl Fn(usize) -> usize,
    ) {
        self.estimator.load(mark, from, stride, column);
    }

    /// How the peaks of the last report run over the rows that are not rigid, in no order: a shape is of the peak with its
    /// frequency.
    pub fn shapes(&self) -> &[PeakShape] {
        self.estimator.shapes()
    }

    /// The report of the window handed over last.
    pub fn report(&mut self) -> Report {
        let mut tones = self.estimator.tones();
        let mark = *self.estimator.mark();
        let window_s = since(mark.end_ns, mark.start_ns).max(1) as f32 * 1e-9;
        let elapsed_s = self
            .last_end_ns
            .map_or(0.0, |last| since(mark.end_ns, last) as f32 * 1e-9);
        self.last_end_ns = Some(mark.end_ns);
        self.follower
            .follow(&mut tones.peaks, &tones.hz_per_s, 1.0 / window_s, elapsed_s);
        name_harmonics(&mut tones.peaks, 1.0 / window_s);
        let um_per_px = self.estimator.config().um_per_px;
        Report {
            seq: mark.seq,
            time_ms: ((since(mark.end_ns, mark.origin_ns).max(0) as u64).saturating_add(500_000))
                / 1_000_000,
            window_s,
            fps: tones.fps,
            lines: mark.lines,
            lost_frames: mark.lost_frames,
            noise_px: tones.row_noise_px,
            velocity_mm_s_rms: um_per_px.map(|scale| velocity_mm_s(&tones, scale)),
            warnings: super::warn::of_window(&mark, &tones, window_s),
            peaks: tones.peaks,
            um_per_px,
            line_time_us_fit: tones.line_time_us_fit,
            noise_floor: tones.noise_floor,
            other_px_rms: tones.other_px_rms,
            broad_band: tones.broad_band,
        }
    }
}

/// Velocity over 10–1000 Hz, mm/s RMS (ISO 20816-1): of all motion, or of the peaks where that is not known.
fn velocity_mm_s(tones: &Tones, um_per_px: f32) -> f32 {
    let broad = tones.broad_band.and_then(|b| b.sum.velocity_px_s);
    match broad {
        Some(px_s) => px_s.value * (um_per_px * 1e-3),
        None => band_velocity(tones, um_per_px),
    }
}

/// Velocity of the peaks within 10–1000 Hz, mm/s RMS: √Σ(2πfA)²/2 (ISO 20816-1).
fn band_velocity(tones: &Tones, um_per_px: f32) -> f32 {
    let mut squares = 0.0;
    for peak in tones
        .peaks
        .iter()
        .filter(|p| (10.0..=1000.0).contains(&p.hz))
    {
        let mm = peak.amplitude_px * um_per_px * 1e-3;
        let speed = core::f32::consts::TAU * peak.hz * mm;
        squares += 0.5 * speed * speed;
    }
    crate::math::sqrtf(squares)
}
