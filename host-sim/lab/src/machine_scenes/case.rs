//! Which recordings are made.

use host_sim::{
    Config, Defects, Disturbances, FirstFrame, Hand, Mode, Rect, Scene, Shadow, Shape, Term, Wave,
};

use crate::spectrum_scenes::scene::Draw;

/// Length of a recording, s: three windows of a second, half a second apart.
const SECONDS: f64 = 2.0;
/// Nearer than this to a multiple of half the frame rate no tone is drawn, Hz: at it, it is hidden.
const CLEAR_HZ: f64 = 4.0;

/// A tone of the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Frequency, Hz.
    pub hz: f64,
    /// Its amplitude at the row where it is largest, px; `None` where the columns of a row do not move alike.
    pub px: Option<f64>,
}

/// A recording and what is true in it.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The camera, the scene and its motion.
    pub config: Config,
    /// Its steady tones.
    pub tones: Vec<Truth>,
}

/// A kind of machine, or of fault.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// In words.
    pub name: &'static str,
    /// What makes one of it: a still recording, and random numbers.
    make: fn(&mut Maker),
}

impl Kind {
    /// The recording of this kind from a seed: 192 x 240 px at 60 fps, 48 µs a row, exposed for 0.2 ms.
    pub fn draw(&self, seed: u64) -> Recording {
        let mut config = Config {
            seed,
            frames: (SECONDS * 60.0) as u32,
            ..Config::default()
        };
        (config.sensor.cols, config.sensor.rows) = (192, 240);
        config.sensor.line_time_ps = 48_000_000;
        config.sensor.exposure_ns = 200_000;
        let mut maker = Maker {
            draw: Draw::new(seed, self.name.len() as u64),
            recording: Recording {
                config,
                tones: Vec::new(),
            },
        };
        (self.make)(&mut maker);
        maker.recording
    }
}

/// What machines do: everything that is no rigid motion along the rows.
pub const MACHINES: [Kind; 15] = [
    kind("rigid, along the rows", |m| m.rigid(0.2, 0.0)),
    kind("along the columns alone", |m| m.rigid(0.0, 0.2)),
    kind("both directions alike", |m| m.rigid(0.2, 0.2)),
    kind("both directions, edges leaning by 30°", |m| {
        m.recording.config.scene = Scene::Edges { lean_deg: 30.0 };
        m.rigid(0.2, 0.0);
        // Only what crosses the edges can be seen.
        m.recording.tones[0].px = None;
    }),
    kind("node at mid-height", |m| m.bending(&[0.0, 0.3])),
    kind("cantilever 1:3", |m| m.bending(&[0.2, 0.1])),
    kind("cantilever, curved", |m| m.bending(&[0.1, 0.1, 0.1])),
    kind("perspective of 10 %", |m| m.bending(&[0.3, 0.015])),
    kind("rotation", |m| {
        let hz = m.hz();
        m.add(hz, rows(&[0.0, -0.15]), columns(0.12), None);
        m.recording.tones.push(Truth { hz, px: None });
    }),
    kind("upper and lower half, two tones", |m| {
        for y in [0, 120] {
            m.part([0, y, 192, 120], Some(0.2));
        }
    }),
    kind("left and right half, two tones", |m| {
        for x in [0, 96] {
            m.part([x, 0, 96, 240], None);
        }
    }),
    kind("machine on a photograph: bends, moves both ways", |m| {
        m.recording.config.scene = Scene::Photo { sky: 0.0 };
        m.recording.config.defects.prnu = 0.01;
        let (hz, bend) = (m.hz(), m.draw.from([0.2, 0.5]));
        let y = m.draw.from([0.3, 1.0]);
        let x = Shape(vec![term(0.2, 0), term(0.2 * bend, 1)]);
        let largest = 0.2 * (1.0 + bend).hypot(y);
        m.add(hz, x, Shape::even(0.2 * y), None);
        m.recording.tones.push(Truth {
            hz,
            px: Some(largest),
        });
    }),
    kind("random vibration of 20 to 400 Hz", |m| {
        m.random(20.0, 400.0)
    }),
    kind("random vibration of 90 to 110 Hz", |m| {
        m.random(90.0, 110.0)
    }),
    kind("still", |_| {}),
];

/// What cameras do: each over a rigid tone of 0.2 px along the rows.
pub const FAULTS: [Kind; 15] = [
    kind("three hot pixels", |m| {
        m.defects(|d| d.hot_pixels = 3);
    }),
    kind("dust", |m| {
        m.defects(|d| (d.dust_specks, d.dust_depth) = (12, 0.4));
    }),
    kind("unequal pixels, 2 %", |m| m.defects(|d| d.prnu = 0.02)),
    kind("column pattern, 1 %", |m| {
        m.defects(|d| d.column_pattern = 0.01);
    }),
    kind("row noise, 0.5 %", |m| m.defects(|d| d.row_noise = 0.005)),
    kind("temporal denoiser, 30 %", |m| {
        m.defects(|d| d.denoise = 0.3);
    }),
    kind("soft shadow of 30 %", |m| {
        m.disturbances(|d| {
            d.shadow = Some(Shadow {
                start_s: 0.2,
                duration_s: 1.2,
                width_px: 60.0,
                depth: 0.3,
            });
        });
    }),
    kind("a hand passes", |m| {
        m.disturbances(|d| {
            d.hand = Some(Hand {
                start_s: 1.2,
                duration_s: 0.4,
                width_px: 50.0,
                level: 0.1,
            });
        });
    }),
    kind("first frame black", |m| m.first(FirstFrame::Black)),
    kind("first frame dark", |m| m.first(FirstFrame::Dark)),
    kind("first frame stale", |m| m.first(FirstFrame::Stale)),
    kind("first frame random", |m| m.first(FirstFrame::Random)),
    kind("every tenth frame a copy", |m| {
        m.rigid(0.2, 0.0);
        m.recording.config.faults.copies = (9..120).step_by(10).collect();
    }),
    kind("5 % of the frames lost", |m| {
        m.rigid(0.2, 0.0);
        m.recording.config.faults.lost_probability = 0.05;
    }),
    kind("camera shakes by 1 px at 7 Hz", |m| {
        m.rigid(0.2, 0.0);
        m.recording.config.shake.tones.push(host_sim::Tone {
            hz: 7.0,
            amplitude_px: 1.0,
            phase_rad: 0.4,
        });
        m.recording.tones.push(Truth {
            hz: 7.0,
            px: Some(1.0),
        });
    }),
];

const fn kind(name: &'static str, make: fn(&mut Maker)) -> Kind {
    Kind { name, make }
}

/// A recording in the making.
struct Maker {
    draw: Draw,
    recording: Recording,
}

impl Maker {
    /// A frequency of 40 to 420 Hz at which nothing hides and no tone so far lies near.
    fn hz(&mut self) -> f64 {
        loop {
            let hz = self.draw.from([40.0, 420.0]);
            let clear = |from: f64| {
                let apart = (hz - from).rem_euclid(30.0);
                apart.min(30.0 - apart) > CLEAR_HZ
            };
            let tones = &self.recording.tones;
            if clear(0.0) && tones.iter().all(|tone| clear(tone.hz) && clear(-tone.hz)) {
                return hz;
            }
        }
    }

    fn add(&mut self, hz: f64, x: Shape, y: Shape, part: Option<Rect>) {
        let phase = self.draw.from([0.0, std::f64::consts::TAU]);
        self.recording.config.modes.push(Mode {
            wave: Wave::Tone { hz },
            x,
            y,
            x_phase_rad: phase,
            y_phase_rad: phase,
            part,
        });
    }

    fn rigid(&mut self, x: f64, y: f64) {
        let hz = self.hz();
        self.add(hz, Shape::even(x), Shape::even(y), None);
        let px = Some(x.hypot(y));
        self.recording.tones.push(Truth { hz, px });
    }

    /// A part that moves along the rows by 0.2 px at a tone of its own, and what is known of its amplitude.
    fn part(&mut self, [x, y, w, h]: [u32; 4], px: Option<f64>) {
        let hz = self.hz();
        let part = Some(Rect { x, y, w, h });
        self.add(hz, Shape::even(0.2), Shape::default(), part);
        self.recording.tones.push(Truth { hz, px });
    }

    /// Along the rows, as a polynomial of the row that is largest at the lower edge.
    fn bending(&mut self, powers: &[f64]) {
        let hz = self.hz();
        self.add(hz, rows(powers), Shape::default(), None);
        let px = Some(powers.iter().sum());
        self.recording.tones.push(Truth { hz, px });
    }

    fn random(&mut self, low_hz: f64, high_hz: f64) {
        let px = 10f64.powf(self.draw.from([-1.7, -1.0]));
        self.recording.config.modes.push(Mode {
            wave: Wave::Random {
                low_hz,
                high_hz,
                seed: self.recording.config.seed,
            },
            x: Shape::even(px),
            y: Shape::default(),
            x_phase_rad: 0.0,
            y_phase_rad: 0.0,
            part: None,
        });
    }

    fn defects(&mut self, set: fn(&mut Defects)) {
        self.rigid(0.2, 0.0);
        set(&mut self.recording.config.defects);
    }

    fn disturbances(&mut self, set: fn(&mut Disturbances)) {
        self.rigid(0.2, 0.0);
        set(&mut self.recording.config.disturbances);
    }

    fn first(&mut self, what: FirstFrame) {
        self.rigid(0.2, 0.0);
        self.recording.config.faults.first_frame = Some(what);
    }
}

fn term(px: f64, rows: u8) -> Term {
    Term {
        px,
        columns: 0,
        rows,
    }
}

fn rows(powers: &[f64]) -> Shape {
    Shape((0..).zip(powers).map(|(n, px)| term(*px, n)).collect())
}

fn columns(px: f64) -> Shape {
    Shape(vec![Term {
        px,
        columns: 1,
        rows: 0,
    }])
}
