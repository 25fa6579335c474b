//! Where the next line is expected.

/// The information-weighted mean of the last rows: one that knows little is carried by its neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prediction {
    shift_px: f32,
    information: f32,
}

impl Prediction {
    /// Weight of what was known a row ago.
    const KEEP: f32 = 0.75;

    /// Expected shift, px.
    #[inline]
    pub(super) fn shift_px(&self) -> f32 {
        self.shift_px
    }

    /// It is sure to about a tenth of a pixel.
    pub(super) fn is_sure(&self) -> bool {
        self.information > 100.0
    }

    #[inline]
    pub(super) fn add(&mut self, shift_px: f32, information: f32) {
        self.information = self.information * Self::KEEP + information;
        self.shift_px += (shift_px - self.shift_px) * (information / self.information);
    }

    /// The picture jumped: what was expected before is worth nothing.
    pub(super) fn jump(&mut self, shift_px: f32, information: f32) {
        self.shift_px = shift_px;
        self.information = information;
    }

    /// Moves the expectation with the reference.
    pub(super) fn move_by(&mut self, px: f32) {
        self.shift_px += px;
    }
}
