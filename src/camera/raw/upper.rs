//! The upper eight bits of deeper pixels, read where they lie.

use super::{RawError, RawFormat};
use crate::camera::{Pixels, UpperBytes};
use crate::kernel::spread::Spread;

impl RawFormat {
    /// How the upper bytes lie, where they need only be picked.
    const fn spread(self) -> Option<Spread> {
        match self {
            Self::Packed10 => Some(Spread::Packed10),
            Self::Packed12 => Some(Spread::Packed12),
            Self::Raw16 => Some(Spread::Words),
            Self::Raw8 | Self::Raw10 | Self::Raw12 => None,
        }
    }

    /// The first `width` pixels of a line, of each its upper eight bits: half the bytes to work on, and packed
    /// pixels need no unpacking. They are read where they lie; only those of right-aligned words must be
    /// shifted, into `upper`. Bytes behind the line may be looked at and count for nothing. What is cut off is worth a rounding
    /// noise of 0.29 of an eight-bit step, well below the light's own noise unless the picture is dark.
    ///
    /// ```
    /// use rowtone::camera::{Pixels, RawFormat};
    ///
    /// let bytes = [0x80, 0x00, 0xff, 0x01, 0b11_10_01_00]; // four pixels of 10 bits
    /// let line = RawFormat::Packed10.upper_line(&bytes, 4, &mut [])?;
    /// assert!(line.values().eq([0x80, 0x00, 0xff, 0x01]));
    /// # Ok::<(), rowtone::camera::RawError>(())
    /// ```
    ///
    /// # Errors
    /// [`RawError`] when the line is too short, or `upper` where it is needed.
    #[inline]
    pub fn upper_line<'a>(
        self,
        bytes: &'a [u8],
        width: usize,
        upper: &'a mut [u8],
    ) -> Result<Pixels<'a>, RawError> {
        let needs = self.bytes(width);
        let has = bytes.len();
        let line = bytes.get(..needs).ok_or(RawError::Line { has, needs })?;
        if let Some(spread) = self.spread() {
            return Ok(Pixels::Upper(UpperBytes::new(bytes, width, spread)));
        }
        let shift = match self {
            Self::Raw10 => 2,
            Self::Raw12 => 4,
            _ => return Ok(Pixels::U8(line)),
        };
        let has = upper.len();
        let upper = upper
            .get_mut(..width)
            .ok_or(RawError::Words { has, needs: width })?;
        let (words, _) = line.as_chunks::<2>();
        for (to, &word) in upper.iter_mut().zip(words) {
            *to = (u16::from_le_bytes(word) >> shift) as u8;
        }
        Ok(Pixels::U8(upper))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::pack;
    use super::*;
    use crate::kernel::Kernel;
    use proptest::prelude::*;
    extern crate std;
    use std::{vec, vec::Vec};

    proptest! {
        #[test]
        fn the_upper_bytes_are_those_of_the_pixels(
            format in prop::sample::select(&RawFormat::ALL[..]),
            pixels in prop::collection::vec(any::<u16>(), 0..170),
            padding in 0usize..40,
            spare in 0usize..40,
        ) {
            let pixels: Vec<u16> = pixels.iter().map(|p| p >> (16 - format.bits())).collect();
            let mut bytes = pack(format, &pixels);
            bytes.resize(bytes.len() + padding, 0xA5);
            let upper: Vec<u8> = pixels.iter().map(|p| (p >> (format.bits() - 8)) as u8).collect();
            let mut buffer = vec![0xDE; pixels.len()];
            let line = format.upper_line(&bytes, pixels.len(), &mut buffer).unwrap();
            prop_assert!(line.values().eq(upper.iter().map(|&p| u16::from(p))));
            let Pixels::Upper(line) = line else {
                return Ok(());
            };
            for kernel in Kernel::all() {
                let mut together = vec![0xDE; pixels.len() + spare];
                prop_assert_eq!(line.gather(kernel, &mut together), Some(&upper[..]));
            }
            prop_assert_eq!(line.gather(Kernel::PORTABLE, &mut vec![0; line.len().saturating_sub(1)]).is_some(), line.is_empty());
        }

        #[test]
        fn a_part_is_that_of_the_pixels(
            format in prop::sample::select(&[RawFormat::Packed10, RawFormat::Packed12, RawFormat::Raw16][..]),
            pixels in prop::collection::vec(any::<u8>(), 0..70),
            first in 0usize..80,
            width in 0usize..80,
        ) {
            let deep: Vec<u16> = pixels.iter().map(|&p| u16::from(p) << (format.bits() - 8)).collect();
            let bytes = pack(format, &deep);
            let Pixels::Upper(line) = format.upper_line(&bytes, pixels.len(), &mut []).unwrap() else {
                panic!("nothing is copied");
            };
            let expected = pixels.get(first..first + width).filter(|_| first % format.group() == 0);
            let part = line.part(first, width).map(|part| part.iter().collect::<Vec<_>>());
            prop_assert_eq!(part.as_deref(), expected);
        }
    }
}
