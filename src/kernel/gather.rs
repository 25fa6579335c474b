//! The upper bytes of packed pixels, side by side: a shuffle picks those that are wanted of some whole groups.

use super::Kernel;
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "aarch64", target_feature = "neon")
))]
use super::Kind;

/// Pixels of a step: what is written stays aligned where the line is, which matters more than anything else here.
#[cfg_attr(
    not(any(
        target_arch = "x86_64",
        all(target_arch = "aarch64", target_feature = "neon")
    )),
    allow(dead_code)
)]
const STEP: usize = 16;

/// Which bytes are wanted of two vectors of 16 bytes, the second of which begins some bytes after the first.
#[derive(Debug)]
#[cfg_attr(
    not(any(
        target_arch = "x86_64",
        all(target_arch = "aarch64", target_feature = "neon")
    )),
    allow(dead_code)
)]
pub(crate) struct Gather {
    /// Their places: eight in the first vector, the same eight in the second, 16 added.
    index: [u8; 16],
    /// Bytes from the first to the second: whole groups, of eight pixels.
    half: usize,
}

/// The upper eight bits of 10-bit pixels: four bytes of every five.
pub(crate) const PACKED10: Gather = Gather {
    index: [0, 1, 2, 3, 5, 6, 7, 8, 16, 17, 18, 19, 21, 22, 23, 24],
    half: 10,
};

/// The upper eight bits of 12-bit pixels: two bytes of every three.
pub(crate) const PACKED12: Gather = Gather {
    index: [0, 1, 3, 4, 6, 7, 9, 10, 16, 17, 19, 20, 22, 23, 25, 26],
    half: 12,
};

impl Kernel {
    /// Picks the bytes of `pixels` pixels, in steps that read and write more than they need where there is room: what is
    /// behind them in `to` is then overwritten. How many are done: all, or whole groups.
    #[inline]
    pub(crate) fn gather(self, what: &Gather, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        #[cfg(not(any(
            target_arch = "x86_64",
            all(target_arch = "aarch64", target_feature = "neon")
        )))]
        let _ = (what, from, to, pixels);
        match self.0 {
            // SAFETY: `fastest` made these kinds after it asked the processor for AVX2, which has SSSE3 in it.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 | Kind::Avx512 => unsafe { ssse3(what, from, to, pixels) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon | Kind::NeonDot => unsafe { neon(what, from, to, pixels) },
            _ => 0,
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "ssse3")]
fn ssse3(what: &Gather, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
    use core::arch::x86_64::*;
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let index = unsafe { _mm_loadu_si128(what.index.as_ptr().cast()) };
    // A place with its top bit set gives 0; of the others the lower four bits count.
    let none = _mm_set1_epi8(i8::MIN);
    let (first, second) = (
        _mm_unpacklo_epi64(index, none),
        _mm_unpackhi_epi64(none, index),
    );
    let (mut at, mut done) = (0, 0);
    // Comparing costs less than to divide for the number of steps.
    while done < pixels && at + what.half + 16 <= from.len() && done + STEP <= to.len() {
        // SAFETY: all bytes read and written lie within the slices, as was just asked.
        unsafe {
            let low = _mm_loadu_si128(from.as_ptr().add(at).cast());
            let high = _mm_loadu_si128(from.as_ptr().add(at + what.half).cast());
            let picked = _mm_or_si128(_mm_shuffle_epi8(low, first), _mm_shuffle_epi8(high, second));
            _mm_storeu_si128(to.as_mut_ptr().add(done).cast(), picked);
        }
        at += 2 * what.half;
        done += STEP;
    }
    pixels.min(done)
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
#[target_feature(enable = "neon")]
fn neon(what: &Gather, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
    use core::arch::aarch64::*;
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let index = unsafe { vld1q_u8(what.index.as_ptr()) };
    let (mut at, mut done) = (0, 0);
    while done < pixels && at + what.half + 16 <= from.len() && done + STEP <= to.len() {
        // SAFETY: all bytes read and written lie within the slices, as was just asked.
        unsafe {
            let low = vld1q_u8(from.as_ptr().add(at));
            let high = vld1q_u8(from.as_ptr().add(at + what.half));
            let picked = vqtbl2q_u8(uint8x16x2_t(low, high), index);
            vst1q_u8(to.as_mut_ptr().add(done), picked);
        }
        at += 2 * what.half;
        done += STEP;
    }
    pixels.min(done)
}
