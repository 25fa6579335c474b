//! The motion checks the time base: frame rate times line time.
//!
//! A tone is seen twice: from frame to frame, which gives its frequency but for multiples of the frame rate, and from row
//! to row, whose phase runs with ν, the frequency within frames. With the right time base ν is one of f + k·fps. With a line
//! time that is wrong by a factor, a read-out upside down or a global shutter taken for a rolling one it is not, for one
//! tone or another. ν is where a shape that stands explains most; its deviation is √6/(2π·T_readout)/(A/σ_A) for a rigid tone
//! in rows that all know the same.
//!
//! Only the product can be seen: 25 for 60 frames a second is the same as a line time 2.4 times too short.

use super::alias::Scores;
use super::fit::Fit;
use super::model::Samples;
use super::order::is_rare;
use super::parameters::Model;
use super::phase::Frequency;
use super::shape::ORDERS;
use crate::math::sqrtf;

/// Tones that take part, the strongest first.
const MOST: usize = 4;

/// Weaker ones do not: power over the noise of 30 dB in amplitude over its deviation.
const STRONG: f32 = 500.0;

/// A frequency within frames is off where it is by so many deviations,
const DEVIATIONS: f32 = 5.0;
/// by this share of itself,
const SHARE: f32 = 0.0025;
/// and by so much that the phase has turned by this over the rows, rad: real shapes turn it a little.
const TURN: f32 = 0.03;

/// A tone that is modulated is told wrong only by so many times that: its sidebands turn the phase too, and a wrong
/// line time looks like modulation.
const MODULATED: f32 = 4.0;

/// A tone of which more chi² for each degree of freedom is left tells nothing.
const MISFIT: f32 = 30.0;

/// A tone of which no more than this is left needs no further order.
const CLEAN: f32 = 1.3;

/// Line times from this share of the given one to its inverse are looked at.
const LOWEST: f32 = 0.2;

/// A line time this near the given one is preferred to others.
const NEAR: f32 = 0.03;

/// A tone this near another one changes, or is two; turns a window length.
const BESIDE: f32 = 4.0;

/// Steps of a scan a period within the read-out.
const STEPS: f32 = 4.0;

/// What the motion says of the time base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TimeBase {
    pub(crate) contradiction: bool,
    /// The right line time over the given one, where exactly one fits.
    pub(crate) ratio: Option<f32>,
}

/// A tone as seen from row to row.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// One of its frequencies from frame to frame.
    frequency: Frequency,
    /// Frequency within frames, Hz.
    within_hz: f32,
    sd_hz: f32,
    tolerance_hz: f32,
}

/// What there is to look at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look<'a> {
    pub(crate) model: &'a Model,
    pub(crate) variance: f32,
    pub(crate) fps: f32,
    pub(crate) highest_hz: f32,
    /// Some tone is told: only then are modulated ones, which may be a wander, asked too.
    pub(crate) is_told: bool,
}

impl Look<'_> {
    /// What the tones of the model say of the time base; the model has no notches.
    pub(crate) fn check(&self, samples: &mut Samples<'_>, fit: &mut Fit) -> TimeBase {
        let mut base = TimeBase::default();
        let readout_s = readout_s(samples);
        if readout_s <= 0.0 || samples.knowing().len() < 4 {
            return base;
        }
        let strong = self.strong(samples);
        self.model.tabulate(samples);
        let right = strong
            .iter()
            .all(|&i| self.is_right(samples, fit, i, readout_s));
        if right {
            return base;
        }
        let mut seen: heapless::Vec<Seen, MOST> = heapless::Vec::new();
        for &i in &strong {
            if let Some(tone) = self.seen(samples, fit, i, readout_s) {
                let _ = seen.push(tone);
            }
        }
        let off = seen.iter().filter(|s| self.off(s, 1.0) > s.tolerance_hz);
        let off = off.count();
        if off == 0 {
            return base;
        }
        let (ratio, others) = self.ratios(&seen);
        // One that is off beside others that are not may be two tones at one alias frequency: then no factor fits all.
        base.contradiction = others || 2 * off > seen.len();
        base.ratio = ratio.filter(|_| base.contradiction);
        base
    }

    /// The strongest tones, one of each alias frequency.
    fn strong(&self, samples: &Samples<'_>) -> heapless::Vec<usize, MOST> {
        let mut strong: heapless::Vec<usize, MOST> = heapless::Vec::new();
        let power = |i: usize| {
            let tone = &self.model.tones[i];
            samples.seen_power(&tone.shape, tone.frequency.hz()) / (4.0 * self.variance)
        };
        while !strong.is_full() {
            let mut best: Option<(usize, f32)> = None;
            for (i, tone) in self.model.tones.iter().enumerate() {
                let taken = strong.iter().any(|&j| self.alike(samples, i, j));
                let power = power(i);
                let more = best.is_none_or(|(_, p)| power > p);
                let steady = if tone.modulated {
                    self.is_told
                } else {
                    !self.has_beside(samples, i)
                };
                if !taken && steady && power > STRONG && more {
                    best = Some((i, power));
                }
            }
            let Some((i, _)) = best else { break };
            let _ = strong.push(i);
        }
        strong
    }

    /// Another tone is so near tone `i` that it may come of its changing.
    fn has_beside(&self, samples: &Samples<'_>, i: usize) -> bool {
        let at = self.model.tones[i].frequency;
        let mut others = self.model.tones.iter().enumerate();
        others.any(|(j, t)| j != i && t.frequency.above(at).abs() * samples.length_s < BESIDE)
    }

    /// Tones `i` and `j` have one alias frequency.
    fn alike(&self, samples: &Samples<'_>, i: usize, j: usize) -> bool {
        let (a, b) = (
            &self.model.tones[i].frequency,
            &self.model.tones[j].frequency,
        );
        [a.above(*b), a.hz() + b.hz()].iter().any(|apart| {
            let away = apart - self.fps * libm::roundf(apart / self.fps);
            away.abs() * samples.length_s < 1.0
        })
    }

    /// Tone `i` as it was fitted is where a standing shape explains most, with that time base.
    fn is_right(&self, samples: &mut Samples<'_>, fit: &mut Fit, i: usize, readout_s: f32) -> bool {
        let tone = self.model.tones[i];
        fit.passes = fit.passes.saturating_add(1);
        let scores = samples.score(self.model, i, |j| j == i);
        let around = Around {
            scores: &scores,
            orders: tone.shape.orders(),
            readout_s,
        };
        let here = tone.frequency.hz();
        let Some((within_hz, sd_hz)) = around.top(samples, here, self.variance) else {
            return false;
        };
        (within_hz - here).abs() < self.tolerance_hz(i, within_hz, sd_hz, readout_s)
    }

    fn tolerance_hz(&self, i: usize, within_hz: f32, sd_hz: f32, readout_s: f32) -> f32 {
        let unsteady = if self.model.tones[i].modulated {
            MODULATED
        } else {
            1.0
        };
        let least = (SHARE * within_hz.abs()).max(TURN / (core::f32::consts::TAU * readout_s));
        (DEVIATIONS * sd_hz).max(unsteady * least)
    }

    /// The frequency within frames of what is at the alias frequency of tone `i`, of all that there are.
    fn seen(
        &self,
        samples: &mut Samples<'_>,
        fit: &mut Fit,
        i: usize,
        readout_s: f32,
    ) -> Option<Seen> {
        fit.passes = fit.passes.saturating_add(1);
        let mut family: heapless::Vec<bool, { crate::report::MAX_PEAKS }> = heapless::Vec::new();
        for j in 0..self.model.tones.len() {
            let _ = family.push(self.alike(samples, i, j));
        }
        let scores = samples.score(self.model, i, |j| family.get(j).copied().unwrap_or(false));
        let both = samples.axes > 1;
        let slots = samples.knowing().len();
        let most = (slots.saturating_sub(1) / 2 + 1).min(ORDERS);
        let mut best: Option<(f32, f32, f32, f32)> = None;
        let mut start_hz = None;
        for order in 0..most {
            let around = Around {
                scores: &scores,
                orders: [order + 1, if both { order + 1 } else { 0 }],
                readout_s,
            };
            // Where the highest order stands is where the others are to be tried.
            let hz = match (order, start_hz) {
                (0, _) => around.highest(samples, self.highest_hz)?,
                (_, Some(hz)) => hz,
                (_, None) => {
                    let orders = [most, if both { most } else { 0 }];
                    Around { orders, ..around }.highest(samples, self.highest_hz)?
                }
            };
            start_hz = (order > 0).then_some(hz);
            let (within_hz, sd_hz) = around.top(samples, hz, self.variance)?;
            let gain = around.value(samples, within_hz);
            let axes = if both { 2.0 } else { 1.0 };
            let (free, numbers) = samples.free_gain(
                &scores,
                Frequency::from_hz(within_hz),
                [true, both],
                super::alias::BANDS,
            );
            let freedom = numbers - 2.0 * axes * (order + 1) as f32;
            let each = ((free - gain) / self.variance / freedom.max(1.0)).max(1.0);
            let grown = best.is_none_or(|(_, before, ..)| {
                let f = (gain - before) / (2.0 * axes * self.variance) / each;
                is_rare(f, 2.0 * axes, freedom)
            });
            if !grown {
                break;
            }
            best = Some((within_hz, gain, sd_hz * sqrtf(each), each));
            if freedom < 2.0 {
                return None;
            }
            if each < CLEAN {
                break;
            }
        }
        let (within_hz, _, sd_hz, _) = best.filter(|(.., each)| *each < MISFIT)?;
        Some(Seen {
            frequency: self.model.tones[i].frequency,
            within_hz,
            sd_hz,
            tolerance_hz: self.tolerance_hz(i, within_hz, sd_hz, readout_s),
        })
    }

    /// How far a tone within frames is from the nearest it can be, if the line time is `ratio` times the given one, Hz.
    fn off(&self, seen: &Seen, ratio: f32) -> f32 {
        let apart = seen.within_hz / ratio - seen.frequency.hz();
        let away = apart - self.fps * libm::roundf(apart / self.fps);
        (ratio * away).abs()
    }

    /// The one factor of the line time that all tones agree on, and whether there is any, be it negative.
    fn ratios(&self, seen: &[Seen]) -> (Option<f32>, bool) {
        let sharp = |s: &Seen| s.within_hz.abs() / s.sd_hz.max(1e-9);
        let mut best: Option<&Seen> = None;
        for tone in seen {
            if best.is_none_or(|b| sharp(tone) > sharp(b)) {
                best = Some(tone);
            }
        }
        let Some(best) = best else {
            return (None, false);
        };
        let (mut only, mut near, mut count, mut any) = (None, None, 0_u32, false);
        let highest = best.within_hz.abs() / LOWEST;
        let most = ((highest + best.frequency.hz()) / self.fps) as i32 + 1;
        for k in -most..=most {
            let at = best.frequency.hz() + k as f32 * self.fps;
            let ratio = best.within_hz / at;
            let fits = (LOWEST..=1.0 / LOWEST).contains(&ratio.abs())
                && seen.iter().all(|s| self.off(s, ratio) < s.tolerance_hz);
            any |= fits;
            if !fits || ratio < 0.0 {
                continue;
            }
            let ratio = self.settled(seen, ratio);
            count += 1;
            only = Some(ratio);
            if (ratio - 1.0).abs() < NEAR {
                near = Some(ratio);
            }
        }
        (near.or(only.filter(|_| count == 1)), any)
    }

    /// The factor that fits all tones best, near `ratio`.
    fn settled(&self, seen: &[Seen], ratio: f32) -> f32 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for tone in seen {
            let apart = tone.within_hz / ratio - tone.frequency.hz();
            let at = tone.frequency.hz() + self.fps * libm::roundf(apart / self.fps);
            let weight = (at / tone.sd_hz.max(1e-6)) * (at / tone.sd_hz.max(1e-6));
            sum += weight * (tone.within_hz / at);
            weights += weight;
        }
        if weights > 0.0 { sum / weights } else { ratio }
    }
}

/// What a standing shape explains, by the frequency within frames.
#[derive(Clone, Copy)]
struct Around<'a> {
    scores: &'a Scores,
    orders: [usize; 2],
    readout_s: f32,
}

impl Around<'_> {
    fn value(&self, samples: &Samples<'_>, hz: f32) -> f32 {
        let at = Frequency::from_hz(hz);
        let fit = samples.shape_at(self.scores, at, self.orders, samples.knowing());
        fit.gain - fit.loss
    }

    /// The top of the parabola about `hz`, moved on to until it is there; and its deviation for that variance of the noise.
    fn top(&self, samples: &Samples<'_>, hz: f32, variance: f32) -> Option<(f32, f32)> {
        let step = 0.25 / self.readout_s;
        let (mut at, mut width) = (hz, step);
        let mut curve = 0.0;
        for _ in 0..6 {
            let [before, here, after] =
                [at - width, at, at + width].map(|hz| self.value(samples, hz));
            let bend = before - 2.0 * here + after;
            if bend >= 0.0 {
                return None;
            }
            let shift = (0.5 * (before - after) / bend).clamp(-1.0, 1.0);
            at += shift * width;
            curve = -0.5 * bend / (width * width);
            if shift.abs() < 0.02 {
                break;
            }
            width = (width * shift.abs().max(0.2)).max(0.01 * step);
        }
        let sd = sqrtf(variance / curve.max(f32::MIN_POSITIVE));
        (at.is_finite() && sd.is_finite()).then_some((at, sd))
    }

    /// About where it is highest of all, Hz.
    fn highest(&self, samples: &Samples<'_>, highest_hz: f32) -> Option<f32> {
        let step = 1.0 / (STEPS * self.readout_s);
        let count = (highest_hz / step).min(4096.0) as i32 + 1;
        let mut best: Option<(f32, f32)> = None;
        for n in -count..=count {
            let hz = n as f32 * step;
            let value = self.value(samples, hz);
            if best.is_none_or(|(_, v)| value > v) {
                best = Some((hz, value));
            }
        }
        best.map(|(hz, _)| hz)
    }
}

/// From the first slot that knows something to the last, s; both included.
fn readout_s(samples: &Samples<'_>) -> f32 {
    let slots = samples.knowing();
    let count = slots.len();
    let ns = &samples.slot_ns[slots];
    match (ns.first(), ns.last()) {
        (Some(first), Some(last)) if count > 1 => {
            (last - first) as f32 * 1e-9 * count as f32 / (count - 1) as f32
        }
        _ => 0.0,
    }
}
