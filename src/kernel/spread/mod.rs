//! Pixels of a byte that do not lie side by side: the upper bytes of packed and of 16-bit pixels.
//!
//! Their inner product is taken where they lie ([`Kernel::sums_spread`]); where a line is needed as a whole
//! they are brought together first ([`Kernel::gather`]). Both are a shuffle that picks the wanted bytes of a vector.

// Plain Rust needs none of the shuffles.
#![cfg_attr(
    not(any(
        target_arch = "x86_64",
        all(target_arch = "aarch64", target_feature = "neon")
    )),
    allow(unused_imports, unused_variables)
)]

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
mod aarch64;
#[cfg(target_arch = "x86_64")]
mod x86_64;

use super::{Kernel, Kind, Sums};

/// How the bytes lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spread {
    /// The upper eight bits of 10-bit pixels: four bytes of every five.
    Packed10,
    /// The upper eight bits of 12-bit pixels: two bytes of every three.
    Packed12,
    /// The upper eight bits of little-endian 16-bit pixels.
    Words,
}

/// Groups of `BYTES` bytes, in each of which `PIXELS` wanted ones, a divisor of 8, come one after the other from `FIRST`
/// on.
pub(super) struct Groups<const PIXELS: usize, const BYTES: usize, const FIRST: usize>;

/// Side by side.
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
pub(super) type Bytes = Groups<1, 1, 0>;
type Packed10 = Groups<4, 5, 0>;
type Packed12 = Groups<2, 3, 0>;
type Words = Groups<1, 2, 1>;

#[cfg_attr(
    not(any(
        target_arch = "x86_64",
        all(target_arch = "aarch64", target_feature = "neon")
    )),
    allow(dead_code)
)]
impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// Pixels and bytes of a group, and the first wanted byte.
    const GROUP: (usize, usize, usize) = (PIXELS, BYTES, FIRST);

    /// Where pixel `x` lies.
    const fn place(x: usize) -> usize {
        x / PIXELS * BYTES + FIRST + x % PIXELS
    }

    fn gather(kernel: Kernel, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        match kernel.0 {
            // SAFETY: `fastest` made these kinds after it asked the processor for AVX2, which has SSSE3 in it.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 | Kind::Avx512 { .. } => unsafe { Self::gather_ssse3(from, to, pixels) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon | Kind::NeonDot => unsafe { Self::gather_neon(from, to, pixels) },
            _ => 0,
        }
    }

    #[inline(always)]
    fn sums(kernel: Kernel, spread: Spread, bytes: &[u8], coefficients: &[i8]) -> Sums {
        let (sums, done) = match kernel.0 {
            // SAFETY: `fastest` made this kind after it asked for all of AVX-512 that this needs.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 { vbmi: true } => return unsafe { Self::sums_64(bytes, coefficients) },
            // SAFETY: `fastest` made these kinds after it asked the processor for AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 | Kind::Avx512 { .. } => unsafe { Self::sums_32(bytes, coefficients) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon => return unsafe { Self::sums_neon(bytes, coefficients) },
            // SAFETY: `fastest` made this kind after it asked for the dot product.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::NeonDot => return unsafe { Self::sums_dot(bytes, coefficients) },
            _ => (Sums::default(), 0),
        };
        if done >= coefficients.len() {
            return sums;
        }
        spread.sums_from(done, bytes, coefficients, sums)
    }
}

impl Spread {
    /// Pixels and bytes of a group, and the first wanted byte.
    const fn group(self) -> (usize, usize, usize) {
        match self {
            Self::Packed10 => Packed10::GROUP,
            Self::Packed12 => Packed12::GROUP,
            Self::Words => Words::GROUP,
        }
    }

    /// Where pixel `x` begins a group, its first byte.
    pub(crate) fn group_at(self, x: usize) -> Option<usize> {
        let (pixels, bytes, _) = self.group();
        x.is_multiple_of(pixels).then_some(x / pixels * bytes)
    }

    /// `sums` of the pixels before `first`, and those of the others, in plain Rust.
    #[inline(never)]
    fn sums_from(self, first: usize, bytes: &[u8], coefficients: &[i8], sums: Sums) -> Sums {
        let rest = coefficients.get(first..).unwrap_or_default();
        let pairs = self.pixels(bytes, first).zip(rest);
        pairs.fold(sums, |sums, (p, &h)| Sums {
            product: sums.product + i64::from(p) * i64::from(h),
            pixels: sums.pixels + u64::from(p),
        })
    }

    /// The pixels from `first` on, one after the other, of the whole groups that are there.
    pub(crate) fn pixels(self, bytes: &[u8], first: usize) -> impl Iterator<Item = u8> {
        let (pixels, group_bytes, wanted) = self.group();
        let end = bytes.len() / group_bytes * pixels;
        // One of 1, 2, 4: a microcontroller and a desktop both shift faster than they divide.
        let shift = pixels.trailing_zeros();
        let place = move |x: usize| (x >> shift) * group_bytes + (x & (pixels - 1)) + wanted;
        (first..end).map(move |x| bytes.get(place(x)).copied().unwrap_or_default())
    }
}

impl Kernel {
    /// Brings `pixels` pixels together, in steps that read and write more than they need where there is room: what is
    /// behind them in `to` is then overwritten. How many are done: all, or whole groups.
    pub(crate) fn gather(self, spread: Spread, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        match spread {
            Spread::Packed10 => Packed10::gather(self, from, to, pixels),
            Spread::Packed12 => Packed12::gather(self, from, to, pixels),
            Spread::Words => Words::gather(self, from, to, pixels),
        }
    }

    /// Sums over pixels where they lie, as many as there are coefficients; where `bytes` ends before, so do the sums.
    /// It may go on behind the line: then whole vectors can be read to the line's end. As [`Kernel::sums_u8`] else.
    #[inline(always)]
    pub(crate) fn sums_spread(self, spread: Spread, bytes: &[u8], coefficients: &[i8]) -> Sums {
        match spread {
            Spread::Packed10 => Packed10::sums(self, spread, bytes, coefficients),
            Spread::Packed12 => Packed12::sums(self, spread, bytes, coefficients),
            Spread::Words => Words::sums(self, spread, bytes, coefficients),
        }
    }
}

/// Unpacks whole pixels of 10 bits as far as the processor has an own way; how many.
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
pub(crate) fn unpack_10(from: &[u8], to: &mut [u16]) -> usize {
    // SAFETY: the program was compiled for processors with NEON.
    unsafe { Packed10::unpack_neon(from, to) }
}

/// No own way.
#[cfg(not(all(target_arch = "aarch64", target_feature = "neon")))]
pub(crate) const fn unpack_10(_: &[u8], _: &mut [u16]) -> usize {
    0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::MAX_COEFFICIENT;
    use proptest::prelude::*;
    extern crate std;
    use std::vec::Vec;

    const BYTES: [u8; 15] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14];

    #[test]
    fn groups_are_those_of_the_formats() {
        let first = |spread: Spread| spread.pixels(&BYTES, 0).take(6).collect::<Vec<_>>();
        assert_eq!(first(Spread::Packed10), [0, 1, 2, 3, 5, 6]);
        assert_eq!(first(Spread::Packed12), [0, 1, 3, 4, 6, 7]);
        assert_eq!(first(Spread::Words), [1, 3, 5, 7, 9, 11]);
    }

    proptest! {
        /// Lines of any length in buffers that end with them or go on, with any bytes and coefficients.
        #[test]
        fn sums_are_those_of_the_line_brought_together(
            spread in prop::sample::select(&[Spread::Packed10, Spread::Packed12, Spread::Words][..]),
            line in prop::collection::vec((any::<u16>(), -MAX_COEFFICIENT..=MAX_COEFFICIENT), 0..1500),
            behind in 0usize..100,
            extreme in any::<bool>(),
        ) {
            let h: Vec<i8> = line.iter().map(|&(_, h)| if extreme { h.signum() * MAX_COEFFICIENT } else { h }).collect();
            let (group_pixels, group_bytes, _) = spread.group();
            let groups = h.len().div_ceil(group_pixels);
            let mut bytes: Vec<u8> = line.iter().flat_map(|&(p, _)| p.to_le_bytes()).collect();
            if extreme {
                bytes.fill(255);
            }
            bytes.resize(groups * group_bytes, 77);
            bytes.resize(bytes.len() + behind, 99);
            let together: Vec<u8> = spread.pixels(&bytes, 0).take(h.len()).collect();
            let expected = Kernel::PORTABLE.sums_u8(&together, &h);
            for kernel in Kernel::all() {
                prop_assert_eq!(kernel.sums_spread(spread, &bytes, &h), expected, "{:?}", kernel);
            }
        }

        /// A line that is too short: no panic, and nothing beyond it is read.
        #[test]
        fn a_line_that_ends_early_ends_the_sums(
            spread in prop::sample::select(&[Spread::Packed10, Spread::Packed12, Spread::Words][..]),
            bytes in prop::collection::vec(any::<u8>(), 0..300),
            coefficients in 0usize..400,
        ) {
            let ones = std::vec![1i8; coefficients];
            let expected: u64 = spread.pixels(&bytes, 0).take(coefficients).map(u64::from).sum();
            for kernel in Kernel::all() {
                let sums = kernel.sums_spread(spread, &bytes, &ones);
                prop_assert_eq!((sums.product, sums.pixels), (expected as i64, expected), "{:?}", kernel);
            }
        }
    }
}
