//! When a row was exposed on average, under a light that changes while it is.
//!
//! A row collects light over its exposure; where the light grows, the later part counts for more. To
//! first order its mean time is later than the middle by (d ln I/dt)·T²/12. Left out, a lamp that flickers
//! by 25 % at 100 Hz puts side tones of 1 % beside a tone of 700 Hz.

/// The light does not change faster than this from row to row: what does is something else.
pub(super) const STEEPEST: f32 = 0.05;

/// Follows the light from row to row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Flicker {
    /// Relative change of the light from row to row, averaged over some rows.
    slope: f32,
    /// Weight of the newest row in that.
    share: f32,
    /// No row of this frame was taken yet.
    fresh: bool,
}

impl Flicker {
    /// Weight of the newest row, once there are enough.
    const SHARE: f32 = 0.25;

    /// A steady light must leave the times as they are.
    const LEAST_NS: u32 = 1000;

    pub(super) fn begin_frame(&mut self) {
        self.fresh = true;
    }

    /// Takes how much brighter a row is than the one before it, as a share.
    #[inline(always)]
    pub(super) fn add(&mut self, brighter: f32) {
        if self.fresh {
            // The row before it is that of another frame.
            self.fresh = false;
            self.share = 1.0;
        } else if brighter.abs() < STEEPEST {
            self.slope += (brighter - self.slope) * self.share;
            if self.share > Self::SHARE {
                // 1, 1/2, 1/3, then 1/4: the plain mean at first.
                self.share = (self.share / (1.0 + self.share)).max(Self::SHARE);
            }
        }
    }

    /// How much later than its middle the exposure's mean time is, ns; 0 for less than the pixels' noise
    /// may feign.
    #[inline]
    pub(super) fn delay_ns(&self, ns_per_slope: f32) -> i32 {
        // The cast saturates, at 2 s.
        let delay_ns = (self.slope * ns_per_slope) as i32;
        if delay_ns.unsigned_abs() < Self::LEAST_NS {
            0
        } else {
            delay_ns
        }
    }
}
