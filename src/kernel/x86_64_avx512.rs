//! AVX-512 with VNNI: `vpdpbusd` multiplies 64 pixels by 64 coefficients and adds them four by four, in 32
//! bits. The same instruction with ones for coefficients sums the pixels.

use super::{Sums, x86_64::ask_ahead};
use core::arch::x86_64::*;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// Sums of a block.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub(super) product: i32,
    pub(super) pixels: i32,
}

/// The sums over all lanes of both, in one go.
#[target_feature(enable = "avx512f")]
pub(super) fn sum(product: __m512i, pixels: __m512i) -> Block {
    let pairs = _mm512_add_epi32(
        _mm512_unpacklo_epi32(product, pixels),
        _mm512_unpackhi_epi32(product, pixels),
    );
    let half = _mm256_add_epi32(
        _mm512_castsi512_si256(pairs),
        _mm512_extracti64x4_epi64::<1>(pairs),
    );
    let quarter = _mm_add_epi32(
        _mm256_castsi256_si128(half),
        _mm256_extracti128_si256::<1>(half),
    );
    let both = _mm_cvtsi128_si64(_mm_add_epi32(quarter, _mm_unpackhi_epi64(quarter, quarter)));
    Block {
        product: both as i32,
        pixels: (both >> 32) as i32,
    }
}

/// 64 bytes.
#[target_feature(enable = "avx512f")]
fn load<T>(bytes: &[T; 64]) -> __m512i {
    const { assert!(size_of::<T>() == 1) };
    // SAFETY: the array is 64 bytes long and the load needs no alignment.
    unsafe { _mm512_loadu_si512(bytes.as_ptr().cast()) }
}

/// Up to 63 bytes, and zeros.
#[target_feature(enable = "avx512f,avx512bw")]
fn load_rest<T>(bytes: &[T]) -> __m512i {
    const { assert!(size_of::<T>() == 1) };
    let mask = (1u64 << (bytes.len() % 64)) - 1;
    // SAFETY: only bytes below `bytes.len()` are read: what the mask leaves out is not touched.
    unsafe { _mm512_maskz_loadu_epi8(mask, bytes.as_ptr().cast()) }
}

/// See [`super::Kernel::run`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni")]
pub(super) fn run<W: super::Wide>(wide: W) -> W::Out {
    wide.run()
}

#[target_feature(enable = "avx512f,avx512bw,avx512vnni")]
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    if n <= BLOCK {
        // A line: without the loop.
        let Block { product, pixels } = block_u8(pixels, coefficients);
        return Sums {
            product: product.into(),
            pixels: pixels as u64,
        };
    }
    let mut sums = Sums::default();
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let block = block_u8(p, h);
        sums.product += i64::from(block.product);
        sums.pixels += block.pixels as u64;
    }
    sums
}

/// Both of the same length. Two steps at once hide the latency of the instruction.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vnni")]
fn block_u8(pixels: &[u8], coefficients: &[i8]) -> Block {
    let (ones, zero) = (_mm512_set1_epi8(1), _mm512_setzero_si512());
    let (mut product, mut plain) = ([zero; 2], [zero; 2]);
    let (p_steps, p_rest) = pixels.as_chunks::<64>();
    let (h_steps, h_rest) = coefficients.as_chunks::<64>();
    let (p_pairs, p_single) = p_steps.as_chunks::<2>();
    let (h_pairs, h_single) = h_steps.as_chunks::<2>();
    for (p, h) in p_pairs.iter().zip(h_pairs) {
        ask_ahead(&p[0]);
        ask_ahead(&p[1]);
        let (p0, p1) = (load(&p[0]), load(&p[1]));
        product[0] = _mm512_dpbusd_epi32(product[0], p0, load(&h[0]));
        product[1] = _mm512_dpbusd_epi32(product[1], p1, load(&h[1]));
        plain[0] = _mm512_dpbusd_epi32(plain[0], p0, ones);
        plain[1] = _mm512_dpbusd_epi32(plain[1], p1, ones);
    }
    for (p, h) in p_single.iter().zip(h_single) {
        ask_ahead(p);
        let p = load(p);
        product[0] = _mm512_dpbusd_epi32(product[0], p, load(h));
        plain[0] = _mm512_dpbusd_epi32(plain[0], p, ones);
    }
    if !p_rest.is_empty() {
        let p = load_rest(p_rest);
        product[1] = _mm512_dpbusd_epi32(product[1], p, load_rest(h_rest));
        plain[1] = _mm512_dpbusd_epi32(plain[1], p, ones);
    }
    sum(
        _mm512_add_epi32(product[0], product[1]),
        _mm512_add_epi32(plain[0], plain[1]),
    )
}

/// As [`sums_u8`], with a second row of coefficients; all of the same length.
#[target_feature(enable = "avx512f,avx512bw,avx512vnni")]
pub(super) fn both_u8(pixels: &[u8], coefficients: &[i8], second: &[i8]) -> (Sums, i64) {
    let (mut sums, mut product) = (Sums::default(), 0);
    let (ones, zero) = (_mm512_set1_epi8(1), _mm512_setzero_si512());
    let blocks = pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK));
    for ((p, h), g) in blocks.zip(second.chunks(BLOCK)) {
        let (mut first, mut other, mut plain) = (zero, zero, zero);
        let (p_steps, p_rest) = p.as_chunks::<64>();
        let (h_steps, h_rest) = h.as_chunks::<64>();
        let (g_steps, g_rest) = g.as_chunks::<64>();
        for ((p, h), g) in p_steps.iter().zip(h_steps).zip(g_steps) {
            ask_ahead(p);
            let p = load(p);
            first = _mm512_dpbusd_epi32(first, p, load(h));
            other = _mm512_dpbusd_epi32(other, p, load(g));
            plain = _mm512_dpbusd_epi32(plain, p, ones);
        }
        if !p_rest.is_empty() {
            let p = load_rest(p_rest);
            first = _mm512_dpbusd_epi32(first, p, load_rest(h_rest));
            other = _mm512_dpbusd_epi32(other, p, load_rest(g_rest));
            plain = _mm512_dpbusd_epi32(plain, p, ones);
        }
        let block = sum(first, plain);
        sums.product += i64::from(block.product);
        sums.pixels += block.pixels as u64;
        product += i64::from(_mm512_reduce_add_epi32(other));
    }
    (sums, product)
}

/// Σ h·p = Σ h·low + 256·Σ h·high, of the pixels' bytes: as bytes they are multiplied by (h, 0) and (0, h).
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni")]
pub(super) fn sums_u16(pixels: &[u16], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    let (zero, one) = (_mm512_setzero_si512(), _mm512_set1_epi16(1));
    let one_above = _mm512_slli_epi16::<8>(one);
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let (mut low, mut high, mut plain_low, mut plain_high) = (zero, zero, zero, zero);
        for (p, h) in p.chunks(32).zip(h.chunks(32)) {
            // All ones for 32 pixels, fewer at the end.
            let mask = u32::MAX >> (32 - p.len());
            // SAFETY: only words and bytes below the slices' equal lengths are read: what the mask leaves
            // out is not touched.
            let (p, h) = unsafe {
                (
                    _mm512_maskz_loadu_epi16(mask, p.as_ptr().cast()),
                    _mm256_maskz_loadu_epi8(mask, h.as_ptr()),
                )
            };
            let h = _mm512_cvtepu8_epi16(h);
            low = _mm512_dpbusd_epi32(low, p, h);
            high = _mm512_dpbusd_epi32(high, p, _mm512_slli_epi16::<8>(h));
            plain_low = _mm512_dpbusd_epi32(plain_low, p, one);
            plain_high = _mm512_dpbusd_epi32(plain_high, p, one_above);
        }
        let (low, high) = (sum(low, plain_low), sum(high, plain_high));
        sums.product += i64::from(low.product) + 256 * i64::from(high.product);
        sums.pixels += low.pixels as u64 + 256 * high.pixels as u64;
    }
    sums
}
