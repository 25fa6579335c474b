//! When a row was exposed on average, under a light that changes while it is.
//!
//! A row collects light over its exposure; where the light grows, the later part counts for more. To
//! first order its mean time is later than the middle by (d ln I/dt)·T²/12. Left out, a lamp that flickers
//! by 25 % at 100 Hz puts side tones of 1 % beside a tone of 700 Hz.
//!
//! Brightness is told by the factor that brings a line to its reference's.

use crate::camera::Timing;

/// The light does not change faster than this from row to row: what does is something else.
const STEEPEST: f32 = 0.05;

/// A steady light must leave the times as they are, ns.
const LEAST_NS: f32 = 1000.0;

/// What a change of the light does to the times of a camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lateness {
    /// T²/(12·line time): what a relative change of the light from row to row delays the exposure's mean
    /// time by, ns. 0 with a global shutter.
    ns_per_slope: f32,
}

impl Lateness {
    pub(crate) fn new(timing: &Timing) -> Self {
        let exposure_ns = timing.exposure_ns() as f32;
        Self {
            ns_per_slope: match timing.line_time_ps() {
                0 => 0.0,
                ps => exposure_ns * exposure_ns / (12.0 * ps as f32 / 1000.0),
            },
        }
    }

    /// Whether the light may change so from a row to the next.
    #[inline(always)]
    pub(crate) fn is_plausible(before: f32, now: f32) -> bool {
        (before - now).abs() <= STEEPEST * now
    }

    /// How much later than their middles `rows` rows were exposed, from the factor of the first to that of the row behind
    /// them, ns; 0 for less than the pixels' noise may feign, `None` where the light may not change so.
    #[inline(always)]
    pub(crate) fn late_ns(self, before: f32, now: f32, rows: f32) -> Option<f32> {
        let (change, whole) = (before - now, rows * now);
        let delay = change * self.ns_per_slope;
        if delay.abs() < LEAST_NS * whole {
            Some(0.0)
        } else if change.abs() <= STEEPEST * whole {
            Some(delay / whole)
        } else {
            None
        }
    }

    /// How much later than its middle the mean time is of the exposure of a row with the factor `now`, which
    /// decreases by `slope` from row to row, ns; `None` for less than the pixels' noise may feign.
    #[inline(always)]
    pub(crate) fn delay_ns(self, slope: f32, now: f32) -> Option<f32> {
        let delay = slope * self.ns_per_slope;
        if delay.abs() < LEAST_NS * now {
            None
        } else {
            Some(delay / now)
        }
    }
}
