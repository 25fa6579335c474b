//! The rows of a picture that know something, and places among them.

/// Beyond the rows that know something a shape is told this far, η: a border that has no neighbours to
/// compare with, not a sky.
const BORDER: f32 = 0.08;

/// The rows that know something, from the upper edge of the first, η = −1, to the lower edge of the last, 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KnowingRows {
    /// Rows of the part above them, and half of how many they are.
    pub(super) begin: f32,
    pub(super) half: f32,
    /// Rows of the part.
    pub(super) all: f32,
}

impl KnowingRows {
    /// η of a place, counted in rows from the part's upper edge.
    pub(super) fn eta(&self, place: f32) -> f32 {
        (place - self.begin) / self.half - 1.0
    }

    /// The row whose middle is nearest to a place among them.
    pub(crate) fn row(&self, eta: f32) -> u16 {
        // A row's middle is half a row below its upper edge.
        let row = self.begin + (eta + 1.0) * self.half - 0.5;
        libm::roundf(row.clamp(0.0, (self.all - 1.0).max(0.0))) as u16
    }

    /// Where the middles of the part's first and last row are, or the farthest places beyond the rows that know something
    /// for which a shape is told.
    pub(crate) fn ends(&self) -> [f32; 2] {
        [0.5, self.all - 0.5].map(|place| self.eta(place).clamp(-1.0 - BORDER, 1.0 + BORDER))
    }
}
