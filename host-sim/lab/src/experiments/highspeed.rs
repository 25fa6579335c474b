//! High-speed video: all rows of a frame at once, so a frame is a sample. Simulated, and a real recording where given.

use std::fmt::Write;
use std::fs::File;
use std::path::Path;

use rowtone::camera::Timing;

use super::film::Setup;
use super::{Folder, working_on};
use crate::LabError;
use crate::methods::classical::Classical;
use crate::methods::core::Core;
use crate::methods::study::{Fit, Recording};
use crate::methods::thesis::Thesis;
use crate::methods::visual::{By, VisualMicrophone};
use crate::methods::{Clip, Method, Shifts, remove_row_means};
use host_sim::{Motion, Tone};
use rowtone_clip::Turn;
use rowtone_clip::y4m::{Next, Reader};
use rowtone_linear::dot;

/// The simulated tones: frequency, Hz, and amplitude, px.
const TONES: [(f64, f64); 2] = [(437.0, 0.05), (713.0, 0.01)];

/// Who measures.
fn methods(core: Core) -> Vec<Box<dyn Method>> {
    vec![
        Box::new(core),
        Box::new(Thesis::default()),
        Box::new(Thesis::coarse()),
        Box::new(VisualMicrophone { by: By::Frame }),
        Box::new(Classical::LucasKanade),
    ]
}

/// One sample a frame: the rows' mean, weighted by what they can know. A recording of one row.
fn one_a_frame(recording: &Recording, shifts: &Shifts) -> (Recording, Shifts) {
    let mut shifts = shifts.clone();
    remove_row_means(&mut shifts);
    let weight = |b: &Option<f64>| b.map_or(0.0, |b| 1.0 / (b * b));
    let mean = |frame: &Vec<f64>| {
        let (mut sum, mut all) = (0.0, f64::MIN_POSITIVE);
        for (v, b) in frame.iter().zip(&recording.bounds_px) {
            if v.is_finite() {
                sum += weight(b) * v;
                all += weight(b);
            }
        }
        sum / all
    };
    let one = Recording {
        clip: Clip::default(),
        times_s: recording.times_s.iter().map(|t| vec![t[0]]).collect(),
        truth_px: recording.truth_px.iter().map(|t| vec![t[0]]).collect(),
        bounds_px: vec![Some(1.0)],
        fps: recording.fps,
    };
    let shifts = shifts.iter().map(|f| vec![mean(f)]).collect();
    (one, shifts)
}

/// The strongest tones, one after the other: frequency, Hz, and amplitude, px; and what is left, px rms.
fn tones(
    recording: &Recording,
    shifts: &Shifts,
    band_hz: (f64, f64),
    count: usize,
) -> (Vec<(f64, f64)>, f64) {
    let (one, mut left) = one_a_frame(recording, shifts);
    remove_row_means(&mut left);
    let mut found = Vec::new();
    for _ in 0..count {
        let fit = Fit::new(&one, &left);
        let Some(hz) = fit.strongest(&left, band_hz) else {
            break;
        };
        let pair = fit.amplitude(&left, hz);
        found.push((hz, pair[0].hypot(pair[1])));
        left = fit.without(&left, hz, pair);
    }
    let flat: Vec<f64> = left.concat();
    let rms = (dot(&flat, &flat) / flat.len().max(1) as f64).sqrt();
    (found, rms)
}

/// A table of a simulated recording, and of a real one where `real` names one.
///
/// # Errors
/// [`LabError`] for what cannot be simulated, read or written.
pub fn run(folder: &Folder, real: Option<&Path>) -> Result<(), LabError> {
    let mut text = simulated()?;
    if let Some(path) = real {
        text += &measured(path)?;
    }
    folder.table("highspeed.md", &text)
}

fn simulated() -> Result<String, LabError> {
    let mut setup = Setup::thesis(96, 500, 1);
    let sensor = &mut setup.sensor;
    (sensor.rows, sensor.fps, sensor.line_time_ps) = (64, 2500.0, 0);
    let motion = Motion {
        tones: TONES
            .iter()
            .map(|&(hz, amplitude_px)| Tone {
                hz,
                amplitude_px,
                phase_rad: 0.4,
            })
            .collect(),
        ..Motion::default()
    };
    let film = setup.film(&motion)?;
    let mut text = String::from(
        "Simulated: 2500 fps, all rows at once, 96x64, 500 frames, tones of 437 Hz, 0.05 px and 713 Hz, 0.01 px, seed 1\n\n\
         | method | first tone, Hz | px | second tone, Hz | px | noise of a frame, px |\n| --- | --: | --: | --: | --: | --: |\n",
    );
    for method in methods(film.core) {
        working_on(&format!("high speed: {}", method.name()));
        let shifts = method.shifts(&film.recording.clip);
        let (found, rms) = tones(&film.recording, &shifts, (20.0, 1240.0), TONES.len());
        let _ = write!(text, "| {} |", method.name());
        for (hz, px) in &found {
            let _ = write!(text, " {hz:.3} | {px:.5} |");
        }
        let _ = writeln!(text, " {rms:.5} |");
    }
    Ok(text)
}

fn measured(path: &Path) -> Result<String, LabError> {
    let recording = beam(path)?;
    let timing = Timing::new(0, 0, recording.clip.height as u16)?;
    let core = Core {
        timing,
        frame_ns: (1e9 / recording.fps).round() as i64,
        bits: 8,
    };
    let mut text = format!(
        "\nReal: {}, {} frames at {} fps, turned by 90 degrees\n\n\
         | method | strongest tone, Hz | px | noise of a frame, px |\n| --- | --: | --: | --: |\n",
        path.file_name().unwrap_or_default().to_string_lossy(),
        recording.clip.frames.len(),
        recording.fps
    );
    for method in methods(core) {
        working_on(&format!("real high speed: {}", method.name()));
        let shifts = method.shifts(&recording.clip);
        let band_hz = (0.01 * recording.fps, 0.49 * recording.fps);
        let (found, rms) = tones(&recording, &shifts, band_hz, 1);
        if let Some((hz, px)) = found.first() {
            let _ = writeln!(text, "| {} | {hz:.1} | {px:.4} | {rms:.4} |", method.name());
        }
    }
    Ok(text)
}

/// Reads a Y4M of one byte a pixel, turned so that what moved up and down moves across. Nothing is known of its noise, so
/// a row's weight is its contrast.
fn beam(path: &Path) -> Result<Recording, LabError> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|why| LabError::Open {
        path: path.to_owned(),
        why,
    })?;
    let mut reader = Reader::open(file, &name)?;
    let header = reader.header().clone();
    let (width, height) = (header.width, header.height);
    let (8, Some(fps)) = (header.format.bits, header.fps) else {
        return Err(LabError::Depth(path.to_owned()));
    };
    let mut frames: Vec<Vec<f64>> = Vec::new();
    let mut bytes = Vec::new();
    while let Next::Frame { luma } = reader.read_frame(&mut bytes)? {
        let mut turned = Vec::new();
        let plane = &bytes[luma..luma + width * height];
        Turn::Quarter.plane(plane, width, height, &mut turned);
        frames.push(turned.iter().map(|&v| f64::from(v)).collect());
    }
    let clip = Clip {
        width: height,
        height: width,
        frames,
    };
    let mean = clip.mean();
    let bounds_px = mean
        .chunks_exact(clip.width)
        .map(|row| {
            let power: f64 = row.windows(3).map(|w| 0.25 * (w[2] - w[0]).powi(2)).sum();
            (power > 0.0).then(|| 1.0 / power.sqrt())
        })
        .collect();
    let count = clip.frames.len();
    Ok(Recording {
        times_s: (0..count)
            .map(|n| vec![n as f64 / fps; clip.height])
            .collect(),
        truth_px: vec![vec![0.0; clip.height]; count],
        bounds_px,
        fps,
        clip,
    })
}
