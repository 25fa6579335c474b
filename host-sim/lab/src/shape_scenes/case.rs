//! Which recordings are measured.

use std::f64::consts::FRAC_PI_2;

use host_sim::{Config, Mode, Optics, Rect, Scene, Shape, Term, Wave};

/// Side of a tile, px.
pub const TILE_PX: u16 = 16;
/// Size of the picture, px: 35 x 20 tiles.
pub const SIZE_PX: (u32, u32) = (560, 320);

/// How a picture vibrates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// All of it alike, along both axes.
    Rigid,
    /// A bar clamped nowhere: one line across stands still.
    OneNode,
    /// A free bar's first bending: two lines stand still.
    TwoNodes,
    /// Turning about the middle row, and about the middle column at half of it.
    Torsion,
    /// A wave that runs along the rows, with half of it along the columns.
    Travelling,
    /// Two halves against each other.
    Against,
    /// A part in still surroundings.
    Patch,
}

/// All of them.
pub const KINDS: [Kind; 7] = [
    Kind::OneNode,
    Kind::TwoNodes,
    Kind::Torsion,
    Kind::Travelling,
    Kind::Against,
    Kind::Patch,
    Kind::Rigid,
];

impl Kind {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::OneNode => "bending, one node",
            Self::TwoNodes => "bending, two nodes",
            Self::Torsion => "torsion",
            Self::Travelling => "travelling wave",
            Self::Against => "two parts against each other",
            Self::Patch => "a patch in still surroundings",
        }
    }

    /// Its modes, `px` at its largest.
    fn modes(self, hz: f64, px: f64, phase: f64) -> Vec<Mode> {
        let mode = |x: Shape, y: Shape, turn: f64, part| Mode {
            wave: Wave::Tone { hz },
            x,
            y,
            x_phase_rad: phase + turn,
            y_phase_rad: phase + turn,
            part,
        };
        let none = || Shape(Vec::new());
        let part = |x, y, w, h| Some(Rect { x, y, w, h });
        let (width, height) = SIZE_PX;
        match self {
            Self::Rigid => vec![mode(Shape::even(px), Shape::even(0.4 * px), 0.0, None)],
            Self::OneNode => vec![mode(rows(px, &[0.0, 1.0]), none(), 0.0, None)],
            Self::TwoNodes => vec![mode(
                rows(px, &[-0.6, 0.0, 1.6]),
                rows(0.2 * px, &[-0.6, 0.0, 1.6]),
                0.0,
                None,
            )],
            Self::Torsion => vec![mode(
                rows(px, &[0.0, 1.0]),
                columns(0.5 * px, 1, 1.0),
                0.0,
                None,
            )],
            Self::Travelling => vec![
                mode(cosine(px), cosine(0.5 * px), FRAC_PI_2, None),
                mode(sine(px), sine(0.5 * px), 0.0, None),
            ],
            Self::Against => {
                let left = width / 2 / u32::from(TILE_PX) * u32::from(TILE_PX);
                vec![
                    mode(Shape::even(px), none(), 0.0, part(0, 0, left, height)),
                    mode(
                        Shape::even(-0.7 * px),
                        none(),
                        0.0,
                        part(left, 0, width - left, height),
                    ),
                ]
            }
            Self::Patch => {
                let tile = u32::from(TILE_PX);
                let own = part(12 * tile, 5 * tile, 12 * tile, 10 * tile);
                vec![mode(Shape::even(px), Shape::even(-0.3 * px), 0.0, own)]
            }
        }
    }

    /// The true shape at a place of the picture, −1 to 1, and px: real and imaginary part of X along x and of Y along y, but
    /// for a phase that all places share; `inside` says whether a place belongs to a part.
    fn modes_at(modes: &[Mode], c: f64, r: f64, inside: impl Fn(&Rect) -> bool) -> [[f64; 2]; 2] {
        let mut sum = [[0.0; 2]; 2];
        for mode in modes
            .iter()
            .filter(|mode| mode.part.as_ref().is_none_or(&inside))
        {
            let shapes = [(&mode.x, mode.x_phase_rad), (&mode.y, mode.y_phase_rad)];
            for (sum, (shape, phase)) in sum.iter_mut().zip(shapes) {
                // px·sin(ωt + φ) is Re −i·px·e^{iφ}·e^{iωt}.
                let px = shape.at(c, r);
                *sum = [sum[0] + px * phase.sin(), sum[1] - px * phase.cos()];
            }
        }
        sum
    }
}

fn rows(px: f64, powers: &[f64]) -> Shape {
    let term = |(rows, share): (usize, &f64)| Term {
        px: px * share,
        columns: 0,
        rows: rows as u8,
    };
    Shape(powers.iter().enumerate().map(term).collect())
}

fn columns(px: f64, power: u8, share: f64) -> Shape {
    Shape(vec![Term {
        px: px * share,
        columns: power,
        rows: 0,
    }])
}

/// Phase of the travelling wave from the middle of the picture to its edge, rad.
const RUN: f64 = 1.5;

/// cos RUN·c and sin RUN·c as their series, as far as the simulator's powers go.
fn series(px: f64, first: u8) -> Shape {
    let mut terms = Vec::new();
    let mut share = if first == 0 { 1.0 } else { RUN };
    for power in (first..7).step_by(2) {
        terms.extend(columns(px, power, share).0);
        let next = f64::from(power);
        share *= -RUN * RUN / ((next + 1.0) * (next + 2.0));
    }
    Shape(terms)
}

fn cosine(px: f64) -> Shape {
    series(px, 0)
}

fn sine(px: f64) -> Shape {
    series(px, 1)
}

/// A recording of a shape.
#[derive(Clone, Debug)]
pub struct Case {
    /// How it vibrates.
    pub kind: Kind,
    /// At which frequency, Hz.
    pub hz: f64,
    /// How far at most, px.
    pub px: f64,
    /// The recording.
    pub config: Config,
}

impl Case {
    /// A shape from a seed: 60 frames a second of 560x320 px, 48 µs a row, exposed for 0.2 ms.
    pub fn new(kind: Kind, hz: f64, px: f64, scene: Scene, seconds: f64, seed: u64) -> Self {
        let mut config = Config {
            seed,
            scene,
            optics: Optics {
                blur_px: Optics::blur_for_cutoff(0.1),
                ..Config::default().optics
            },
            ..Config::default()
        };
        (config.sensor.cols, config.sensor.rows) = SIZE_PX;
        config.sensor.fps = 60.0;
        config.sensor.line_time_ps = 48_000_000;
        config.sensor.exposure_ns = 200_000;
        config.frames = (seconds * config.sensor.fps).round() as u32;
        config.motion.tones.clear();
        config.modes = kind.modes(hz, px, 0.7 * (seed % 9) as f64);
        Self {
            kind,
            hz,
            px,
            config,
        }
    }

    /// Mean of the true shape over a tile, px: as real and imaginary parts along x and y, but for a phase that all share.
    pub fn truth(&self, column: usize, row: usize) -> [[f64; 2]; 2] {
        let (side, (width, height)) = (u32::from(TILE_PX), SIZE_PX);
        let place = |at: u32, all: u32| 2.0 * f64::from(at) / f64::from(all - 1) - 1.0;
        let mut sum = [[0.0; 2]; 2];
        for y in row as u32 * side..(row as u32 + 1) * side {
            for x in column as u32 * side..(column as u32 + 1) * side {
                let inside = |part: &Rect| {
                    (part.x..part.x + part.w).contains(&x) && (part.y..part.y + part.h).contains(&y)
                };
                let (c, r) = (place(x, width), place(y, height));
                let own = Kind::modes_at(&self.config.modes, c, r, inside);
                for (sum, own) in sum.iter_mut().flatten().zip(own.iter().flatten()) {
                    *sum += own / f64::from(side * side);
                }
            }
        }
        sum
    }
}
