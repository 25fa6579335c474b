//! The samples as lines of neighbours in time, in the place of the shifts they are made of.

use num_complex::Complex32 as Complex;

use super::super::model::Samples;
use super::super::parameters::Model;
use super::super::rows;
use super::super::shape::legendre;
use super::super::window::unpack_weight;
use super::Given;
use crate::math::{cos_sin, turns};
use crate::report::{FROM_HZ, TO_HZ};

/// A slot whose second measurement knows nothing is used where it would change the first by less than this.
const HARDLY_COUPLED: f32 = 0.02;

/// Cosines that are taken off each slot in any case, one for so many frames ...
const FRAMES_A_COSINE: usize = 12;

/// ... and no more than these.
const MOST_COSINES: usize = 4;

/// One of so many times the power of the others is a pattern.
const STANDS_OUT: f32 = 4.0;

/// Rows are bridged where the fastest motion of the band turns no further between their neighbours.
const BRIDGED_TURNS: f32 = 0.3;

/// Samples that follow each other at even distances: a frame's slots, or all frames of a camera whose rows are exposed
/// at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lines {
    pub(super) count: usize,
    /// Samples of a line.
    pub(super) taps: usize,
    /// From a sample to the next, s.
    pub(super) step_s: f32,
    /// A line is all frames of the only slot.
    over_frames: bool,
}

impl Lines {
    pub(super) fn of(samples: &Samples<'_>, given: &Given<'_>) -> Option<Self> {
        if samples.slots > 1 {
            return Some(Self {
                count: samples.frames,
                taps: samples.slots,
                step_s: given.group.spacing_ns() as f32 * 1e-9,
                over_frames: false,
            });
        }
        if given.fps <= 0.0 {
            return None;
        }
        Some(Self {
            count: 1,
            taps: libm::roundf(samples.length_s * given.fps) as usize + 1,
            step_s: 1.0 / given.fps,
            over_frames: true,
        })
    }

    /// Line `line` of an axis into `out`; no numbers where there are no samples.
    pub(super) fn gather(&self, samples: &Samples<'_>, axis: usize, line: usize, out: &mut [f32]) {
        let (frames, first) = (samples.frames, axis * samples.slots * samples.frames);
        if !self.over_frames {
            for (slot, value) in out.iter_mut().enumerate().take(self.taps) {
                let at = first + slot * frames + line;
                *value = samples.shift_px.get(at).copied().unwrap_or(f32::NAN);
            }
            self.bridge(out, |weights, known| dot(&weights, known));
            return;
        }
        out.fill(f32::NAN);
        let begin = samples.frame_t.first().copied().unwrap_or(0.0);
        let scale = samples.length_s / self.step_s;
        for (frame, &t) in samples.frame_t.iter().enumerate().take(frames) {
            let place = libm::roundf((t - begin) * scale) as usize;
            if let (Some(value), Some(&x)) =
                (out.get_mut(place), samples.shift_px.get(first + frame))
            {
                *value = x;
            }
        }
    }

    /// Variance along an axis of the sample at each place of a line, for a noise of unit variance in a sample of average
    /// weight; infinite where it knows nothing.
    pub(super) fn variances(&self, samples: &Samples<'_>, axis: usize, out: &mut [f32]) {
        if self.over_frames {
            out.fill(variance(samples, axis, 0));
            return;
        }
        for (slot, value) in out.iter_mut().enumerate() {
            *value = variance(samples, axis, slot);
        }
        self.bridge(out, |weights, known| dot(&weights.map(|w| w * w), known));
    }

    /// Most neighbours in a row that are known all along, of an axis; `out` is written over.
    pub(super) fn longest_run(&self, samples: &Samples<'_>, axis: usize, out: &mut [f32]) -> usize {
        self.variances(samples, axis, out);
        let (mut run, mut longest) = (0, 0);
        for value in out {
            run = if value.is_finite() { run + 1 } else { 0 };
            longest = longest.max(run);
        }
        longest
    }

    /// Bridges gaps of a few rows that nothing is known of, where rows lie so near each other that the fastest motion of the
    /// band runs smoothly over them: `of` gives a value from the cubic's weights of the two neighbours on either side.
    /// Else one row that is always missing would leave no place for a filter.
    fn bridge(&self, line: &mut [f32], of: impl Fn([f32; 4], [f32; 4]) -> f32) {
        let most = ((BRIDGED_TURNS / (self.step_s * TO_HZ)) as usize).saturating_sub(1);
        let mut at = 2;
        while at + 2 < line.len() {
            let gap = line[at..].iter().take_while(|x| !x.is_finite()).count();
            let after = at + gap;
            if gap > 0 && gap <= most && after + 1 < line.len() {
                let known = [at - 2, at - 1, after, after + 1].map(|place| line[place]);
                for i in 0..gap {
                    line[at + i] = of(cubic(i as f32 + 1.0, gap as f32 + 1.0), known);
                }
            }
            at = after + 1;
        }
    }
}

/// Weights of Lagrange's cubic `t` places after the second of four: they lie at −1, 0, `end` and `end` + 1.
fn cubic(t: f32, end: f32) -> [f32; 4] {
    let (first, rest) = (t * (t - end) * (t - end - 1.0), (t + 1.0) / (end + 1.0));
    let outer = (end + 1.0) * (end + 2.0);
    [
        -first / outer,
        rest * (t - end) * (t - end - 1.0) / end,
        -rest * t * (t - end - 1.0) / end,
        rest * t * (t - end) / (end + 2.0),
    ]
}

fn dot(weights: &[f32; 4], known: [f32; 4]) -> f32 {
    weights.iter().zip(known).map(|(w, x)| w * x).sum()
}

/// Variance along an axis of a slot's samples, for a noise of unit variance in a sample of average weight.
pub(super) fn variance(samples: &Samples<'_>, axis: usize, slot: usize) -> f32 {
    let frames = samples.frames.max(1) as f32;
    let weight = |series: usize| samples.series_weight.get(series).copied().unwrap_or(0.0) / frames;
    let (first, second) = (weight(slot), weight(samples.slots + slot));
    if samples.channels < 2 {
        return 1.0 / first;
    }
    if samples.lean.is_some() {
        let [a, b] = across(samples, slot);
        return 1.0 / (first * a * a + second * b * b);
    }
    let coupling = samples.couplings.get(slot).map_or(0.0, |c| c.coupling);
    match axis {
        0 if second <= 0.0 && coupling.abs() < HARDLY_COUPLED => 1.0 / first,
        0 => 1.0 / first + coupling * coupling / second,
        _ => 1.0 / second,
    }
}

/// What a slot's two measurements see of the motion across the edges.
fn across(samples: &Samples<'_>, slot: usize) -> [f32; 2] {
    let second = samples.sight(samples.slots + slot).of_drift(0);
    [samples.sight(slot).of_drift(0), second]
}

/// So many frames allow for one notch: half of what they know at most is taken by notches.
pub(super) const FRAMES_A_NOTCH: usize = 8;

/// Numbers that a notch takes of each series.
const OF_A_NOTCH: usize = 4;

/// Takes drift, offsets and the tones of `model` off the samples, and makes x and y of the two measurements: x in the first
/// half of the shifts, y in the second. Gives how many numbers were taken of each slot's samples.
pub(super) fn residual(samples: &mut Samples<'_>, model: &Model) -> usize {
    for series in 0..samples.series() {
        take_series(samples, model, series);
    }
    let mut taken = 1 + OF_A_NOTCH * samples.notches.len();
    if samples.slots > 1 {
        taken += take_patterns(samples);
    }
    if samples.channels > 1 {
        for slot in 0..samples.slots {
            separate(samples, slot);
        }
    }
    taken
}

/// A slot's reference may also be off by more and less while a shadow passes or the light changes; in a frame such a
/// pattern looks like fast motion. So slow cosines of the time (a discrete cosine transform's) are taken off each slot, and
/// not only its mean: the first few, and others up to an eighth of the frame rate that stand out of what faster ones hold.
/// Gives how many.
fn take_patterns(samples: &mut Samples<'_>) -> usize {
    let frames = samples.frames;
    let always = (frames / FRAMES_A_COSINE).min(MOST_COSINES);
    let highest = frames / 4;
    let mut taken = 0;
    let (mut level, mut count) = (0.0, 0.0_f32);
    for order in (highest + 1..frames).step_by((frames / 16).max(1)) {
        level += cosine(samples, order, false);
        count += 1.0;
    }
    level /= count.max(1.0);
    for order in 1..=highest {
        if order <= always || cosine(samples, order, false) > STANDS_OUT * level {
            cosine(samples, order, true);
            taken += 1;
        }
    }
    taken
}

/// The power that the cosine of an order has in all series; takes it off them if asked for.
fn cosine(samples: &mut Samples<'_>, order: usize, take: bool) -> f32 {
    let n = samples.frames;
    for (wave, &t) in samples.own_re.iter_mut().zip(samples.frame_t.iter()) {
        // From half a frame before the first to half a frame after the last.
        let shrunk = (t + 0.5) * (n as f32 - 1.0) + 0.5;
        *wave = cos_sin(turns(0.5 * order as f32 * shrunk / n as f32)).0;
    }
    let wave = &samples.own_re[..n];
    let mut power = 0.0;
    for series in 0..samples.channels * samples.slots {
        let shifts = &mut samples.shift_px[series * n..series * n + n];
        let (mut product, mut square) = (0.0, 0.0);
        for (&x, &p) in shifts.iter().zip(wave) {
            if x.is_finite() {
                product += p * x;
                square += p * p;
            }
        }
        if square <= 0.0 {
            continue;
        }
        let share = product / square;
        power += product * share * samples.series_weight[series];
        if take {
            for (x, &p) in shifts.iter_mut().zip(wave) {
                *x -= share * p;
            }
        }
    }
    power
}

fn take_series(samples: &mut Samples<'_>, model: &Model, series: usize) {
    let n = samples.frames;
    samples.residual(series, &model.tones, &model.drift);
    let here = series * n..series * n + n;
    let shifts = samples.shift_px[here.clone()].iter_mut();
    for ((x, &weight), &weighted) in shifts.zip(&samples.weight[here]).zip(samples.row.iter()) {
        let weight = unpack_weight(weight);
        *x = if weight > 0.0 {
            weighted / weight
        } else {
            f32::NAN
        };
    }
}

/// x + κ·y and y of a slot to x and y.
fn separate(samples: &mut Samples<'_>, slot: usize) {
    let n = samples.frames;
    let coupling = samples.couplings.get(slot).map_or(0.0, |c| c.coupling);
    let [a, b] = across(samples, slot);
    let leans = samples.lean.is_some();
    let at = samples.slots * n;
    for i in slot * n..slot * n + n {
        let (first, second) = (samples.shift_px[i], samples.shift_px[at + i]);
        let weight = |i: usize| unpack_weight(samples.weight[i]);
        samples.shift_px[i] = if leans {
            let (v, w) = (weight(i) * a, weight(at + i) * b);
            // A measurement without weight is no number.
            let of = |weight: f32, x: f32| if weight == 0.0 { 0.0 } else { weight * x };
            (of(v, first) + of(w, second)) / (v * a + w * b)
        } else if second.is_nan() && coupling.abs() < HARDLY_COUPLED {
            first
        } else {
            first - coupling * second
        };
    }
}

/// Puts the tones of `model` that are within the band back along an axis; the phasors are tabulated.
pub(super) fn put_back(samples: &mut Samples<'_>, model: &Model, axis: usize) {
    let n = samples.frames;
    for slot in 0..samples.slots {
        let polynomials = legendre(samples.slot_eta[slot]);
        for (i, tone) in model.tones.iter().enumerate() {
            if tone.frequency.hz() < FROM_HZ {
                continue;
            }
            let k = i + 1;
            let amplitude = tone.shape.at(&polynomials)[axis];
            let g = amplitude * samples.slot_phasor(k, slot).conj();
            let first = (axis * samples.slots + slot) * n;
            let (re, im) = (&samples.frame_re[k * n..], &samples.frame_im[k * n..]);
            let row = &mut samples.shift_px[first..first + n];
            rows::less_tone(row, &re[..n], &im[..n], Complex::new(-g.re, -g.im));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_gaps_are_bridged_by_cubics_and_long_ones_stay() {
        let lines = Lines {
            count: 1,
            taps: 24,
            // Three rows at most: 0.3 turns of 1000 Hz are 300 µs.
            step_s: 7e-5,
            over_frames: false,
        };
        let curve = |i: usize| {
            let t = i as f32 * 0.1;
            2.0 + t - 0.5 * t * t + 0.3 * t * t * t
        };
        let gaps = [0, 3, 6, 7, 10, 11, 12, 15, 16, 17, 18];
        let mut line = [0.0; 24];
        for (i, value) in line.iter_mut().enumerate() {
            *value = if gaps.contains(&i) {
                f32::NAN
            } else {
                curve(i)
            };
        }
        lines.bridge(&mut line, |weights, known| dot(&weights, known));
        for (i, &value) in line.iter().enumerate() {
            let bridged = ![0, 15, 16, 17, 18].contains(&i);
            assert_eq!(value.is_finite(), bridged, "{i}");
            assert!(!bridged || (value - curve(i)).abs() < 1e-4, "{i}: {value}");
        }
        let mut none = [f32::NAN; 4];
        lines.bridge(&mut none, |weights, known| dot(&weights, known));
        lines.bridge(&mut [], |weights, known| dot(&weights, known));
        assert!(none.iter().all(|x| x.is_nan()));
    }
}
