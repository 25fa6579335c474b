//! From samples to reports: the core's report side, fed frame by frame.
//!
//! A [`Plan`] decides how many rows make a sample and how much memory a window takes; [`Analysis::run`]
//! then hands every sample and every report to whoever wants them, as they come.

use rowtone::camera::Timing;
use rowtone::pipeline::{Reading, ReportSide, Silence};
use rowtone::report::{PeakShape, Report, Warning};
use rowtone::spectrum::Config;
use rowtone::timeline::{Group, Sample, Tally, rows_per_sample};
use rowtone::tracker::Axes;

use crate::MeasureError;
use crate::keyed::Held;
use crate::since_frame::Later;
use crate::tracking::{FrameShifts, Shifts};
use crate::wander::Wander;
use rowtone_clip::{Camera, Rect};
use rowtone_memory::SpectrumMemory;

/// Highest frequency that is looked for when none is given, Hz: beyond what machines do as a rule, and
/// few enough samples.
const USUAL_MAX_HZ: f64 = 2000.0;
/// Samples are taken this many times as densely as the highest frequency asks for: what the averaging of unlike rows
/// does to a fast tone is known to the third order of their length, so half of it leaves a sixteenth of the error.
const DENSER: f64 = 2.0;
/// A tone this much above the usual highest frequency is still reported.
const JUST_ABOVE: f64 = 1.05;
/// Most passes over the samples of a window of video whose frames were predicted from each other.
const PREDICTED_PASSES: u32 = 250;
/// Most samples of a window.
const MOST_SAMPLES: usize = 1 << 20;

/// What to look for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Length of a window, s.
    pub window_s: f64,
    /// From one window to the next, s.
    pub hop_s: f64,
    /// Most peaks reported.
    pub max_peaks: usize,
    /// Lowest frequency, Hz.
    pub min_hz: Option<f64>,
    /// Highest frequency, Hz.
    pub max_hz: Option<f64>,
    /// Scale of the picture, µm a pixel.
    pub um_per_px: Option<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            window_s: 1.0,
            hop_s: 0.5,
            max_peaks: 8,
            min_hz: None,
            max_hz: None,
            um_per_px: None,
        }
    }
}

/// How a recording will be analysed.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    config: Config,
    group: Group,
    axes: Axes,
    fps: f64,
    window_s: f64,
}

impl Plan {
    /// Chooses how many rows make a sample: as many as the highest frequency allows.
    ///
    /// # Errors
    /// [`MeasureError::Settings`] for settings that cannot be used.
    pub fn new(camera: &Camera, settings: &Settings) -> Result<Self, MeasureError> {
        // Rows are counted from the top of the part.
        let timing = Timing::new(
            camera.timing.line_time_ps(),
            camera.timing.exposure_ns(),
            camera.part_or_rest()?.height as u16,
        )?;
        let frames = (settings.window_s * camera.fps).ceil() as u32;
        let max_hz = settings.max_hz.unwrap_or(USUAL_MAX_HZ);
        let rows = rows_per_sample(timing, (DENSER * max_hz) as f32, frames, MOST_SAMPLES);
        let group = Group::new(timing, rows)?;
        let config = Config {
            window_ns: (settings.window_s * 1e9).round() as i64,
            hop_ns: (settings.hop_s * 1e9).round() as i64,
            min_hz: settings.min_hz.map(|hz| hz as f32),
            max_hz: settings
                .max_hz
                .or((!timing.is_global_shutter()).then_some(JUST_ABOVE * USUAL_MAX_HZ))
                .map(|hz| hz as f32),
            max_peaks: settings.max_peaks,
            um_per_px: settings.um_per_px.map(|scale| scale as f32),
            ..Config::default()
        };
        config.check()?;
        Ok(Self {
            config,
            group,
            axes: camera.axes,
            fps: camera.fps,
            window_s: settings.window_s,
        })
    }

    /// How rows are to be combined.
    pub fn groups(&self) -> Group {
        self.group
    }

    /// The memory that the analysis borrows.
    pub fn memory(&self) -> SpectrumMemory {
        SpectrumMemory::for_axes(self.axes, self.group, self.window_s, self.fps)
    }

    /// Lowest frequency that is looked for, Hz.
    pub fn min_hz(&self) -> f64 {
        let period = 1.0 / self.window_s;
        self.config.min_hz.map_or(period, f64::from)
    }

    /// Highest frequency that can be reported, Hz.
    pub fn max_hz(&self) -> f64 {
        let spacing_s = match self.group.spacing_ns() {
            0 => 1.0 / self.fps,
            ns => ns as f64 * 1e-9,
        };
        let known = 0.5 / spacing_s;
        self.config.max_hz.map_or(known, |hz| known.min(hz.into()))
    }
}

/// What an analysis has to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// This part of the picture as it was given is measured; before the first frame.
    Part(Rect),
    /// Something to tell the user, a line, without the recording's name.
    Note(&'a str),
    /// A frame has been taken in; it started at this time, ns.
    Frame(i64),
    /// Some rows of it, combined.
    Sample(&'a Sample),
    /// A window is complete; and how its peaks run over the rows that are not rigid, rows counted in the picture.
    Report(&'a Report, &'a [PeakShape]),
}

/// The analysis of a recording.
#[derive(Debug)]
pub struct Analysis<'a> {
    shifts: Shifts,
    reports: ReportSide<'a>,
    /// What the camera itself does.
    wander: Wander,
    /// Frames without samples.
    silence: Silence,
    /// Reports that wait for the key frames, where a codec took something of the others.
    held: Option<Held>,
    group: Group,
    band_hz: (f64, f64),
}

impl<'a> Analysis<'a> {
    /// An analysis of what `shifts` delivers, which must combine rows in the plan's groups.
    ///
    /// # Errors
    /// [`MeasureError::Settings`] for settings that cannot be used.
    pub fn new(
        shifts: Shifts,
        plan: &Plan,
        memory: &'a mut SpectrumMemory,
    ) -> Result<Self, MeasureError> {
        let mut config = plan.config;
        if shifts.predicted {
            // A codec's errors are like a host of tones, and it is key frames that decide.
            config.max_passes = config.max_passes.min(PREDICTED_PASSES);
        }
        let reports = ReportSide::new(config, plan.group, memory.lend())?;
        Ok(Self {
            shifts,
            reports,
            wander: Wander::new(plan.config.window_ns),
            silence: Silence::new(plan.config.window_ns, plan.config.hop_ns),
            held: None,
            group: plan.group,
            band_hz: (plan.min_hz(), plan.max_hz()),
        })
    }

    /// Runs to the end of the recording. After an input that becomes unusable the last window still
    /// comes before the failure.
    ///
    /// # Errors
    /// [`MeasureError`] of the input, or what `on` returned.
    pub fn run<E: From<MeasureError>>(
        &mut self,
        mut on: impl FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let outcome = loop {
            match self.shifts.next_frame() {
                Ok(Some(frame)) => {
                    self.take(&frame, &mut on)?;
                    self.shifts.recycle(frame);
                }
                Ok(None) => break Ok(()),
                Err(error) => break Err(error.into()),
            }
        };
        if let Some(report) = self.reports.finish() {
            self.hand_on(report, &mut on)?;
        }
        if let Some(held) = self.held.take() {
            let keys = self.shifts.key_samples();
            let later = self.later();
            for (mut report, mut shapes) in held.judged(keys, self.group, self.band_hz) {
                later.turn_all(&mut report, &mut shapes);
                on(Event::Report(&report, &shapes))?;
            }
        }
        outcome
    }

    /// How much later than the picture the part begins.
    fn later(&self) -> Later {
        Later::of_row(self.shifts.part.y, self.group.timing())
    }

    /// What to say when no row of the recording could be measured.
    pub fn nothing_measured(&self) -> MeasureError {
        self.shifts.nothing_measured()
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.shifts.warning()
    }

    fn take<E>(
        &mut self,
        frame: &FrameShifts,
        on: &mut impl FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        if let Some(chosen) = frame.chosen {
            self.wander.note_shake(chosen.shake_px);
            self.held = chosen.keyed.then(Held::default);
            on(Event::Part(chosen.part))?;
        }
        for note in &frame.notes {
            on(Event::Note(note))?;
        }
        on(Event::Frame(frame.start_ns))?;
        if let Some(held) = &mut self.held {
            held.note_frame(frame.start_ns);
        }
        let mut tally = Tally::NONE;
        let mut silent = true;
        for reading in &frame.readings {
            tally.add(&reading.tally);
            silent &= reading.sample.is_none();
        }
        self.wander.note_frame(frame.start_ns, &frame.readings);
        let fps = self.shifts.camera.fps as f32;
        if let Some(report) = self.silence.note_frame(frame.start_ns, silent, fps, &tally)
            // Nothing could ever be measured, which is no report but a refusal.
            && !report.warnings.contains(Warning::LittleTexture)
        {
            self.hand_on(report, on)?;
        }
        let mut readings = frame.readings.iter();
        readings.try_for_each(|reading| self.push(reading, on))
    }

    fn push<E>(
        &mut self,
        reading: &Reading,
        on: &mut impl FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        if let Some(sample) = &reading.sample {
            on(Event::Sample(sample))?;
        }
        if self.reports.push(*reading)
            && let Some(report) = self.reports.report()
        {
            self.hand_on(report, on)?;
        }
        Ok(())
    }

    fn hand_on<E>(
        &mut self,
        mut report: Report,
        on: &mut impl FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.silence.number(&mut report);
        // What the recording as a whole warns of.
        report.warnings = report.warnings.union(self.shifts.camera.warnings);
        let moves = self.wander.exceeds(&report);
        report.warnings.insert_if(moves, Warning::CameraMoves);
        let mut shapes = self.reports.shapes().to_vec();
        for row in shapes.iter_mut().flat_map(|s| &mut s.rows) {
            row.row = row.row.saturating_add(self.shifts.part.y as u16);
        }
        match &mut self.held {
            Some(held) => {
                held.push(report, shapes);
                Ok(())
            }
            None => {
                self.later().turn_all(&mut report, &mut shapes);
                on(Event::Report(&report, &shapes))
            }
        }
    }
}
