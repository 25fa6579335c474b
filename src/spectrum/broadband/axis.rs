//! One axis of a window: the noise of its samples, the powers of what is no tone, how its displacement is distributed.
//!
//! The noise is white, so what a filter above the band has says how much of it there is in the band. A measure takes the
//! widest of three bands (all of it, 60 %, 36 %) above which something stands out: in what lies above that, there is only
//! noise, and the noise of velocity grows with the 2.5th power of the frequency.

use super::super::judge::Noise;
use super::super::model::Samples;
use super::filter::{Filter, Grid, Kind};
use super::moments::Moments;
use super::take::{Lines, variance};
use crate::math::sqrtf;
use crate::report::{Figure, Measures};

/// Places of [`Powers`].
pub(super) const VELOCITY: usize = 0;
pub(super) const SLOW_VELOCITY: usize = 1;
pub(super) const DISPLACEMENT: usize = 2;
pub(super) const ACCELERATION: usize = 3;

/// Bands that are tried, as shares of the widest.
const BANDS: [f32; 3] = [1.0, 0.6, 0.36];

/// Something stands out of the noise from so many deviations on.
const STANDS_OUT: f32 = 1.5;

/// Filtered samples needed at least.
const LEAST_COUNT: f32 = 100.0;

/// Where the noise is not seen above the band, its variance is known to this share.
const ASSUMED: f32 = 0.03;

/// What a filter makes of motion within its band is right to this share: of velocity and displacement, of acceleration.
const RIPPLE: [f32; 2] = [0.005, 0.025];

/// Kurtosis and crest factor are told where the motion has so many times the power of the noise.
const TELLING: f32 = 0.5;

/// From this kurtosis on a motion is no few tones.
const RANDOM: f32 = 2.2;

/// Parts of a line that is the whole window.
const PARTS: usize = 12;

/// A mean square of the window and how sure it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Power {
    value: f32,
    /// Variance of what was taken into the value, and of the whole band's.
    variance: f32,
    whole: f32,
}

/// Mean squares of velocity (twice), displacement and acceleration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Powers([Power; 4]);

impl Powers {
    pub(super) fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        for (a, b) in sum.0.iter_mut().zip(&other.0) {
            a.value += b.value;
            a.variance += b.variance;
            a.whole += b.whole;
        }
        sum
    }

    pub(super) fn add(&mut self, kind: usize, value: f32, variance: f32) {
        if let Some(power) = self.0.get_mut(kind) {
            power.value += value;
            power.variance += variance;
            power.whole += variance;
        }
    }

    /// What is slower than the band, of the velocity from 2 Hz on.
    pub(super) fn add_slow(&mut self, square: f32) {
        self.add(SLOW_VELOCITY, square, 0.02 * square * square);
    }

    /// The root of a mean square.
    pub(super) fn root(&self, kind: usize) -> Figure {
        let power = self.0[kind.min(ACCELERATION)];
        let value = sqrtf(power.value.max(0.0));
        let sd = sqrtf(power.variance);
        let at_most = sqrtf(power.value.max(0.0) + 2.0 * sqrtf(power.whole));
        // Near zero a square's root is as unsure as the root of its deviation.
        let sd = sd / (2.0 * value).max(sqrtf(sd)).max(f32::MIN_POSITIVE);
        Figure { value, sd, at_most }
    }
}

/// One axis, of which the samples were made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis<'a> {
    pub(super) index: usize,
    lines: &'a Lines,
    /// Variance of a sample of average weight, px².
    noise_px2: f32,
    /// Variance of that over its square.
    noise_unsure: f32,
    /// What the frames' weights add up to, for a noise of one.
    information: f32,
    /// Numbers that were taken of each slot's samples.
    removed: usize,
}

impl<'a> Axis<'a> {
    /// `None` where nothing is known along it.
    pub(super) fn new(
        samples: &Samples<'_>,
        lines: &'a Lines,
        index: usize,
        (noise, removed): (&[Noise; 2], usize),
    ) -> Option<Self> {
        let weights = (0..samples.slots).map(|slot| 1.0 / variance(samples, index, slot));
        let information: f32 = weights.filter(|w| w.is_finite()).sum();
        (information > 0.0).then(|| Self {
            index,
            lines,
            noise_px2: noise[index.min(1)].quietest(),
            noise_unsure: ASSUMED * ASSUMED,
            information,
            removed,
        })
    }

    /// Of a frame's mean.
    pub(super) fn frame_variance_px2(&self) -> f32 {
        self.noise_px2 / self.information
    }

    /// Of a tone's amplitude, before the exposure is undone: 2σ²/N. `floor_px2`: of a sample of average weight, as if all noise
    /// were as at the tone's frequency.
    pub(super) fn tone_variance_px2(&self, samples: &Samples<'_>, floor_px2: f32) -> f32 {
        2.0 * self.noise_px2.max(floor_px2) / (self.information * samples.frames.max(1) as f32)
    }

    /// What is no tone, in mean squares; `None` where there are not enough samples in a row. Measures the noise.
    pub(super) fn powers(
        &mut self,
        samples: &Samples<'_>,
        (filters, top_hz): (&Grid<'_>, f32),
        (grid, work): (&mut [f32], &mut [f32]),
    ) -> Option<Powers> {
        self.weigh(samples, &filters.pass(Kind::Velocity, top_hz, work), grid);
        self.hear_noise(samples, (filters, top_hz), (grid, work));
        let mut powers = Powers::default();
        for (kind, place) in [
            (Kind::Velocity, VELOCITY),
            (Kind::Displacement, DISPLACEMENT),
            (Kind::Acceleration, ACCELERATION),
        ] {
            powers.0[place] = self.power(samples, (filters, top_hz), kind, (grid, work))?;
        }
        powers.0[SLOW_VELOCITY] = powers.0[VELOCITY];
        Some(powers)
    }

    /// Leaves the samples' variances in the second part of the grid, and in the third how much what a filter makes of those
    /// around each place is to count.
    fn weigh(&self, samples: &Samples<'_>, filter: &Filter, grid: &mut [f32]) {
        let n = self.lines.taps;
        let (variances, rest) = grid[n..].split_at_mut(n);
        self.lines.variances(samples, self.index, variances);
        let weights = &mut rest[..n];
        let (mut sum, mut count) = (0.0, 0.0_f32);
        for (at, weight) in weights.iter_mut().enumerate() {
            let inside = at >= filter.half() && at + filter.half() < n;
            *weight = if inside {
                filter.noise(variances, at)
            } else {
                f32::INFINITY
            };
            if weight.is_finite() && *weight > 0.0 {
                sum += 1.0 / *weight;
                count += 1.0;
            }
        }
        // Places with the usual noise count alike; those with much more, as little as they know.
        let usual = count / sum;
        for weight in weights {
            let over = 1.0 + *weight / usual;
            *weight = if over.is_finite() {
                4.0 / (over * over)
            } else {
                0.0
            };
        }
    }

    /// Measures the noise where there is nothing else, if there is such a band.
    fn hear_noise(
        &mut self,
        samples: &Samples<'_>,
        (filters, top_hz): (&Grid<'_>, f32),
        (grid, work): (&mut [f32], &mut [f32]),
    ) {
        let nyquist = 0.5 / filters.step_s;
        let from_hz = top_hz + 1.5 * filters.transition_hz();
        if nyquist - from_hz < 0.25 * nyquist {
            return;
        }
        let filter = filters.above(from_hz, work);
        let Some((moments, unit)) = self.scan(samples, &filter, grid) else {
            return;
        };
        self.noise_px2 = moments.means()[0] / unit;
        self.noise_unsure =
            filter.unsteadiness(moments.count / moments.blocks()) / moments.blocks();
    }

    /// Moments of what a filter makes of all samples, and the mean square it makes of unit noise; `None` where there are not
    /// enough.
    fn scan(
        &self,
        samples: &Samples<'_>,
        filter: &Filter,
        grid: &mut [f32],
    ) -> Option<(Moments, f32)> {
        let n = self.lines.taps;
        let half = filter.half();
        let (line, rest) = grid.split_at_mut(n);
        let (variances, weights) = rest.split_at(n);
        let mut moments = Moments::default();
        let inside = half..n.saturating_sub(half);
        let part = if self.lines.count > 1 {
            n
        } else {
            (n / PARTS).max(1)
        };
        for index in 0..self.lines.count {
            self.lines.gather(samples, self.index, index, line);
            for (i, at) in inside.clone().enumerate() {
                let value = filter.apply(line, at);
                if weights[at] > 0.0 && value.is_finite() {
                    moments.add(weights[at], value);
                }
                if i % part == part - 1 {
                    moments.end_block();
                }
            }
            moments.end_block();
        }
        let (mut noise, mut total) = (0.0, 0.0);
        for at in inside.filter(|&at| weights[at] > 0.0) {
            noise += weights[at] * filter.noise(variances, at);
            total += weights[at];
        }
        let enough = moments.count >= LEAST_COUNT && moments.blocks() >= 2.0;
        (enough && total > 0.0).then(|| (moments, noise / total))
    }

    /// One mean square over the window, in the widest band above which something stands out of the noise.
    fn power(
        &self,
        samples: &Samples<'_>,
        (filters, top_hz): (&Grid<'_>, f32),
        kind: Kind,
        (grid, work): (&mut [f32], &mut [f32]),
    ) -> Option<Power> {
        let mut tried = [Power::default(); BANDS.len() + 1];
        let mut noises = [0.0; BANDS.len() + 1];
        for ((share, power), noise) in BANDS.iter().zip(&mut tried).zip(&mut noises) {
            let filter = filters.pass(kind, share * top_hz, work);
            let (moments, unit) = self.scan(samples, &filter, grid)?;
            let blocks = moments.blocks();
            let of_noise = self.noise_px2 * unit;
            let unsteady = filter.unsteadiness(moments.count / blocks) / blocks;
            *noise = of_noise * of_noise * (unsteady + self.noise_unsure);
            // What was seen is a part of the time; of that part nothing is unsure but the noise.
            let seen = (moments.count * self.lines.step_s / samples.length_s).min(1.0);
            let differs = (moments.variance(1.0, 0.0) - *noise).max(0.0) * (1.0 - seen);
            // So many parts of as many as there are frames went with the slots' means, polynomials and notches.
            let frames = samples.frames as f32;
            let whole = frames / (frames - self.removed as f32).max(0.3 * frames);
            let value = whole * (moments.means()[0] - of_noise);
            let ripple = 2.0 * value * RIPPLE[usize::from(kind == Kind::Acceleration)];
            *power = Power {
                value,
                variance: *noise + differs + ripple * ripple,
                whole: 0.0,
            };
        }
        // Where nothing stands out it is as much nothing as the narrowest band is sure.
        tried[BANDS.len()].variance = noises[BANDS.len() - 1];
        let mut chosen = tried[BANDS.len()];
        for (i, &power) in tried.iter().enumerate().take(BANDS.len()) {
            let above = power.value - tried[i + 1].value;
            let noise = sqrtf((noises[i] - noises[i + 1]).max(0.0));
            if above > STANDS_OUT * noise {
                chosen = power;
                break;
            }
        }
        // What was left out may be there all the same.
        let left_out = (tried[0].value - chosen.value).max(0.0);
        let unsure = sqrtf(tried[0].variance.max(chosen.variance)) + 0.5 * left_out;
        chosen.whole = unsure * unsure;
        Some(chosen)
    }

    /// Peak-to-peak, crest factor and kurtosis of the displacement, its tones put back.
    pub(super) fn distribution(
        &self,
        samples: &Samples<'_>,
        filter: &Filter,
        measures: &mut Measures,
        grid: &mut [f32],
    ) {
        self.weigh(samples, filter, grid);
        let Some((moments, unit)) = self.scan(samples, filter, grid) else {
            return;
        };
        let noise = self.noise_px2 * unit;
        let noise_px = sqrtf(noise);
        let ends = [moments.lowest, moments.highest];
        let near = self.near_ends(samples, (filter, ends), 2.0 * noise_px, grid);
        let shared = filter.shared().max(1.0);
        // The largest of so many values that noise was added to is too large by so much.
        let excess = |near: f32| noise_px * sqrtf(2.0 * libm::logf((near / shared).max(1.0)));
        let highest = (ends[1] - excess(near[1])).max(0.0);
        let lowest = (ends[0] + excess(near[0])).min(0.0);
        // A part of the time was not seen; what is random had a larger one then, as likely as not.
        let seen = (moments.count * self.lines.step_s / samples.length_s).min(1.0);
        let [second, fourth] = moments.means();
        let power = second - noise;
        let random = fourth > RANDOM * second * second;
        let missed = if random {
            0.5 * second * -libm::logf(seen) / highest.max(-lowest)
        } else {
            0.0
        };
        let sd = sqrtf(0.5 * noise + missed * missed);
        measures.peak_to_peak_px =
            Some(with_limit(highest - lowest, core::f32::consts::SQRT_2 * sd));
        if power < TELLING * noise {
            return;
        }
        let rms = measures.displacement_px;
        measures.crest_factor =
            rms.and_then(|rms| crest_factor(highest.max(-lowest), rms, sd / rms.value));
        let square = power * power;
        let kurtosis = (fourth - 6.0 * noise * power - 3.0 * noise * noise) / square;
        let of_second = -6.0 * noise / square - 2.0 * kurtosis / power;
        let variance = moments.variance(of_second, 1.0 / square);
        measures.kurtosis = Some(with_limit(kurtosis.max(1.0), sqrtf(variance)));
    }

    /// How many filtered samples are within `reach` of the lowest and the highest.
    fn near_ends(
        &self,
        samples: &Samples<'_>,
        (filter, ends): (&Filter, [f32; 2]),
        reach: f32,
        grid: &mut [f32],
    ) -> [f32; 2] {
        let n = self.lines.taps;
        let half = filter.half();
        let line = &mut grid[..n];
        let mut near = [0.0; 2];
        for index in 0..self.lines.count {
            self.lines.gather(samples, self.index, index, line);
            for at in half..n.saturating_sub(half) {
                let value = filter.apply(line, at);
                for (near, end) in near.iter_mut().zip(ends) {
                    *near += f32::from(u8::from((value - end).abs() <= reach));
                }
            }
        }
        near
    }
}

/// The largest filtered distance of both axes from rest, px.
pub(super) fn farthest_px(
    samples: &Samples<'_>,
    lines: &Lines,
    filter: &Filter,
    grid: &mut [f32],
) -> f32 {
    let n = lines.taps;
    let (x, rest) = grid.split_at_mut(n);
    let y = &mut rest[..n];
    let mut farthest = 0.0_f32;
    for line in 0..lines.count {
        lines.gather(samples, 0, line, x);
        lines.gather(samples, 1, line, y);
        for at in filter.half()..n.saturating_sub(filter.half()) {
            let (x, y) = (filter.apply(x, at), filter.apply(y, at));
            // What is no number is no largest.
            farthest = farthest.max(x * x + y * y);
        }
    }
    sqrtf(farthest)
}

/// The largest displacement over its RMS, which are as unsure as `sd`, a share, and the RMS say.
pub(super) fn crest_factor(largest_px: f32, rms: Figure, sd: f32) -> Option<Figure> {
    if rms.value <= 0.0 {
        return None;
    }
    let value = largest_px / rms.value;
    let of_rms = value * rms.sd / rms.value;
    Some(with_limit(value, sqrtf(sd * sd + of_rms * of_rms)))
}

fn with_limit(value: f32, sd: f32) -> Figure {
    Figure {
        value,
        sd,
        at_most: value + 2.0 * sd,
    }
}
