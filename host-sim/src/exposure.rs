//! Integration over a row's own exposure interval.
//!
//! The interval is cut where light or motion jump; each piece gets as many Gauss–Legendre nodes as
//! the fastest vibration and the distance moved ask for, so what is left of the error is far below
//! the noise: the number grows with cycles and pixels per exposure, and the tests hold the result
//! against closed forms.

use super::config::Config;
use super::field::{Mode, Wave};
use super::texture::Kernel;

/// Nodes and weights on -1 to 1 for every number of nodes up to 32.
#[derive(Clone, Debug)]
pub struct Quadrature {
    rules: Vec<Vec<(f64, f64)>>,
}

const MOST_NODES: usize = 32;

impl Default for Quadrature {
    fn default() -> Self {
        Self {
            rules: (0..=MOST_NODES).map(gauss_legendre).collect(),
        }
    }
}

/// Roots of the Legendre polynomial of degree `n` by Newton's method, and their weights.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let degree = n as f64;
    (0..n)
        .map(|i| {
            let mut x = libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (degree + 0.5));
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                slope = degree * (x * p1 - p0) / (x * x - 1.0);
                x -= p1 / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

impl Quadrature {
    /// Instants and weights (adding up to the length) for an interval, s.
    fn instants(&self, from_s: f64, to_s: f64, nodes: usize, into: &mut Vec<(f64, f64)>) {
        let pieces = nodes.div_ceil(MOST_NODES).max(1);
        let rule = &self.rules[nodes.div_ceil(pieces).clamp(1, MOST_NODES)];
        let half = 0.5 * (to_s - from_s) / pieces as f64;
        for piece in 0..pieces {
            let middle = from_s + half * (2 * piece + 1) as f64;
            into.extend(rule.iter().map(|&(x, w)| (middle + half * x, half * w)));
        }
    }
}

/// What a row saw during its exposure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// The still part: only the camera shakes.
    pub still: Kernel,
    /// The part that moves with the object.
    pub moving: Kernel,
    /// The same for the scene after its change; empty when the exposure ended before it.
    pub still_after: Kernel,
    /// The same for the scene after its change.
    pub moving_after: Kernel,
    /// Mean light over the exposure, 1 for the steady light.
    pub light: f64,
    /// Mean displacement of the object over the exposure, each instant counted by its light, px; in
    /// the dark, counted evenly.
    pub displacement_px: f64,
    /// The same of the camera's own motion, px.
    pub shake_px: f64,
    instants: Vec<(f64, f64)>,
    jumps: Vec<f64>,
}

impl Seen {
    /// Looks from `from_s` for `exposure_s`.
    pub fn look(&mut self, config: &Config, quadrature: &Quadrature, from_s: f64, exposure_s: f64) {
        self.choose_instants(config, quadrature, from_s, exposure_s);
        for kernel in [
            &mut self.still,
            &mut self.moving,
            &mut self.still_after,
            &mut self.moving_after,
        ] {
            kernel.clear();
        }
        let has_still = config.background_cols > 0 || config.vibrating.is_some();
        let (mut light, mut moved, mut shaken, mut plain) = (0.0, 0.0, 0.0, (0.0, 0.0));
        for &(t, share) in &self.instants {
            let weight = share * config.light.at(t);
            let (d, s) = (config.motion.at(t), config.shake.at(t));
            light += weight;
            moved += weight * d;
            shaken += weight * s;
            plain = (plain.0 + share * d, plain.1 + share * s);
            let changed = config.disturbances.scene_change_s.is_some_and(|c| t >= c);
            let (still, moving) = match changed {
                false => (&mut self.still, &mut self.moving),
                true => (&mut self.still_after, &mut self.moving_after),
            };
            moving.add(d + s, weight);
            if has_still {
                still.add(s, weight);
            }
        }
        self.light = light;
        (self.displacement_px, self.shake_px) = if light > 0.0 {
            (moved / light, shaken / light)
        } else {
            plain
        };
    }

    /// The instants at which it looked last, s, with weights that add up to 1.
    pub(super) fn instants(&self) -> &[(f64, f64)] {
        &self.instants
    }

    /// Instants of the exposure with weights that add up to 1.
    fn choose_instants(
        &mut self,
        config: &Config,
        quadrature: &Quadrature,
        from_s: f64,
        exposure_s: f64,
    ) {
        self.instants.clear();
        if exposure_s <= 0.0 {
            self.instants.push((from_s, 1.0));
            return;
        }
        let to_s = from_s + exposure_s;
        self.jumps.clear();
        config.motion.jumps(from_s, to_s, &mut self.jumps);
        config.shake.jumps(from_s, to_s, &mut self.jumps);
        config.light.jumps(from_s, to_s, &mut self.jumps);
        let hits = config.modes.iter().filter_map(|mode| match mode.wave {
            Wave::Hit { start_s, .. } => Some(start_s),
            _ => None,
        });
        self.jumps.extend(hits.filter(|&t| t > from_s && t < to_s));
        self.jumps.extend(
            config
                .disturbances
                .scene_change_s
                .filter(|&t| t > from_s && t < to_s),
        );
        self.jumps.push(to_s);
        self.jumps.sort_by(f64::total_cmp);
        let fastest_hz = config
            .motion
            .highest_hz()
            .max(config.shake.highest_hz())
            .max(config.light.highest_hz());
        let modes = config.modes.iter().map(Mode::highest_hz);
        let fastest_hz = modes.fold(fastest_hz, f64::max);
        let mut start = from_s;
        for &end in &self.jumps {
            let length = end - start;
            let travel = config.motion.travel_px(length)
                + config.shake.travel_px(length)
                + config
                    .modes
                    .iter()
                    .map(|m| m.travel_px(length))
                    .sum::<f64>();
            let nodes =
                4 + (4.0 * fastest_hz * length).ceil() as usize + (4.0 * travel).ceil() as usize;
            quadrature.instants(start, end, nodes, &mut self.instants);
            start = end;
        }
        for (_, w) in &mut self.instants {
            *w /= exposure_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Flicker, Led, Tone};
    use std::f64::consts::{PI, TAU};

    #[test]
    fn rules_integrate_polynomials_exactly() {
        let q = Quadrature::default();
        for n in 1..=MOST_NODES {
            for power in [0usize, 1, 2 * n - 2, 2 * n - 1] {
                let got: f64 = q.rules[n]
                    .iter()
                    .map(|(x, w)| w * x.powi(power as i32))
                    .sum();
                let want = if power % 2 == 0 {
                    2.0 / (power + 1) as f64
                } else {
                    0.0
                };
                assert!(
                    (got - want).abs() < 1e-12,
                    "{n} nodes, power {power}: {got}"
                );
            }
        }
    }

    fn seen(config: &Config, from_s: f64, exposure_s: f64) -> Seen {
        let mut seen = Seen::default();
        seen.look(config, &Quadrature::default(), from_s, exposure_s);
        seen
    }

    #[test]
    fn a_tone_is_attenuated_by_the_sinc_of_its_cycles_per_exposure() {
        for cycles in [0.01, 0.3, 0.9, 1.5, 7.3, 40.2] {
            let (exposure, amplitude) = (0.005, 0.7);
            let hz = cycles / exposure;
            let mut config = Config::default();
            config.motion.tones.push(Tone {
                hz,
                amplitude_px: amplitude,
                phase_rad: 0.4,
            });
            for k in 0..20 {
                let t = f64::from(k) * 1.234e-3;
                let sinc = (PI * cycles).sin() / (PI * cycles);
                let want = amplitude * sinc * (TAU * hz * (t + 0.5 * exposure) + 0.4).sin();
                let got = seen(&config, t, exposure).displacement_px;
                assert!((got - want).abs() < 1e-6, "{cycles} cycles: {got} {want}");
            }
        }
    }

    #[test]
    fn light_is_averaged_over_the_exposure() {
        let mut config = Config::default();
        config.light.flicker = Some(Flicker {
            depth: 0.3,
            hz: 100.0,
            phase_rad: 0.0,
        });
        let x = PI * 100.0 * 0.004;
        let want = 1.0 + 0.3 * x.sin() / x * (TAU * 100.0 * 0.003).sin();
        assert!((seen(&config, 0.001, 0.004).light - want).abs() < 1e-9);
        config.light.flicker = None;
        config.light.led = Some(Led {
            hz: 1000.0,
            duty: 0.25,
            phase: 0.0,
            off_level: 0.0,
            missing: 0.0,
        });
        assert!((seen(&config, 0.0, 0.010).light - 0.25).abs() < 1e-9);
        assert!((seen(&config, 0.0001, 0.0003).light - 0.5).abs() < 1e-9);
        assert!(seen(&config, 0.0003, 0.0003).light.abs() < 1e-12);
    }
}
