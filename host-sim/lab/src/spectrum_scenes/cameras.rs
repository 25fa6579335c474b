//! Whole simulated recordings: from pictures through line engine and spectrum to the report, as `rowtone analyze` goes.
//!
//! Sensors are the presets' (noise, full well, frame rate or a slower one) with a smaller picture; their line times are
//! such that the blank time is as drawn.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rowtone::report::Report;
use rowtone::timeline::{Sample, Spread};
use rowtone::tracker::Axes;

use super::bound::Bound;
use super::scene::{Draw, TrueTone, Truth};
use super::score::Score;
use crate::LabError;
use crate::filmed::Filmed;
use host_sim::{Camera, Optics, Preset, SimError, crlb};
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings};
use rowtone_measure::tracking::Shifts;

/// Highest frequency that `rowtone analyze` looks for by itself, Hz.
const TOP_HZ: f64 = 2000.0;

/// Longest part of a period that a row is exposed: beyond it too little of a tone is left.
const MOST_EXPOSED: f64 = 0.7;

/// Largest amplitude of a tone, px. Near a multiple of the frame rate the bound is high, and so would be a
/// tone of so many times the bound.
const MOST_PX: f64 = 1.0;

/// From what to what the recordings are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges {
    /// Blank time, share of the frame period.
    pub blank: [f64; 2],
    /// Amplitude over its bound, evenly in decibels.
    pub over_bound: [f64; 2],
    /// Tones, from and to.
    pub tones: [usize; 2],
    /// Frames lost, share.
    pub lost: [f64; 2],
}

impl Default for Ranges {
    fn default() -> Self {
        Self {
            blank: [0.01, 0.45],
            over_bound: [10.0, 1000.0],
            tones: [1, 5],
            lost: [0.0, 0.05],
        }
    }
}

/// A recording and its truth.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The camera, which makes its frames when asked.
    pub camera: Camera,
    /// What is true.
    pub truth: Truth,
}

impl Recording {
    /// Recording number `number` of the series `seed`.
    ///
    /// # Errors
    /// [`SimError`] when the ranges make no camera.
    pub fn draw(ranges: &Ranges, seed: u64, number: u64) -> Result<Self, SimError> {
        let mut draw = Draw::new(seed, number);
        let config = still(&mut draw, ranges, seed.wrapping_mul(1_000_003) + number);
        let window_s = f64::from(config.frames) / config.sensor.fps;
        let camera = Camera::new(config.clone())?;
        let rows = rows(&camera);
        let exposure_s = f64::from(config.sensor.exposure_ns) * 1e-9;
        let line_s = f64::from(config.sensor.line_time_ps) * 1e-12;
        let top = TOP_HZ.min(0.45 / line_s).min(MOST_EXPOSED / exposure_s);
        let [least, most] = ranges.tones;
        let count = least + (draw.unit() * (most - least + 1) as f64) as usize;
        let tones = loop {
            let hz = draw.frequencies(count, [5.0, top], 2.5 / window_s);
            let tones = tones(&mut draw, &hz, ranges, &rows, exposure_s);
            if tones.iter().all(|t| t.amplitude_px < MOST_PX) {
                break tones;
            }
        };
        let mut moving = config;
        moving.motion.tones = tones
            .iter()
            .map(|t| host_sim::Tone {
                hz: t.hz,
                amplitude_px: t.amplitude_px,
                phase_rad: t.phase_rad + FRAC_PI_2, // the simulator's are sines
            })
            .collect();
        Ok(Self {
            truth: Truth {
                fps: moving.sensor.fps,
                window_s,
                tones,
            },
            camera: Camera::new(moving)?,
        })
    }

    /// What the whole way makes of it: one window, the whole recording.
    ///
    /// # Errors
    /// [`LabError`] as `rowtone analyze`.
    pub fn analyze(&self) -> Result<Report, LabError> {
        let feed = Filmed::new(&self.camera, Axes::X)?.feed()?;
        let plan = Plan::new(
            &feed.camera,
            &Settings {
                // More than there is: all of it is the last window.
                window_s: 1.5 * self.truth.window_s,
                ..Settings::default()
            },
        )?;
        let shifts = Shifts::start(feed, Some(plan.groups()))?;
        let mut memory = plan.memory();
        let mut last = None;
        Analysis::new(shifts, &plan, &mut memory)?.run(|event| {
            if let Event::Report(report, _) = event {
                last = Some(report.clone());
            }
            Ok::<(), LabError>(())
        })?;
        last.ok_or(LabError::NoReport)
    }
}

/// Draws and scores `count` recordings.
///
/// # Errors
/// [`LabError`] of the first recording that cannot be made or analysed.
pub fn score(ranges: &Ranges, seed: u64, count: u64) -> Result<Score, LabError> {
    let mut score = Score::default();
    for number in 0..count {
        let recording =
            Recording::draw(ranges, seed, number).map_err(|why| LabError::Recording {
                what: format!("recording {number}"),
                why,
            })?;
        score.add(number, &recording.truth, &recording.analyze()?);
    }
    Ok(score)
}

/// A recording in which nothing moves.
fn still(draw: &mut Draw, ranges: &Ranges, seed: u64) -> host_sim::Config {
    let preset = Preset::ALL[(draw.unit() * Preset::ALL.len() as f64) as usize];
    let mut sensor = preset.sensor();
    // The band cannot use the columns at the edges: some 20, which the bound counts.
    sensor.cols = draw.from([192.0, 384.0]) as u32;
    sensor.rows = draw.from([120.0, 240.0]) as u32;
    sensor.fps = (sensor.fps * draw.from([0.5, 1.0])).max(25.0);
    let line_s = (1.0 - draw.from(ranges.blank)) / sensor.fps / f64::from(sensor.rows);
    sensor.line_time_ps = (line_s * 1e12) as u32;
    sensor.exposure_ns = draw.from([50e3, 500e3]) as u32;
    let scene = match (draw.unit() * 4.0) as u32 {
        0 => host_sim::Scene::Speckle {
            grain_px: draw.from([1.5, 3.0]),
        },
        1 => host_sim::Scene::Bar {
            width_px: draw.from([20.0, 60.0]),
        },
        2 => host_sim::Scene::Stripes {
            period_px: draw.from([12.0, 24.0]),
        },
        _ => host_sim::Scene::Photo {
            sky: draw.from([0.0, 0.3]),
        },
    };
    let window_s = draw.from([0.5, 1.5]);
    let mut config = host_sim::Config {
        seed,
        frames: (window_s * sensor.fps) as u32,
        sensor,
        scene,
        ..host_sim::Config::default()
    };
    config.optics.blur_px = Optics::blur_for_cutoff(draw.from([0.08, 0.15]));
    config.faults.lost_probability = draw.from(ranges.lost);
    config.faults.jitter_us = 50.0;
    config
}

/// What each row that arrives could at best know, as samples of one row.
pub(super) fn rows(camera: &Camera) -> Vec<Sample> {
    let bounds = crlb::row_bounds_px(camera);
    let timing = camera.timing();
    let mut rows = Vec::new();
    for slot in camera.arriving() {
        for (row, bound) in bounds.iter().enumerate() {
            let Some(bound) = bound else { continue };
            rows.push(Sample {
                curvature: Default::default(),
                frame: slot.number,
                slot: row as u16,
                time_ns: slot.start_ns + timing.middle_ns(row as u16),
                shift_px: 0.0,
                information_per_px2: (1.0 / (bound * bound)) as f32,
                spread: Spread::default(),
                vertical: None,
            });
        }
    }
    rows
}

/// Tones of random phases and amplitudes; the exposure leaves a part of each.
fn tones(
    draw: &mut Draw,
    hz: &[f64],
    ranges: &Ranges,
    rows: &[Sample],
    exposure_s: f64,
) -> Vec<TrueTone> {
    let unit: Vec<(f64, f64)> = hz.iter().map(|&f| (f, draw.from([0.0, TAU]))).collect();
    let bounds = Bound::of(rows, 1.0, &unit);
    unit.iter()
        .zip(bounds)
        .map(|(&(hz, phase_rad), bound)| {
            let x = PI * hz * exposure_s;
            let left = x.sin() / x;
            let amplitude_bound_px = bound.amplitude_px / left;
            let over = 10_f64.powf(draw.from(ranges.over_bound.map(f64::log10)));
            TrueTone {
                hz,
                amplitude_px: over * amplitude_bound_px,
                phase_rad,
                hz_bound: bound.hz / (over * bound.amplitude_px),
                amplitude_bound_px,
            }
        })
        .collect()
}
