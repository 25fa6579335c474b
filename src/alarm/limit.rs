//! One limit: which windows are above it, and whether it is passed.

use super::{Baseline, Limit, Reading};

/// A limit's memory of the last windows.
#[derive(Clone, Debug)]
pub(super) struct LimitWatch {
    limit: Limit,
    /// Bit n: the window n evidences ago was at the limit or above, or was below where it clears.
    above: u32,
    below: u32,
    passed: bool,
}

impl LimitWatch {
    pub(super) fn new(limit: Limit) -> Self {
        Self {
            limit,
            above: 0,
            below: 0,
            passed: false,
        }
    }

    pub(super) fn is_learned(&self) -> bool {
        matches!(self.limit, Limit::Learned { .. })
    }

    pub(super) fn is_passed(&self) -> bool {
        self.passed
    }

    /// Forgets all windows: the machine has stopped.
    pub(super) fn clear(&mut self) {
        *self = Self::new(self.limit);
    }

    /// Where it is, in the quantity's unit, and where it clears; `None` until its baseline is learned.
    pub(super) fn at(&self, baseline: Option<Baseline>, hysteresis: f32) -> Option<(f32, f32)> {
        match self.limit {
            Limit::Fixed(limit) => Some((limit, limit * (1.0 - hysteresis))),
            Limit::Learned { share, spreads } => {
                let Baseline { centre, spread } = baseline?;
                let distance = (share * centre).max(spreads * spread);
                Some((centre + distance, centre + distance * (1.0 - hysteresis)))
            }
        }
    }

    /// Takes a window. Whether it was evidence: above the limit or below.
    pub(super) fn window(&mut self, reading: Reading, at: (f32, f32), delay: u8) -> bool {
        let (limit, clears) = at;
        let (above, below) = match reading {
            Reading::Value(v) => (v >= limit, v < clears),
            Reading::AtMost(v) if v < limit => (false, v < clears),
            Reading::AtLeast(v) if v >= limit => (true, false),
            _ => return false,
        };
        let delay = u32::from(delay.clamp(1, super::MAX_DELAY));
        // The last 2·delay − 1 windows, 31 at most.
        let kept = (1 << (2 * delay - 1)) - 1;
        self.above = ((self.above << 1) | u32::from(above)) & kept;
        self.below = ((self.below << 1) | u32::from(below)) & kept;
        if self.above.count_ones() >= delay {
            self.passed = true;
        } else if self.below.count_ones() >= delay {
            self.passed = false;
        }
        true
    }
}
