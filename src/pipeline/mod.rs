//! Samples are collected to windows, windows become reports.
//!
//! Contract: the line side calls [`Analyzer::push`] for every sample; where that says a window is complete,
//! [`Analyzer::report`] computes it (before the next push: the next sample overwrites the window's edge). At the end of
//! the input [`Analyzer::finish`] gives the last window. To compute on another core or thread, use the two halves
//! themselves: [`Collector`] on the line side, [`Collector::hand_over`] into a [`Reporter`] on the other.
//!
//! A window is made of whole frames: those whose first row starts within it.

mod collector;
mod elsewhere;
mod reporter;

pub use collector::Collector;
pub use reporter::Reporter;

use crate::report::{PeakShape, Report};
use crate::spectrum::{Config, ConfigError, Storage};
use crate::timeline::{Group, Sample};

/// Collects and computes, one after the other.
///
/// ```
/// use rowtone::pipeline::Analyzer;
/// use rowtone::camera::Timing;
/// use rowtone::spectrum::{Config, StaticStorage};
/// use rowtone::timeline::{Group, Sample};
///
/// // 60 frames a second, 30 samples a frame, 0.5 ms apart; an object that moves by 0.1 px at 133 Hz.
/// let group = Group::new(Timing::new(50_000_000, 0, 300)?, 10)?;
/// let mut memory = Box::new(StaticStorage::<2048, 64, 32, 4096, 9>::new());
/// let mut analyzer = Analyzer::new(Config::default(), group, memory.lend())?;
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
///         assert!(!analyzer.push(sample));
///     }
/// }
/// let report = analyzer.finish().expect("a second of frames");
/// assert_eq!(report.peaks.len(), 1);
/// assert!((report.peaks[0].hz - 133.0).abs() < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Analyzer<'a> {
    collector: Collector<'a>,
    reporter: Reporter<'a>,
}

impl<'a> Analyzer<'a> {
    /// # Errors
    /// [`ConfigError`] when the config cannot be used or the storage is too small.
    pub fn new(config: Config, group: Group, storage: Storage<'a>) -> Result<Self, ConfigError> {
        Ok(Self {
            collector: Collector::new(&config, group, storage.collected)?,
            reporter: Reporter::new(config, group, storage.estimator)?,
        })
    }

    /// Takes a sample; says whether a window is complete, to be computed by [`Analyzer::report`] before the next push.
    ///
    /// A sample that knows nothing, is of a frame before the window, or of a slot there is not, is dropped and counted.
    pub fn push(&mut self, sample: Sample) -> bool {
        self.collector.push(sample)
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
