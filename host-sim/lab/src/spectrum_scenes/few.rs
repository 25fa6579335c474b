//! Few frames: the thesis's own test, tones from 75 to 325 Hz in a handful of frames, without a still reference.

use std::f64::consts::{FRAC_PI_2, PI};

use super::bound::Bound;
use super::cameras::{Recording, rows};
use super::scene::{TrueTone, Truth};
use crate::LabError;
use host_sim::{Camera, Config, Preset, Tone};

/// Tones, Hz.
const HZ: [f64; 11] = [
    75.0, 100.0, 125.0, 150.0, 175.0, 200.0, 225.0, 250.0, 275.0, 300.0, 325.0,
];

/// One row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The tone, Hz.
    pub hz: f64,
    /// Share of its energy that the rows' unknown offsets leave.
    pub kept: f64,
    /// Cramér–Rao bound of its frequency, Hz.
    pub bound_hz: f64,
    /// The same where a slow drift (t, t²) is unknown too.
    pub drift_bound_hz: f64,
    /// Errors of its frequency, Hz, one a recording; `None` where it was not found.
    pub errors_hz: Vec<Option<f64>>,
    /// Peaks that are no tone.
    pub false_peaks: usize,
}

impl Row {
    /// Largest error, Hz; infinite where the tone was missed.
    pub fn worst_hz(&self) -> f64 {
        let size = |e: &Option<f64>| e.map_or(f64::INFINITY, f64::abs);
        self.errors_hz.iter().map(size).fold(0.0, f64::max)
    }
}

/// The thesis's camera, `cols` columns of it, for `frames` frames; `tries` recordings a tone.
///
/// # Errors
/// [`LabError`] of the first recording that cannot be made or analysed.
pub fn rows_of(
    frames: u32,
    amplitude_px: f64,
    cols: u32,
    seed: u64,
    tries: u64,
) -> Result<Vec<Row>, LabError> {
    let row = |hz| row(hz, frames, amplitude_px, cols, seed, tries);
    HZ.into_iter().map(row).collect()
}

fn row(
    hz: f64,
    frames: u32,
    amplitude_px: f64,
    cols: u32,
    seed: u64,
    tries: u64,
) -> Result<Row, LabError> {
    let cannot = |why| LabError::Recording {
        what: format!("{frames} frames at {hz} Hz"),
        why,
    };
    let mut row = Row {
        hz,
        kept: 1.0,
        bound_hz: 0.0,
        drift_bound_hz: 0.0,
        errors_hz: Vec::new(),
        false_peaks: 0,
    };
    for number in 0..tries {
        let phase_rad = 2.399_963 * (number as f64 + hz);
        let mut config = Config {
            seed: seed.wrapping_mul(1_000_003) + number,
            sensor: Preset::Thesis.sensor(),
            frames,
            ..Config::default()
        };
        config.sensor.cols = cols;
        config.motion.tones = vec![Tone {
            hz,
            amplitude_px,
            phase_rad,
        }];
        let camera = Camera::new(config).map_err(cannot)?;
        let sensor = &camera.config().sensor;
        let (fps, x) = (sensor.fps, PI * hz * f64::from(sensor.exposure_ns) * 1e-9);
        if number == 0 {
            let known = rows(&camera);
            let unit = [(hz, phase_rad - FRAC_PI_2)];
            let seen_px = amplitude_px * x.sin() / x;
            row.bound_hz = Bound::beside(&known, 1.0, &unit, 0)[0].hz / seen_px;
            row.drift_bound_hz = Bound::of(&known, 1.0, &unit)[0].hz / seen_px;
            row.kept = kept(f64::from(frames), hz / fps);
        }
        let recording = Recording {
            truth: Truth {
                fps,
                window_s: f64::from(frames) / fps,
                tones: vec![TrueTone {
                    hz,
                    amplitude_px,
                    phase_rad,
                    hz_bound: row.bound_hz,
                    amplitude_bound_px: 0.0,
                }],
            },
            camera,
        };
        let report = recording.analyze()?;
        let error = |p: &rowtone::report::Peak| f64::from(p.hz) - hz;
        let near = report.peaks.iter().map(error);
        let nearest = near.min_by(|a, b| a.abs().total_cmp(&b.abs()));
        let found = nearest.filter(|e| e.abs() < 0.5 / recording.truth.window_s);
        row.false_peaks += report.peaks.len() - usize::from(found.is_some());
        row.errors_hz.push(found);
    }
    Ok(row)
}

/// 1 − |D_N(x)|²/N², x in frame rates: what is left of a tone when each row's mean over n frames is taken off.
fn kept(n: f64, x: f64) -> f64 {
    let below = n * (PI * x).sin();
    if below.abs() < 1e-9 {
        return 0.0;
    }
    1.0 - ((n * PI * x).sin() / below).powi(2)
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:>6} {:>6} {:>6} {:>7} {:>9} {:>9} {:>9} {:>6}",
        "frames", "px", "Hz", "kept", "crb Hz", "+drift", "worst Hz", "false"
    )
}

/// A row of the table.
pub fn line(frames: u32, amplitude_px: f64, row: &Row) -> String {
    format!(
        "{frames:>6} {amplitude_px:>6} {:>6} {:>7.4} {:>9.4} {:>9.4} {:>9.4} {:>6}",
        row.hz,
        row.kept,
        row.bound_hz,
        row.drift_bound_hz,
        row.worst_hz(),
        row.false_peaks
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_multiple_of_the_frame_rate_keeps_nothing() {
        assert_eq!(kept(6.0, 2.0), 0.0);
        assert!((kept(6.0, 1.5) - 1.0).abs() < 1e-12);
        // Two frames half a turn apart: all of it; a quarter: half.
        assert!((kept(2.0, 0.25) - 0.5).abs() < 1e-12);
    }
}
