//! A line as the tracker takes it: side by side in memory, or brought together only when it must be.

use crate::{camera::UpperBytes, camera::pixel::Pixel, kernel::Kernel};

/// The pixels of a line, as far as most lines need them.
pub(super) trait Summed {
    /// How many they are.
    fn len(&self) -> usize;
    /// Σ h·p and Σ p of all of them, as [`Pixel::sums`].
    fn sums(&self, kernel: Kernel, row: &[i8]) -> (f32, f32);
    /// Σ h·p, Σ h'·p and Σ p, as [`Pixel::both_sums`].
    fn both_sums(&self, kernel: Kernel, row: &[i8], second: &[i8]) -> (f32, f32, f32);
}

/// The pixels of a line.
pub(super) trait Row: Summed {
    /// One of them.
    type P: Pixel;
    /// All of them, side by side.
    fn pixels(&mut self) -> &[Self::P];
}

impl<P: Pixel> Summed for &[P] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[P]>::len(self)
    }
    #[inline(always)]
    fn sums(&self, kernel: Kernel, row: &[i8]) -> (f32, f32) {
        P::sums(kernel, self, row)
    }
    #[inline(always)]
    fn both_sums(&self, kernel: Kernel, row: &[i8], second: &[i8]) -> (f32, f32, f32) {
        P::both_sums(kernel, self, row, second)
    }
}

impl<P: Pixel> Row for &[P] {
    type P = P;
    #[inline(always)]
    fn pixels(&mut self) -> &[P] {
        self
    }
}

/// Upper bytes that lie among others. The common case, small motion, takes one inner product and reads them where
/// they are; whatever else comes has them copied, once.
#[derive(Debug)]
pub(super) struct Scattered<'a> {
    upper: UpperBytes<'a>,
    kernel: Kernel,
    /// Room for the line.
    room: &'a mut [u8],
    together: bool,
}

impl<'a> Scattered<'a> {
    /// `None` where `room` is less than the line.
    pub(super) fn new(upper: UpperBytes<'a>, kernel: Kernel, room: &'a mut [u8]) -> Option<Self> {
        (room.len() >= upper.len()).then_some(Self {
            upper,
            kernel,
            room,
            together: false,
        })
    }
}

impl Summed for UpperBytes<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        UpperBytes::len(self)
    }
    #[inline(always)]
    fn sums(&self, kernel: Kernel, row: &[i8]) -> (f32, f32) {
        let sums = UpperBytes::sums(self, kernel, row);
        (sums.product as f32, sums.pixels as f32)
    }
    #[inline(always)]
    fn both_sums(&self, kernel: Kernel, row: &[i8], second: &[i8]) -> (f32, f32, f32) {
        let (product, pixels) = Summed::sums(self, kernel, row);
        (product, Summed::sums(self, kernel, second).0, pixels)
    }
}

impl Summed for Scattered<'_> {
    fn len(&self) -> usize {
        self.upper.len()
    }
    fn sums(&self, kernel: Kernel, row: &[i8]) -> (f32, f32) {
        Summed::sums(&self.upper, kernel, row)
    }
    fn both_sums(&self, kernel: Kernel, row: &[i8], second: &[i8]) -> (f32, f32, f32) {
        Summed::both_sums(&self.upper, kernel, row, second)
    }
}

impl Row for Scattered<'_> {
    type P = u8;
    #[inline(never)]
    fn pixels(&mut self) -> &[u8] {
        if !self.together {
            self.upper.gather(self.kernel, self.room);
            self.together = true;
        }
        self.room.get(..self.upper.len()).unwrap_or_default()
    }
}
