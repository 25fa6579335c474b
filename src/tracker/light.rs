//! The light: how bright a line is against its reference, and how that changes from row to row, for what it does
//! to the rows' times ([`Lateness`]).

use crate::{camera::Timing, timeline::Lateness};

/// The brightness is told by the factor that brings a line to its reference's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    /// That factor of the last line.
    pub(super) to_reference: f32,
    /// Decrease of that factor from row to row, averaged over some rows.
    slope: f32,
    /// Weight of the newest row in that.
    share: f32,
    /// The factor of the brightest rows while learning: how far the light rises above the reference's.
    brightest: f32,
    /// No row of this frame was taken yet.
    fresh: bool,
    lateness: Lateness,
}

impl Light {
    /// Light that rises by less than this over the reference's does not.
    const STEADY: f32 = 0.97;
    /// Light that rises higher than this was a flash, and is not expected again.
    const FLASH: f32 = 0.4;
    /// Weight of the newest row, once there are enough.
    const SHARE: f32 = 0.25;

    pub(super) fn new(timing: &Timing) -> Self {
        Self {
            to_reference: 1.0,
            slope: 0.0,
            share: 1.0,
            brightest: 1.0,
            fresh: true,
            lateness: Lateness::new(timing),
        }
    }

    /// Forgets the light.
    pub(super) fn relearn(&mut self) {
        (self.to_reference, self.brightest) = (1.0, 1.0);
    }

    /// A row is learned in the light of the last line. Each brighter one counts for a quarter, so that no single row
    /// decides.
    pub(super) fn note_learned(&mut self) {
        if (Self::FLASH..self.brightest).contains(&self.to_reference) {
            self.brightest += 0.25 * (self.to_reference - self.brightest);
        }
    }

    /// The share of a saturated pixel's value from which on a pixel of the reference is saturated in the brightest
    /// light, 0.4 to 1.
    pub(super) fn unsaturated_share(&self) -> f32 {
        match self.brightest < Self::STEADY {
            true => self.brightest,
            false => 1.0,
        }
    }

    pub(super) fn begin_frame(&mut self) {
        self.fresh = true;
    }

    /// The first rows of the frame are over.
    pub(super) fn is_settled(&self) -> bool {
        !self.fresh && self.share <= Self::SHARE
    }

    /// Whether the light may change so from the last line to the next.
    #[inline(always)]
    pub(super) fn may_become(&self, next: f32) -> bool {
        Lateness::is_plausible(self.to_reference, next)
    }

    /// Whether it may have changed so since the line before.
    #[inline(always)]
    pub(super) fn may_have_been(&self, before: f32) -> bool {
        Lateness::is_plausible(before, self.to_reference)
    }

    /// Takes the next line's factor, where the light [`Light::is_settled`] and [`Light::may_become`] that.
    #[inline(always)]
    pub(super) fn add_settled(&mut self, next: f32) {
        self.slope += (self.to_reference - next - self.slope) * Self::SHARE;
    }

    /// The factor was `before` with the line before the last one.
    pub(super) fn add_since(&mut self, before: f32) {
        let now = self.to_reference;
        if self.fresh {
            // The row before it is that of another frame.
            self.fresh = false;
            self.share = 1.0;
        } else if Lateness::is_plausible(before, now) {
            self.slope += (before - now - self.slope) * self.share;
            if self.share > Self::SHARE {
                // 1, 1/2, 1/3, then 1/4: the plain mean at first.
                self.share = (self.share / (1.0 + self.share)).max(Self::SHARE);
            }
        }
    }

    /// How much later than its middle the mean time is of the last line's exposure, ns; `None` for less than the
    /// pixels' noise may feign.
    pub(super) fn delay_ns(&self) -> Option<f32> {
        self.lateness.delay_ns(self.slope, self.to_reference)
    }
}
