//! What a line and its reference both see when the picture has moved by whole pixels.

use core::ops::Range;

/// Further than any line is wide, px.
const FAR_PX: f32 = 16384.0;

/// The whole number of pixels of one colour nearest to `px`, in pixels. 0 for NaN; further than any line is
/// wide is not told apart.
#[inline]
pub(super) fn nearest_step(px: f32, stride: i32) -> i32 {
    super::nearest(px.clamp(-FAR_PX, FAR_PX) / stride as f32) * stride
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_of_one_colour_and_never_leave_their_type() {
        assert_eq!(
            [0.9, 1.1, -2.9, -3.1].map(|px| nearest_step(px, 2)),
            [0, 2, -2, -4]
        );
        assert_eq!([0.4, 0.6, -0.6].map(|px| nearest_step(px, 1)), [0, 1, -1]);
        for stride in [1, 2] {
            assert_eq!(nearest_step(f32::NAN, stride), 0);
            for huge in [3e9, f32::MAX, f32::INFINITY] {
                assert_eq!(nearest_step(huge, stride), 16384);
                assert_eq!(nearest_step(-huge, stride), -16384);
            }
        }
    }

    #[test]
    fn line_and_reference_share_what_both_see() {
        let right = Overlap::new(10, 3).unwrap();
        assert_eq!(
            (right.line, right.reference, right.unseen),
            (3..10, 0..7, 7..10)
        );
        let left = Overlap::new(10, -3).unwrap();
        assert_eq!(
            (left.line, left.reference, left.unseen),
            (0..7, 3..10, 0..3)
        );
        assert!(Overlap::new(10, 11).is_none() && Overlap::new(10, i32::MIN).is_none());
    }
}
