//! Motion in the plane of the picture that is not the same everywhere: bending, rotation, zoom, parts
//! that go their own ways, motion along the columns, random vibration and hits.
//!
//! A [`Mode`] is one wave in time with a shape over the picture for each axis. Places are counted from
//! −1 at the left or upper edge to 1 at the right or lower edge, so that a shape says at once what it
//! is: `0.3r` along x is a bending with its node at mid-height, `−0.15r` along x with `0.2c` along y a
//! rotation. Modes add up; what [`Config::motion`](super::Config::motion) says moves along x comes on top.

use std::f64::consts::TAU;

use serde::Serialize;

use super::error::{SimError, check};
use super::random::{stream, unit};
use super::rect::Rect;

/// Sines that a random vibration is made of.
const RANDOM_SINES: usize = 400;

/// One term of a [`Shape`]: `px · c^columns · r^rows`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Term {
    /// Amplitude, px.
    pub px: f64,
    /// Power of the column's place.
    pub columns: u8,
    /// Power of the row's place.
    pub rows: u8,
}

/// An amplitude over the picture, px: a polynomial of the place (c, r), each −1 to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Shape(pub Vec<Term>);

impl Shape {
    /// The same amplitude everywhere, px.
    pub fn even(px: f64) -> Self {
        Self(vec![Term {
            px,
            columns: 0,
            rows: 0,
        }])
    }

    /// Amplitude at the place (`c`, `r`), px.
    pub fn at(&self, c: f64, r: f64) -> f64 {
        let term = |t: &Term| t.px * c.powi(i32::from(t.columns)) * r.powi(i32::from(t.rows));
        self.0.iter().map(term).sum()
    }

    /// No larger anywhere in the picture, px.
    pub fn most_px(&self) -> f64 {
        self.0.iter().map(|t| t.px.abs()).sum()
    }
}

/// How a mode moves in time; 1 at most but for a random vibration, whose rms is 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Wave {
    /// A steady sine.
    Tone {
        /// Frequency, Hz, above 0.
        hz: f64,
    },
    /// Still until it is struck, then a sine that dies away.
    Hit {
        /// Frequency, Hz, above 0.
        hz: f64,
        /// When it is struck, s.
        start_s: f64,
        /// Time in which the amplitude falls to 1/e, s, above 0.
        decay_s: f64,
    },
    /// Random vibration of an even spectrum between two frequencies, as a sum of sines.
    Random {
        /// Lowest frequency, Hz.
        low_hz: f64,
        /// Highest frequency, Hz.
        high_hz: f64,
        /// Which of the many.
        seed: u64,
    },
}

/// One wave and where it moves the picture, along both axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// How it moves in time.
    pub wave: Wave,
    /// Along the rows, positive to the right.
    pub x: Shape,
    /// Along the columns, positive downwards.
    pub y: Shape,
    /// Phase of the motion along the rows, rad.
    pub x_phase_rad: f64,
    /// Phase of the motion along the columns, rad.
    pub y_phase_rad: f64,
    /// Where it is felt; everywhere when absent.
    pub part: Option<Rect>,
}

/// A sine of a random vibration: turns a second, phase.
type Sine = (f64, f64);

/// A mode prepared for asking it at many instants.
#[derive(Clone, Debug)]
pub(super) struct Player {
    mode: Mode,
    sines: Vec<Sine>,
}

impl Player {
    pub(super) fn new(mode: &Mode) -> Self {
        let sines = match mode.wave {
            Wave::Random {
                low_hz,
                high_hz,
                seed,
            } => {
                let mut rng = stream(seed, 5, 0);
                (0..RANDOM_SINES)
                    .map(|k| {
                        let at = (k as f64 + unit(&mut rng)) / RANDOM_SINES as f64;
                        (low_hz + (high_hz - low_hz) * at, TAU * unit(&mut rng))
                    })
                    .collect()
            }
            _ => Vec::new(),
        };
        Self {
            mode: mode.clone(),
            sines,
        }
    }

    /// The waves along x and along y at `t_s`.
    pub(super) fn waves(&self, t_s: f64) -> [f64; 2] {
        [self.mode.x_phase_rad, self.mode.y_phase_rad].map(|phase| match self.mode.wave {
            Wave::Tone { hz } => libm::sin(TAU * hz * t_s + phase),
            Wave::Hit {
                hz,
                start_s,
                decay_s,
            } => match t_s - start_s {
                t if t > 0.0 => libm::exp(-t / decay_s) * libm::sin(TAU * hz * t + phase),
                _ => 0.0,
            },
            Wave::Random { .. } => {
                let sine = |&(hz, own): &Sine| libm::sin(TAU * hz * t_s + own + phase);
                let sum: f64 = self.sines.iter().map(sine).sum();
                sum * (2.0 / RANDOM_SINES as f64).sqrt()
            }
        })
    }

    pub(super) fn mode(&self) -> &Mode {
        &self.mode
    }
}

impl Mode {
    /// Makes a random vibration another one than those of other numbers.
    pub fn number(&mut self, number: u64) {
        if let Wave::Random { seed, .. } = &mut self.wave {
            *seed = number;
        }
    }

    /// Its highest frequency, Hz.
    pub fn highest_hz(&self) -> f64 {
        match self.wave {
            Wave::Tone { hz } | Wave::Hit { hz, .. } => hz,
            Wave::Random { high_hz, .. } => high_hz,
        }
    }

    /// Farthest that it moves the picture along x and along y, px; of a random vibration five times
    /// its rms.
    pub fn reach_px(&self) -> [f64; 2] {
        let most = match self.wave {
            Wave::Random { .. } => 5.0,
            _ => 1.0,
        };
        [&self.x, &self.y].map(|shape| most * shape.most_px())
    }

    /// The pixel at (`x`, `y`) moves with it.
    pub fn is_felt_at(&self, x: u32, y: u32) -> bool {
        self.part
            .is_none_or(|p| (p.x..p.x + p.w).contains(&x) && (p.y..p.y + p.h).contains(&y))
    }

    /// An upper bound of how far it moves within `seconds`, px.
    pub fn travel_px(&self, seconds: f64) -> f64 {
        let [x, y] = self.reach_px();
        x.max(y) * (TAU * self.highest_hz() * seconds).min(2.0)
    }

    pub(crate) fn check(&self) -> Result<(), SimError> {
        let frequency = |hz: f64| {
            check(
                hz > 0.0 && hz < 1e6,
                "a mode's frequency (Hz)",
                hz,
                "above 0 and below 1 MHz",
            )
        };
        match self.wave {
            Wave::Tone { hz } => frequency(hz)?,
            Wave::Hit {
                hz,
                start_s,
                decay_s,
            } => {
                frequency(hz)?;
                check(
                    start_s.is_finite(),
                    "a hit's start (s)",
                    start_s,
                    "a number",
                )?;
                check(decay_s > 0.0, "a hit's decay (s)", decay_s, "above 0")?;
            }
            Wave::Random {
                low_hz, high_hz, ..
            } => {
                frequency(high_hz)?;
                check(
                    low_hz >= 0.0 && low_hz < high_hz,
                    "a random vibration's lowest frequency (Hz)",
                    low_hz,
                    "0 or more, below the highest",
                )?;
            }
        }
        for term in self.x.0.iter().chain(&self.y.0) {
            check(
                term.px.abs() < 100.0,
                "a mode's amplitude (px)",
                term.px,
                "below 100",
            )?;
            check(
                term.columns <= 6 && term.rows <= 6,
                "a power in a mode's shape",
                f64::from(term.columns.max(term.rows)),
                "at most 6",
            )?;
        }
        for phase in [self.x_phase_rad, self.y_phase_rad] {
            check(phase.is_finite(), "a mode's phase (rad)", phase, "a number")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(wave: Wave) -> Mode {
        Mode {
            wave,
            x: Shape::even(1.0),
            y: Shape::default(),
            x_phase_rad: 0.0,
            y_phase_rad: 0.0,
            part: None,
        }
    }

    #[test]
    fn a_shape_is_its_polynomial() {
        let terms = [(0.2, 0, 0), (0.1, 0, 1), (-0.3, 2, 1)];
        let shape = Shape(
            terms
                .map(|(px, columns, rows)| Term { px, columns, rows })
                .to_vec(),
        );
        assert!((shape.at(-0.5, 0.4) - (0.2 + 0.04 - 0.3 * 0.25 * 0.4)).abs() < 1e-12);
        assert!((shape.most_px() - 0.6).abs() < 1e-12);
    }

    /// The rms over 20 s of 400 sines of random phase: its own sd is 3.5 %, 12 % is over three.
    #[test]
    fn a_random_vibration_has_an_rms_of_one_and_keeps_to_its_band() {
        let player = Player::new(&mode(Wave::Random {
            low_hz: 20.0,
            high_hz: 400.0,
            seed: 3,
        }));
        let step_s = 0.4e-3;
        let values: Vec<f64> = (0..50_000)
            .map(|k| player.waves(f64::from(k) * step_s)[0])
            .collect();
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        assert!((rms - 1.0).abs() < 0.12, "{rms}");
        let power = |hz: f64| {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, v) in values.iter().enumerate() {
                let phase = TAU * hz * k as f64 * step_s;
                re += v * phase.cos();
                im += v * phase.sin();
            }
            (re * re + im * im) / values.len() as f64
        };
        let mean = |from: u32| (0..40).map(|k| power(f64::from(from + k))).sum::<f64>() / 40.0;
        assert!(mean(200) > 100.0 * mean(600), "{} {}", mean(200), mean(600));
    }

    #[test]
    fn a_hit_is_still_before_and_dies_away_after() {
        let player = Player::new(&mode(Wave::Hit {
            hz: 100.0,
            start_s: 0.5,
            decay_s: 0.1,
        }));
        assert_eq!(player.waves(0.499)[0], 0.0);
        let (first, later) = (player.waves(0.5025)[0], player.waves(0.6025)[0]);
        assert!((first - (-0.025_f64).exp()).abs() < 1e-9, "{first}");
        assert!((later / first - (-1.0_f64).exp()).abs() < 1e-9, "{later}");
    }
}
