//! The thesis's single tones (Figs. 5.2 and 5.3): six frames at 120 fps of 1048 rows, 75 to 325 Hz.

use std::fmt::Write;

use super::core::Core;
use super::study::{Fit, record};
use super::thesis::Thesis;
use super::visual::{By, VisualMicrophone};
use super::{Method, remove_row_means};
use crate::sim::{Config, Preset, SimError, Tone};
use rowtone::camera::Timing;

/// One tone by all three methods: frequency error, Hz; `None` where it was not found within 6 Hz.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// True frequency, Hz.
    pub hz: f64,
    /// Errors of `methods`, in their order.
    pub errors_hz: Vec<Option<f64>>,
}

/// What is compared.
fn methods(timing: Timing, fps: f64) -> Vec<Box<dyn Method>> {
    vec![
        Box::new(Core {
            timing,
            frame_ns: (1e9 / fps).round() as i64,
            bits: 8,
        }),
        Box::new(Thesis::default()),
        Box::new(VisualMicrophone { by: By::Row }),
    ]
}

/// Names of the columns.
pub const NAMES: [&str; 3] = ["rowtone", "thesis", "Visual Microphone"];

/// Films and measures one tone; `cols` columns of the thesis's picture.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn line(hz: f64, amplitude_px: f64, cols: u32, seed: u64) -> Result<Line, SimError> {
    let mut config = Config {
        seed,
        sensor: Preset::Thesis.sensor(),
        frames: 6,
        ..Config::default()
    };
    config.sensor.cols = cols;
    config.motion.tones.push(Tone {
        hz,
        amplitude_px,
        phase_rad: 0.7,
    });
    let sensor = &config.sensor;
    let fps = sensor.fps;
    let timing = Timing::new(sensor.line_time_ps, sensor.exposure_ns, sensor.rows as u16);
    let recording = record(config)?;
    let methods = timing.map(|t| methods(t, fps)).unwrap_or_default();
    let errors_hz = methods
        .iter()
        .map(|method| {
            let mut shifts = method.shifts(&recording.clip);
            remove_row_means(&mut shifts);
            Fit::new(&recording, &shifts)
                .frequency(&shifts, hz, 6.0)
                .map(|f| f - hz)
        })
        .collect();
    Ok(Line { hz, errors_hz })
}

/// The whole sweep, as Markdown.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn markdown(amplitude_px: f64, cols: u32) -> Result<String, SimError> {
    let mut text = format!(
        "Frequency error in Hz, {amplitude_px} px, six frames of {cols}x1048 at 120 fps\n\n| Hz |"
    );
    NAMES.iter().for_each(|n| {
        let _ = write!(text, " {n} |");
    });
    text.push_str("\n| --: | --: | --: | --: |\n");
    for k in 0..=10 {
        let line = line(75.0 + 25.0 * f64::from(k), amplitude_px, cols, 1)?;
        let _ = write!(text, "| {} |", line.hz);
        for error in &line.errors_hz {
            match error {
                Some(e) => {
                    let _ = write!(text, " {e:+.3} |");
                }
                None => text.push_str(" not found |"),
            }
        }
        text.push('\n');
    }
    Ok(text)
}
