//! Simulated recordings with their truth, and what a method made of them.

use std::f64::consts::TAU;
use std::time::Instant;

use super::{Clip, Method, Shifts, remove_row_means};
use host_sim::{Camera, Config, PixelBuffer, SimError, crlb};
use rowtone_linear::{Symmetric, dot, median};

/// A simulated clip and everything that is true of it.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The pictures.
    pub clip: Clip,
    /// Middle of exposure of every row, s, `[frame][row]`.
    pub times_s: Vec<Vec<f64>>,
    /// What the row saw, the exposure's averaging included, px.
    pub truth_px: Vec<Vec<f64>>,
    /// Least standard deviation of any estimate of a row (Cramér–Rao), px; `None` for rows that know nothing.
    pub bounds_px: Vec<Option<f64>>,
    /// Frame rate, Hz.
    pub fps: f64,
}

/// Films a scene. Lost frames are left out.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn record(config: Config) -> Result<Recording, SimError> {
    let (width, height, fps) = (
        config.sensor.cols as usize,
        config.sensor.rows as usize,
        config.sensor.fps,
    );
    let camera = Camera::new(config)?;
    let (mut frames, mut times_s, mut truth_px) = (Vec::new(), Vec::new(), Vec::new());
    for slot in camera.arriving() {
        frames.push(match camera.frame(slot).pixels {
            PixelBuffer::U8(p) => p.iter().map(|&v| f64::from(v)).collect(),
            PixelBuffer::U16(p) => p.iter().map(|&v| f64::from(v)).collect(),
        });
        let rows: Vec<_> = (0..height as u32)
            .map(|row| camera.row_truth(slot, row))
            .collect();
        times_s.push(rows.iter().map(|r| r.middle_ns as f64 * 1e-9).collect());
        truth_px.push(rows.iter().map(|r| r.displacement_px).collect());
    }
    let bounds_px = crlb::row_bounds_px(&camera);
    Ok(Recording {
        clip: Clip {
            width,
            height,
            frames,
        },
        times_s,
        truth_px,
        bounds_px,
        fps,
    })
}

/// What a method made of a recording of one tone.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The method.
    pub method: &'static str,
    /// Noise of the rows, each over its own bound (robust); 1 is the best possible.
    pub noise_over_bound: f64,
    /// Amplitude found over true amplitude, less 1.
    pub amplitude_error: f64,
    /// Frequency found less true frequency, Hz; `None` where the tone was not found within 5 Hz.
    pub hz_error: Option<f64>,
    /// Largest ghost at ±k times the frame rate from the tone (k = 1 to 3), over the tone.
    pub ghost: f64,
    /// Time of a line, µs, on this machine.
    pub us_per_line: f64,
}

/// Runs a method and compares with the truth: a tone of `hz`.
pub fn score(method: &dyn Method, recording: &Recording, hz: f64) -> Score {
    let started = Instant::now();
    let mut shifts = method.shifts(&recording.clip);
    let lines = (recording.clip.frames.len() * recording.clip.height).max(1);
    let us_per_line = started.elapsed().as_secs_f64() * 1e6 / lines as f64;
    remove_row_means(&mut shifts);
    let mut truth = recording.truth_px.clone();
    remove_row_means(&mut truth);
    let fit = Fit::new(recording, &shifts);
    let [c, s] = fit.amplitude(&shifts, hz);
    let [tc, ts] = fit.amplitude(&truth, hz);
    let (found, true_amplitude) = (c.hypot(s), tc.hypot(ts));
    let gain = found / true_amplitude;
    // The row's own mean took one of its values' freedom.
    let freedom = (1.0 - 1.0 / recording.clip.frames.len().max(2) as f64).sqrt();
    let errors: Vec<f64> = each(&fit.known)
        .filter_map(|(n, y)| {
            Some((shifts[n][y] - gain * truth[n][y]).abs() / recording.bounds_px[y]?)
        })
        .collect();
    let noise = 1.4826 * median(&errors) / gain.clamp(0.05, 20.0) / freedom;
    let left: Shifts = fit.without(&shifts, hz, [c, s]);
    let ghost = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0]
        .iter()
        .map(|k| (hz + k * recording.fps).abs())
        .filter(|g| *g > 0.2 * recording.fps)
        .map(|g| {
            let [c, s] = fit.amplitude(&left, g);
            c.hypot(s) / found.max(1e-12)
        })
        .fold(0.0, f64::max);
    Score {
        method: method.name(),
        noise_over_bound: noise,
        amplitude_error: gain - 1.0,
        hz_error: fit.frequency(&shifts, hz, 5.0).map(|f| f - hz),
        ghost,
        us_per_line,
    }
}

/// Tones on the rows that exist, each row's unknown offset taken into account (docs/spectrum.md).
#[derive(Debug)]
pub struct Fit<'a> {
    recording: &'a Recording,
    /// Which values exist.
    known: Vec<Vec<bool>>,
}

impl<'a> Fit<'a> {
    /// For all rows that a method measured and that can be known.
    pub fn new(recording: &'a Recording, shifts: &Shifts) -> Self {
        let known = shifts
            .iter()
            .map(|f| {
                f.iter()
                    .zip(&recording.bounds_px)
                    .map(|(v, b)| v.is_finite() && b.is_some())
                    .collect()
            })
            .collect();
        Self { recording, known }
    }

    /// Cosine and sine at `hz`, each row's mean removed, `[frame][row]`.
    fn regressors(&self, hz: f64) -> [Shifts; 2] {
        let make = |f: fn(f64) -> f64| -> Shifts {
            let mut waves: Shifts = self
                .recording
                .times_s
                .iter()
                .zip(&self.known)
                .map(|(times, known)| {
                    times
                        .iter()
                        .zip(known)
                        .map(|(t, k)| if *k { f(TAU * hz * t) } else { f64::NAN })
                        .collect()
                })
                .collect();
            remove_row_means(&mut waves);
            waves
        };
        [make(f64::cos), make(f64::sin)]
    }

    /// Least-squares amplitudes of cosine and sine at `hz`, px.
    pub fn amplitude(&self, shifts: &Shifts, hz: f64) -> [f64; 2] {
        self.projection(shifts, hz).0
    }

    /// Amplitudes, and the energy they explain.
    fn projection(&self, shifts: &Shifts, hz: f64) -> ([f64; 2], f64) {
        let waves = self.regressors(hz);
        let mut normal = Symmetric::zeros(2);
        let mut right = vec![0.0; 2];
        for (n, y) in each(&self.known) {
            let line = [waves[0][n][y], waves[1][n][y]];
            normal.add_outer(&line, 1.0);
            right[0] += line[0] * shifts[n][y];
            right[1] += line[1] * shifts[n][y];
        }
        match normal.factor() {
            Some(factor) => {
                let solved = factor.solve(&right);
                ([solved[0], solved[1]], dot(&solved, &right))
            }
            None => ([0.0, 0.0], 0.0),
        }
    }

    /// What is left without a tone.
    pub fn without(&self, shifts: &Shifts, hz: f64, [c, s]: [f64; 2]) -> Shifts {
        let waves = self.regressors(hz);
        (0..shifts.len())
            .map(|n| {
                (0..shifts[n].len())
                    .map(|y| shifts[n][y] - c * waves[0][n][y] - s * waves[1][n][y])
                    .collect()
            })
            .collect()
    }

    /// The frequency in a band, Hz, that explains most; `None` where that lies at the band's edge.
    pub fn strongest(&self, shifts: &Shifts, (low, high): (f64, f64)) -> Option<f64> {
        let times = self.recording.times_s.iter().flatten();
        let end = times.copied().fold(0.0, f64::max);
        // A quarter of what the length of the recording tells apart.
        let step = 0.25 / end.max(1e-3);
        let count = ((high - low) / step) as usize;
        let best = (0..=count)
            .map(|k| low + step * k as f64)
            .map(|hz| (hz, self.projection(shifts, hz).1))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        self.frequency(shifts, best.0, 2.0 * step)
    }

    /// The frequency within `reach` of `hz` that explains most; `None` where that lies at the edge.
    pub fn frequency(&self, shifts: &Shifts, hz: f64, reach: f64) -> Option<f64> {
        let energy = |f: f64| self.projection(shifts, f).1;
        let (mut best, mut step) = (hz, reach / 8.0);
        let grid: Vec<(f64, f64)> = (-8..=8)
            .map(|k| hz + f64::from(k) * step)
            .map(|f| (f, energy(f)))
            .collect();
        let top = (0..grid.len()).max_by(|&a, &b| grid[a].1.total_cmp(&grid[b].1))?;
        if top == 0 || top + 1 == grid.len() {
            return None;
        }
        best = grid.get(top).map_or(best, |g| g.0);
        // Parabolas over ever smaller steps.
        for _ in 0..4 {
            let (l, c, r) = (energy(best - step), energy(best), energy(best + step));
            let bend = l - 2.0 * c + r;
            if bend < 0.0 {
                best += (0.5 * (l - r) / bend).clamp(-1.0, 1.0) * step;
            }
            step *= 0.3;
        }
        Some(best)
    }
}

fn each(known: &[Vec<bool>]) -> impl Iterator<Item = (usize, usize)> + '_ {
    known.iter().enumerate().flat_map(|(n, rows)| {
        rows.iter()
            .enumerate()
            .filter(|(_, k)| **k)
            .map(move |(y, _)| (n, y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::classical::Classical;
    use host_sim::Tone;

    #[test]
    fn a_textbook_method_is_scored() {
        let mut config = Config::default();
        (config.sensor.cols, config.sensor.rows, config.frames) = (96, 100, 10);
        config.motion.tones.push(Tone {
            hz: 83.0,
            amplitude_px: 0.2,
            phase_rad: 0.4,
        });
        let recording = record(config).unwrap();
        let score = score(&Classical::LucasKanade, &recording, 83.0);
        assert!(score.amplitude_error.abs() < 0.2, "{score:?}");
        assert!(score.hz_error.is_some_and(|e| e.abs() < 0.5), "{score:?}");
        assert!(
            score.noise_over_bound > 0.8 && score.noise_over_bound < 20.0,
            "{score:?}"
        );
    }
}
