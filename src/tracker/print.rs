//! Prints of lines, to know a line that was delivered twice.
//!
//! A sensor never delivers the same pixels twice: its noise differs. A converter, a driver or a codec does, and such
//! a frame is no new measurement; taken for one, it drags every amplitude. So each row keeps a print of its last
//! line. Where the sums of the inner product were taken they are the print, for nothing; elsewhere it is made of some
//! pixels. The prints of two rows may meet by chance, those of two frames do not.

use crate::camera::pixel::Pixel;

/// Pixels of a line that a print is made of.
const PIXELS: usize = 16;

/// Tells how a print was made.
const BY_PIXELS: u32 = 1;

/// The print of a line by Σ h·p and Σ p.
#[inline(always)]
pub(super) fn of_sums((product, pixels): (f32, f32)) -> u32 {
    (product.to_bits() ^ pixels.to_bits().rotate_left(16)) & !BY_PIXELS
}

/// The print was made of some pixels.
#[inline(always)]
pub(super) fn is_by_pixels(print: u32) -> bool {
    print & BY_PIXELS != 0
}

/// The print of a line by some of its pixels (FNV-1a, Fowler, Noll and Vo).
pub(super) fn of_pixels<P: Pixel>(pixels: &[P]) -> u32 {
    let step = (pixels.len() / PIXELS).max(1);
    let (mut print, mut next) = (0x811C_9DC5_u32, 0);
    // Half the instructions of `step_by`.
    while let Some(p) = pixels.get(next) {
        print = (print ^ u32::from(p.value())).wrapping_mul(0x0100_0193);
        next += step;
    }
    print | BY_PIXELS
}

/// What the rows of a frame say of its being a copy.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Copies {
    /// A row of this frame differs from that of the frame before: the others are measured, whatever their prints.
    fresh: bool,
    /// Rows that do not differ.
    repeated: u16,
}

impl Copies {
    /// The frame may be a copy: none of its rows differed so far.
    pub(super) fn may_be(&self) -> bool {
        !self.fresh
    }

    /// The frame seems to be one: some of its rows did not differ, and none did.
    pub(super) fn seems(&self) -> bool {
        self.repeated > 0 && !self.fresh
    }

    /// A row's print was compared.
    pub(super) fn note(&mut self, repeated: bool) {
        self.fresh |= !repeated;
        self.repeated = self.repeated.saturating_add(u16::from(repeated));
    }

    /// The frame has ended; true where it was a copy.
    pub(super) fn end_frame(&mut self) -> bool {
        core::mem::take(self).seems()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_more_is_another_print() {
        let line: [u8; 128] = core::array::from_fn(|x| (x * 37 % 251) as u8);
        let mut other = line;
        other[64] += 1;
        assert_eq!(of_pixels(&line), of_pixels(&line.clone()));
        assert_ne!(of_pixels(&line), of_pixels(&other));
        assert_ne!(of_sums((3.0, 900.0)), of_sums((3.0, 901.0)));
        assert_ne!(of_sums((3.0, 900.0)), of_sums((-3.0, 900.0)));
    }

    #[test]
    fn a_frame_is_a_copy_when_all_of_its_rows_are() {
        let mut copies = Copies::default();
        assert!(!copies.end_frame(), "no row was compared");
        (0..3).for_each(|_| copies.note(true));
        assert!(copies.may_be() && copies.end_frame());
        copies.note(true);
        copies.note(false);
        assert!(!copies.may_be() && !copies.end_frame());
    }
}
