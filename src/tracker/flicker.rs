//! Follows the light from row to row, for what it does to the rows' times ([`Lateness`]).

use crate::{camera::Timing, timeline::Lateness};

/// Follows the light from row to row. Brightness is told by the factor that brings a line to its reference's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flicker {
    /// Decrease of that factor from row to row, averaged over some rows.
    slope: f32,
    /// Weight of the newest row in that.
    share: f32,
    /// No row of this frame was taken yet.
    fresh: bool,
    lateness: Lateness,
}

impl Flicker {
    /// Weight of the newest row, once there are enough.
    const SHARE: f32 = 0.25;

    pub(super) fn new(timing: &Timing) -> Self {
        Self {
            slope: 0.0,
            share: 1.0,
            fresh: true,
            lateness: Lateness::new(timing),
        }
    }

    pub(super) fn begin_frame(&mut self) {
        self.fresh = true;
    }

    /// The first rows of the frame are over.
    pub(super) fn is_settled(&self) -> bool {
        !self.fresh && self.share <= Self::SHARE
    }

    /// Whether the light may change so from a row to the next.
    #[inline(always)]
    pub(super) fn is_plausible(before: f32, now: f32) -> bool {
        Lateness::is_plausible(before, now)
    }

    /// Takes the factor of the row before and that of this one, where the light [`Flicker::is_settled`] and
    /// the change [`Flicker::is_plausible`].
    #[inline(always)]
    pub(super) fn add_settled(&mut self, before: f32, now: f32) {
        self.slope += (before - now - self.slope) * Self::SHARE;
    }

    /// Takes the factor of the row before and that of this one.
    pub(super) fn add(&mut self, before: f32, now: f32) {
        if self.fresh {
            // The row before it is that of another frame.
            self.fresh = false;
            self.share = 1.0;
        } else if Self::is_plausible(before, now) {
            self.slope += (before - now - self.slope) * self.share;
            if self.share > Self::SHARE {
                // 1, 1/2, 1/3, then 1/4: the plain mean at first.
                self.share = (self.share / (1.0 + self.share)).max(Self::SHARE);
            }
        }
    }

    /// How much later than its middle the mean time is of the exposure of a row with the factor `now`, ns;
    /// `None` for less than the pixels' noise may feign.
    pub(super) fn delay_ns(&self, now: f32) -> Option<f32> {
        self.lateness.delay_ns(self.slope, now)
    }
}
