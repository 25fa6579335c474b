//! Samples with noise that is not white, and tones that are not steady: what is found, and what is called a tone.

use std::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{Peak, Report};
use rowtone::spectrum::Config;
use rowtone::timeline::{Group, Sample};

use super::bound::Bound;
use super::scene::Draw;
use rowtone_memory::SpectrumMemory;

/// Standard deviation of a sample, px.
pub const SAMPLE_NOISE_PX: f64 = 0.015;

/// Random vibration of even density over a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Random {
    /// Its lowest and highest frequency, Hz.
    pub band_hz: [f64; 2],
    /// Its root mean square, px.
    pub rms_px: f64,
}

/// What moves besides the random vibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Nothing.
    Still,
    /// One steady tone within a band, Hz, at random, of so many standard deviations of the noise floor there.
    Tone {
        /// From and to, Hz.
        band_hz: [f64; 2],
        /// Amplitude over its standard deviation for noise of the floor's level.
        over_sd: f64,
    },
    /// Struck once, a quarter of the window after its start.
    Hit {
        /// Amplitude at the stroke, px.
        px: f64,
        /// It falls to 1/e in, s.
        decay_s: f64,
    },
    /// A tone whose frequency rises evenly.
    RunUp {
        /// px.
        px: f64,
        /// Hz/s.
        hz_per_s: f64,
    },
    /// A tone whose amplitude rises and falls by half.
    Modulated {
        /// px.
        px: f64,
        /// How often, Hz.
        by_hz: f64,
    },
    /// A tone whose speed wanders.
    Unsteady {
        /// px.
        px: f64,
        /// Standard deviation of the frequency over the frequency.
        share: f64,
        /// Fastest part of the wandering, Hz.
        to_hz: f64,
    },
}

/// A kind of windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// In words.
    pub name: &'static str,
    /// Length of a window, s.
    pub window_s: f64,
    /// Random vibration.
    pub random: Option<Random>,
    /// What else moves.
    pub motion: Motion,
}

/// A window, and what is true in it.
#[derive(Clone, Debug)]
pub struct Scene {
    group: Group,
    samples: Vec<Sample>,
    fps: f64,
    window_s: f64,
    /// The tone's frequency in the middle of the last window, Hz.
    pub hz: Option<f64>,
    /// The tone's amplitude, px.
    pub amplitude_px: f64,
    /// How fast it rises, Hz/s, and when it is at `hz`, s.
    rise: (f64, f64),
}

/// A noise of even density: so many sinusoids that a window cannot tell them from it.
struct Noise(Vec<(f64, f64, f64)>);

impl Noise {
    fn draw(draw: &mut Draw, band_hz: [f64; 2], rms: f64, length_s: f64) -> Self {
        let step = 0.4 / length_s;
        let count = ((band_hz[1] - band_hz[0]) / step).ceil().max(8.0);
        let step = (band_hz[1] - band_hz[0]) / count;
        let size = rms / count.sqrt();
        let lines = (0..count as u32).map(|i| {
            let hz = band_hz[0] + step * (f64::from(i) + draw.unit());
            (TAU * hz, size * draw.normal(), size * draw.normal())
        });
        Self(lines.collect())
    }

    fn at(&self, t: f64) -> f64 {
        let lines = self.0.iter();
        lines
            .map(|(w, a, b)| {
                let (sin, cos) = (w * t).sin_cos();
                a * cos + b * sin
            })
            .sum()
    }

    /// Its integral.
    fn sum_to(&self, t: f64) -> f64 {
        let lines = self.0.iter();
        lines
            .map(|(w, a, b)| {
                let (sin, cos) = (w * t).sin_cos();
                (a * sin - b * cos) / w
            })
            .sum()
    }
}

impl Scene {
    /// Window `number` of the series `seed`.
    ///
    /// # Panics
    /// Never: its cameras have rows.
    pub fn draw(kind: &Kind, seed: u64, number: u64) -> Self {
        let mut draw = Draw::new(seed, number);
        let fps = draw.from([25.0, 200.0]).max(8.0 / kind.window_s);
        let blank = draw.from([0.01, 0.45]);
        let spacing_s = 1.0 / draw.from([1000.0, 5000.0]);
        let slots = ((1.0 - blank) / fps / spacing_s).round().max(4.0);
        let spacing_s = (1.0 - blank) / fps / slots;
        let timing = Timing::new((spacing_s * 1e12) as u32, 0, slots as u16).expect("has rows");
        let group = Group::new(timing, 1).expect("one row a sample");
        let lost = draw.from([0.0, 0.05]);
        // A window and a half: two reports.
        let length_s = 1.5 * kind.window_s;
        let frames = (length_s * fps).ceil() as u32;
        let offsets: Vec<f64> = (0..slots as usize).map(|_| 0.3 * draw.normal()).collect();
        let mut samples = Vec::new();
        for frame in 0..frames {
            let start_s = f64::from(frame) / fps + 50e-6 * draw.normal();
            if frame > 0 && frame + 1 < frames && draw.unit() < lost {
                continue;
            }
            for slot in 0..slots as u16 {
                let shift = offsets[usize::from(slot)] + SAMPLE_NOISE_PX * draw.normal();
                samples.push(Sample {
                    curvature: Default::default(),
                    frame,
                    slot,
                    time_ns: (start_s * 1e9).round() as i64 + group.middle_ns(slot),
                    shift_px: shift as f32,
                    information_per_px2: (SAMPLE_NOISE_PX * SAMPLE_NOISE_PX).recip() as f32,
                    spread: Default::default(),
                    vertical: None,
                });
            }
        }
        let mut scene = Self {
            group,
            samples,
            fps,
            window_s: kind.window_s,
            hz: None,
            amplitude_px: 0.0,
            rise: (0.0, 0.0),
        };
        let random = kind
            .random
            .map(|r| Noise::draw(&mut draw, r.band_hz, r.rms_px, length_s));
        let motion = scene.motion(&mut draw, kind, length_s);
        for sample in &mut scene.samples {
            let t = sample.time_ns as f64 * 1e-9;
            let noise = random.as_ref().map_or(0.0, |noise| noise.at(t));
            sample.shift_px = (f64::from(sample.shift_px) + noise + motion(t)) as f32;
        }
        scene
    }

    /// A frequency away from multiples of the frame rate.
    fn visible_hz(&self, draw: &mut Draw, band_hz: [f64; 2]) -> f64 {
        let top = 0.45e9 / self.group.spacing_ns() as f64;
        loop {
            let hz = draw.from([band_hz[0], band_hz[1].min(top)]);
            let away = hz - self.fps * (hz / self.fps).round();
            if away.abs() * self.window_s > 1.5_f64.min(0.2 * self.fps * self.window_s) {
                return hz;
            }
        }
    }

    fn motion(&mut self, draw: &mut Draw, kind: &Kind, length_s: f64) -> Box<dyn Fn(f64) -> f64> {
        let phase = draw.from([0.0, TAU]);
        let middle = length_s - 0.5 * kind.window_s;
        let hz = match kind.motion {
            Motion::Still => return Box::new(|_| 0.0),
            Motion::Tone { band_hz, .. } => self.visible_hz(draw, band_hz),
            _ => self.visible_hz(draw, [60.0, 400.0]),
        };
        self.hz = Some(hz);
        let tone = move |px: f64, t: f64| px * (TAU * hz * t + phase).cos();
        match kind.motion {
            Motion::Still => Box::new(|_| 0.0),
            Motion::Tone { over_sd, .. } => {
                let sd = self.floor_sd(kind, hz, phase, length_s);
                self.amplitude_px = over_sd * sd;
                let px = self.amplitude_px;
                Box::new(move |t| tone(px, t))
            }
            Motion::Hit { px, decay_s } => {
                self.amplitude_px = px;
                let at = middle - 0.25 * kind.window_s;
                Box::new(move |t| match t > at {
                    true => tone(px, t) * (-(t - at) / decay_s).exp(),
                    false => 0.0,
                })
            }
            Motion::RunUp { px, hz_per_s } => {
                self.amplitude_px = px;
                self.rise = (hz_per_s, middle);
                Box::new(move |t| {
                    let t = t - middle;
                    px * (TAU * (hz + 0.5 * hz_per_s * t) * t + phase).cos()
                })
            }
            Motion::Modulated { px, by_hz } => {
                self.amplitude_px = px;
                let start = draw.from([0.0, TAU]);
                Box::new(move |t| tone(px, t) * (1.0 + 0.5 * (TAU * by_hz * t + start).cos()))
            }
            Motion::Unsteady { px, share, to_hz } => {
                self.amplitude_px = px;
                let wander = Noise::draw(draw, [0.05, to_hz], share * hz, length_s);
                Box::new(move |t| px * (TAU * (hz * t + wander.sum_to(t)) + phase).cos())
            }
        }
    }

    /// Standard deviation of the amplitude of a tone at `hz` in noise of the density that there is at `hz`, px.
    fn floor_sd(&self, kind: &Kind, hz: f64, phase: f64, length_s: f64) -> f64 {
        let first = length_s - kind.window_s;
        let window: Vec<Sample> = self
            .samples
            .iter()
            .filter(|s| s.time_ns as f64 * 1e-9 >= first)
            .copied()
            .collect();
        let bound = Bound::of(&window, 1.0, &[(hz, phase)])[0].amplitude_px;
        // A band's density against white noise's, as the window's samples see both.
        let share = kind.random.map_or(0.0, |r| {
            let inside = (r.band_hz[0]..=r.band_hz[1]).contains(&hz);
            let rate = window.len() as f64 / kind.window_s;
            let density = r.rms_px.powi(2) / (r.band_hz[1] - r.band_hz[0]);
            let white = 2.0 * SAMPLE_NOISE_PX.powi(2) / rate;
            if inside { density / white } else { 0.0 }
        });
        bound * (1.0 + share).sqrt()
    }

    /// The last window's report, and the largest number of passes that a window took.
    ///
    /// # Panics
    /// Never: the memory fits the scene, which has samples.
    pub fn analyze(&self) -> Report {
        let config = Config {
            window_ns: (self.window_s * 1e9) as i64,
            hop_ns: (self.window_s * 0.5e9) as i64,
            ..Config::default()
        };
        let mut memory = SpectrumMemory::new(self.group, self.window_s, self.fps);
        let mut analyzer =
            ReportSide::new(config, self.group, memory.lend()).expect("the memory fits the scene");
        let mut last = None;
        for sample in &self.samples {
            if analyzer.push(*sample) {
                last = analyzer.report().or(last);
            }
        }
        analyzer.finish().or(last).expect("a scene has samples")
    }
}

/// What a series of windows of one kind came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Windows.
    pub windows: u64,
    /// Those with a sure peak that is no tone.
    pub with_false: u64,
    /// Those in which the tone was found, within 0.5/T or 5 of its deviations.
    pub found: u64,
    /// Those in which it was found and nothing else was.
    pub alone: u64,
    /// Largest error of its frequency, Hz.
    pub worst_hz: f64,
    hz_over_sd: f64,
    amplitude_over_sd: f64,
    hz_squares: f64,
    /// What went wrong, a line a window.
    pub failures: Vec<String>,
}

impl Outcome {
    /// Draws and analyses `count` windows.
    pub fn of(kind: &Kind, seed: u64, count: u64) -> Self {
        let mut outcome = Self::default();
        for number in 0..count {
            let scene = Scene::draw(kind, seed, number);
            outcome.add(number, &scene, &scene.analyze());
        }
        outcome
    }

    fn add(&mut self, number: u64, scene: &Scene, report: &Report) {
        self.windows += 1;
        let sure: Vec<&Peak> = report.peaks.iter().filter(|p| !p.ambiguous).collect();
        let middle_s = report.time_ms as f64 * 1e-3 - 0.5 * f64::from(report.window_s);
        let (hz_per_s, at_s) = scene.rise;
        let true_hz = scene.hz.map(|hz| hz + hz_per_s * (middle_s - at_s));
        let near = |p: &&Peak| {
            let off = true_hz.map_or(f64::INFINITY, |hz| (f64::from(p.hz) - hz).abs());
            off < (0.5 / scene.window_s).max(5.0 * f64::from(p.hz_sd))
        };
        let found = report.peaks.iter().find(near);
        if let (Some(p), Some(hz)) = (found, true_hz) {
            self.found += 1;
            let off = f64::from(p.hz) - hz;
            let amplitude = f64::from(p.amplitude_px) - scene.amplitude_px;
            self.worst_hz = self.worst_hz.max(off.abs());
            self.hz_squares += off * off;
            self.hz_over_sd += (off / f64::from(p.hz_sd)).powi(2);
            self.amplitude_over_sd += (amplitude / f64::from(p.amplitude_px_sd)).powi(2);
        }
        let strays = sure.iter().filter(|p| !near(p)).count()
            + sure.iter().filter(|p| near(p)).count().saturating_sub(1);
        self.with_false += u64::from(strays > 0);
        self.alone += u64::from(found.is_some() && strays == 0);
        if strays > 0 || (scene.hz.is_some() && found.is_none()) {
            let peaks: Vec<String> = report
                .peaks
                .iter()
                .map(|p| {
                    let sure = if p.ambiguous { " ambiguous" } else { "" };
                    format!(
                        "{:.3} ± {:.3} Hz {:.4} px{sure}",
                        p.hz, p.hz_sd, p.amplitude_px
                    )
                })
                .collect();
            let truth = scene.hz.map_or(String::from("no tone"), |hz| {
                format!("{hz:.3} Hz {:.4} px", scene.amplitude_px)
            });
            self.failures.push(format!(
                "window {number}, {:.2} fps; true: {truth}; found: {}",
                scene.fps,
                peaks.join(", ")
            ));
        }
    }

    /// Errors of what was found, rms: frequency, Hz; frequency and amplitude over their stated deviations.
    pub fn errors(&self) -> [f64; 3] {
        let n = self.found.max(1) as f64;
        [self.hz_squares, self.hz_over_sd, self.amplitude_over_sd].map(|sum| (sum / n).sqrt())
    }
}

/// The kinds of windows of the table.
pub fn kinds() -> Vec<Kind> {
    let random = |low, high, rms_px| {
        Some(Random {
            band_hz: [low, high],
            rms_px,
        })
    };
    let still = |name, window_s, random| Kind {
        name,
        window_s,
        random,
        motion: Motion::Still,
    };
    let moving = |name, window_s, motion| Kind {
        name,
        window_s,
        random: None,
        motion,
    };
    let tone = |name, window_s, random, band_hz| Kind {
        name,
        window_s,
        random,
        motion: Motion::Tone {
            band_hz,
            over_sd: 10.0,
        },
    };
    let wide = random(20.0, 400.0, 0.1);
    vec![
        still("white, 1 s", 1.0, None),
        still("white, 0.25 s", 0.25, None),
        still("20-400 Hz 0.1 px, 1 s", 1.0, wide),
        still("20-400 Hz 0.1 px, 0.25 s", 0.25, wide),
        still("20-400 Hz 0.02 px, 1 s", 1.0, random(20.0, 400.0, 0.02)),
        still("90-110 Hz 0.1 px, 1 s", 1.0, random(90.0, 110.0, 0.1)),
        still("90-110 Hz 0.02 px, 1 s", 1.0, random(90.0, 110.0, 0.02)),
        still("90-110 Hz 0.007 px, 1 s", 1.0, random(90.0, 110.0, 0.007)),
        still("90-110 Hz 0.1 px, 0.25 s", 0.25, random(90.0, 110.0, 0.1)),
        still(
            "90-110 Hz 0.007 px, 0.25 s",
            0.25,
            random(90.0, 110.0, 0.007),
        ),
        tone("tone in white, 1 s", 1.0, None, [30.0, 390.0]),
        tone("tone in 20-400 Hz, 1 s", 1.0, wide, [30.0, 390.0]),
        tone("tone in 20-400 Hz, 0.25 s", 0.25, wide, [30.0, 390.0]),
        moving(
            "hit, 0.05 s",
            1.0,
            Motion::Hit {
                px: 0.5,
                decay_s: 0.05,
            },
        ),
        moving(
            "hit, 0.1 s",
            1.0,
            Motion::Hit {
                px: 0.5,
                decay_s: 0.1,
            },
        ),
        moving(
            "hit, 0.3 s",
            1.0,
            Motion::Hit {
                px: 0.5,
                decay_s: 0.3,
            },
        ),
        moving(
            "run-up, 5 Hz/s",
            1.0,
            Motion::RunUp {
                px: 0.2,
                hz_per_s: 5.0,
            },
        ),
        moving(
            "run-up, 17 Hz/s",
            1.0,
            Motion::RunUp {
                px: 0.2,
                hz_per_s: 17.0,
            },
        ),
        moving(
            "run-up, 40 Hz/s",
            1.0,
            Motion::RunUp {
                px: 0.2,
                hz_per_s: 40.0,
            },
        ),
        moving(
            "modulated at 5 Hz",
            1.0,
            Motion::Modulated {
                px: 0.2,
                by_hz: 5.0,
            },
        ),
        moving(
            "modulated at 1.3 Hz",
            1.0,
            Motion::Modulated {
                px: 0.2,
                by_hz: 1.3,
            },
        ),
        moving(
            "modulated at 0.4 Hz",
            1.0,
            Motion::Modulated {
                px: 0.2,
                by_hz: 0.4,
            },
        ),
        moving(
            "unsteady by 0.2 %",
            1.0,
            Motion::Unsteady {
                px: 0.2,
                share: 0.002,
                to_hz: 2.0,
            },
        ),
    ]
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:<28} {:>7} {:>7} {:>7} {:>7} {:>9} {:>9} {:>6} {:>6}",
        "windows", "number", "false%", "found%", "alone%", "Hz rms", "Hz worst", "f/sd", "A/sd"
    )
}

/// A row of the table.
pub fn row(kind: &Kind, outcome: &Outcome) -> String {
    let share = |n: u64| 100.0 * n as f64 / outcome.windows.max(1) as f64;
    let mut line = format!(
        "{:<28} {:>7} {:>7.1}",
        kind.name,
        outcome.windows,
        share(outcome.with_false)
    );
    if kind.motion != Motion::Still {
        let [hz, f, a] = outcome.errors();
        line += &format!(
            " {:>7.1} {:>7.1} {hz:>9.4} {:>9.4} {f:>6.2} {a:>6.2}",
            share(outcome.found),
            share(outcome.alone),
            outcome.worst_hz
        );
    }
    line
}
