//! When a row was exposed on average, under a light that changes while it is.
//!
//! A row collects light over its exposure; where the light grows, the later part counts for more. To
//! first order its mean time is later than the middle by (d ln I/dt)·T²/12. Left out, a lamp that flickers
//! by 25 % at 100 Hz puts side tones of 1 % beside a tone of 700 Hz.

use crate::camera::Timing;

/// The light does not change faster than this from row to row: what does is something else.
const STEEPEST: f32 = 0.05;

/// Follows the light from row to row. Brightness is told by the factor that brings a line to its reference's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flicker {
    /// Decrease of that factor from row to row, averaged over some rows.
    slope: f32,
    /// Weight of the newest row in that.
    share: f32,
    /// No row of this frame was taken yet.
    fresh: bool,
    /// T²/(12·line time): what a relative change of the light from row to row delays the exposure's mean
    /// time by, ns. 0 with a global shutter.
    ns_per_slope: f32,
}

impl Flicker {
    /// Weight of the newest row, once there are enough.
    const SHARE: f32 = 0.25;

    /// A steady light must leave the times as they are.
    const LEAST_NS: f32 = 1000.0;

    pub(super) fn new(timing: &Timing) -> Self {
        let exposure_ns = timing.exposure_ns() as f32;
        Self {
            slope: 0.0,
            share: 1.0,
            fresh: true,
            ns_per_slope: match timing.line_time_ps() {
                0 => 0.0,
                ps => exposure_ns * exposure_ns / (12.0 * ps as f32 / 1000.0),
            },
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
        (before - now).abs() <= STEEPEST * now
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
    #[inline(always)]
    pub(super) fn delay_ns(&self, now: f32) -> Option<f32> {
        let delay = self.slope * self.ns_per_slope;
        if delay.abs() < Self::LEAST_NS * now {
            None
        } else {
            Some(delay / now)
        }
    }
}
