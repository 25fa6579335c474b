//! AVX2: `vpmaddubsw` multiplies 32 pixels by 32 coefficients at once, `vpsadbw` sums 32 pixels.

use super::{Sums, portable};
use core::arch::x86_64::*;

/// What the processor has and the operating system keeps the registers of.
#[derive(Clone, Copy, Default)]
pub(super) struct Features {
    /// AVX2.
    pub(super) avx2: bool,
    /// AVX-512 F, BW, VL and VNNI.
    pub(super) avx512_vnni: bool,
    /// VBMI besides.
    pub(super) avx512_vbmi: bool,
}

impl Features {
    pub(super) fn detect() -> Self {
        let leaf1 = __cpuid(1);
        let (osxsave, avx) = (leaf1.ecx & (1 << 27) != 0, leaf1.ecx & (1 << 28) != 0);
        if !osxsave || !avx || __cpuid(0).eax < 7 {
            return Self::default();
        }
        // SAFETY: OSXSAVE was checked, so XGETBV exists.
        let saved = unsafe { xgetbv() };
        let leaf7 = __cpuid_count(7, 0);
        let has = |register: u32, bits: &[u32]| bits.iter().all(|&bit| register & (1 << bit) != 0);
        // XMM and YMM; then also the masks and both halves of ZMM.
        let (avx2, zmm) = (saved & 0x06 == 0x06, saved & 0xe6 == 0xe6);
        // F, BW, VL; VNNI.
        let avx512_vnni = zmm && has(leaf7.ebx, &[5, 16, 30, 31]) && has(leaf7.ecx, &[11]);
        Self {
            avx2: avx2 && has(leaf7.ebx, &[5]),
            avx512_vnni,
            avx512_vbmi: avx512_vnni && has(leaf7.ecx, &[1]),
        }
    }
}

#[target_feature(enable = "xsave")]
fn xgetbv() -> u64 {
    // SAFETY: register 0 exists wherever XGETBV does.
    unsafe { _xgetbv(0) }
}

#[target_feature(enable = "avx2")]
pub(super) fn sum_i32(v: __m256i) -> i64 {
    let v = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
    let v = _mm_add_epi32(v, _mm_shuffle_epi32::<0b00_00_11_10>(v));
    let v = _mm_add_epi32(v, _mm_shuffle_epi32::<0b00_00_00_01>(v));
    i64::from(_mm_cvtsi128_si32(v))
}

#[target_feature(enable = "avx2")]
pub(super) fn sum_i64(v: __m256i) -> u64 {
    let v = _mm_add_epi64(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
    let v = _mm_add_epi64(v, _mm_unpackhi_epi64(v, v));
    _mm_cvtsi128_si64(v) as u64
}

/// See [`super::Kernel::run`].
#[target_feature(enable = "avx2")]
pub(super) fn run<W: super::Wide>(wide: W) -> W::Out {
    wide.run()
}

/// How far ahead memory is asked, bytes: some lines, so that the pauses between them are made use of.
const AHEAD: usize = 8192;

/// Asks memory for a later line's pixels: the next rows of a picture lie behind this one, and memory would
/// else have nothing to do while what follows the inner product is computed.
#[inline(always)]
pub(super) fn ask_ahead(step: &[u8; 64]) {
    ask_ahead_of(step.as_ptr());
}

/// [`ask_ahead`], from any place.
#[inline(always)]
pub(super) fn ask_ahead_of(place: *const u8) {
    ask(place.wrapping_add(AHEAD));
}

/// Asks memory for the line of the cache that this place is in.
#[inline(always)]
pub(super) fn ask(place: *const u8) {
    // SAFETY: a prefetch changes nothing that the program could see, and never faults, whatever the address.
    unsafe { _mm_prefetch::<_MM_HINT_T1>(place.cast()) };
}

/// 64 bytes as two vectors.
#[target_feature(enable = "avx2")]
fn load<T>(bytes: &[T; 64]) -> [__m256i; 2] {
    const { assert!(size_of::<T>() == 1) };
    let at: *const __m256i = bytes.as_ptr().cast();
    // SAFETY: the array is 64 bytes long and the loads need no alignment.
    unsafe { [_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1))] }
}

/// Two steps at once hide the latency of the additions.
#[target_feature(enable = "avx2")]
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    let (ones, zero) = (_mm256_set1_epi16(1), _mm256_setzero_si256());
    // A lane of the product gains at most 2·2·64·255 a step: 4096 steps of 32 pixels stay in 31 bits,
    // blocks of 65536 pixels are far below.
    for (p, h) in pixels.chunks(1 << 16).zip(coefficients.chunks(1 << 16)) {
        let (p_steps, p_rest) = p.as_chunks::<64>();
        let (h_steps, h_rest) = h.as_chunks::<64>();
        let (mut product0, mut product1) = (zero, zero);
        let (mut plain0, mut plain1) = (zero, zero);
        for (p, h) in p_steps.iter().zip(h_steps) {
            ask_ahead(p);
            let ([p0, p1], [h0, h1]) = (load(p), load(h));
            let m0 = _mm256_madd_epi16(_mm256_maddubs_epi16(p0, h0), ones);
            let m1 = _mm256_madd_epi16(_mm256_maddubs_epi16(p1, h1), ones);
            product0 = _mm256_add_epi32(product0, m0);
            product1 = _mm256_add_epi32(product1, m1);
            plain0 = _mm256_add_epi64(plain0, _mm256_sad_epu8(p0, zero));
            plain1 = _mm256_add_epi64(plain1, _mm256_sad_epu8(p1, zero));
        }
        sums.product += sum_i32(_mm256_add_epi32(product0, product1));
        sums.pixels += sum_i64(_mm256_add_epi64(plain0, plain1));
        let rest = portable::sums_u8(p_rest, h_rest);
        sums.product += rest.product;
        sums.pixels += rest.pixels;
    }
    sums
}

/// Σ h·p = 2·Σ h·(p >> 1) + Σ h·(p & 1): both factors fit signed 16 bits for every p.
#[target_feature(enable = "avx2")]
pub(super) fn sums_u16(pixels: &[u16], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    let (one, zero) = (_mm256_set1_epi16(1), _mm256_setzero_si256());
    let ones32 = _mm256_set1_epi32(0xFFFF);
    // All lanes together gain at most 16·64·32767 a step of 16 pixels: blocks of 32 steps fit 31 bits.
    for (p, h) in pixels.chunks(512).zip(coefficients.chunks(512)) {
        let (p_steps, p_rest) = p.as_chunks::<16>();
        let (h_steps, h_rest) = h.as_chunks::<16>();
        let (mut high, mut low, mut plain) = (zero, zero, zero);
        for (p, h) in p_steps.iter().zip(h_steps) {
            // SAFETY: the arrays are 32 and 16 bytes long and the loads need no alignment.
            let (p, h) = unsafe {
                (
                    _mm256_loadu_si256(p.as_ptr().cast()),
                    _mm_loadu_si128(h.as_ptr().cast()),
                )
            };
            let h = _mm256_cvtepi8_epi16(h);
            high = _mm256_add_epi32(high, _mm256_madd_epi16(_mm256_srli_epi16::<1>(p), h));
            low = _mm256_add_epi32(low, _mm256_madd_epi16(_mm256_and_si256(p, one), h));
            plain = _mm256_add_epi32(plain, _mm256_and_si256(p, ones32));
            plain = _mm256_add_epi32(plain, _mm256_srli_epi32::<16>(p));
        }
        sums.product += 2 * sum_i32(high) + sum_i32(low);
        sums.pixels += sum_i32(plain) as u64;
        let rest = portable::sums_u16(p_rest, h_rest);
        sums.product += rest.product;
        sums.pixels += rest.pixels;
    }
    sums
}

/// As [`sums_u8`], with a second row of coefficients; all of the same length.
#[target_feature(enable = "avx2")]
pub(super) fn both_u8(pixels: &[u8], coefficients: &[i8], second: &[i8]) -> (Sums, i64) {
    let (mut sums, mut product) = (Sums::default(), 0);
    let (ones, zero) = (_mm256_set1_epi16(1), _mm256_setzero_si256());
    let blocks = pixels.chunks(1 << 16).zip(coefficients.chunks(1 << 16));
    for ((p, h), g) in blocks.zip(second.chunks(1 << 16)) {
        let (p_steps, p_rest) = p.as_chunks::<64>();
        let (h_steps, h_rest) = h.as_chunks::<64>();
        let (g_steps, g_rest) = g.as_chunks::<64>();
        let (mut first, mut other, mut plain) = ([zero; 2], [zero; 2], [zero; 2]);
        for ((p, h), g) in p_steps.iter().zip(h_steps).zip(g_steps) {
            ask_ahead(p);
            let (p, h, g) = (load(p), load(h), load(g));
            for k in 0..2 {
                let m = _mm256_madd_epi16(_mm256_maddubs_epi16(p[k], h[k]), ones);
                first[k] = _mm256_add_epi32(first[k], m);
                let m = _mm256_madd_epi16(_mm256_maddubs_epi16(p[k], g[k]), ones);
                other[k] = _mm256_add_epi32(other[k], m);
                plain[k] = _mm256_add_epi64(plain[k], _mm256_sad_epu8(p[k], zero));
            }
        }
        sums.product += sum_i32(_mm256_add_epi32(first[0], first[1]));
        sums.pixels += sum_i64(_mm256_add_epi64(plain[0], plain[1]));
        product += sum_i32(_mm256_add_epi32(other[0], other[1]));
        let rest = portable::sums_u8(p_rest, h_rest);
        sums.product += rest.product;
        sums.pixels += rest.pixels;
        product += portable::sums_u8(p_rest, g_rest).product;
    }
    (sums, product)
}
