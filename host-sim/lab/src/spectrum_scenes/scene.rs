//! The recipe of a random scene.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rowtone::camera::Timing;
use rowtone::timeline::{Group, Sample};

use super::bound::Bound;

/// From what to what a scene's numbers are drawn (evenly, amplitudes evenly in decibels).
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges {
    /// Blank time, share of the frame period.
    pub blank: [f64; 2],
    /// Frame rate, Hz.
    pub fps: [f64; 2],
    /// Frames lost, share.
    pub lost: [f64; 2],
    /// Jitter of the frames' starts, s rms.
    pub jitter_s: f64,
    /// Window, s.
    pub window_s: [f64; 2],
    /// Samples a second while the shutter runs.
    pub sample_hz: [f64; 2],
    /// Tones, from and to.
    pub tones: [usize; 2],
    /// Amplitude over its bound.
    pub over_bound: [f64; 2],
    /// Least distance of tones, in 1/window.
    pub apart: f64,
    /// Creep, px/s, up to this either way.
    pub creep_px_per_s: f64,
}

impl Default for Ranges {
    /// Those of the project's own figures: see docs/spectrum.md.
    fn default() -> Self {
        Self {
            blank: [0.01, 0.45],
            fps: [25.0, 200.0],
            lost: [0.0, 0.05],
            jitter_s: 50e-6,
            window_s: [0.5, 2.0],
            sample_hz: [1000.0, 5000.0],
            tones: [1, 5],
            over_bound: [10.0, 1000.0],
            apart: 2.5,
            creep_px_per_s: 0.5,
        }
    }
}

/// A tone of the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueTone {
    /// Frequency, Hz.
    pub hz: f64,
    /// Zero to peak, px.
    pub amplitude_px: f64,
    /// Phase at time 0, rad.
    pub phase_rad: f64,
    /// Cramér–Rao bound of the frequency, Hz.
    pub hz_bound: f64,
    /// Cramér–Rao bound of the amplitude, px.
    pub amplitude_bound_px: f64,
}

/// What is true in one window.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Frame rate, Hz.
    pub fps: f64,
    /// Window, s.
    pub window_s: f64,
    /// What is in it.
    pub tones: Vec<TrueTone>,
}

/// One window of samples and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Groups of rows.
    pub group: Group,
    /// In the order in which a camera would give them.
    pub samples: Vec<Sample>,
    /// What is true.
    pub truth: Truth,
}

/// Random numbers of a scene.
pub(crate) struct Draw(ChaCha8Rng);

impl Draw {
    /// Those of scene `number` of the series `seed`.
    pub(crate) fn new(seed: u64, number: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number);
        Self(rng)
    }

    /// Evenly from 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly from a range.
    pub(crate) fn from(&mut self, range: [f64; 2]) -> f64 {
        range[0] + (range[1] - range[0]) * self.unit()
    }

    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// So many frequencies within `band`, Hz, none nearer than `apart_hz` to another.
    pub(super) fn frequencies(&mut self, count: usize, band: [f64; 2], apart_hz: f64) -> Vec<f64> {
        let mut hz: Vec<f64> = Vec::new();
        while hz.len() < count {
            let f = self.from(band);
            if hz.iter().all(|g| (f - g).abs() >= apart_hz) {
                hz.push(f);
            }
        }
        hz
    }
}

impl Scene {
    /// Scene number `number` of the series `seed`.
    ///
    /// # Panics
    /// When the ranges make no camera (a sample rate below a few frame rates).
    pub fn draw(ranges: &Ranges, seed: u64, number: u64) -> Self {
        let mut draw = Draw::new(seed, number);
        let fps = draw.from(ranges.fps);
        let blank = draw.from(ranges.blank);
        let window_s = draw.from(ranges.window_s);
        let spacing_s = 1.0 / draw.from(ranges.sample_hz);
        let slots = (((1.0 - blank) / fps / spacing_s).round()).max(2.0);
        let spacing_s = (1.0 - blank) / fps / slots;
        let timing = Timing::new((spacing_s * 1e12) as u32, 0, slots as u16).expect("has rows");
        let group = Group::new(timing, 1).expect("one row a sample");
        let lost = draw.from(ranges.lost);
        let frames = (window_s * fps) as u32;
        let noise_px = 10_f64.powf(draw.from([-3.0, -1.5]));
        let offsets: Vec<f64> = (0..slots as usize).map(|_| 0.3 * draw.normal()).collect();
        let texture: Vec<f64> = (0..slots as usize)
            .map(|_| (0.5 * draw.normal()).exp())
            .collect();
        // What the line engine says of its noise need not be right.
        let claim = draw.from([0.7, 1.5]);
        let mut samples = Vec::new();
        for frame in 0..frames {
            let start_s = f64::from(frame) / fps + ranges.jitter_s * draw.normal();
            let light = (0.1 * draw.normal()).exp();
            if frame > 0 && frame + 1 < frames && draw.unit() < lost {
                continue;
            }
            for slot in 0..slots as u16 {
                let information = texture[usize::from(slot)] * light / (noise_px * noise_px);
                let time_ns = (start_s * 1e9).round() as i64 + group.middle_ns(slot);
                let shift = offsets[usize::from(slot)] + draw.normal() / information.sqrt();
                samples.push(Sample {
                    curvature: Default::default(),
                    frame,
                    slot,
                    time_ns,
                    shift_px: shift as f32,
                    information_per_px2: (information * claim) as f32,
                    spread: Default::default(),
                    vertical: None,
                });
            }
        }
        let mut scene = Self {
            group,
            samples,
            truth: Truth {
                fps,
                window_s,
                tones: Vec::new(),
            },
        };
        let count = ranges.tones[0]
            + (draw.unit() * (ranges.tones[1] - ranges.tones[0] + 1) as f64) as usize;
        let top = 0.45e9 / scene.group.spacing_ns() as f64;
        let hz = draw.frequencies(count, [5.0, top], ranges.apart / window_s);
        scene.add_tones(&mut draw, &hz, ranges, claim);
        let creep = draw.from([-ranges.creep_px_per_s, ranges.creep_px_per_s]);
        for sample in &mut scene.samples {
            let t = sample.time_ns as f64 * 1e-9;
            let moved: f64 = scene
                .truth
                .tones
                .iter()
                .map(|tone| tone.amplitude_px * (TAU * tone.hz * t + tone.phase_rad).cos())
                .sum();
            sample.shift_px = (f64::from(sample.shift_px) + moved + creep * t) as f32;
        }
        scene
    }

    fn add_tones(&mut self, draw: &mut Draw, hz: &[f64], ranges: &Ranges, claim: f64) {
        let phases: Vec<f64> = hz.iter().map(|_| draw.from([0.0, TAU])).collect();
        let unit: Vec<(f64, f64)> = hz.iter().copied().zip(phases.iter().copied()).collect();
        let bounds = Bound::of(&self.samples, claim, &unit);
        let db = ranges.over_bound.map(f64::log10);
        for ((&hz, &phase_rad), bound) in hz.iter().zip(&phases).zip(bounds) {
            let amplitude_px = bound.amplitude_px * 10_f64.powf(draw.from(db));
            self.truth.tones.push(TrueTone {
                hz,
                amplitude_px,
                phase_rad,
                hz_bound: bound.hz / amplitude_px,
                amplitude_bound_px: bound.amplitude_px,
            });
        }
    }
}
