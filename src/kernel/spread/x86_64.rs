//! On x86-64: 16 pixels are picked of two vectors of 16 bytes, or with AVX-512's byte permutation as many as 64 bytes hold.

use super::{Groups, STEP};
use crate::kernel::Sums;
use crate::kernel::x86_64::{ask_ahead_of, sum_i32, sum_i64};
use crate::kernel::x86_64_avx512::sum;
use core::arch::x86_64::*;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// The lower `count` bits, at most 64.
const fn below(count: usize) -> u64 {
    if count < 64 {
        (1 << count) - 1
    } else {
        u64::MAX
    }
}

impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// The shuffles that pick eight pixels each, of the first vector to the lower half and of the second to the upper.
    #[inline]
    #[target_feature(enable = "ssse3")]
    fn shuffles() -> (__m128i, __m128i) {
        // SAFETY: the array is 16 bytes long and the load needs no alignment.
        let places = unsafe { _mm_loadu_si128(Self::PLACES_IN_TWO.as_ptr().cast()) };
        // A place with its top bit set gives 0; of the others the lower four bits count.
        let none = _mm_set1_epi8(i8::MIN);
        (
            _mm_unpacklo_epi64(places, none),
            _mm_unpackhi_epi64(none, places),
        )
    }

    /// See [`super::Kernel::gather`].
    #[target_feature(enable = "ssse3")]
    pub(super) fn gather_ssse3(from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        let (first, second) = Self::shuffles();
        let (mut at, mut done) = (0, 0);
        // Comparing costs less than to divide for the number of steps.
        while done < pixels && at + Self::HALF + 16 <= from.len() && done + STEP <= to.len() {
            // SAFETY: all bytes read and written lie within the slices, as was just asked.
            unsafe {
                let low = _mm_loadu_si128(from.as_ptr().add(at).cast());
                let high = _mm_loadu_si128(from.as_ptr().add(at + Self::HALF).cast());
                let picked =
                    _mm_or_si128(_mm_shuffle_epi8(low, first), _mm_shuffle_epi8(high, second));
                _mm_storeu_si128(to.as_mut_ptr().add(done).cast(), picked);
            }
            at += 2 * Self::HALF;
            done += STEP;
        }
        pixels.min(done)
    }

    /// Sums of as many whole steps of 32 pixels as can be read, and how many pixels that are.
    #[target_feature(enable = "avx2")]
    pub(super) fn sums_32(bytes: &[u8], coefficients: &[i8]) -> (Sums, usize) {
        let (first, second) = Self::shuffles();
        let (first, second) = (
            _mm256_broadcastsi128_si256(first),
            _mm256_broadcastsi128_si256(second),
        );
        let (ones, zero) = (_mm256_set1_epi16(1), _mm256_setzero_si256());
        let mut sums = Sums::default();
        let (mut at, mut done) = (0, 0);
        let (steps, _) = coefficients.as_chunks::<32>();
        // A lane of the product gains at most 2·2·64·255 a step: a block's 2048 steps stay in 31 bits.
        for steps in steps.chunks(BLOCK / 32) {
            let (mut product, mut plain) = (zero, zero);
            for h in steps {
                if at + 3 * Self::HALF + 16 > bytes.len() {
                    break;
                }
                // SAFETY: all 16 bytes at each of the four places lie within the slice, as was just asked; the array is
                // 32 bytes long. No load needs alignment.
                let (low, high, h) = unsafe {
                    let from = bytes.as_ptr().add(at);
                    ask_ahead_of(from);
                    let load =
                        |halves: usize| _mm_loadu_si128(from.add(halves * Self::HALF).cast());
                    (
                        _mm256_set_m128i(load(2), load(0)),
                        _mm256_set_m128i(load(3), load(1)),
                        _mm256_loadu_si256(h.as_ptr().cast()),
                    )
                };
                let p = _mm256_or_si256(
                    _mm256_shuffle_epi8(low, first),
                    _mm256_shuffle_epi8(high, second),
                );
                let pairs = _mm256_madd_epi16(_mm256_maddubs_epi16(p, h), ones);
                product = _mm256_add_epi32(product, pairs);
                plain = _mm256_add_epi64(plain, _mm256_sad_epu8(p, zero));
                at += 4 * Self::HALF;
                done += 32;
            }
            sums.product += sum_i32(product);
            sums.pixels += sum_i64(plain);
        }
        (sums, done)
    }

    /// All sums of a block, and how many pixels that are. Two steps at once hide the latency of the instruction.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512vnni,avx512vbmi")]
    pub(super) fn sums_64(bytes: &[u8], coefficients: &[i8]) -> (Sums, usize) {
        let step_bytes = 64 / BYTES * BYTES;
        let n = coefficients.len().min(BLOCK);
        // SAFETY: the array is 64 bytes long and the load needs no alignment.
        let places = unsafe { _mm512_loadu_si512(Self::PLACES_IN_64.as_ptr().cast()) };
        let (ones, zero) = (_mm512_set1_epi8(1), _mm512_setzero_si512());
        let (mut product, mut plain) = ([zero; 2], [zero; 2]);
        let (mut at, mut done) = (0, 0);
        let mut add = |side: usize, readable: usize, pixels: usize, at: usize, done: usize| {
            // SAFETY: only bytes below the slices' lengths are read, as the callers have asked: what a mask leaves out is
            // not touched.
            let (p, h) = unsafe {
                let from = bytes.as_ptr().add(at);
                ask_ahead_of(from);
                (
                    _mm512_maskz_loadu_epi8(below(readable), from.cast()),
                    _mm512_maskz_loadu_epi8(below(pixels), coefficients.as_ptr().add(done)),
                )
            };
            let p = _mm512_maskz_permutexvar_epi8(below(pixels), places, p);
            product[side] = _mm512_dpbusd_epi32(product[side], p, h);
            plain[side] = _mm512_dpbusd_epi32(plain[side], p, ones);
        };
        while done + 2 * Self::IN_64 <= n && at + 2 * step_bytes <= bytes.len() {
            add(0, step_bytes, Self::IN_64, at, done);
            add(
                1,
                step_bytes,
                Self::IN_64,
                at + step_bytes,
                done + Self::IN_64,
            );
            at += 2 * step_bytes;
            done += 2 * Self::IN_64;
        }
        // The rest of the line: a whole step at most twice, and of the last one a part.
        for side in [0, 1] {
            let readable = (bytes.len() - at).min(step_bytes);
            let pixels = (n - done).min(readable / BYTES * PIXELS);
            if pixels > 0 {
                add(side, readable, pixels, at, done);
                at += readable;
                done += pixels;
            }
        }
        let block = sum(
            _mm512_add_epi32(product[0], product[1]),
            _mm512_add_epi32(plain[0], plain[1]),
        );
        let sums = Sums {
            product: block.product.into(),
            pixels: block.pixels as u64,
        };
        (sums, done)
    }
}
