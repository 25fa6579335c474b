//! A recording through the real tracker, and its figures.

use rowtone::camera::Line;
use rowtone::pipeline::ReportSide;
use rowtone::spectrum;
use rowtone::timeline::{Binner, Displacement, Group, rows_per_sample};
use rowtone::tracker::{Config, ConfigError, Outcome, Tracker};

use super::case::Case;
use host_sim::{Camera, Frame, SimError, crlb};
use rowtone_measure::tracking::subtract;
use rowtone_memory::{SpectrumMemory, TrackerMemory};

/// What came of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Noise of a row over its Cramér–Rao bound, the median over rows. Each row's own offset is taken off;
    /// of n frames the median of a standard deviation is a little low, which is undone (Wilson & Hilferty).
    pub to_bound: f64,
    /// Scale of the measured motion against the true one, less 1.
    pub amplitude_error: f64,
    /// Largest peak that is no tone, as a share of the largest tone; where peaks were looked for.
    pub invented: Option<f64>,
    /// The tones found, of how many.
    pub found: Option<(usize, usize)>,
    /// What is left of the camera's shake, as a share, where there is one.
    pub shake_left: Option<f64>,
    /// Lines without texture, disturbed, and of learning anew, as shares of the lines after learning.
    pub no_texture: f64,
    /// See [`Figures::no_texture`].
    pub disturbed: f64,
    /// How often the reference was learned anew.
    pub relearned: u32,
    /// It was told that a texture that repeats was read at another of its repetitions.
    pub slips_told: bool,
}

/// Why a case could not be measured.
#[derive(Debug)]
pub enum CaseError {
    /// The recording cannot be.
    Simulation(SimError),
    /// The tracker refused.
    Tracker(ConfigError),
    /// The spectrum refused.
    Spectrum(String),
}

impl std::fmt::Display for CaseError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Simulation(error) => write!(f, "{error}"),
            Self::Tracker(error) => write!(f, "{error}"),
            Self::Spectrum(error) => f.write_str(error),
        }
    }
}

impl std::error::Error for CaseError {}

fn tracker<'a>(
    memory: &'a mut TrackerMemory,
    width: usize,
    camera: &Camera,
    case: &Case,
) -> Result<Tracker<'a>, CaseError> {
    let config = Config {
        bits: case.config.sensor.bits,
        learn_frames: case.learn_frames,
        columns_per_line: case.columns_per_line.unwrap_or(u16::MAX),
        ..Config::new(camera.timing(), width as u16)
    };
    Tracker::new(config, memory.lend()).map_err(CaseError::Tracker)
}

/// Measures a recording.
///
/// # Errors
/// [`CaseError`] when the case contradicts itself.
pub fn measure(case: &Case) -> Result<Figures, CaseError> {
    let camera = Camera::new(case.config.clone()).map_err(CaseError::Simulation)?;
    let (cols, rows) = (case.config.sensor.cols as usize, case.config.sensor.rows);
    let split = case.config.background_cols as usize;
    let (width, still_width) = (cols - split, split.max(16));
    let mut memory = TrackerMemory::new(width, rows as usize);
    let mut still_memory = TrackerMemory::new(still_width, rows as usize);
    let mut tracker = self::tracker(&mut memory, width, &camera, case)?;
    let mut still = match split {
        0 => None,
        _ => Some(self::tracker(
            &mut still_memory,
            still_width,
            &camera,
            case,
        )?),
    };
    let mut sums = Sums::new(&camera);
    let mut peaks = Vec::new();
    let mut lines = 0.0;
    let before = u32::from(case.learn_frames) * 2;
    for slot in camera.arriving() {
        let frame = camera.frame(slot);
        let later_ns = match case.exposure_told {
            true => {
                let truth = camera.row_truth(slot, 0);
                let usual_ns = i64::from(case.config.sensor.exposure_ns) / 2;
                truth.middle_ns - usual_ns - slot.start_ns
            }
            false => 0,
        };
        let mut shifts = track(&mut tracker, &frame, split..cols, later_ns);
        if let Some(still) = &mut still {
            let background = track(still, &frame, 0..split, later_ns);
            subtract(&mut shifts, &background);
        }
        if slot.number >= before {
            lines += f64::from(rows);
        }
        let ended = case.measured_from_s * 1e9;
        if (slot.start_ns as f64) < ended {
            continue;
        }
        for d in &shifts {
            let truth = camera.row_truth(slot, u32::from(d.row));
            sums.add(d, truth.displacement_px, truth.shake_px);
        }
        peaks.extend(shifts);
    }
    let counts = tracker.counts();
    let mut figures = sums.figures();
    figures.no_texture = counts.no_texture as f64 / lines;
    figures.disturbed = counts.occluded as f64 / lines;
    figures.relearned = counts.relearned;
    figures.slips_told = tracker.slips() > 0;
    if case.peaks {
        let (found, invented) = look_for_peaks(case, &camera, &peaks)?;
        figures.found = Some((found, case.config.motion.tones.len()));
        figures.invented = Some(invented);
    }
    Ok(figures)
}

/// `later_ns`: how much later the middle of each exposure is than the tracker's timing says.
fn track(
    tracker: &mut Tracker<'_>,
    frame: &Frame,
    cols: std::ops::Range<usize>,
    later_ns: i64,
) -> Vec<Displacement> {
    let lines = (0..frame.rows()).filter_map(|row| frame.line(row));
    let shifts = lines.filter_map(|line| {
        let pixels = line.pixels.part(cols.start, cols.len())?;
        match tracker.push(&Line {
            pixels,
            start_ns: line.start_ns + later_ns,
            ..line
        }) {
            Outcome::Measured(displacement) => Some(displacement),
            _ => None,
        }
    });
    shifts.collect()
}

/// Of one row: n, and Σ of w: error, truth, shake, measured and their products.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    n: f64,
    error: f64,
    error2: f64,
    truth: f64,
    truth2: f64,
    shake: f64,
    shake2: f64,
    error_truth: f64,
    error_shake: f64,
}

struct Sums {
    rows: Vec<Row>,
    bounds: Vec<Option<f64>>,
}

impl Sums {
    fn new(camera: &Camera) -> Self {
        let bounds = crlb::row_bounds_px(camera);
        Self {
            rows: vec![Row::default(); bounds.len()],
            bounds,
        }
    }

    fn add(&mut self, d: &Displacement, truth: f64, shake: f64) {
        let Some(row) = self.rows.get_mut(usize::from(d.row)) else {
            return;
        };
        let error = f64::from(d.shift_px) - truth;
        row.n += 1.0;
        row.error += error;
        row.error2 += error * error;
        row.truth += truth;
        row.truth2 += truth * truth;
        row.shake += shake;
        row.shake2 += shake * shake;
        row.error_truth += error * truth;
        row.error_shake += error * shake;
    }

    fn figures(&self) -> Figures {
        let (mut tt, mut et, mut ss, mut es) = (0.0, 0.0, 0.0, 0.0);
        let mut ratios = Vec::new();
        for (row, bound) in self.rows.iter().zip(&self.bounds) {
            let Some(bound) = bound.filter(|_| row.n >= 5.0) else {
                continue;
            };
            let w = 1.0 / (bound * bound);
            tt += w * (row.truth2 - row.truth * row.truth / row.n);
            et += w * (row.error_truth - row.error * row.truth / row.n);
            ss += w * (row.shake2 - row.shake * row.shake / row.n);
            es += w * (row.error_shake - row.error * row.shake / row.n);
            let k = row.n - 1.0;
            let variance = (row.error2 - row.error * row.error / row.n).max(0.0) / k;
            let median = (1.0 - 2.0 / (9.0 * k)).powi(3);
            ratios.push((variance / median).sqrt() / bound);
        }
        ratios.sort_by(f64::total_cmp);
        Figures {
            to_bound: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
            amplitude_error: et / tt,
            shake_left: (ss > 0.0).then(|| (es / ss).abs()),
            ..Figures::default()
        }
    }
}

/// The tones found, and the largest peak that is none against the largest tone.
fn look_for_peaks(
    case: &Case,
    camera: &Camera,
    rows: &[Displacement],
) -> Result<(usize, f64), CaseError> {
    let spectrum_error = |e: &dyn std::fmt::Display| CaseError::Spectrum(e.to_string());
    let (timing, fps) = (camera.timing(), case.config.sensor.fps);
    let per_sample = rows_per_sample(timing, case.max_hz, fps as u32 + 2, 1 << 16);
    let group = Group::new(timing, per_sample).map_err(|e| spectrum_error(&e))?;
    let mut memory = SpectrumMemory::new(group, 1.0, fps);
    let config = spectrum::Config {
        max_peaks: 16,
        ..spectrum::Config::default()
    };
    let mut report_side =
        ReportSide::new(config, group, memory.lend()).map_err(|e| spectrum_error(&e))?;
    let mut binner = Binner::new(group);
    let mut reports = Vec::new();
    for &row in rows {
        if let Some(sample) = binner.push(row)
            && report_side.push(sample)
        {
            reports.extend(report_side.report());
        }
    }
    if reports.is_empty() {
        reports.extend(report_side.finish());
    }
    let tones = &case.config.motion.tones;
    let largest = tones.iter().map(|t| t.amplitude_px).fold(0.0, f64::max);
    let (mut found, mut invented) = (tones.len(), 0.0f64);
    for report in &reports {
        let near = |hz: f64| {
            let near = |p: &&rowtone::report::Peak| (f64::from(p.hz) - hz).abs() < 0.5;
            report.peaks.iter().find(near)
        };
        found = found.min(tones.iter().filter(|t| near(t.hz).is_some()).count());
        for peak in &report.peaks {
            if tones
                .iter()
                .all(|t| (f64::from(peak.hz) - t.hz).abs() >= 0.5)
            {
                invented = invented.max(f64::from(peak.amplitude_px) / largest);
            }
        }
    }
    Ok((if reports.is_empty() { 0 } else { found }, invented))
}
