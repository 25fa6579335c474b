//! Raw lines of a sensor, Bayer or mono, as the tracker reads them.
//!
//! A sensor sends 8, 10, 12 or 16 bits a pixel. Packed (MIPI CSI-2 specification, section "RAW image data";
//! Linux calls it SRGGB10P, SRGGB12P), some pixels share bytes:
//!
//! | format | pixels in bytes | bytes |
//! | --- | --- | --- |
//! | 10 packed | 4 in 5 | four upper eights, then the four lower pairs of bits, first pixel lowest |
//! | 12 packed | 2 in 3 | two upper eights, then the two lower fours, first pixel lower |
//!
//! Unpacked, a pixel is a little-endian 16-bit word, right-aligned (10, 12) or using it all (16; the
//! Raspberry Pi 5 shifts every depth up to that). 8-bit lines are read where they are.
//!
//! ```
//! use rowtone::camera::{Pixels, RawFormat};
//!
//! let bytes = [0x80, 0x00, 0xff, 0x01, 0b11_10_01_00]; // as the camera writes them
//! let mut words = [0; 4];
//! let line = RawFormat::Packed10.line(&bytes, 4, &mut words)?;
//! assert_eq!(line, Pixels::U16(&[0x200, 0x001, 0x3fe, 0x007]));
//! # Ok::<(), rowtone::camera::RawError>(())
//! ```

mod upper;

use crate::camera::Pixels;
use crate::kernel::spread;
use core::fmt;

/// How the pixels of a raw line lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawFormat {
    /// A byte a pixel.
    Raw8,
    /// 4 pixels of 10 bits in 5 bytes.
    Packed10,
    /// 2 pixels of 12 bits in 3 bytes.
    Packed12,
    /// 10 bits in the lower end of a 16-bit word.
    Raw10,
    /// 12 bits in the lower end of a 16-bit word.
    Raw12,
    /// A whole 16-bit word.
    Raw16,
}

impl RawFormat {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Raw8,
        Self::Packed10,
        Self::Packed12,
        Self::Raw10,
        Self::Raw12,
        Self::Raw16,
    ];

    /// Bits of a pixel, 8 to 16.
    pub const fn bits(self) -> u8 {
        match self {
            Self::Raw8 => 8,
            Self::Packed10 | Self::Raw10 => 10,
            Self::Packed12 | Self::Raw12 => 12,
            Self::Raw16 => 16,
        }
    }

    /// Pixels that share bytes: a part of a line starts at a multiple of this.
    pub const fn group(self) -> usize {
        match self {
            Self::Packed10 => 4,
            Self::Packed12 => 2,
            _ => 1,
        }
    }

    /// Bytes that `pixels` pixels take, a last group begun counted whole. Saturates.
    #[inline]
    pub const fn bytes(self, pixels: usize) -> usize {
        // By constants, a division is a multiplication.
        match self {
            Self::Raw8 => pixels,
            Self::Packed10 => pixels.div_ceil(4).saturating_mul(5),
            Self::Packed12 => pixels.div_ceil(2).saturating_mul(3),
            Self::Raw10 | Self::Raw12 | Self::Raw16 => pixels.saturating_mul(2),
        }
    }

    /// The first `width` pixels of a line. 8-bit pixels stay where they are, others are unpacked into
    /// `words`. Bytes beyond the line (its padding) are not looked at.
    ///
    /// # Errors
    /// [`RawError`] when the line or the words are too few.
    #[inline]
    pub fn line<'a>(
        self,
        bytes: &'a [u8],
        width: usize,
        words: &'a mut [u16],
    ) -> Result<Pixels<'a>, RawError> {
        let needs = self.bytes(width);
        let has = bytes.len();
        let bytes = bytes.get(..needs).ok_or(RawError::Line { has, needs })?;
        if self == Self::Raw8 {
            return Ok(Pixels::U8(bytes));
        }
        let has = words.len();
        let words = words
            .get_mut(..width)
            .ok_or(RawError::Words { has, needs: width })?;
        match self {
            Self::Raw8 => {}
            Self::Packed10 => {
                let done = spread::unpack_10(bytes, words);
                let (bytes, words) = (&bytes[done / 4 * 5..], &mut words[done..]);
                unpack(bytes, words, four_of_10);
            }
            Self::Packed12 => unpack(bytes, words, |&[a, b, low]: &[u8; 3]| {
                let pixel = |high, low| (u16::from(high) << 4) | u16::from(low);
                [pixel(a, low & 15), pixel(b, low >> 4)]
            }),
            // What stands above a right-aligned pixel is no part of it.
            Self::Raw10 => unpack(bytes, words, |&w: &[u8; 2]| [u16::from_le_bytes(w) & 0x3ff]),
            Self::Raw12 => unpack(bytes, words, |&w: &[u8; 2]| [u16::from_le_bytes(w) & 0xfff]),
            Self::Raw16 => unpack(bytes, words, |&w: &[u8; 2]| [u16::from_le_bytes(w)]),
        }
        Ok(Pixels::U16(words))
    }
}

/// Four pixels of 10 bits, as four numbers in one of 64 bits.
#[inline(always)]
fn four_of_10(&[a, b, c, d, low]: &[u8; 5]) -> [u16; 4] {
    let high = u64::from(u32::from_le_bytes([a, b, c, d]));
    let high = (high | high << 16) & 0x0000_ffff_0000_ffff;
    let high = (high | high << 8) & 0x00ff_00ff_00ff_00ff;
    // Each pair of bits at the lower end of its pixel.
    let low = u64::from(low);
    let low = (low | low << 14 | low << 28 | low << 42) & 0x0003_0003_0003_0003;
    let all = high << 2 | low;
    [0, 16, 32, 48].map(|shift| (all >> shift) as u16)
}

/// Unpacks groups of `BYTES` bytes into groups of `PIXELS` pixels; a last group may be needed in part.
#[inline(always)]
fn unpack<T: Copy, const BYTES: usize, const PIXELS: usize>(
    bytes: &[u8],
    pixels: &mut [T],
    group: impl Fn(&[u8; BYTES]) -> [T; PIXELS],
) {
    let (groups, _) = bytes.as_chunks::<BYTES>();
    let (whole, part) = pixels.as_chunks_mut::<PIXELS>();
    for (to, from) in whole.iter_mut().zip(groups) {
        *to = group(from);
    }
    if let Some(last) = groups.get(whole.len()) {
        part.iter_mut()
            .zip(group(last))
            .for_each(|(to, from)| *to = from);
    }
}

/// Why a line could not be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawError {
    /// The camera gave fewer bytes than the line has.
    Line {
        /// Bytes given.
        has: usize,
        /// Bytes of a line.
        needs: usize,
    },
    /// The lent words are fewer than the line's pixels.
    Words {
        /// Words lent.
        has: usize,
        /// Pixels of the line.
        needs: usize,
    },
}

impl fmt::Display for RawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { has, needs } => write!(f, "the line has {has} bytes and needs {needs}"),
            Self::Words { has, needs } => write!(f, "{has} words were lent and {needs} are needed"),
        }
    }
}

impl core::error::Error for RawError {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    extern crate std;
    use std::{vec, vec::Vec};

    /// As the sensor packs them.
    pub(super) fn pack(format: RawFormat, pixels: &[u16]) -> Vec<u8> {
        let at = |group: &[u16], i: usize| group.get(i).copied().unwrap_or(0);
        match format {
            RawFormat::Raw8 => pixels.iter().map(|&p| p as u8).collect(),
            RawFormat::Packed10 => pixels
                .chunks(4)
                .flat_map(|g| {
                    let p = [at(g, 0), at(g, 1), at(g, 2), at(g, 3)];
                    let low = (0..4).fold(0, |low, i| low | (p[i] & 3) << (2 * i));
                    [p[0] >> 2, p[1] >> 2, p[2] >> 2, p[3] >> 2, low].map(|v| v as u8)
                })
                .collect(),
            RawFormat::Packed12 => pixels
                .chunks(2)
                .flat_map(|g| {
                    let (a, b) = (at(g, 0), at(g, 1));
                    [a >> 4, b >> 4, (a & 15) | (b & 15) << 4].map(|v| v as u8)
                })
                .collect(),
            _ => pixels.iter().flat_map(|p| p.to_le_bytes()).collect(),
        }
    }

    fn words(pixels: Pixels<'_>) -> Vec<u16> {
        pixels.values().collect()
    }

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(
            format in prop::sample::select(&RawFormat::ALL[..]),
            pixels in prop::collection::vec(any::<u16>(), 0..300),
            padding in 0usize..40,
        ) {
            let pixels: Vec<u16> = pixels.iter().map(|p| p >> (16 - format.bits())).collect();
            let mut bytes = pack(format, &pixels);
            prop_assert_eq!(bytes.len(), format.bytes(pixels.len()));
            bytes.resize(bytes.len() + padding, 0xA5);
            let mut buffer = vec![0xDEAD; pixels.len() + padding];
            let line = format.line(&bytes, pixels.len(), &mut buffer).unwrap();
            prop_assert_eq!(words(line), pixels);
        }

        #[test]
        fn a_part_starts_at_a_group(
            format in prop::sample::select(&RawFormat::ALL[..]),
            pixels in prop::collection::vec(any::<u16>(), 16..70),
            first in 0usize..4,
        ) {
            let pixels: Vec<u16> = pixels.iter().map(|p| p >> (16 - format.bits())).collect();
            let bytes = pack(format, &pixels);
            let first = first * format.group();
            let mut buffer = vec![0; pixels.len()];
            let from = &bytes[format.bytes(first)..];
            let line = format.line(from, pixels.len() - first, &mut buffer).unwrap();
            prop_assert_eq!(words(line), pixels[first..].to_vec());
        }

        #[test]
        fn too_little_of_anything_is_refused(
            format in prop::sample::select(&RawFormat::ALL[..]),
            bytes in prop::collection::vec(any::<u8>(), 0..100),
            width in prop_oneof![0usize..100, Just(usize::MAX), Just(usize::MAX / 2)],
            lent in 0usize..100,
        ) {
            let mut upper = vec![0; lent];
            let upper = format.upper_line(&bytes, width, &mut upper).map(|line| line.len());
            let mut buffer = vec![0; lent];
            let all = format.line(&bytes, width, &mut buffer).map(|line| line.len());
            if !matches!(all, Err(RawError::Words { .. })) {
                prop_assert_eq!(upper, all);
            }
            match format.line(&bytes, width, &mut buffer) {
                Ok(line) => prop_assert_eq!(line.len(), width),
                Err(RawError::Line { has, needs }) => prop_assert!(has < needs),
                Err(RawError::Words { has, needs }) => prop_assert!(has < needs),
            }
        }
    }

    #[test]
    fn junk_above_a_right_aligned_pixel_is_cut_off() {
        let mut buffer = [0; 1];
        let line = RawFormat::Raw10.line(&[0xff, 0xff], 1, &mut buffer);
        assert_eq!(line, Ok(Pixels::U16(&[0x3ff])));
    }
}
