//! The line time from a steady machine tone that turns by less than a period from the first row to the last.
//!
//! The tone is seen twice. From frame to frame it has a frequency below half the frame rate, f or f's alias; from row
//! to row its phase turns by ν = F·t_line a row, F = k·fps ± f being what it truly is. Each k makes a line
//! time; that of a read-out which fits into a frame and is none that no rolling shutter has is believed, and of several
//! the one with which the other tones join too. A guess ([`About::Near`]) or the frequency itself decides what is left.
//!
//! | file | what it does |
//! | --- | --- |
//! | [`motion`] | displacement of small cells |
//! | `steady` | the tones from frame to frame |
//! | `slant` | how their phases turn from row to row |

pub mod motion;
mod refusal;
mod slant;
mod steady;

use super::fit::Fit;
use super::frames::{CLOCK_TOLERANCE, Rolling, Verdict};
use super::model::{Background, Model};
use super::rows::Recording;
use super::stripes::Stripes;
use super::{Calibration, Source, conclude};
use motion::Motion;
pub use refusal::NoTone;
use slant::{Slant, slant};
use std::f64::consts::TAU;

/// Fewest frames in which a tone is looked for.
const LEAST_FRAMES: usize = 32;
/// A turn from row to row is believed from so many standard deviations on.
const DEVIATIONS: f64 = 5.0;
/// Shortest line time of a rolling shutter that is believed, s: fast stacked sensors take 3 µs and more.
const SHORTEST_LINE_S: f64 = 2e-6;
/// Shortest read-out that is believed, share of the frame period,
const SHORTEST_READOUT: f64 = 0.1;
/// and, s, or half of the frame period where that is less: slow-motion modes read as fast as the sensor can.
const SHORTEST_READOUT_S: f64 = 1.2e-3;
/// Highest tone, Hz.
const HIGHEST_HZ: f64 = 20_000.0;
/// Another tone speaks where its turn is known within this share of what one frame rate more would make.
const SPEAKS: f64 = 0.15;
/// Cells whose noise may be one and the same: the blocks of a video codec, or light that flickers.
const ALIKE: f64 = 16.0;

/// What is known of the tone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum About {
    /// Nothing.
    Nothing,
    /// About where it is, Hz.
    Near(f64),
    /// Exactly where it is, Hz.
    Exactly(f64),
}

/// One way to read the turn of the rows.
#[derive(Clone, Copy, Debug)]
struct Reading {
    /// What the tone truly is, Hz.
    hz: f64,
    line_time_s: f64,
    rolling: Rolling,
}

/// Calibrates a camera by a tone in the motion of small cells; `recording` gives times and the picture's rows, its row
/// means are not asked.
///
/// # Errors
/// [`NoTone`].
pub fn calibrate(
    motion: &Motion,
    recording: &Recording,
    about: About,
) -> Result<(Calibration, Stripes), NoTone> {
    if let About::Near(hz) | About::Exactly(hz) = about
        && !(hz.is_finite() && hz > 0.0)
    {
        return Err(NoTone::Hz { hz });
    }
    let frames = motion.frames.len();
    if frames < LEAST_FRAMES {
        return Err(NoTone::TooFewFrames {
            frames,
            least: LEAST_FRAMES,
        });
    }
    let times = recording.times_s.as_deref();
    let times = times.filter(|t| t.len() == frames).ok_or(NoTone::NoTimes)?;
    let period_s = recording.frame_period_s().ok_or(NoTone::NoTimes)?;
    if motion.rows.is_empty() {
        return Err(NoTone::NoTexture);
    }
    let tones = steady::tones(motion, times);
    if tones.is_empty() {
        return Err(NoTone::NothingSteady);
    }
    let mut slants: Vec<Slant> = (0..tones.len())
        .filter_map(|i| {
            let moves = steady::moves(motion, times, &tones, i);
            slant(&motion.rows, motion.height, &moves)
        })
        .collect();
    slants.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    let rows = recording.picture_rows.unwrap_or(motion.height);
    let camera = Camera {
        period_s,
        rows,
        span_s: steady::span(times),
    };
    let (tone, reading) = camera.read(&slants, about)?;
    let (hz_sd, scale) = match about {
        About::Exactly(hz) => (0.0, reading.hz / hz),
        _ => (camera.hz_sd(&tone), 1.0),
    };
    let verdict = Verdict::Clear {
        rolling: reading.rolling,
        scale,
        scale_sd: camera.hz_sd(&tone) / reading.hz,
    };
    let hz = match about {
        About::Exactly(hz) => hz,
        _ => reading.hz,
    };
    let stripes = drawn(motion, times, &tone);
    conclude(
        recording,
        Source {
            hz,
            hz_sd,
            verdict,
            is_known: matches!(about, About::Exactly(_)),
            duty: None,
            is_light: false,
        },
        stripes,
    )
    .map_err(NoTone::Other)
}

/// What the readings depend on.
struct Camera {
    period_s: f64,
    rows: usize,
    span_s: f64,
}

impl Camera {
    /// The tone that tells, and how to read it.
    fn read(&self, slants: &[Slant], about: About) -> Result<(Slant, Reading), NoTone> {
        if let About::Exactly(hz) = about {
            return self.known(slants, hz);
        }
        let turns = |s: &&Slant| s.per_row.abs() > DEVIATIONS * s.sd;
        let Some(tone) = slants.iter().find(turns) else {
            return Err(match slants.first() {
                Some(s) => NoTone::AtOnce {
                    hz: s.hz,
                    turns: s.per_row * self.rows as f64,
                    sd: s.sd * self.rows as f64,
                },
                None => NoTone::NothingSteady,
            });
        };
        let mut readings = self.readings(tone);
        if let About::Near(near) = about {
            readings.sort_by(|a, b| (a.hz - near).abs().total_cmp(&(b.hz - near).abs()));
            let is_clear = readings.len() < 2
                || (readings[1].hz - near).abs() >= 2.0 * (readings[0].hz - near).abs();
            if is_clear {
                readings.truncate(1);
            }
        } else if readings.len() > 1 {
            let others = slants.iter().filter(|s| s.hz != tone.hz && turns(s));
            let others: Vec<&Slant> = others.collect();
            let joins = |r: &Reading| others.iter().all(|s| self.joins(tone, r, s));
            let joined: Vec<Reading> = readings.iter().copied().filter(joins).collect();
            if !joined.is_empty() {
                readings = joined;
            }
        }
        match readings[..] {
            [one] => Ok((*tone, one)),
            [] => Err(NoTone::NoReading { hz: tone.hz }),
            _ => Err(NoTone::Ambiguous {
                readings: by_hz(readings)
                    .iter()
                    .map(|r| (r.hz, r.line_time_s))
                    .collect(),
            }),
        }
    }

    /// The tone of a frequency that is known.
    fn known(&self, slants: &[Slant], hz: f64) -> Result<(Slant, Reading), NoTone> {
        let fps = 1.0 / self.period_s;
        let frames = (hz / fps).round();
        let alias = hz - frames * fps;
        let near = CLOCK_TOLERANCE * hz + 1.0 / self.span_s;
        let is_it = |s: &&Slant| (s.hz - alias.abs()).abs() < near;
        let Some(tone) = slants.iter().find(is_it) else {
            return Err(NoTone::NotThere {
                hz,
                seen_hz: slants.iter().map(|s| s.hz).collect(),
            });
        };
        if tone.per_row.abs() < DEVIATIONS * tone.sd {
            return Err(NoTone::AtOnce {
                hz,
                turns: tone.per_row * self.rows as f64,
                sd: tone.sd * self.rows as f64,
            });
        }
        let line_time_s = tone.per_row.abs() / hz;
        if line_time_s * self.rows as f64 > self.period_s * (1.0 + CLOCK_TOLERANCE) {
            return Err(NoTone::NoReading { hz });
        }
        let reading = Reading {
            hz: frames * fps + tone.hz.copysign(alias),
            line_time_s,
            rolling: direction(alias, tone.per_row),
        };
        Ok((*tone, reading))
    }

    /// All that a tone may be.
    fn readings(&self, tone: &Slant) -> Vec<Reading> {
        let fps = 1.0 / self.period_s;
        let most = (HIGHEST_HZ / fps) as i32 + 1;
        (-most..=most)
            .map(|k| tone.hz + f64::from(k) * fps)
            .map(|signed| Reading {
                hz: signed.abs(),
                line_time_s: tone.per_row.abs() / signed.abs(),
                rolling: direction(signed, tone.per_row),
            })
            .filter(|r| {
                let readout = r.line_time_s * self.rows as f64 / self.period_s;
                let shortest = (SHORTEST_READOUT_S / self.period_s).min(0.5);
                (SHORTEST_READOUT.max(shortest)..1.0 + CLOCK_TOLERANCE).contains(&readout)
                    && r.line_time_s > SHORTEST_LINE_S
                    && r.hz < HIGHEST_HZ
            })
            .collect()
    }

    /// Whether another tone's turn is one that this reading allows; one that is not known well enough joins.
    fn joins(&self, tone: &Slant, reading: &Reading, other: &Slant) -> bool {
        let fps = 1.0 / self.period_s;
        let sign = if reading.rolling == Rolling::Down {
            1.0
        } else {
            -1.0
        };
        let line = sign * reading.line_time_s;
        let k = ((other.per_row / line - other.hz) / fps).round();
        let off = other.per_row - line * (other.hz + k * fps);
        let by_the_line = tone.sd / tone.per_row.abs() * other.per_row.abs();
        let sd = other.sd.hypot(by_the_line);
        let spacing = reading.line_time_s * fps;
        DEVIATIONS * sd > SPEAKS * spacing || off.abs() < DEVIATIONS * sd
    }

    /// Standard deviation of a tone's frequency, Hz, by the lever of a straight line through its phase.
    fn hz_sd(&self, tone: &Slant) -> f64 {
        (6.0 * ALIKE / tone.snr.max(1.0)).sqrt() / (TAU * self.span_s)
    }
}

fn by_hz(mut readings: Vec<Reading>) -> Vec<Reading> {
    readings.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    readings
}

fn direction(signed_hz: f64, per_row: f64) -> Rolling {
    if (signed_hz < 0.0) == (per_row < 0.0) {
        Rolling::Down
    } else {
        Rolling::Up
    }
}

/// The tone in the whole rows, as a fit to be drawn.
fn drawn(motion: &Motion, times_s: &[f64], tone: &Slant) -> Stripes {
    let rows = motion.whole_rows(motion.frames.len());
    let frames = rows.len();
    let (height, count) = (motion.height, frames as f64);
    let centre = 0.5 * (height as f64 - 1.0);
    let start = tone.phase / TAU;
    let phases = times_s.iter().map(|t| tone.hz * (t - times_s[0]) + start);
    let model = Model {
        per_row: tone.per_row.abs(),
        phases: phases.map(|p| p * tone.per_row.signum()).collect(),
        harmonics: vec![[1.0, 0.0]],
    };
    let mean = |y: usize| rows.iter().map(|r| r[y]).sum::<f64>() / count;
    let offset: Vec<f64> = (0..height).map(mean).collect();
    let wave = |n: usize, y: usize| model.wave(model.psi(n, y as f64 - centre));
    let gain: Vec<f64> = (0..height)
        .map(|y| {
            let product = |n: usize| (rows[n][y] - offset[y]) * wave(n, y);
            2.0 / count * (0..frames).map(product).sum::<f64>()
        })
        .collect();
    let left = |n: usize| -> Vec<f64> {
        let value = |y: usize| rows[n][y] - offset[y] - gain[y] * wave(n, y);
        (0..height).map(value).collect()
    };
    let residual: Vec<Vec<f64>> = (0..frames).map(left).collect();
    Stripes {
        background: Background::PerRow,
        left_out: (0, 0),
        fit: Fit {
            rss: residual.iter().flatten().map(|r| r * r).sum(),
            count: frames * height,
            parameters: 2 * height + 2,
            per_row_sd: tone.sd,
            not_met: 0.0,
            residual,
            offset,
            gain,
            model,
        },
    }
}
