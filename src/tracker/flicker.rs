//! When a row was exposed on average, under a light that changes while it is.
//!
//! A row collects light over its exposure; where the light grows, the later part counts for more. To
//! first order its mean time is later than the middle by (d ln I/dt)·T²/12. Left out, a lamp that flickers
//! by 25 % at 100 Hz puts side tones of 1 % beside a tone of 700 Hz.

/// Follows the light from row to row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Flicker {
    /// Brightness against the reference in the row before; none at the start of a frame.
    before: Option<f32>,
    /// Relative change of the light from row to row, averaged over some rows.
    slope: f32,
    /// Weight of the newest row in that.
    share: f32,
}

impl Flicker {
    /// Weight of the newest row, once there are enough.
    const SHARE: f32 = 0.25;

    /// The light does not change faster than this from row to row: what does is something else.
    const STEEPEST: f32 = 0.05;

    /// A steady light must leave the times as they are.
    const LEAST_NS: i64 = 1000;

    pub(super) fn begin_frame(&mut self) {
        self.before = None;
        self.share = 1.0;
    }

    /// Takes the brightness of a row, as the factor that brings it to its reference's.
    #[inline]
    pub(super) fn add(&mut self, to_reference: f32) {
        if let Some(before) = self.before {
            let change = before / to_reference - 1.0;
            if change.abs() < Self::STEEPEST {
                self.slope += (change - self.slope) * self.share;
                // 1, 1/2, 1/3, then 1/4: the plain mean at first.
                self.share = (self.share / (1.0 + self.share)).max(Self::SHARE);
            }
        }
        self.before = Some(to_reference);
    }

    /// How much later than its middle the exposure's mean time is, ns; 0 for less than the pixels' noise
    /// may feign.
    #[inline]
    pub(super) fn delay_ns(&self, ns_per_slope: f32) -> i64 {
        let delay_ns = (self.slope * ns_per_slope) as i64;
        if delay_ns.abs() < Self::LEAST_NS {
            0
        } else {
            delay_ns
        }
    }
}
