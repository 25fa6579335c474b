//! Readings to reports, one after the other.

use super::{Collector, Reading, Reporter};
use crate::report::{PeakShape, Report};
use crate::spectrum::{Config, ConfigError, Storage};
use crate::timeline::Group;

/// The report side of the pipeline, on one thread: collects readings to windows and computes their reports.
///
/// ```
/// use rowtone::pipeline::ReportSide;
/// use rowtone::camera::Timing;
/// use rowtone::spectrum::{Config, StaticStorage};
/// use rowtone::timeline::{Group, Sample};
///
/// // 60 frames a second, 30 samples a frame, 0.5 ms apart; an object that moves by 0.1 px at 133 Hz.
/// let group = Group::new(Timing::new(50_000_000, 0, 300)?, 10)?;
/// let mut memory = Box::new(StaticStorage::<2048, 64, 32, 4096, 9>::new());
/// let mut report_side = ReportSide::new(Config::default(), group, memory.lend())?;
/// let mut noise = 1_u32;
/// for frame in 0..60 {
///     for slot in 0..group.slots() {
///         let time_ns = i64::from(frame) * 16_666_667 + group.middle_ns(slot);
///         noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
///         let shift_px = 0.1 * (time_ns as f64 * 1e-9 * 133.0 * std::f64::consts::TAU).cos()
///             + 0.01 * (f64::from(noise) / 4.3e9 - 0.5);
///         let sample = Sample {
///             frame, slot, curvature: Default::default(), time_ns, shift_px: shift_px as f32, information_per_px2: 1e5, spread: group.even_spread(),
///             vertical: None,
///         };
///         assert!(!report_side.push(sample));
///     }
/// }
/// let report = report_side.finish().expect("a second of frames");
/// assert_eq!(report.peaks.len(), 1);
/// assert!((report.peaks[0].hz - 133.0).abs() < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ReportSide<'a> {
    collector: Collector<'a>,
    reporter: Reporter<'a>,
}

impl<'a> ReportSide<'a> {
    /// # Errors
    /// [`ConfigError`] when the config cannot be used or the storage is too small.
    pub fn new(config: Config, group: Group, storage: Storage<'a>) -> Result<Self, ConfigError> {
        Ok(Self {
            collector: Collector::new(&config, group, storage.collected)?,
            reporter: Reporter::new(config, group, storage.estimator)?,
        })
    }

    /// Takes a reading of the line side (or a sample alone); says whether a window is complete, to be computed by
    /// [`ReportSide::report`] before the next push.
    ///
    /// A sample that knows nothing, is of a frame before the window, or of a slot there is not, is dropped and counted.
    pub fn push(&mut self, reading: impl Into<Reading>) -> bool {
        self.collector.push(reading)
    }

    /// Computes the window that is complete; `None` when none is.
    pub fn report(&mut self) -> Option<Report> {
        let ready = self.collector.hand_over(&mut self.reporter);
        ready.then(|| self.reporter.report())
    }

    /// The last window, at the end of the input: where at least two fifths of a hop of frames came after the window before, or
    /// there was none before. It is as long as the others where there are frames enough.
    pub fn finish(&mut self) -> Option<Report> {
        self.collector.finish();
        self.report()
    }

    /// How the peaks of the last report run over the rows that are not rigid: a shape is of the peak with its frequency.
    pub fn shapes(&self) -> &[PeakShape] {
        self.reporter.shapes()
    }

    /// Passes over the samples that the last window took: what its cost is proportional to.
    pub const fn passes(&self) -> u32 {
        self.reporter.passes()
    }

    /// Samples dropped so far: they knew nothing, came late, were of no slot, or lacked rows that their slot has as a rule.
    pub const fn dropped_samples(&self) -> u32 {
        self.collector.dropped_samples()
    }

    /// Windows that were complete but never computed.
    pub const fn dropped_windows(&self) -> u32 {
        self.collector.dropped_windows()
    }
}
