//! On x86-64: 16 pixels are picked of two vectors of 16 bytes, or with AVX-512's byte permutation as many as 64 bytes hold.

use super::Groups;
use crate::kernel::Sums;
use crate::kernel::x86_64::{ask_ahead_of, sum_i32, sum_i64};
use crate::kernel::x86_64_avx512::{Block, sum};
use core::arch::x86_64::*;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// Pixels of a step of 16 bytes: what is written stays aligned where the line is.
const STEP: usize = 16;

/// The lower `count` bits, at most 64.
const fn below(count: usize) -> u64 {
    if count < 64 {
        (1 << count) - 1
    } else {
        u64::MAX
    }
}

impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// Bytes of eight pixels.
    const HALF: usize = 8 / PIXELS * BYTES;

    /// The places of 16 pixels, in two vectors of 16 bytes, the second of which begins [`Self::HALF`] bytes after the
    /// first: eight in each.
    const PLACES_IN_TWO: [u8; 16] = {
        let mut places = [0; 16];
        let mut x = 0;
        while x < 8 {
            places[x] = Self::place(x) as u8;
            places[x + 8] = places[x] + 16;
            x += 1;
        }
        places
    };

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

    /// Pixels of a step of 64 bytes: whole groups, and a multiple of 16 as lines mostly are.
    const STEP_64: usize = 64 / (16 / PIXELS * BYTES) * 16;

    /// Their places; the last bytes of a step have none.
    const PLACES_IN_64: [u8; 64] = {
        let mut places = [0; 64];
        let mut x = 0;
        while x < Self::STEP_64 {
            places[x] = Self::place(x) as u8;
            x += 1;
        }
        places
    };

    /// Bytes of a step.
    const BYTES_64: usize = Self::STEP_64 / PIXELS * BYTES;

    /// All ones where a step has a pixel.
    const LANES_64: [u8; 64] = {
        let mut lanes = [0; 64];
        let mut x = 0;
        while x < Self::STEP_64 {
            lanes[x] = u8::MAX;
            x += 1;
        }
        lanes
    };

    /// All sums.
    #[target_feature(enable = "avx512f,avx512bw,avx512vnni,avx512vbmi")]
    pub(super) fn sums_64(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let mut sums = Sums::default();
        let (mut bytes, mut coefficients) = (bytes, coefficients);
        loop {
            // A line is a block.
            let now = coefficients
                .len()
                .min(BLOCK / Self::STEP_64 * Self::STEP_64);
            let block = Self::block_64(bytes, &coefficients[..now]);
            sums.product += i64::from(block.product);
            sums.pixels += block.pixels as u64;
            coefficients = &coefficients[now..];
            if coefficients.is_empty() {
                return sums;
            }
            bytes = bytes.get(now / PIXELS * BYTES..).unwrap_or_default();
        }
    }

    /// Steps of a block, as far as `bytes` go. Two at once hide the latency of the additions.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512vnni,avx512vbmi")]
    fn block_64(bytes: &[u8], coefficients: &[i8]) -> Block {
        // SAFETY: the arrays are 64 bytes long and the loads need no alignment.
        let (places, lanes) = unsafe {
            (
                _mm512_loadu_si512(Self::PLACES_IN_64.as_ptr().cast()),
                _mm512_loadu_si512(Self::LANES_64.as_ptr().cast()),
            )
        };
        let (ones, zero) = (_mm512_set1_epi8(1), _mm512_setzero_si512());
        let (mut product, mut plain) = ([zero; 2], [zero; 2]);
        let mut add = |side: usize, p: __m512i, h: __m512i| {
            product[side] = _mm512_dpbusd_epi32(product[side], p, h);
            plain[side] = _mm512_dpbusd_epi32(plain[side], p, ones);
        };
        let (mut at, mut done) = (0, 0);
        // Whole vectors are read: the last of them ends that much behind its step.
        while at + Self::BYTES_64 + 64 <= bytes.len()
            && done + Self::STEP_64 + 64 <= coefficients.len()
        {
            for side in [0, 1] {
                // SAFETY: both vectors lie within their slices, as was just asked for the second turn, and need no
                // alignment.
                let (p, h) = unsafe {
                    let from = bytes.as_ptr().add(at);
                    ask_ahead_of(from);
                    (
                        _mm512_loadu_si512(from.cast()),
                        _mm512_loadu_si512(coefficients.as_ptr().add(done).cast()),
                    )
                };
                add(
                    side,
                    _mm512_and_si512(_mm512_permutexvar_epi8(places, p), lanes),
                    h,
                );
                at += Self::BYTES_64;
                done += Self::STEP_64;
            }
        }
        // The rest: what no mask lets through is not read and counts as 0.
        while done < coefficients.len() && at < bytes.len() {
            let readable = (bytes.len() - at).min(64);
            let pixels = (coefficients.len() - done)
                .min(Self::STEP_64)
                .min(readable / BYTES * PIXELS);
            // SAFETY: only bytes below the slices' lengths are let through.
            let (p, h) = unsafe {
                (
                    _mm512_maskz_loadu_epi8(below(readable), bytes.as_ptr().add(at).cast()),
                    _mm512_maskz_loadu_epi8(below(pixels), coefficients.as_ptr().add(done)),
                )
            };
            add(
                0,
                _mm512_maskz_permutexvar_epi8(below(pixels), places, p),
                h,
            );
            at += Self::BYTES_64;
            done += pixels;
        }
        sum(
            _mm512_add_epi32(product[0], product[1]),
            _mm512_add_epi32(plain[0], plain[1]),
        )
    }
}
