//! The upper bytes of packed pixels, side by side: of every 15 bytes one shuffle picks those that are wanted.

use super::Kernel;
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "aarch64", target_feature = "neon")
))]
use super::Kind;

/// Bytes that a step goes on by: whole groups of packed pixels, three of 10 bits or five of 12.
const STEP: usize = 15;

/// Which of 16 bytes are wanted, and how many; the others are marked by a top bit.
#[derive(Debug)]
pub(crate) struct Gather {
    index: [u8; 16],
    pixels: usize,
}

/// The upper eight bits of 10-bit pixels: four bytes of every five.
pub(crate) const PACKED10: Gather = Gather {
    index: [
        0, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13, 0x80, 0x80, 0x80, 0x80,
    ],
    pixels: 12,
};

/// The upper eight bits of 12-bit pixels: two bytes of every three.
pub(crate) const PACKED12: Gather = Gather {
    index: [
        0, 1, 3, 4, 6, 7, 9, 10, 12, 13, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80,
    ],
    pixels: 10,
};

impl Kernel {
    /// Picks bytes as long as whole steps fit on both sides. How many pixels were written; they are whole groups. The
    /// bytes of `to` after them are unspecified.
    #[inline]
    pub(crate) fn gather(self, what: &Gather, from: &[u8], to: &mut [u8]) -> usize {
        match self.0 {
            // SAFETY: `fastest` made this kind after it asked the processor for AVX2, which has SSSE3 in it.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { ssse3(what, from, to) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon | Kind::NeonDot => unsafe { neon(what, from, to) },
            _ => 0,
        }
    }
}

/// Steps for which 16 bytes can be read and written.
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "aarch64", target_feature = "neon")
))]
fn steps(what: &Gather, from: &[u8], to: &[u8]) -> usize {
    let fit = |length: usize, step: usize| length.checked_sub(16).map_or(0, |rest| rest / step + 1);
    fit(from.len(), STEP).min(fit(to.len(), what.pixels))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "ssse3")]
fn ssse3(what: &Gather, from: &[u8], to: &mut [u8]) -> usize {
    use core::arch::x86_64::*;
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let index = unsafe { _mm_loadu_si128(what.index.as_ptr().cast()) };
    let steps = steps(what, from, to);
    for step in 0..steps {
        // SAFETY: `steps` are so few that the 16 bytes lie within both slices.
        unsafe {
            let bytes = _mm_loadu_si128(from.as_ptr().add(step * STEP).cast());
            let picked = _mm_shuffle_epi8(bytes, index);
            _mm_storeu_si128(to.as_mut_ptr().add(step * what.pixels).cast(), picked);
        }
    }
    steps * what.pixels
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
#[target_feature(enable = "neon")]
fn neon(what: &Gather, from: &[u8], to: &mut [u8]) -> usize {
    use core::arch::aarch64::*;
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let index = unsafe { vld1q_u8(what.index.as_ptr()) };
    let steps = steps(what, from, to);
    for step in 0..steps {
        // SAFETY: `steps` are so few that the 16 bytes lie within both slices.
        unsafe {
            let bytes = vld1q_u8(from.as_ptr().add(step * STEP));
            let picked = vqtbl1q_u8(bytes, index);
            vst1q_u8(to.as_mut_ptr().add(step * what.pixels), picked);
        }
    }
    steps * what.pixels
}
