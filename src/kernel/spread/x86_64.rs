//! On x86-64: 16 pixels are picked of two vectors of 16 bytes, or with AVX-512's byte permutation
//! 64 of two of 64 bytes.

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

    /// Bytes of 256 pixels: whole vectors of 64.
    const BYTES_256: usize = 256 / PIXELS * BYTES;

    /// In which of those vectors each 64 pixels begin: they lie in it and the next.
    const VECTORS: [usize; 4] = {
        let mut vectors = [0; 4];
        let mut k = 0;
        while k < 4 {
            vectors[k] = Self::place(64 * k) / 64;
            assert!(64 * (vectors[k] + 2) <= Self::BYTES_256);
            k += 1;
        }
        vectors
    };

    /// The places of the pixels in both.
    const PLACES_IN_128: [[u8; 64]; 4] = {
        let mut places = [[0; 64]; 4];
        let mut x = 0;
        while x < 256 {
            let place = Self::place(x) - 64 * Self::VECTORS[x / 64];
            assert!(place < 128);
            places[x / 64][x % 64] = place as u8;
            x += 1;
        }
        places
    };

    /// Asks memory for what lies behind the vectors of these 64 pixels.
    #[inline(always)]
    fn ask_ahead(k: usize, from: *const u8) {
        let end = const {
            [
                Self::VECTORS[1],
                Self::VECTORS[2],
                Self::VECTORS[3],
                Self::BYTES_256 / 64,
            ]
        }[k];
        for vector in const { Self::VECTORS }[k]..end {
            ask_ahead_of(from.wrapping_add(64 * vector));
        }
    }

    /// All sums.
    #[target_feature(enable = "avx512f,avx512bw,avx512vnni,avx512vbmi")]
    pub(super) fn sums_64(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let mut sums = Sums::default();
        let (mut bytes, mut coefficients) = (bytes, coefficients);
        loop {
            // A line is a block.
            let now = coefficients.len().min(BLOCK);
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

    /// Sums of a block, as far as `bytes` go: 256 pixels at a time, the rest 64 at a time.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512vnni,avx512vbmi")]
    fn block_64(bytes: &[u8], coefficients: &[i8]) -> Block {
        let pixels = coefficients.len().min(bytes.len() / BYTES * PIXELS);
        let (ones, zero) = (_mm512_set1_epi8(1), _mm512_setzero_si512());
        // SAFETY: the arrays are 64 bytes long and the loads need no alignment.
        let places = const { &Self::PLACES_IN_128 }
            .each_ref()
            .map(|places| unsafe { _mm512_loadu_si512(places.as_ptr().cast()) });
        // Two sets of sums hide the latency of the additions.
        let (mut product, mut plain) = ([zero; 2], [zero; 2]);
        let mut add = |k: usize, p: __m512i, h: __m512i| {
            product[k % 2] = _mm512_dpbusd_epi32(product[k % 2], p, h);
            plain[k % 2] = _mm512_dpbusd_epi32(plain[k % 2], p, ones);
        };
        let (mut from, mut h) = (bytes.as_ptr(), coefficients.as_ptr());
        for _ in 0..pixels / 256 {
            for (k, &places) in places.iter().enumerate() {
                Self::ask_ahead(k, from);
                let first = 64 * const { Self::VECTORS }[k];
                // SAFETY: 256 pixels are `BYTES_256` bytes, which both vectors lie in, and they and their coefficients
                // are there; no load needs alignment.
                let (low, high, h) = unsafe {
                    (
                        _mm512_loadu_si512(from.add(first).cast()),
                        _mm512_loadu_si512(from.add(first + 64).cast()),
                        _mm512_loadu_si512(h.add(64 * k).cast()),
                    )
                };
                add(k, _mm512_permutex2var_epi8(low, places, high), h);
            }
            (from, h) = (from.wrapping_add(Self::BYTES_256), h.wrapping_add(256));
        }
        // What no mask lets through is not read and counts as 0.
        let done = pixels / 256 * 256;
        let there = bytes.len() - done / PIXELS * BYTES;
        for (k, &places) in places.iter().enumerate() {
            let left = (pixels - done).saturating_sub(64 * k);
            if left == 0 {
                break;
            }
            Self::ask_ahead(k, from);
            let first = 64 * const { Self::VECTORS }[k];
            let read = |at: usize| below(there.saturating_sub(at));
            // SAFETY: only bytes and coefficients that are there are let through.
            let (low, high, h) = unsafe {
                (
                    _mm512_maskz_loadu_epi8(read(first), from.wrapping_add(first).cast()),
                    _mm512_maskz_loadu_epi8(read(first + 64), from.wrapping_add(first + 64).cast()),
                    _mm512_maskz_loadu_epi8(below(left), h.wrapping_add(64 * k)),
                )
            };
            add(
                k,
                _mm512_maskz_permutex2var_epi8(below(left), low, places, high),
                h,
            );
        }
        sum(
            _mm512_add_epi32(product[0], product[1]),
            _mm512_add_epi32(plain[0], plain[1]),
        )
    }
}
