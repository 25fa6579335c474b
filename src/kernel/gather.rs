//! The upper bytes of packed pixels, side by side: a shuffle picks those that are wanted of some whole groups.

use super::Kernel;
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "aarch64", target_feature = "neon")
))]
use super::Kind;

/// Which bytes are wanted of a vector's 16.
#[derive(Debug)]
pub(crate) struct Gather {
    /// Their places, the rest marked by a top bit.
    index: [u8; 16],
    /// How many they are.
    pixels: usize,
    /// Bytes of which they are all that is wanted: whole groups of packed pixels.
    bytes: usize,
    /// Of two vectors' results side by side the 32-bit words that are full.
    #[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
    words: [i32; 8],
}

/// The upper eight bits of 10-bit pixels: four bytes of every five.
pub(crate) const PACKED10: Gather = Gather {
    index: [
        0, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13, 0x80, 0x80, 0x80, 0x80,
    ],
    pixels: 12,
    bytes: 15,
    words: [0, 1, 2, 4, 5, 6, 7, 7],
};

/// The upper eight bits of 12-bit pixels: two bytes of every three.
pub(crate) const PACKED12: Gather = Gather {
    index: [
        0, 1, 3, 4, 6, 7, 9, 10, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80,
    ],
    pixels: 8,
    bytes: 12,
    words: [0, 1, 4, 5, 7, 7, 7, 7],
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
            // SAFETY: `fastest` made this kind after it asked the processor for AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { avx2(what, from, to, pixels) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon | Kind::NeonDot => unsafe { neon(what, from, to, pixels) },
            _ => 0,
        }
    }
}

/// Steps that stay within both sides: each reads and writes so much and goes on by so much.
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "aarch64", target_feature = "neon")
))]
fn steps(from: (usize, usize, usize), to: (usize, usize, usize)) -> usize {
    let fit = |(has, touches, goes_on): (usize, usize, usize)| {
        has.checked_sub(touches)
            .map_or(0, |rest| rest / goes_on + 1)
    };
    fit(from).min(fit(to))
}

/// Two vectors a step: fewer and larger stores, which the sums that follow wait for.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(what: &Gather, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
    use core::arch::x86_64::*;
    let (bytes, a_step) = (2 * what.bytes, 2 * what.pixels);
    // SAFETY: the arrays are 16 and 32 bytes long and the loads need no alignment.
    let (index, words) = unsafe {
        (
            _mm_loadu_si128(what.index.as_ptr().cast()),
            _mm256_loadu_si256(what.words.as_ptr().cast()),
        )
    };
    let index = _mm256_broadcastsi128_si256(index);
    let fit = steps((from.len(), what.bytes + 16, bytes), (to.len(), 32, a_step));
    let steps = fit.min(pixels.div_ceil(a_step));
    for step in 0..steps {
        // SAFETY: `steps` are so few that all bytes read and written lie within the slices.
        unsafe {
            let at = from.as_ptr().add(step * bytes);
            let low = _mm_loadu_si128(at.cast());
            let high = _mm_loadu_si128(at.add(what.bytes).cast());
            let both = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(low), high);
            let picked = _mm256_shuffle_epi8(both, index);
            let picked = _mm256_permutevar8x32_epi32(picked, words);
            _mm256_storeu_si256(to.as_mut_ptr().add(step * a_step).cast(), picked);
        }
    }
    pixels.min(steps * a_step)
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
#[target_feature(enable = "neon")]
fn neon(what: &Gather, from: &[u8], to: &mut [u8], pixels: usize) -> usize {
    use core::arch::aarch64::*;
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let index = unsafe { vld1q_u8(what.index.as_ptr()) };
    let fit = steps((from.len(), 16, what.bytes), (to.len(), 16, what.pixels));
    let steps = fit.min(pixels.div_ceil(what.pixels));
    for step in 0..steps {
        // SAFETY: `steps` are so few that all bytes read and written lie within the slices.
        unsafe {
            let bytes = vld1q_u8(from.as_ptr().add(step * what.bytes));
            let picked = vqtbl1q_u8(bytes, index);
            vst1q_u8(to.as_mut_ptr().add(step * what.pixels), picked);
        }
    }
    pixels.min(steps * what.pixels)
}
