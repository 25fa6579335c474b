//! What learning keeps of rows and columns while the reference is not finished.

use super::static_pixels::Watched;

/// What learning keeps of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowLearning {
    /// Mean shift of the frames of the first round, px: the middle of the motion.
    pub(crate) shift_px: f32,
    /// Frames that the reference is the mean of.
    pub(crate) frames: u16,
    /// Mean variance of the paths along which they were exposed, px²/1024.
    #[cfg(feature = "long-exposure")]
    smear: u16,
    /// Mean brightness of the lines against the reference.
    pub(super) light: f32,
    /// Its sharpest pixels, and those that are left out.
    pub(super) watched: Watched,
}

/// What learning keeps of a column.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColumnLearning {
    /// The first pixel seen.
    pub(super) first: Option<u16>,
    /// How many differed from it.
    pub(super) changes: u16,
}

impl ColumnLearning {
    pub(crate) const EMPTY: Self = Self {
        first: None,
        changes: 0,
    };
}

impl RowLearning {
    pub(crate) const EMPTY: Self = Self {
        shift_px: 0.0,
        frames: 0,
        #[cfg(feature = "long-exposure")]
        smear: 0,
        light: 0.0,
        watched: Watched::EMPTY,
    };

    /// A line of it was averaged in.
    pub(super) fn was_seen(&self) -> bool {
        self.light > 0.0
    }

    pub(crate) fn frames(&self) -> u16 {
        self.frames.max(1)
    }

    /// The next frame's line was exposed along a path of this variance.
    #[cfg(feature = "long-exposure")]
    pub(crate) fn add_smear(&mut self, px2: f32) {
        let before = f32::from(self.smear) / 1024.0;
        let mean = before + (px2 - before) / f32::from(self.frames.saturating_add(1));
        self.smear = (mean * 1024.0 + 0.5) as u16;
    }

    /// Of the frames that the reference is the mean of, px²; `None` while there are none.
    #[cfg(feature = "long-exposure")]
    pub(crate) fn smear_px2(&self) -> Option<f32> {
        (self.frames > 0).then_some(f32::from(self.smear) / 1024.0)
    }
}
