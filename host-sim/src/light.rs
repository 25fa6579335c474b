//! The light on the scene as a function of time.

use std::f64::consts::TAU;

use serde::Serialize;

use super::error::{SimError, check};
use super::motion::{Step, check_steps, step_value};

/// A lamp on the mains: light `1 + depth · sin(2π·hz·t + phase_rad)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Flicker {
    /// Depth, 0 to 1.
    pub depth: f64,
    /// Frequency, Hz: twice the mains frequency for a filament or a fluorescent tube.
    pub hz: f64,
    /// Phase at time 0, rad.
    pub phase_rad: f64,
}

/// A light that is switched on and off at a steady rate, with sharp edges, for calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Led {
    /// Flashes a second, Hz.
    pub hz: f64,
    /// Share of a period it is on, above 0 and below 1.
    pub duty: f64,
    /// Part of a period at time 0, in periods.
    pub phase: f64,
    /// Light when off, relative to on, 0 to 1.
    pub off_level: f64,
    /// Share of the flashes that fail to come, at random.
    pub missing: f64,
}

impl Led {
    /// Number of the period that `t_s` lies in, and where in it, 0 to 1.
    fn period(&self, t_s: f64) -> (f64, f64) {
        let u = t_s * self.hz + self.phase;
        let whole = libm::floor(u);
        (whole, u - whole)
    }

    fn at(&self, t_s: f64) -> f64 {
        let (number, u) = self.period(t_s);
        let on = u < self.duty && hash_unit(number as i64 as u64) >= self.missing;
        if on { 1.0 } else { self.off_level }
    }

    fn edges(&self, from_s: f64, to_s: f64, into: &mut Vec<f64>) {
        let mut number = self.period(from_s).0;
        loop {
            let start = (number - self.phase) / self.hz;
            if start >= to_s {
                break;
            }
            let edges = [start, start + self.duty / self.hz];
            into.extend(edges.into_iter().filter(|&t| t > from_s && t < to_s));
            number += 1.0;
        }
    }
}

/// A number from 0 to 1 that depends only on `n` (the finaliser of SplitMix64).
fn hash_unit(n: u64) -> f64 {
    let mut z = n.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// The light, relative to its steady value; everything multiplies.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Light {
    /// Mains flicker.
    pub flicker: Option<Flicker>,
    /// A flashing light.
    pub led: Option<Led>,
    /// Factors from given times on.
    pub steps: Vec<Step>,
    /// Uneven light: by how much more, relative to the middle, it is at the right edge than at the
    /// left, and at the bottom than at the top; -2 to 2.
    pub gradient: [f64; 2],
}

impl Light {
    /// Light at `t_s`, 1 for the steady light.
    pub fn at(&self, t_s: f64) -> f64 {
        let flicker = |f: &Flicker| 1.0 + f.depth * libm::sin(TAU * f.hz * t_s + f.phase_rad);
        self.flicker.as_ref().map_or(1.0, flicker)
            * self.led.as_ref().map_or(1.0, |l| l.at(t_s))
            * step_value(&self.steps, t_s, 1.0)
    }

    /// It never changes.
    pub fn is_steady(&self) -> bool {
        self.flicker.is_none() && self.led.is_none() && self.steps.is_empty()
    }

    /// Light at a place in the picture, relative to its middle; `None` when it is even.
    pub fn at_place(&self, cols: usize, row: usize, rows: usize) -> Option<impl Fn(usize) -> f64> {
        let [across, down] = self.gradient;
        let share = |k: usize, n: usize| k as f64 / (n.max(2) - 1) as f64 - 0.5;
        let here = 1.0 + down * share(row, rows);
        (self.gradient != [0.0; 2])
            .then_some(move |col| (here + across * share(col, cols)).max(0.0))
    }

    /// Highest frequency of its smooth part, Hz.
    pub fn highest_hz(&self) -> f64 {
        self.flicker.as_ref().map_or(0.0, |f| f.hz)
    }

    /// Puts the instants at which it jumps and that lie inside the interval into `into`, s.
    pub(super) fn jumps(&self, from_s: f64, to_s: f64, into: &mut Vec<f64>) {
        into.extend(
            self.steps
                .iter()
                .map(|s| s.t_s)
                .filter(|&t| t > from_s && t < to_s),
        );
        if let Some(led) = &self.led {
            led.edges(from_s, to_s, into);
        }
    }

    pub(super) fn check(&self) -> Result<(), SimError> {
        if let Some(f) = &self.flicker {
            check(
                (0.0..=1.0).contains(&f.depth),
                "the flicker's depth",
                f.depth,
                "0 to 1",
            )?;
            check(
                f.hz > 0.0 && f.hz < 1e6,
                "the flicker's frequency (Hz)",
                f.hz,
                "above 0, below 1 MHz",
            )?;
            check(
                f.phase_rad.is_finite(),
                "the flicker's phase (rad)",
                f.phase_rad,
                "a number",
            )?;
        }
        if let Some(l) = &self.led {
            check(
                l.hz > 0.0 && l.hz < 1e6,
                "the LED's frequency (Hz)",
                l.hz,
                "above 0, below 1 MHz",
            )?;
            check(
                l.duty > 0.0 && l.duty < 1.0,
                "the LED's duty cycle",
                l.duty,
                "above 0 and below 1",
            )?;
            check(
                l.phase.is_finite(),
                "the LED's phase (periods)",
                l.phase,
                "a number",
            )?;
            check(
                (0.0..=1.0).contains(&l.off_level),
                "the LED's light when off",
                l.off_level,
                "0 to 1",
            )?;
            check(
                (0.0..=1.0).contains(&l.missing),
                "the LED's missing flashes",
                l.missing,
                "0 to 1",
            )?;
        }
        for s in &self.steps {
            check(
                (0.0..1e3).contains(&s.value),
                "a light step",
                s.value,
                "a factor from 0 to 1000",
            )?;
        }
        for g in self.gradient {
            check(
                (-2.0..=2.0).contains(&g),
                "the light's gradient",
                g,
                "-2 to 2",
            )?;
        }
        check_steps(&self.steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_led_is_on_for_its_duty_and_every_edge_is_named() {
        let led = Led {
            hz: 1000.0,
            duty: 0.3,
            phase: 0.25,
            off_level: 0.1,
            missing: 0.0,
        };
        let light = Light {
            led: Some(led),
            ..Light::default()
        };
        let mut edges = Vec::new();
        light.jumps(0.01, 0.02, &mut edges);
        assert_eq!(edges.len(), 20);
        for t in edges {
            assert!(
                (light.at(t - 1e-8) - light.at(t + 1e-8)).abs() > 0.8,
                "no edge at {t}"
            );
        }
        let on = (0..10_000)
            .filter(|&k| light.at(f64::from(k) * 1e-6 + 5e-7) == 1.0)
            .count();
        assert!((2999..=3001).contains(&on), "{on}");
    }

    #[test]
    fn a_gradient_is_one_in_the_middle_and_never_negative() {
        let light = Light {
            gradient: [0.5, -2.0],
            ..Light::default()
        };
        let at = |x, y| light.at_place(101, y, 51).expect("uneven")(x);
        assert_eq!((at(50, 25), at(100, 25), at(0, 25)), (1.0, 1.25, 0.75));
        assert_eq!((at(50, 0), at(0, 50)), (2.0, 0.0));
        assert!(Light::default().at_place(9, 0, 9).is_none());
    }

    #[test]
    fn flashes_go_missing_at_the_asked_rate() {
        let led = Led {
            hz: 1000.0,
            duty: 0.5,
            phase: 0.0,
            off_level: 0.0,
            missing: 0.1,
        };
        let came = (0..10_000)
            .filter(|&k| led.at((f64::from(k) + 0.2) * 1e-3) > 0.5)
            .count();
        assert!((8900..=9100).contains(&came), "{came}"); // 10 sd of 30
    }
}
