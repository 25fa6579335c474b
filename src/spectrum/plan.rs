//! Two frame rates, so that nothing stays hidden.
//!
//! A vibration at a multiple of the frame rate stands still in the picture and is taken for the reference. At a
//! slightly other rate it moves; a window with frames of both sees every frequency.

use core::fmt;

/// Two frame rates to alternate between, half a window each.
///
/// ```
/// use rowtone::spectrum::FrameRatePlan;
/// let plan = FrameRatePlan::new(60.0, 1.0, 1000.0)?;
/// assert_eq!(plan.fps(0.1), 60.0);
/// assert!(plan.fps(0.6) < 60.0 && plan.fps(1.1) == 60.0);
/// # Ok::<(), rowtone::spectrum::PlanError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRatePlan {
    fps: [f32; 2],
    half_s: f32,
}

impl FrameRatePlan {
    /// A plan for a camera that makes at most `max_fps`, windows of `window_s` s, and vibrations up to `max_hz`.
    ///
    /// The second rate is lower by δ, so that the lines of the two halves (each 2/window wide) do not meet at the
    /// first multiple, k·δ ≥ 2.5/window, and two multiples k and k+1 of the two rates meet nowhere below `max_hz`
    /// where δ allows it (fps/δ multiples are apart).
    ///
    /// # Errors
    /// [`PlanError`] when a number is not above 0 or the window holds less than eight frames.
    pub fn new(max_fps: f32, window_s: f32, max_hz: f32) -> Result<Self, PlanError> {
        for value in [max_fps, window_s, max_hz] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(PlanError::NotPositive(value));
            }
        }
        if max_fps * window_s < 8.0 {
            return Err(PlanError::FewFrames(max_fps * window_s));
        }
        let apart = 2.5 / window_s;
        let multiples = libm::ceilf(max_hz / max_fps) + 1.0;
        // With δ = fps/(m + ½) the rates' multiples pass each other midway near the m-th, without meeting.
        let widest = max_fps / (multiples + 0.5);
        let delta = apart.max(widest.min(0.1 * max_fps)).min(0.3 * max_fps);
        Ok(Self {
            fps: [max_fps, max_fps - delta],
            half_s: 0.5 * window_s,
        })
    }

    /// The two rates, Hz; the higher first.
    pub const fn rates(&self) -> [f32; 2] {
        self.fps
    }

    /// The rate wanted `elapsed_s` seconds after the plan began, Hz.
    pub fn fps(&self, elapsed_s: f32) -> f32 {
        let half = libm::floorf(elapsed_s.max(0.0) / self.half_s);
        if libm::fmodf(half, 2.0) < 1.0 {
            self.fps[0]
        } else {
            self.fps[1]
        }
    }
}

/// Why a [`FrameRatePlan`] was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlanError {
    /// Rates and times must be above 0.
    NotPositive(f32),
    /// A window of two rates needs at least eight frames.
    FewFrames(f32),
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotPositive(v) => write!(f, "rates and times of a plan must be above 0, not {v}"),
            Self::FewFrames(v) => write!(
                f,
                "a window of two frame rates needs at least 8 frames, not {v}: make it longer"
            ),
        }
    }
}

impl core::error::Error for PlanError {}
