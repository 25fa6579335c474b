//! What a line and its reference both see when the picture has moved by whole pixels.

use core::ops::Range;

/// Which pixels of a line meet which of its reference when it is read `whole` pixels to the right:
/// p\[x + whole\] meets r\[x\].
pub(super) struct Overlap {
    pub(super) line: Range<usize>,
    pub(super) reference: Range<usize>,
    /// The part of the reference that the line does not show.
    pub(super) unseen: Range<usize>,
}

impl Overlap {
    /// `None` when nothing is left.
    #[inline]
    pub(super) fn new(width: usize, whole: i32) -> Option<Self> {
        let by = whole.unsigned_abs() as usize;
        let rest = width.checked_sub(by)?;
        let (ahead, behind) = (by..width, 0..rest);
        Some(if whole >= 0 {
            Self {
                line: ahead,
                reference: behind,
                unseen: rest..width,
            }
        } else {
            Self {
                line: behind,
                reference: ahead,
                unseen: 0..by,
            }
        })
    }
}
