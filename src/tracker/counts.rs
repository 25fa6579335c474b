//! Every line is counted, whatever became of it.

use super::Outcome;

/// What became of the lines since the tracker was made. All saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Measured.
    pub measured: u64,
    /// Used for learning.
    pub learning: u64,
    /// Without enough texture.
    pub no_texture: u64,
    /// Unlike their reference.
    pub disturbed: u64,
    /// Of another width, or of a row that is not there.
    pub misfit: u64,
    /// How often the scene changed and the reference was learned anew.
    pub relearned: u32,
}

impl Counts {
    #[inline]
    pub(super) fn add(&mut self, outcome: &Outcome) {
        let count = match outcome {
            Outcome::Measured(_) => &mut self.measured,
            Outcome::Learning => &mut self.learning,
            Outcome::NoTexture => &mut self.no_texture,
            Outcome::Disturbed => &mut self.disturbed,
            Outcome::Misfit => &mut self.misfit,
        };
        *count = count.saturating_add(1);
    }
}
