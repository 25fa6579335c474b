//! A window's samples taken over: weights of a mean of one, times relative to the middle of the window.
//!
//! From here on the line side may go on with its own memory, and all arithmetic is in `f32`: times are nanoseconds
//! in 64 bits until the window's middle is taken off.

use super::knowing::KnowingRows;
use super::storage::EstimatorStorage;
use super::window::{NO_SKEW, SampleBuffer, pack_weight, skew_unit_ns, unpack_weight};
use crate::math::since;
use crate::timeline::Group;

/// What a window is, as far as the fit wants to know.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Loaded {
    pub(crate) frames: usize,
    /// Some samples have times of their own.
    pub(crate) skewed: bool,
    /// Sum of weights.
    pub(crate) total_weight: f32,
    /// Samples with a weight.
    pub(crate) count: u32,
    /// From the first sample to the last, s.
    pub(crate) length_s: f32,
    /// Frame rate, Hz; 0 with less than two frames.
    pub(crate) fps: f32,
    /// Where times are 0 in the fit, ns on the camera's clock.
    pub(crate) zero_ns: i64,
    /// All frames came at that one rate.
    pub(crate) steady_rate: bool,
    /// Where the rows are among those that know something.
    pub(crate) rows: KnowingRows,
}

impl Loaded {
    /// Copies `frames` frames from `from` into `storage`: `column(i)` is the column of frame i, rows are `stride` apart.
    pub(crate) fn take(
        storage: &mut EstimatorStorage<'_>,
        group: &Group,
        frames: usize,
        from: &SampleBuffer<'_>,
        stride: usize,
        column: impl Fn(usize) -> usize,
    ) -> Self {
        let slots = usize::from(group.slots());
        let to = &mut storage.samples;
        let channels = to.channels(slots);
        let known = from.channels(slots) * slots;
        for series in 0..channels * slots {
            for i in 0..frames {
                let (a, b) = (series * stride + column(i), series * frames + i);
                let there = series < known;
                let weight = from.weight.get(a).filter(|_| there).copied().unwrap_or(0);
                to.weight[b] = weight;
                to.shift_px[b] = match from.shift_px.get(a) {
                    Some(x) if weight > 0 => *x,
                    _ => 0.0,
                };
                if series < slots {
                    to.skew[b] = from.skew.get(a).copied().unwrap_or(0);
                }
            }
        }
        for slot in 0..slots {
            to.spread[slot] = from.spread.get(slot).copied().unwrap_or_default();
            if let Some(coupling) = to.couplings.get_mut(slot) {
                *coupling = from.couplings.get(slot).copied().unwrap_or_default();
            }
        }
        for i in 0..frames {
            to.frames[i] = from.frames.get(column(i)).copied().unwrap_or_default();
        }
        let mut loaded = Self {
            frames,
            ..Self::default()
        };
        loaded.normalise(&mut storage.samples.weight[..channels * frames * slots]);
        loaded.place(storage, group, slots);
        loaded.rate(&storage.samples.frames[..frames]);
        loaded
    }

    /// Weights to a mean of one: their sums stay within an `f32`.
    fn normalise(&mut self, weight: &mut [u16]) {
        let mut count = 0_u32;
        let mut sum = 0.0;
        for &w in weight.iter().filter(|&&w| w > 0) {
            sum += unpack_weight(w) * 1e-20;
            count += 1;
        }
        let mean = sum / count.max(1) as f32;
        let scale = if mean > 0.0 { 1e-20 / mean } else { 0.0 };
        for w in weight.iter_mut() {
            // A sample far beyond all others would be all that counts; and one far below, nothing.
            *w = pack_weight(unpack_weight(*w) * scale);
        }
        self.count = count;
    }

    /// Times of frames and slots, their weights.
    fn place(&mut self, s: &mut EstimatorStorage<'_>, group: &Group, slots: usize) {
        let frames = self.frames;
        let (frame_t, rest) = s.frame_rows.split_at_mut(frames);
        let frame_weight = &mut rest[..frames];
        let (slot_t, rest) = s.slot_rows.split_at_mut(slots);
        let (slot_eta, rest) = rest.split_at_mut(slots);
        let two = s.samples.channels(slots) > 1;
        let (slot_weight, rest) = rest.split_at_mut(slots);
        let second_weight = &mut rest[..if two { slots } else { 0 }];
        frame_weight.fill(0.0);
        let unit = skew_unit_ns(group);
        let (mut late, mut total) = (0.0_f32, 0.0_f32);
        for slot in 0..slots {
            let (mut sum, mut skew_sum, mut second) = (0.0, 0.0, 0.0);
            for i in 0..frames {
                let at = slot * frames + i;
                let first = unpack_weight(s.samples.weight[at]);
                let other = if two {
                    unpack_weight(s.samples.weight[at + slots * frames])
                } else {
                    0.0
                };
                let w = first + other;
                sum += w;
                second += other;
                skew_sum += w * f32::from(s.samples.skew[at]);
                frame_weight[i] += w;
                if w <= 0.0 {
                    s.samples.skew[at] = 0;
                }
            }
            slot_weight[slot] = sum - second;
            if let Some(weight) = second_weight.get_mut(slot) {
                *weight = second;
            }
            let skew = if sum > 0.0 {
                libm::roundf(skew_sum / sum) as i16
            } else {
                0
            };
            // The slot's usual skew goes into its own time; only what differs from frame to frame stays.
            for i in 0..frames {
                let at = slot * frames + i;
                let second = two && s.samples.weight[at + slots * frames] > 0;
                if s.samples.weight[at] > 0 || second {
                    let left = s.samples.skew[at].saturating_sub(skew);
                    s.samples.skew[at] = left;
                    self.skewed |= left.unsigned_abs() > NO_SKEW;
                }
            }
            s.slot_ns[slot] = group.middle_ns(slot as u16) + i64::from(skew) * unit;
            late += sum * s.slot_ns[slot] as f32;
            total += sum;
        }
        let knows = |slot: usize| slot_weight[slot] + second_weight.get(slot).unwrap_or(&0.0);
        self.rows = spread_over_rows(slot_eta, knows, total, group);
        let middle = if total > 0.0 {
            (late / total) as i64
        } else {
            0
        };
        let first = s.samples.frames[..frames].iter().map(|f| f.start_ns).min();
        let last = s.samples.frames[..frames].iter().map(|f| f.start_ns).max();
        let (first, last) = (first.unwrap_or(0), last.unwrap_or(0));
        let begin = first.saturating_add(s.slot_ns.first().copied().unwrap_or(0));
        let end = last.saturating_add(s.slot_ns[..slots].last().copied().unwrap_or(0));
        let span_ns = since(end, begin).max(1);
        let center = since(begin.saturating_add(span_ns / 2), middle);
        self.zero_ns = center.saturating_add(middle);
        self.length_s = span_ns as f32 * 1e-9;
        self.total_weight = total;
        for i in 0..frames {
            s.frame_ns[i] = since(s.samples.frames[i].start_ns, center);
            frame_t[i] = s.frame_ns[i] as f32 / span_ns as f32;
        }
        for slot in 0..slots {
            s.slot_ns[slot] -= middle;
            slot_t[slot] = s.slot_ns[slot] as f32 / span_ns as f32;
        }
    }

    /// The frame rate from frame numbers and times, and whether the window has a single one.
    fn rate(&mut self, marks: &[super::window::FrameMark]) {
        let (Some(a), Some(b)) = (marks.first(), marks.last()) else {
            return;
        };
        let periods = b.number.wrapping_sub(a.number) as i32;
        let span = since(b.start_ns, a.start_ns);
        if periods <= 0 || span <= 0 {
            return;
        }
        let period_ns = span / i64::from(periods);
        let left = span % i64::from(periods);
        let slack = (period_ns / 8).max(1);
        self.fps = periods as f32 / (span as f32 * 1e-9);
        self.steady_rate = marks.iter().all(|m| {
            let n = i64::from(m.number.wrapping_sub(a.number));
            // span·n/periods, which would not fit 64 bits on the way.
            let expected = period_ns
                .wrapping_mul(n)
                .wrapping_add(left * n / i64::from(periods));
            since(m.start_ns, a.start_ns)
                .wrapping_sub(expected)
                .unsigned_abs()
                < slack.unsigned_abs()
        });
    }
}

/// A slot that knows less than this share of the mean does not count among the rows that know something.
const KNOWS: f32 = 0.02;

/// Where the slots' middles are among the rows that know something.
fn spread_over_rows(
    eta: &mut [f32],
    weight: impl Fn(usize) -> f32,
    total: f32,
    group: &Group,
) -> KnowingRows {
    let slots = eta.len();
    let mean = total / slots.max(1) as f32;
    let knows = |slot: &usize| weight(*slot) > KNOWS * mean;
    let first = (0..slots).find(knows).unwrap_or(0);
    let last = (0..slots).rfind(knows).unwrap_or(slots.saturating_sub(1));
    let rows = f32::from(group.rows_per_sample());
    let begin = first as f32 * rows;
    let end = last as f32 * rows + f32::from(group.rows_of(last as u16));
    let knowing = KnowingRows {
        begin,
        half: (0.5 * (end - begin)).max(0.5),
        all: f32::from(group.timing().rows()),
    };
    for (slot, eta) in eta.iter_mut().enumerate() {
        let middle = slot as f32 * rows + 0.5 * f32::from(group.rows_of(slot as u16));
        *eta = knowing.eta(middle).clamp(-1.0, 1.0);
    }
    knowing
}
