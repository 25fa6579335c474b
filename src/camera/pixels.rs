//! The pixels of a line, as the kernels read them.

use crate::kernel::{Kernel, LineSums, spread::Spread};

/// The pixels of a line as the kernels read them.
///
/// Deeper pixels need no scaling: a line is only ever compared with its own reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pixels<'a> {
    /// 8-bit luma or raw.
    U8(&'a [u8]),
    /// 9- to 16-bit luma or raw, one pixel a word. Packed pixels are unpacked to it
    /// ([`RawFormat::line`](crate::camera::RawFormat::line)).
    U16(&'a [u16]),
    /// The upper eight bits of packed or 16-bit raw pixels
    /// ([`RawFormat::upper_line`](crate::camera::RawFormat::upper_line)).
    Upper(UpperBytes<'a>),
}

impl<'a> Pixels<'a> {
    /// Pixels in the line.
    pub const fn len(&self) -> usize {
        match self {
            Self::U8(p) => p.len(),
            Self::U16(p) => p.len(),
            Self::Upper(p) => p.len(),
        }
    }

    /// No pixel at all.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// `width` pixels from `first` on; `None` where the line ends before, or where `first` lies within pixels that share
    /// bytes.
    #[inline]
    pub fn part(&self, first: usize, width: usize) -> Option<Self> {
        let all = first..first.checked_add(width)?;
        Some(match self {
            Self::U8(p) => Self::U8(p.get(all)?),
            Self::U16(p) => Self::U16(p.get(all)?),
            Self::Upper(p) => Self::Upper(p.part(first, width)?),
        })
    }

    /// The pixels' values, one after the other.
    pub fn values(&self) -> impl Iterator<Item = u16> + use<'a> {
        let (mut bytes, mut words, mut upper) = (None, None, None);
        match *self {
            Self::U8(p) => bytes = Some(p.iter().map(|&p| u16::from(p))),
            Self::U16(p) => words = Some(p.iter().copied()),
            Self::Upper(p) => upper = Some(p.iter().map(u16::from)),
        }
        let bytes = bytes.into_iter().flatten();
        bytes
            .chain(words.into_iter().flatten())
            .chain(upper.into_iter().flatten())
    }
}

/// A line of packed or 16-bit pixels of which the upper eight bits count: one byte a pixel, beside bytes that do not.
/// Made by [`RawFormat::upper_line`](crate::camera::RawFormat::upper_line).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpperBytes<'a> {
    /// From the first pixel's group on; goes on behind the last where the camera's buffer does.
    bytes: &'a [u8],
    width: usize,
    spread: Spread,
}

impl<'a> UpperBytes<'a> {
    /// Bytes behind a line that [`UpperBytes::gather`] likes to have.
    pub const SPARE: usize = 16;

    /// `bytes` from the first pixel's group on must hold `width` pixels.
    #[inline]
    pub(crate) const fn new(bytes: &'a [u8], width: usize, spread: Spread) -> Self {
        Self {
            bytes,
            width,
            spread,
        }
    }

    /// Pixels of the line.
    pub const fn len(&self) -> usize {
        self.width
    }

    /// No pixel at all.
    pub const fn is_empty(&self) -> bool {
        self.width == 0
    }

    /// The pixels, one after the other.
    pub fn iter(&self) -> impl Iterator<Item = u8> + use<'a> {
        self.spread.pixels(self.bytes, 0).take(self.width)
    }

    /// `width` pixels from `first` on; `None` where the line ends before, or where `first` lies within a group.
    pub fn part(&self, first: usize, width: usize) -> Option<Self> {
        if first.checked_add(width)? > self.width {
            return None;
        }
        let bytes = self.bytes.get(self.spread.group_at(first)?..)?;
        Some(Self {
            bytes,
            width,
            ..*self
        })
    }

    /// Σ h·p and Σ p with a row of coefficients that is kept, one a pixel from the first on.
    #[inline(always)]
    pub(crate) fn sums(&self, kernel: Kernel, row: &[i8]) -> LineSums {
        kernel.kept_spread(self.spread, self.bytes, row)
    }

    /// Brings the pixels together in `line`. `None` where that is shorter. Best is [`UpperBytes::SPARE`] more than
    /// the line: whole vectors are written then, and what stands behind the line is overwritten.
    pub fn gather<'b>(&self, kernel: Kernel, line: &'b mut [u8]) -> Option<&'b [u8]> {
        line.get(..self.width)?;
        let done = kernel.gather(self.spread, self.bytes, line, self.width);
        let line = line.get_mut(..self.width)?;
        let rest = line.get_mut(done..)?;
        let pixels = self.spread.pixels(self.bytes, done);
        rest.iter_mut().zip(pixels).for_each(|(to, p)| *to = p);
        Some(line)
    }
}
