//! Where the next line is expected.

/// The information-weighted mean of the last rows: one that knows little is carried by its neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prediction {
    weighted_px: f32,
    information: f32,
}

impl Prediction {
    /// Weight of what was known a row ago.
    const KEEP: f32 = 0.75;

    /// Expected shift, px.
    #[inline]
    pub(super) fn shift_px(&self) -> f32 {
        if self.information > 0.0 {
            self.weighted_px / self.information
        } else {
            0.0
        }
    }

    /// It is sure to about a tenth of a pixel.
    pub(super) fn is_sure(&self) -> bool {
        self.information > 100.0
    }

    #[inline]
    pub(super) fn add(&mut self, shift_px: f32, information: f32) {
        self.weighted_px = self.weighted_px * Self::KEEP + shift_px * information;
        self.information = self.information * Self::KEEP + information;
    }

    /// The picture jumped: what was expected before is worth nothing.
    pub(super) fn jump(&mut self, shift_px: f32, information: f32) {
        self.weighted_px = shift_px * information;
        self.information = information;
    }

    /// Moves the expectation with the reference.
    pub(super) fn move_by(&mut self, px: f32) {
        self.weighted_px += px * self.information;
    }
}
