//! What a tone's amplitude gains by the rows' being smeared out.
//!
//! A row is exposed for a while, in which the picture moves: it shows the reference smeared out by the path it took, most
//! in the middle of a tone's motion, least at its ends, and its reference is smeared out by the mean. So the ends read too
//! large. With the response q(d) = d − κd³/6 of the rows and a tone of amplitude A, of which the exposure leaves the share s:
//! the mean of q over the exposure is sA(1 − κA²/8) of the tone, the inverse of q at the mean of d gives back κ(sA)³/8,
//! and the reference's slope is less by the share κA²(1 − s²)/4. What is left is too large by
//!
//! ```text
//! κA²(1 − s²)/8
//! ```
//!
//! Of the other tones nothing is left on the mean. Against exact sums over made-up textures it is right to a tenth of
//! itself up to 1 px and s = 0.37. It holds while the motion is met by one place of the reference; beyond half a
//! pixel rows are measured against the next, the sign changes, and all that can be said is how much it may be.

use super::parameters::Model;
use crate::timeline::{Curvature, Group};

/// A motion of no more than this is measured against one place of the reference, px.
const ONE_PLACE_PX: f32 = 0.5;

/// Beyond so large a share the series does not hold.
const MOST: f32 = 0.1;

/// What is needed to correct the tones of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Smear<'a> {
    group: &'a Group,
    curvature_per_px2: f32,
    one_place: bool,
}

/// What an amplitude is to be multiplied by, and how much of it is in doubt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Correction {
    pub(crate) scale: f32,
    pub(crate) doubt: f32,
}

impl<'a> Smear<'a> {
    pub(crate) fn of(group: &'a Group, curvature: Curvature, model: &Model) -> Self {
        let sizes = model.tones.iter().map(|t| t.shape.power());
        let reach_px: f32 = sizes.map(crate::math::sqrtf).sum();
        Self {
            group,
            curvature_per_px2: curvature.per_px2(),
            one_place: reach_px <= ONE_PLACE_PX,
        }
    }

    /// For a tone of `amplitude_px`, before the exposure averaged it, at `hz`.
    pub(crate) fn correction(&self, amplitude_px: f32, hz: f32) -> Correction {
        let left = self.group.exposed(hz);
        let smear_px2 = amplitude_px * amplitude_px * (1.0 - left * left);
        let too_large = (0.125 * self.curvature_per_px2 * smear_px2).min(MOST);
        if self.one_place {
            Correction {
                scale: 1.0 / (1.0 + too_large),
                doubt: 0.0,
            }
        } else {
            Correction {
                scale: 1.0,
                doubt: too_large,
            }
        }
    }
}
