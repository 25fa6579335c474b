//! Broad-band measures of random scenes against what the motion was in the same window.
//!
//! A scene is a camera and a motion: tones, random vibration of even density over a band, or both, along x or along both
//! axes. Its windows are drawn one by one. The truth is that of the window, the time between frames included.

use std::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{BroadBand, Figure, Measures};
use rowtone::spectrum::Config;
use rowtone::timeline::{Group, Sample, Vertical};
use rowtone::tracker::Axes;
use rowtone_memory::SpectrumMemory;

use super::scene::Draw;

/// What moves in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two to four tones.
    Tones,
    /// Random vibration.
    Random,
    /// One to three tones and random vibration.
    Both,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tones, Self::Random, Self::Both];

    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tones => "tones",
            Self::Random => "random vibration",
            Self::Both => "tones and random",
        }
    }
}

/// Measures that are compared, in the order of the figures of a window.
pub const MEASURES: [&str; 6] = [
    "velocity",
    "velocity 2 Hz",
    "displacement",
    "acceleration",
    "kurtosis",
    "crest factor",
];

/// Window, s.
const WINDOW_S: f64 = 1.0;

/// The truth is taken from so many points.
const POINTS: usize = 8192;

/// Sinusoids of one axis: Hz, and amplitudes of cosine and sine, px.
type Waves = Vec<(f64, [f64; 2])>;

/// A camera and a motion.
#[derive(Clone, Debug)]
struct Scene {
    kind: Kind,
    group: Group,
    fps: f64,
    lost: f64,
    noise_px: f64,
    /// Both axes, and how much of y each slot takes for x.
    couplings: Option<Vec<f64>>,
    tones: [Waves; 2],
    band_hz: [f64; 2],
    rms_px: f64,
}

impl Scene {
    fn draw(kind: Kind, draw: &mut Draw) -> Self {
        let fps = draw.from([25.0, 200.0]);
        let blank = draw.from([0.0, 0.4]);
        let slots = ((1.0 - blank) / fps * draw.from([4000.0, 9000.0]))
            .round()
            .max(24.0);
        let line_ps = (1.0 - blank) / fps / slots * 1e12;
        // The exposure leaves two fifths or more of what is at 1000 Hz.
        let exposure_ns = draw.from([0.0, 7e5]) as u32;
        let timing = Timing::new(line_ps as u32, exposure_ns, slots as u16).expect("has rows");
        let two = draw.unit() < 0.5;
        let couplings = two.then(|| (0..slots as usize).map(|_| 0.4 * draw.normal()).collect());
        let mut tones = [Waves::new(), Waves::new()];
        let count = match kind {
            Kind::Tones => 2 + (3.0 * draw.unit()) as usize,
            Kind::Random => 0,
            Kind::Both => 1 + (3.0 * draw.unit()) as usize,
        };
        for hz in draw.frequencies(count, [12.0, 800.0], 4.0) {
            // A tone at a multiple of the frame rate is hidden, as it is from the peaks.
            let hz = if (hz / fps - (hz / fps).round()).abs() * fps < 2.0 {
                hz + 4.0
            } else {
                hz
            };
            let px = 10_f64.powf(draw.from([-1.3, -0.3])) / (1.0 + hz / 100.0);
            for axis in &mut tones {
                axis.push((hz, [px * draw.normal(), px * draw.normal()]));
            }
        }
        let low = draw.from([12.0, 80.0]);
        Self {
            kind,
            group: Group::new(timing, 1).expect("one row a sample"),
            fps,
            lost: draw.from([0.0, 0.05]),
            noise_px: 10_f64.powf(draw.from([-2.5, -1.8])),
            couplings,
            tones,
            band_hz: [low, draw.from([200.0, 900.0])],
            rms_px: 10_f64.powf(draw.from([-1.3, -0.5])),
        }
    }

    /// The waves of one window.
    fn waves(&self, draw: &mut Draw) -> [Waves; 2] {
        let mut waves = self.tones.clone();
        if self.kind == Kind::Tones {
            return waves;
        }
        let [low, high] = self.band_hz;
        let count = ((high - low) / 0.8 * WINDOW_S).ceil();
        let size = self.rms_px / count.sqrt();
        for axis in &mut waves {
            for i in 0..count as u32 {
                let hz = low + (high - low) * (f64::from(i) + draw.unit()) / count;
                axis.push((hz, [size * draw.normal(), size * draw.normal()]));
            }
        }
        waves
    }

    /// A window: what is told of it, and what is true of each axis that is measured.
    fn window(&self, draw: &mut Draw) -> (Option<BroadBand>, Vec<Truth>) {
        let waves = self.waves(draw);
        let axes = if self.couplings.is_some() { 2 } else { 1 };
        let tones = |axis: usize| self.tones[axis].len();
        let truth = (0..axes)
            .map(|axis| Truth::of(&waves[axis], tones(axis)))
            .collect();
        let slots = self.group.slots();
        let middles: Vec<f64> = (0..slots)
            .map(|s| self.group.middle_ns(s) as f64 * 1e-9)
            .collect();
        let offsets: Vec<f64> = middles.iter().map(|_| 0.3 * draw.normal()).collect();
        let kind = if axes == 2 { Axes::Xy } else { Axes::X };
        let mut memory = SpectrumMemory::for_axes(kind, self.group, WINDOW_S, self.fps);
        let config = Config {
            window_ns: (WINDOW_S * 1e9) as i64,
            ..Config::default()
        };
        let mut reports = ReportSide::new(config, self.group, memory.lend()).expect("fits");
        // As filmed: the exposure's averaging is in it.
        let filmed = waves.clone().map(|axis| -> Waves {
            let left = |hz: f64| f64::from(self.group.exposed(hz as f32));
            let weaken = |(hz, px): (f64, [f64; 2])| (hz, px.map(|px| px * left(hz)));
            axis.into_iter().map(weaken).collect()
        });
        let mut last = None;
        for frame in 0..(WINDOW_S * self.fps) as u32 + 1 {
            let start_s =
                (f64::from(frame) + 0.01) / self.fps + 50e-6 * draw.normal().clamp(-3.0, 3.0);
            if frame > 0 && draw.unit() < self.lost {
                continue;
            }
            for slot in 0..slots {
                let i = usize::from(slot);
                let t = start_s + middles[i];
                let x = at(&filmed[0], t);
                let y = self.couplings.as_ref().map_or(0.0, |_| at(&filmed[1], t));
                let information = self.noise_px.powi(-2);
                let vertical = self.couplings.as_ref().map(|couplings| Vertical {
                    shift_px: (y + self.noise_px * draw.normal()) as f32,
                    information_per_px2: information as f32,
                    coupling: couplings[i] as f32,
                    ..Vertical::default()
                });
                let coupled = vertical.map_or(0.0, |v| f64::from(v.coupling) * y);
                let sample = Sample {
                    curvature: Default::default(),
                    frame,
                    slot,
                    time_ns: (start_s * 1e9).round() as i64 + self.group.middle_ns(slot),
                    shift_px: (offsets[i] + x + coupled + self.noise_px * draw.normal()) as f32,
                    information_per_px2: information as f32,
                    spread: Default::default(),
                    vertical,
                };
                if reports.push(sample) {
                    last = last.or(reports.report());
                }
            }
        }
        let last = last.or_else(|| reports.finish());
        (last.and_then(|report| report.broad_band), truth)
    }
}

/// Where waves are at a time, px.
fn at(waves: &Waves, t: f64) -> f64 {
    let each = waves.iter().map(|(hz, [a, b])| {
        let (s, c) = (TAU * hz * t).sin_cos();
        a * c + b * s
    });
    each.sum()
}

/// What is true of an axis in a window.
#[derive(Clone, Debug)]
struct Truth {
    /// Displacement at points of the window, px.
    px: Vec<f64>,
    /// Mean squares of displacement, velocity and acceleration: steady tones have those of whole periods, the others those
    /// of the window.
    squares: [f64; 3],
}

impl Truth {
    /// Of waves of which the first few are tones.
    fn of(waves: &Waves, tones: usize) -> Self {
        let (steady, others) = waves.split_at(tones);
        let mut points = vec![[0.0; 3]; POINTS];
        for wave in others {
            add(&mut points, wave);
        }
        let mut squares = [0, 1, 2].map(|part| {
            let sum: f64 = points.iter().map(|p: &[f64; 3]| p[part] * p[part]).sum();
            sum / POINTS as f64
        });
        for wave in steady {
            add(&mut points, wave);
            let (hz, [a, b]) = wave;
            for (power, square) in (0..).zip(&mut squares) {
                *square += 0.5 * (a * a + b * b) * (TAU * hz).powi(2 * power);
            }
        }
        Self {
            px: points.iter().map(|p| p[0]).collect(),
            squares,
        }
    }
}

/// Adds displacement, velocity and acceleration of a wave at evenly spaced points of a window.
fn add(points: &mut [[f64; 3]], (hz, [a, b]): &(f64, [f64; 2])) {
    let w = TAU * hz;
    let (sin, cos) = (w * WINDOW_S / POINTS as f64).sin_cos();
    let (mut c, mut s) = (1.0, 0.0);
    for point in points {
        let (x, v) = (a * c + b * s, b * c - a * s);
        point[0] += x;
        point[1] += w * v;
        point[2] -= w * w * x;
        (c, s) = (c * cos - s * sin, s * cos + c * sin);
    }
}

/// What is true, in the order of [`MEASURES`]; `None` of what has no such measure.
fn truth(axes: &[Truth]) -> [Option<f64>; 6] {
    let [displacement, velocity, acceleration] =
        [0, 1, 2].map(|part| axes.iter().map(|a| a.squares[part]).sum::<f64>().sqrt());
    let farthest = (0..POINTS).map(|i| axes.iter().map(|a| a.px[i] * a.px[i]).sum::<f64>());
    let farthest = farthest.fold(0.0, f64::max).sqrt();
    let kurtosis = (axes.len() == 1).then(|| {
        let moment = |power: i32| axes[0].px.iter().map(|x| x.powi(power)).sum::<f64>();
        moment(4) * POINTS as f64 / moment(2).powi(2)
    });
    [
        Some(velocity),
        Some(velocity),
        Some(displacement),
        Some(acceleration),
        kurtosis,
        Some(farthest / displacement),
    ]
}

/// What is told, in the order of [`MEASURES`].
fn told(of: &Measures) -> [Option<Figure>; 6] {
    [
        of.velocity_px_s,
        of.velocity_from_2_hz_px_s,
        of.displacement_px,
        of.acceleration_px_s2,
        of.kurtosis,
        of.crest_factor,
    ]
}

/// What a measure came to over the windows of many scenes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Windows.
    pub windows: u32,
    /// In which the measure was told and its stated deviation is no more than 3 % of it.
    pub sharp: u32,
    /// In which it was told with [`Figure::is_limit`], or not at all.
    pub limits: u32,
    /// In which the truth is above [`Figure::at_most`].
    pub above: u32,
    /// Errors of sharp windows, shares of the truth.
    pub errors: Vec<f64>,
    /// Errors over stated deviations, of all windows in which it was told.
    pub over_sd: Vec<f64>,
    /// Errors of all windows of a scene together (of the root of the mean square), where all are told.
    pub together: Vec<f64>,
}

impl Score {
    /// Mean error of sharp windows, and the root of the mean square of errors, shares of the truth.
    pub fn errors(&self) -> [f64; 2] {
        [mean(&self.errors), rms(&self.errors)]
    }

    /// Root of the mean square of errors over stated deviations.
    pub fn over_sd(&self) -> f64 {
        rms(&self.over_sd)
    }

    /// Largest error of a scene's windows together, a share.
    pub fn worst_together(&self) -> f64 {
        self.together.iter().fold(0.0, |most, e| e.abs().max(most))
    }
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len().max(1) as f64
}

fn rms(of: &[f64]) -> f64 {
    mean(&of.iter().map(|x| x * x).collect::<Vec<_>>()).sqrt()
}

/// Scores of the measures over `scenes` scenes of a kind, each seen for `windows` windows; the vector of both axes where
/// both are measured.
pub fn scores(kind: Kind, seed: u64, scenes: u64, windows: u32) -> [Score; 6] {
    let mut scores: [Score; 6] = Default::default();
    for number in 0..scenes {
        let mut draw = Draw::new(seed, number);
        let scene = Scene::draw(kind, &mut draw);
        let mut sums = [[0.0; 3]; 6];
        for _ in 0..windows {
            let (report, axes) = scene.window(&mut draw);
            let (told, truth) = (report.map(|r| told(&r.sum)), truth(&axes));
            for (i, score) in scores.iter_mut().enumerate() {
                let Some(truth) = truth[i] else { continue };
                score.windows += 1;
                let Some(figure) = told.and_then(|t| t[i]) else {
                    score.limits += 1;
                    sums[i][2] += 1.0;
                    continue;
                };
                score.limits += u32::from(figure.is_limit());
                score.above += u32::from(truth > f64::from(figure.at_most));
                let (value, sd) = (f64::from(figure.value), f64::from(figure.sd));
                score.over_sd.push((value - truth) / sd);
                sums[i][0] += value * value;
                sums[i][1] += truth * truth;
                if sd <= 0.03 * value {
                    score.sharp += 1;
                    score.errors.push(value / truth - 1.0);
                } else {
                    sums[i][2] += 1.0;
                }
            }
        }
        for (score, [value, truth, unsharp]) in scores.iter_mut().zip(sums) {
            if unsharp == 0.0 && truth > 0.0 {
                score.together.push((value / truth).sqrt() - 1.0);
            }
        }
    }
    scores
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:<18} {:<14} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8}",
        "scenes",
        "measure",
        "windows",
        "sharp%",
        "limit%",
        "above%",
        "bias%",
        "rms%",
        "err/sd",
        "ten%"
    )
}

/// A row of the table.
pub fn row(kind: Kind, measure: usize, score: &Score) -> String {
    let share = |n: u32| 100.0 * f64::from(n) / f64::from(score.windows.max(1));
    let [bias, scatter] = score.errors().map(|e| 100.0 * e);
    format!(
        "{:<18} {:<14} {:>7} {:>7.1} {:>7.1} {:>7.1} {bias:>7.2} {scatter:>7.2} {:>7.2} {:>8.2}",
        kind.name(),
        MEASURES[measure],
        score.windows,
        share(score.sharp),
        share(score.limits),
        share(score.above),
        score.over_sd(),
        100.0 * score.worst_together()
    )
}
