//! Filters that make velocity, displacement or acceleration of neighbouring samples, the exposure undone.
//!
//! Their taps are the least-squares fit of the wanted response: up to a frequency the errors count as shares of what is
//! wanted, above a transition of 1.5 over the filter's length the answer is to be none (Parks & Burrus, Digital Filter Design,
//! 1987, 3.2). They reach over no more than 6 ms of one frame, so the time between frames, of which nothing is known, is
//! not in them, and no motion has images.

use crate::math::{cos_sin, sqrtf, turns};
use crate::timeline::Group;

/// Most taps on either side of the middle.
pub(super) const MOST_HALF: usize = 32;

/// Fewest taps on either side of a short filter.
const SHORTEST: usize = 4;

/// From pass to stop, over one filter length.
const TRANSITION: f32 = 1.5;

/// Points of the fit, below and above the transition.
const POINTS: usize = 64;

/// How much an answer above the transition counts, as a share of the wanted one at the top of the band.
const STOPPED: f32 = 0.3;

/// Below this the errors count as at this, Hz.
const SLOW_HZ: f32 = 40.0;

/// A share of the matrix's mean diagonal that is added to it: what 32 bits can tell apart.
const RIDGE: f32 = 2e-6;

/// The same of a filter whose answer need not be exact.
const WIDE_RIDGE: f32 = 1e-4;

/// Memory that a fit needs.
pub(super) const WORK: usize = (MOST_HALF + 1) * (MOST_HALF + 2);

/// What a filter makes of displacements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Displacement,
    Velocity,
    Acceleration,
}

/// How the taps of a filter hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Symmetry {
    /// The same on both sides.
    Even,
    /// The same, and they add up to nothing: what stands still has no answer.
    Balanced,
    /// The opposite on the other side.
    Odd,
}

/// A filter over `2·half + 1` samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filter {
    taps: [f32; MOST_HALF + 1],
    half: usize,
    symmetry: Symmetry,
}

/// The samples that filters run over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid<'a> {
    pub(super) group: &'a Group,
    /// From a sample to the next, s.
    pub(super) step_s: f32,
    /// Taps on either side.
    pub(super) half: usize,
}

impl Grid<'_> {
    /// From where a filter passes all to where it passes nothing, Hz.
    pub(super) fn transition_hz(&self) -> f32 {
        TRANSITION / (2.0 * self.half as f32 * self.step_s)
    }

    /// For filters of a third of the length, of which the transition is the wider.
    pub(super) fn short(&self) -> Self {
        let half = (self.half / 3).max(SHORTEST).min(self.half);
        Self { half, ..*self }
    }

    /// A filter that passes frequencies up to `top_hz`; fitted in `work`, at least [`WORK`] long.
    pub(super) fn pass(&self, kind: Kind, top_hz: f32, work: &mut [f32]) -> Filter {
        let response = |hz: f32| {
            let w = core::f32::consts::TAU * hz;
            let left = self.group.attenuation(hz).max(0.05);
            match kind {
                Kind::Displacement => 1.0 / left,
                Kind::Velocity => w / left,
                Kind::Acceleration => w * w / left,
            }
        };
        let (full, slow) = (response(top_hz), response(SLOW_HZ.min(top_hz)));
        let wanted = |hz: f32| (response(hz) / full, full / response(hz).max(slow));
        // A short filter has no room for a transition below the highest frequency: then it stops nothing.
        let stop_hz = (top_hz + self.transition_hz()).min(0.5 / self.step_s);
        let stop = [stop_hz, 0.5 / self.step_s];
        let symmetry = match kind {
            Kind::Displacement => Symmetry::Even,
            Kind::Velocity => Symmetry::Odd,
            Kind::Acceleration => Symmetry::Balanced,
        };
        let mut filter = self.fit(
            ([0.0, top_hz], wanted),
            (stop, STOPPED),
            (symmetry, RIDGE),
            work,
        );
        for tap in &mut filter.taps {
            *tap *= full;
        }
        filter
    }

    /// A filter that passes what is above `from_hz`, where there is only noise.
    pub(super) fn above(&self, from_hz: f32, work: &mut [f32]) -> Filter {
        let below = (from_hz - self.transition_hz()).max(0.0);
        let pass = [from_hz, 0.5 / self.step_s];
        // What is slow is largest as a rule.
        let stop = ([0.0, below], 10.0);
        self.fit(
            (pass, |_| (1.0, 1.0)),
            stop,
            (Symmetry::Balanced, WIDE_RIDGE),
            work,
        )
    }

    /// Taps whose answer is what `wanted` says from `pass.0` to `pass.1`, and none over `stop`, each weighed.
    fn fit(
        &self,
        (pass, wanted): ([f32; 2], impl Fn(f32) -> (f32, f32)),
        (stop, stopped): ([f32; 2], f32),
        (symmetry, ridge): (Symmetry, f32),
        work: &mut [f32],
    ) -> Filter {
        let half = self.half.min(MOST_HALF);
        let mut filter = Filter {
            taps: [0.0; MOST_HALF + 1],
            half,
            symmetry,
        };
        let first = usize::from(symmetry != Symmetry::Even);
        let n = half + 1 - first;
        let Some((matrix, right)) = work.split_at_mut_checked(n * n) else {
            return filter;
        };
        matrix.fill(0.0);
        let Some(right) = right.get_mut(..n) else {
            return filter;
        };
        right.fill(0.0);
        for i in 0..2 * POINTS {
            let [from, to] = if i < POINTS { pass } else { stop };
            let hz = from + ((i % POINTS) as f32 + 0.5) * (to - from) / POINTS as f32;
            let (want, weight) = if i < POINTS {
                wanted(hz)
            } else {
                (0.0, stopped)
            };
            let mut row = [0.0; MOST_HALF + 1];
            for (j, value) in row.iter_mut().enumerate().take(half + 1) {
                let (c, s) = cos_sin(turns(hz * self.step_s * j as f32));
                let twice = if j == 0 { 1.0 } else { 2.0 };
                let of_tap = match symmetry {
                    Symmetry::Even => c,
                    Symmetry::Balanced => c - 1.0,
                    Symmetry::Odd => s,
                };
                *value = weight * twice * of_tap;
            }
            let row = &row[first..=half];
            for (j, &a) in row.iter().enumerate() {
                right[j] += a * weight * want;
                for (sum, &b) in matrix[j * n..].iter_mut().zip(&row[..=j]) {
                    *sum += a * b;
                }
            }
        }
        solve(matrix, right, ridge);
        filter.taps[first..=half].copy_from_slice(right);
        if symmetry == Symmetry::Balanced {
            filter.taps[0] = -2.0 * right.iter().sum::<f32>();
        }
        filter
    }
}

/// Solves a symmetric positive system of which the lower half is given, in place (Cholesky).
fn solve(matrix: &mut [f32], right: &mut [f32], ridge: f32) {
    let n = right.len();
    let trace: f32 = (0..n).map(|i| matrix[i * n + i]).sum();
    let ridge = ridge * trace / n.max(1) as f32;
    for i in 0..n {
        matrix[i * n + i] += ridge;
        for j in 0..=i {
            let mut sum = matrix[i * n + j];
            for k in 0..j {
                sum -= matrix[i * n + k] * matrix[j * n + k];
            }
            matrix[i * n + j] = if i == j {
                // What rounding made of nothing must not be divided by.
                if sum > 0.1 * ridge { sqrtf(sum) } else { 1e18 }
            } else {
                sum / matrix[j * n + j]
            };
        }
        let mut sum = right[i];
        for k in 0..i {
            sum -= matrix[i * n + k] * right[k];
        }
        right[i] = sum / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let mut sum = right[i];
        for k in i + 1..n {
            sum -= matrix[k * n + i] * right[k];
        }
        right[i] = sum / matrix[i * n + i];
    }
}

impl Filter {
    /// Samples on either side of the middle.
    pub(super) const fn half(&self) -> usize {
        self.half
    }

    /// What it makes of the samples around `at`, which has `half` on either side; no number where one is missing.
    pub(super) fn apply(&self, samples: &[f32], at: usize) -> f32 {
        let Some(around) = samples.get(at.wrapping_sub(self.half)..=at + self.half) else {
            return f32::NAN;
        };
        let (before, rest) = around.split_at(self.half);
        let Some((middle, after)) = rest.split_first() else {
            return f32::NAN;
        };
        let odd = self.symmetry == Symmetry::Odd;
        let pairs = before.iter().rev().zip(after).zip(&self.taps[1..]);
        let mut sum = self.taps[0] * middle;
        for ((&b, &a), &tap) in pairs {
            sum += tap * if odd { a - b } else { a + b };
        }
        sum
    }

    /// What it makes of independent noise of these variances.
    pub(super) fn noise(&self, variances: &[f32], at: usize) -> f32 {
        let Some(around) = variances.get(at.wrapping_sub(self.half)..=at + self.half) else {
            return f32::NAN;
        };
        let mut sum = 0.0;
        for (i, &variance) in around.iter().enumerate() {
            let tap = self.taps[i.abs_diff(self.half)];
            sum += tap * tap * variance;
        }
        sum
    }

    /// Variance of the mean square over `count` places in a row of what it makes of white noise, over the square of its
    /// mean: 2/P²·Σ(P − |k|)·ρ_k², ρ its autocorrelation.
    pub(super) fn unsteadiness(&self, count: f32) -> f32 {
        let odd = self.symmetry == Symmetry::Odd;
        let tap = |i: isize| {
            let tap = self.taps.get(i.unsigned_abs()).copied().unwrap_or(0.0);
            if odd && i < 0 { -tap } else { tap }
        };
        let half = self.half as isize;
        let product = |lag: isize| (-half..=half - lag).map(|i| tap(i) * tap(i + lag)).sum();
        let all: f32 = product(0);
        let mut sum = count;
        for lag in 1..=2 * half {
            let shared: f32 = product(lag);
            let rho = shared / all;
            sum += 2.0 * (count - lag as f32).max(0.0) * rho * rho;
        }
        2.0 * sum / (count * count)
    }

    /// Samples that share so much that they count as one.
    pub(super) fn shared(&self) -> f32 {
        0.5 * 100.0 * self.unsteadiness(100.0)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::camera::Timing;
    use std::vec::Vec;

    /// 300 rows of 100 µs, exposed for 600 µs: one a sample.
    fn group() -> Group {
        Group::new(Timing::new(100_000_000, 600_000, 300).unwrap(), 1).unwrap()
    }

    /// What a filter makes of a tone of 1 px as the exposure leaves it, zero to peak.
    fn answer(filter: &Filter, hz: f32) -> f32 {
        let left = group().attenuation(hz);
        let mut most = 0.0_f32;
        for phase in 0..16_u8 {
            let samples: Vec<f32> = (0..101_u8)
                .map(|i| {
                    let turn = hz * 1e-4 * f32::from(i) + f32::from(phase) / 16.0;
                    left * (turn * core::f32::consts::TAU).sin()
                })
                .collect();
            most = most.max(filter.apply(&samples, 50).abs());
        }
        most
    }

    #[test]
    fn they_differentiate_and_undo_the_exposure() {
        let group = group();
        let grid = Grid {
            group: &group,
            step_s: 1e-4,
            half: 30,
        };
        for (kind, power) in [
            (Kind::Displacement, 0),
            (Kind::Velocity, 1),
            (Kind::Acceleration, 2),
        ] {
            let filter = grid.pass(kind, 1000.0, &mut [0.0; WORK]);
            for hz in [60.0, 211.0, 450.0, 800.0, 950.0] {
                let want = (core::f32::consts::TAU * hz).powi(power);
                let got = answer(&filter, hz) / want;
                assert!((got - 1.0).abs() < 0.03, "{kind:?} {hz} Hz: {got}");
            }
            let beyond = 1000.0 + 1.3 * grid.transition_hz();
            let got = answer(&filter, beyond) / group.attenuation(beyond);
            let full = (core::f32::consts::TAU * 1000.0).powi(power) / group.attenuation(1000.0);
            assert!(got < 0.06 * full, "{kind:?}: {got} of {full}");
        }
        let noise = grid.above(2000.0, &mut [0.0; WORK]);
        assert!(answer(&noise, 900.0) < 0.03);
    }

    #[test]
    fn noise_comes_out_as_stated() {
        let group = group();
        let grid = Grid {
            group: &group,
            step_s: 1e-4,
            half: 20,
        };
        let filter = grid.pass(Kind::Velocity, 1000.0, &mut [0.0; WORK]);
        let mut seed = 1_u32;
        let noise: Vec<f32> = (0..60_000)
            .map(|_| {
                let mut sum = 0.0;
                for _ in 0..12 {
                    seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    sum += (seed >> 8) as f32 / 16_777_216.0;
                }
                sum - 6.0
            })
            .collect();
        let want = filter.noise(&[1.0; 60], 30);
        let squares: Vec<f32> = (20..noise.len() - 20)
            .map(|at| filter.apply(&noise, at).powi(2) / want)
            .collect();
        let mean = squares.iter().sum::<f32>() / squares.len() as f32;
        // 60 000 samples, of which some five count as one: a deviation of 1.3 %, and 4 of them.
        assert!((mean - 1.0).abs() < 0.052, "{mean}");
        let blocks: Vec<f32> = squares
            .chunks_exact(100)
            .map(|b| b.iter().sum::<f32>() / 100.0)
            .collect();
        let spread = blocks.iter().map(|b| (b - mean).powi(2)).sum::<f32>() / blocks.len() as f32;
        let said = filter.unsteadiness(100.0);
        // 599 blocks: a deviation of 6 % at least, and 4 of them.
        assert!((spread / said - 1.0).abs() < 0.3, "{spread} {said}");
    }
}
