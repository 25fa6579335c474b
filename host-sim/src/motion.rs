//! What moves, and how: displacement in pixels as a function of time.

use std::f64::consts::TAU;

use serde::Serialize;

use super::error::{SimError, check};
use super::sound::Sound;

/// A steady vibration: `amplitude_px · sin(2π·hz·t + phase_rad)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tone {
    /// Frequency, Hz, above 0.
    pub hz: f64,
    /// Zero-to-peak amplitude, px, before the exposure averages it.
    pub amplitude_px: f64,
    /// Phase at time 0, rad.
    pub phase_rad: f64,
}

/// A vibration whose frequency runs evenly from one value to another; still before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Chirp {
    /// Frequency at the start, Hz.
    pub from_hz: f64,
    /// Frequency at the end, Hz.
    pub to_hz: f64,
    /// Start, s.
    pub start_s: f64,
    /// How long it lasts, s.
    pub duration_s: f64,
    /// Zero-to-peak amplitude, px.
    pub amplitude_px: f64,
}

impl Chirp {
    /// Its frequency at `t_s`, Hz; `None` before and after.
    pub fn hz_at(&self, t_s: f64) -> Option<f64> {
        let u = (t_s - self.start_s) / self.duration_s;
        (0.0..1.0)
            .contains(&u)
            .then_some(self.from_hz + (self.to_hz - self.from_hz) * u)
    }

    fn at(&self, t_s: f64) -> f64 {
        let t = t_s - self.start_s;
        if !(0.0..self.duration_s).contains(&t) {
            return 0.0;
        }
        let sweep = (self.to_hz - self.from_hz) / (2.0 * self.duration_s);
        self.amplitude_px * libm::sin(TAU * t * (self.from_hz + sweep * t))
    }
}

/// A value that holds from `t_s` on, until the next step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// From when on, s.
    pub t_s: f64,
    /// The value: a displacement in px, or a factor, as the field says.
    pub value: f64,
}

/// The value of the last step at or before `t_s`, or `before`.
pub(super) fn step_value(steps: &[Step], t_s: f64, before: f64) -> f64 {
    steps
        .iter()
        .rev()
        .find(|s| s.t_s <= t_s)
        .map_or(before, |s| s.value)
}

/// Everything that moves one thing; the parts add up.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Motion {
    /// Steady vibrations.
    pub tones: Vec<Tone>,
    /// Sweeps.
    pub chirps: Vec<Chirp>,
    /// Positions taken at once, px; sorted by time.
    pub steps: Vec<Step>,
    /// A recorded movement.
    pub sound: Option<Sound>,
    /// Slow creep, px/s.
    pub drift_px_per_s: f64,
}

impl Motion {
    /// Displacement to the right at `t_s`, px.
    pub fn at(&self, t_s: f64) -> f64 {
        let tone = |a: &Tone| a.amplitude_px * libm::sin(TAU * a.hz * t_s + a.phase_rad);
        self.tones.iter().map(tone).sum::<f64>()
            + self.chirps.iter().map(|c| c.at(t_s)).sum::<f64>()
            + self.sound.as_ref().map_or(0.0, |s| s.at(t_s))
            + step_value(&self.steps, t_s, 0.0)
            + self.drift_px_per_s * t_s
    }

    /// Nothing moves.
    pub fn is_still(&self) -> bool {
        *self == Self::default()
    }

    /// Highest frequency in it, Hz.
    pub fn highest_hz(&self) -> f64 {
        let tones = self.tones.iter().map(|t| t.hz);
        let chirps = self.chirps.iter().map(|c| c.from_hz.max(c.to_hz));
        let sound = self.sound.iter().map(|s| 0.5 * s.rate_hz);
        tones.chain(chirps).chain(sound).fold(0.0, f64::max)
    }

    /// An upper bound of how far it can move within `seconds`, px, steps left out.
    pub fn travel_px(&self, seconds: f64) -> f64 {
        let swing = |hz: f64, a: f64| a.abs() * (TAU * hz * seconds).min(2.0);
        self.tones
            .iter()
            .map(|t| swing(t.hz, t.amplitude_px))
            .sum::<f64>()
            + self
                .chirps
                .iter()
                .map(|c| swing(c.from_hz.max(c.to_hz), c.amplitude_px))
                .sum::<f64>()
            + self
                .sound
                .iter()
                .map(|s| swing(0.5 * s.rate_hz, s.amplitude_px))
                .sum::<f64>()
            + (self.drift_px_per_s * seconds).abs()
    }

    /// Farthest it gets from where it starts within `seconds`, px: an upper bound.
    pub fn reach_px(&self, seconds: f64) -> f64 {
        self.tones.iter().map(|t| t.amplitude_px.abs()).sum::<f64>()
            + self
                .chirps
                .iter()
                .map(|c| c.amplitude_px.abs())
                .sum::<f64>()
            + self.sound.iter().map(|s| s.amplitude_px.abs()).sum::<f64>()
            + self.steps.iter().map(|s| s.value.abs()).fold(0.0, f64::max)
            + (self.drift_px_per_s * seconds).abs()
    }

    /// Puts the instants at which it jumps and that lie inside the interval into `into`, s.
    pub(super) fn jumps(&self, from_s: f64, to_s: f64, into: &mut Vec<f64>) {
        let steps = self.steps.iter().map(|s| s.t_s);
        let chirps = self
            .chirps
            .iter()
            .flat_map(|c| [c.start_s, c.start_s + c.duration_s]);
        into.extend(steps.chain(chirps).filter(|&t| t > from_s && t < to_s));
    }

    pub(super) fn check(&self) -> Result<(), SimError> {
        for t in &self.tones {
            check(
                t.hz > 0.0 && t.hz < 1e6,
                "a tone's frequency (Hz)",
                t.hz,
                "above 0 and below 1 MHz",
            )?;
            check(
                t.amplitude_px.abs() < 1e4,
                "a tone's amplitude (px)",
                t.amplitude_px,
                "below 10 000",
            )?;
            check(
                t.phase_rad.is_finite(),
                "a tone's phase (rad)",
                t.phase_rad,
                "a number",
            )?;
        }
        for c in &self.chirps {
            for hz in [c.from_hz, c.to_hz] {
                check(
                    (0.0..1e6).contains(&hz),
                    "a chirp's frequency (Hz)",
                    hz,
                    "0 to 1 MHz",
                )?;
            }
            check(
                c.start_s.is_finite(),
                "a chirp's start (s)",
                c.start_s,
                "a number",
            )?;
            check(
                c.duration_s > 0.0,
                "a chirp's duration (s)",
                c.duration_s,
                "above 0",
            )?;
            check(
                c.amplitude_px.abs() < 1e4,
                "a chirp's amplitude (px)",
                c.amplitude_px,
                "below 10 000",
            )?;
        }
        for s in &self.steps {
            check(s.value.abs() < 1e4, "a step (px)", s.value, "below 10 000")?;
        }
        check_steps(&self.steps)?;
        if let Some(s) = &self.sound {
            check(
                s.rate_hz > 0.0,
                "the sound's sample rate (Hz)",
                s.rate_hz,
                "above 0",
            )?;
            check(
                s.amplitude_px.abs() < 1e4,
                "the sound's amplitude (px)",
                s.amplitude_px,
                "below 10 000",
            )?;
        }
        let drift = self.drift_px_per_s;
        check(drift.abs() < 1e4, "the drift (px/s)", drift, "below 10 000")
    }
}

/// Steps must come in order of time.
pub(super) fn check_steps(steps: &[Step]) -> Result<(), SimError> {
    let mut last = f64::NEG_INFINITY;
    for s in steps {
        check(
            s.t_s > last,
            "a step's time (s)",
            s.t_s,
            "later than the step before it",
        )?;
        last = s.t_s;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up() {
        let motion = Motion {
            tones: vec![Tone {
                hz: 10.0,
                amplitude_px: 2.0,
                phase_rad: 0.5,
            }],
            steps: vec![
                Step {
                    t_s: 1.0,
                    value: 3.0,
                },
                Step {
                    t_s: 2.0,
                    value: -1.0,
                },
            ],
            drift_px_per_s: 0.25,
            ..Motion::default()
        };
        let tone = |t: f64| 2.0 * (TAU * 10.0 * t + 0.5).sin();
        assert!((motion.at(0.3) - tone(0.3) - 0.075).abs() < 1e-12);
        assert!((motion.at(1.5) - tone(1.5) - 3.375).abs() < 1e-12);
        assert!((motion.at(2.5) - tone(2.5) + 1.0 - 0.625).abs() < 1e-12);
    }

    #[test]
    fn a_chirps_phase_is_the_integral_of_its_frequency() {
        let c = Chirp {
            from_hz: 100.0,
            to_hz: 1000.0,
            start_s: 0.5,
            duration_s: 10.0,
            amplitude_px: 1.0,
        };
        let (mut phase, n) = (0.0, 100_000);
        let dt = 3.0 / f64::from(n);
        for k in 0..n {
            phase += TAU * dt * c.hz_at(0.5 + (f64::from(k) + 0.5) * dt).unwrap();
        }
        assert!((c.at(3.5) - phase.sin()).abs() < 1e-6);
        assert_eq!((c.at(0.4), c.at(10.6), c.hz_at(10.6)), (0.0, 0.0, None));
    }

    #[test]
    fn travel_bounds_what_really_happens() {
        let tones = vec![Tone {
            hz: 40.0,
            amplitude_px: 1.5,
            phase_rad: 0.3,
        }];
        let motion = Motion {
            tones,
            drift_px_per_s: -2.0,
            ..Motion::default()
        };
        for k in 0..200 {
            let t = f64::from(k) * 0.001;
            for s in [0.0001, 0.001, 0.01] {
                assert!((motion.at(t + s) - motion.at(t)).abs() <= motion.travel_px(s) + 1e-12);
            }
        }
    }

    #[test]
    fn disordered_steps_and_bad_tones_are_refused() {
        let at = |t_s: f64| Step { t_s, value: 1.0 };
        assert!(
            Motion {
                steps: vec![at(2.0), at(1.0)],
                ..Motion::default()
            }
            .check()
            .is_err()
        );
        let tones = vec![Tone {
            hz: f64::NAN,
            amplitude_px: 1.0,
            phase_rad: 0.0,
        }];
        assert!(
            Motion {
                tones,
                ..Motion::default()
            }
            .check()
            .is_err()
        );
    }
}
