//! Both sides in one, for one thread.

use core::fmt;

use super::{LineSide, ReportSide};
use crate::camera::Line;
use crate::report::Report;
use crate::timeline::Group;
use crate::{spectrum, tracker};

/// Lines go in, reports come out: both sides of the pipeline on one thread.
///
/// ```
/// use rowtone::camera::{Line, Pixels, Timing};
/// use rowtone::pipeline::Pipeline;
/// use rowtone::timeline::Group;
/// use rowtone::{spectrum, tracker};
///
/// // 16 rows of 64 pixels, 1 ms apart, 50 frames a second; two rows make a sample.
/// let timing = Timing::new(1_000_000_000, 0, 16)?;
/// let group = Group::new(timing, 2)?;
/// let mut picture = tracker::StaticStorage::<{ 64 * 16 }, 16, 64>::new();
/// let mut windows = Box::new(spectrum::StaticStorage::<1024, 64, 8, 4096, 9>::new());
/// let lines = tracker::Config::new(timing, 64);
/// let mut pipeline =
///     Pipeline::new(lines, group, spectrum::Config::default(), picture.lend(), windows.lend())?;
/// let mut reports = Vec::new();
/// for frame in 0..150_u32 {
///     for row in 0..16 {
///         let start_ns = i64::from(frame) * 20_000_000 + timing.start_ns(row);
///         let swing_px = 0.2 * (start_ns as f32 * 1e-9 * 7.3 * core::f32::consts::TAU).sin();
///         let pixels: [u8; 64] = core::array::from_fn(|x| {
///             let phase = (x as f32 - swing_px) * 0.6;
///             (128.0 + 60.0 * phase.sin() + 30.0 * (1.7 * phase).cos()).round() as u8
///         });
///         reports.extend(pipeline.push(&Line { frame, row, start_ns, pixels: Pixels::U8(&pixels) }));
///     }
/// }
/// reports.extend(pipeline.finish().into_iter().flatten());
/// assert!((reports[0].peaks[0].hz - 7.3).abs() < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Pipeline<'a> {
    /// The line side.
    pub lines: LineSide<'a>,
    /// The report side.
    pub reports: ReportSide<'a>,
}

impl<'a> Pipeline<'a> {
    /// A pipeline that has learned nothing yet. Rows are combined to `group`s; all memory is lent.
    ///
    /// # Errors
    /// [`PipelineError`] says which config cannot be used, or which buffer is too short.
    pub fn new(
        lines: tracker::Config,
        group: Group,
        reports: spectrum::Config,
        picture: tracker::Storage<'a>,
        windows: spectrum::Storage<'a>,
    ) -> Result<Self, PipelineError> {
        Ok(Self {
            lines: LineSide::new(lines, group, picture)?,
            reports: ReportSide::new(reports, group, windows)?,
        })
    }

    /// Takes a line; gives the report of the window that ended before it, where one did.
    pub fn push(&mut self, line: &Line<'_>) -> Option<Report> {
        let reading = *self.lines.push(line)?;
        let complete = self.reports.push(reading);
        complete.then(|| self.reports.report()).flatten()
    }

    /// The input ends: gives the reports of what is left, the window that was complete and the last one.
    pub fn finish(&mut self) -> [Option<Report>; 2] {
        let last = self.lines.finish();
        let complete = last.is_some_and(|reading| self.reports.push(reading));
        let before = complete.then(|| self.reports.report()).flatten();
        self.reports.push(self.lines.rest());
        [before, self.reports.finish()]
    }
}

/// Why a [`Pipeline`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PipelineError {
    /// The line side's config or storage.
    Lines(tracker::ConfigError),
    /// The report side's.
    Reports(spectrum::ConfigError),
}

impl fmt::Display for PipelineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lines(error) => error.fmt(f),
            Self::Reports(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for PipelineError {}

impl From<tracker::ConfigError> for PipelineError {
    fn from(error: tracker::ConfigError) -> Self {
        Self::Lines(error)
    }
}

impl From<spectrum::ConfigError> for PipelineError {
    fn from(error: spectrum::ConfigError) -> Self {
        Self::Reports(error)
    }
}
