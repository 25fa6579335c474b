//! The samples of one window as a matrix: a row a slot, a column a frame.
//!
//! Sample times are sums, t(n, s) = t_n + τ_s: frame n begins at t_n, slot s is exposed τ_s later. So the
//! phasor of a tone at a sample is a product of one a frame and one a slot, and a pass over the samples
//! costs two multiplications a tone. What is left of a sample's own time (rows of a group weigh
//! differently from frame to frame) is its skew, kept in small steps and applied to first order.

use crate::math::since;
use crate::report::Warnings;
use crate::timeline::{Curvature, Group, Sample, Spread, Tally, Vertical};

/// A sample is skewed where its time is off its frame's and slot's by more than this many steps.
pub(crate) const NO_SKEW: u16 = 16;

/// Samples as they are collected: shift, weight and skew, 8 bytes a sample, and 6 more where they know both axes.
#[derive(Debug)]
pub struct SampleBuffer<'a> {
    /// Shifts, px; twice as many where they know both axes, those along y behind the others.
    pub shift_px: &'a mut [f32],
    /// Weights, the upper half of an `f32`'s bits; 0 where there is no sample. As many as there are shifts.
    pub weight: &'a mut [u16],
    /// Time beyond that of frame and slot, in steps of the skew unit.
    pub skew: &'a mut [i16],
    /// How the rows of each slot lie in time, one a slot.
    pub spread: &'a mut [Spread],
    /// What of a motion along y each slot takes for one along x, one a slot; empty where the samples know x alone.
    pub couplings: &'a mut [SlotCoupling],
    /// The frames.
    pub frames: &'a mut [FrameMark],
}

/// How the two measurements of a slot's samples see a motion (x, y): constants of its rows' texture, as
/// [`crate::timeline::Vertical`] has them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotCoupling {
    /// κ: the first one is x + κ·y. No unit.
    pub coupling: f32,
    /// And so much of the speed along y, ns.
    pub coupling_delay_ns: f32,
    /// The second one is y and so much of its speed, ns.
    pub delay_ns: f32,
}

impl SlotCoupling {
    /// Nothing of the one in the other.
    pub(crate) const NONE: Self = Self {
        coupling: 0.0,
        coupling_delay_ns: 0.0,
        delay_ns: 0.0,
    };

    /// That of one sample; what is no number is 0.
    fn of(vertical: &Vertical) -> Self {
        let known = |v: f32| if v.abs() < MOST_COUPLING { v } else { 0.0 };
        Self {
            coupling: known(vertical.coupling),
            coupling_delay_ns: known(vertical.coupling_delay_ns),
            delay_ns: known(vertical.delay_ns),
        }
    }

    /// After one more sample.
    pub(crate) fn follow(&mut self, vertical: &Vertical, first: bool) {
        let now = Self::of(vertical);
        let share = if first { 1.0 } else { FOLLOW };
        self.coupling += share * (now.coupling - self.coupling);
        self.coupling_delay_ns += share * (now.coupling_delay_ns - self.coupling_delay_ns);
        self.delay_ns += share * (now.delay_ns - self.delay_ns);
    }
}

/// Couplings and delays (ns) beyond this are nonsense.
const MOST_COUPLING: f32 = 1e9;

/// One frame of a [`SampleBuffer`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameMark {
    /// Number of the frame, counted by the camera.
    pub number: u32,
    /// Start of exposure of its first row, ns on the camera's clock.
    pub start_ns: i64,
    /// What became of its rows.
    pub tally: Tally,
}

impl SampleBuffer<'_> {
    /// How many frames of `slots` samples fit.
    pub(crate) fn frame_capacity(&self, slots: usize) -> usize {
        let series = self.channels(slots) * slots.max(1);
        let samples = self.shift_px.len().min(self.weight.len()) / series;
        if self.spread.len() < slots {
            return 0;
        }
        samples
            .min(self.skew.len() / slots.max(1))
            .min(self.frames.len())
    }

    /// 2 where there is room for both axes, else 1.
    pub(crate) fn channels(&self, slots: usize) -> usize {
        if slots > 0 && self.couplings.len() >= slots {
            2
        } else {
            1
        }
    }
}

/// The upper half of the bits: 8 significant bits are plenty for a weight.
pub(crate) fn pack_weight(weight: f32) -> u16 {
    if weight > 0.0 && weight.is_finite() {
        ((weight.to_bits().saturating_add(0x8000) >> 16) as u16).min(0x7f00)
    } else {
        0
    }
}

/// Back from [`pack_weight`].
pub(crate) fn unpack_weight(weight: u16) -> f32 {
    f32::from_bits(u32::from(weight) << 16)
}

/// Steps in which the skew is kept, ns: a whole group is 16 384 steps or less.
pub(crate) fn skew_unit_ns(group: &Group) -> i64 {
    group.spacing_ns() / 16_384 + 1
}

/// How fast a slot's spread follows what its samples say, as a share a frame: rows that something passes
/// before are not the slot's.
const FOLLOW: f32 = 0.25;

/// A sample whose variance is off its slot's by more than this share of an even one's lacks rows that others have.
const RAGGED: f32 = 0.15;

/// What is known of a slot's spread after one more sample; what is no spread changes nothing. Says whether the sample is
/// like the slot's others: one that lacks rows sees a fast tone at another size and time, which looks like tones
/// beside it.
pub(crate) fn follow_spread(known: &mut Spread, now: Spread, first: bool, even: &Spread) -> bool {
    let off = (now.variance_ns2 - known.variance_ns2).abs();
    // A single row cannot lack one: what its variance is off by is rounding.
    let single = even.variance_ns2 <= 0.0;
    let usual = first || single || off <= RAGGED * even.variance_ns2;
    let share = if first { 1.0 } else { FOLLOW };
    let variance = known.variance_ns2 + share * (now.variance_ns2 - known.variance_ns2);
    let third = known.third_ns3 + share * (now.third_ns3 - known.third_ns3);
    if variance >= 0.0 && variance.is_finite() && third.is_finite() {
        *known = Spread {
            variance_ns2: variance,
            third_ns3: third,
        };
    }
    usual
}

/// A sample's time beyond that of its frame and slot, in skew units; saturates.
pub(crate) fn skew_of(group: &Group, sample: &Sample, start_ns: i64) -> i16 {
    let late = since(
        since(sample.time_ns, start_ns),
        group.middle_ns(sample.slot),
    );
    (late / skew_unit_ns(group)).clamp(i64::from(i16::MIN), i64::from(i16::MAX)) as i16
}

/// What a window is, apart from its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WindowMark {
    /// Number of the window, from 0.
    pub seq: u32,
    /// Start of the first frame that may be in it, ns on the camera's clock.
    pub start_ns: i64,
    /// End of the window: start of the first frame that may not be in it, ns on the camera's clock.
    pub end_ns: i64,
    /// The camera's clock when the stream began, ns.
    pub origin_ns: i64,
    /// Frames in it.
    pub frames: u16,
    /// Frames missing in it, by their numbers.
    pub lost_frames: u16,
    /// Rows measured in it.
    pub lines: u32,
    /// Of its last sample's rows.
    pub curvature: Curvature,
    /// Shorter than asked for.
    pub short: bool,
    /// What its rows warn of.
    pub warnings: Warnings,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Timing;

    /// Variances of so many ns², in turn, of groups of so many rows of 10 µs: which samples are taken.
    fn taken<const N: usize>(rows_per_sample: u16, variances_ns2: [f32; N]) -> [bool; N] {
        let group = Group::new(Timing::new(10_000_000, 0, 120).unwrap(), rows_per_sample).unwrap();
        let mut known = Spread::default();
        let mut first = true;
        variances_ns2.map(|variance_ns2| {
            let now = Spread {
                variance_ns2,
                third_ns3: 0.0,
            };
            let first = core::mem::take(&mut first);
            follow_spread(&mut known, now, first, &group.even_spread())
        })
    }

    #[test]
    fn a_group_that_lacks_rows_is_left_out_and_a_single_row_cannot() {
        let whole = 8.25e8;
        assert_eq!(
            taken(10, [whole, whole, 0.6 * whole, whole]),
            [true, true, false, true]
        );
        // What is left of x·x − x² by rounding.
        assert_eq!(taken(1, [0.0, 6.0, 0.0, 12.0, 0.0]), [true; 5]);
    }
}
