//! What the stages need of a pixel, whatever its depth.

use crate::kernel::Kernel;

/// A pixel of 8 or of up to 16 bits.
pub(crate) trait Pixel: Copy {
    /// Its value.
    fn value(self) -> u16;
    /// Σ h·p and Σ p of a line, of at most 8192 pixels, with the whole row of coefficients that is kept.
    fn sums(kernel: Kernel, pixels: &[Self], row: &[i8]) -> (f32, f32);
    /// Σ h·p, Σ h'·p and Σ p of such a line with both rows of coefficients that are kept.
    fn both_sums(kernel: Kernel, pixels: &[Self], row: &[i8], second: &[i8]) -> (f32, f32, f32);
    /// The same of a part, and as many columns of the row from `from` on.
    fn part_sums(kernel: Kernel, pixels: &[Self], row: &[i8], from: usize) -> (f32, f32);
    /// Keeps a line for later in a scratch of f32, of which only the bits are used: one for two pixels is
    /// enough.
    fn pack(pixels: &[Self], to: &mut [f32]);
    /// Pixel `x` of a line that was packed; 0 beyond its end.
    fn unpack(from: &[f32], x: usize) -> u16;
}

impl Pixel for u8 {
    #[inline(always)]
    fn value(self) -> u16 {
        u16::from(self)
    }
    #[inline(always)]
    fn sums(kernel: Kernel, pixels: &[Self], row: &[i8]) -> (f32, f32) {
        let sums = kernel.kept_u8(pixels, row);
        (sums.product as f32, sums.pixels as f32)
    }
    #[inline(always)]
    fn both_sums(kernel: Kernel, pixels: &[Self], row: &[i8], second: &[i8]) -> (f32, f32, f32) {
        let (sums, second) = kernel.kept_both_u8(pixels, row, second);
        (sums.product as f32, second as f32, sums.pixels as f32)
    }
    #[inline(always)]
    fn part_sums(kernel: Kernel, pixels: &[Self], row: &[i8], from: usize) -> (f32, f32) {
        let sums = kernel.kept_part_u8(pixels, row, from);
        (sums.product as f32, sums.pixels as f32)
    }
    fn pack(pixels: &[Self], to: &mut [f32]) {
        let (fours, rest) = pixels.as_chunks::<4>();
        let mut to = to.iter_mut();
        // The words first: then `to` goes on where they end.
        for (&four, to) in fours.iter().zip(&mut to) {
            *to = f32::from_bits(u32::from_le_bytes(four));
        }
        if let Some(to) = to.next() {
            let byte = |k: usize| rest.get(k).copied().unwrap_or(0);
            *to = f32::from_bits(u32::from_le_bytes([byte(0), byte(1), byte(2), 0]));
        }
    }
    fn unpack(from: &[f32], x: usize) -> u16 {
        let word = from.get(x / 4).map_or(0, |four| four.to_bits());
        u16::from((word >> (8 * (x % 4))) as u8)
    }
}

impl Pixel for u16 {
    #[inline(always)]
    fn value(self) -> u16 {
        self
    }
    #[inline(always)]
    fn sums(kernel: Kernel, pixels: &[Self], row: &[i8]) -> (f32, f32) {
        Self::part_sums(kernel, pixels, row, 0)
    }
    #[inline(always)]
    fn both_sums(kernel: Kernel, pixels: &[Self], row: &[i8], second: &[i8]) -> (f32, f32, f32) {
        let (product, sum) = Self::sums(kernel, pixels, row);
        (product, Self::sums(kernel, pixels, second).0, sum)
    }
    #[inline(always)]
    fn part_sums(kernel: Kernel, pixels: &[Self], row: &[i8], from: usize) -> (f32, f32) {
        let sums = kernel.kept_part_u16(pixels, row, from);
        (sums.product as f32, sums.pixels as f32)
    }
    fn pack(pixels: &[Self], to: &mut [f32]) {
        for (to, p) in to.iter_mut().zip(pixels.chunks(2)) {
            let low = p.first().map_or(0, |&p| u32::from(p));
            let high = p.get(1).map_or(0, |&p| u32::from(p));
            *to = f32::from_bits(low | high << 16);
        }
    }
    fn unpack(from: &[f32], x: usize) -> u16 {
        let word = from.get(x / 2).map_or(0, |two| two.to_bits());
        (word >> (16 * (x % 2))) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::Pixel;

    #[test]
    fn what_was_packed_comes_out() {
        let mut scratch = [0.0; 16];
        // Every byte, and so every bit pattern of an f32's exponent, NaNs too.
        for first in 0..=u8::MAX {
            let pixels: [u8; 29] = core::array::from_fn(|x| first.wrapping_sub(x as u8));
            u8::pack(&pixels, &mut scratch);
            let deep: [u16; 29] = core::array::from_fn(|x| (u16::from(first) * 257) ^ x as u16);
            assert!((0..29).all(|x| u8::unpack(&scratch, x) == u16::from(pixels[x])));
            u16::pack(&deep, &mut scratch);
            assert!((0..29).all(|x| u16::unpack(&scratch, x) == deep[x]));
        }
        assert_eq!(
            (u8::unpack(&scratch, 64), u16::unpack(&scratch, 32)),
            (0, 0)
        );
    }
}
