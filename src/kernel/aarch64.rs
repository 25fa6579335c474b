//! NEON: 64 pixels a step, with the dot-product instructions of Armv8.2 (Raspberry Pi 5) or without
//! (Raspberry Pi 3, 4 and Zero 2).
//!
//! NEON multiplies unsigned by unsigned. A coefficient and [`MAX_COEFFICIENT`] together are an unsigned number, so
//! Σ h·p = Σ (h + 64)·p − 64·Σ p, and Σ p is wanted anyway.

use super::{MAX_COEFFICIENT, Sums, portable, spread::Groups};
use core::arch::{aarch64::*, asm};

/// Steps a block with dot products: 1025·64·255·128 < 2³¹, so the sums of a whole block and what is left fit 32 bits.
const STEPS_DOT: usize = 1024;
/// Without: a lane of 16 bits of the pixel sum gains 2·2·255 a step, 64 steps fit.
const STEPS: usize = 63;
/// Deep pixels: a lane of the products gains 2·65535·128 a step of 16 pixels, 128 steps stay below 2³¹.
const BLOCK_U16: usize = 2048;

/// The processor has the dot-product instructions.
pub(super) fn has_dot_product() -> bool {
    #[cfg(feature = "std")]
    {
        extern crate std;
        std::arch::is_aarch64_feature_detected!("dotprod")
    }
    // Without an operating system to ask: what the program was compiled for.
    #[cfg(not(feature = "std"))]
    {
        cfg!(target_feature = "dotprod")
    }
}

/// The last 64 pixels of a line whose steps leave less.
struct Last<'a> {
    /// From the first one's group on.
    pixels: &'a [u8],
    h: &'a [i8; 64],
    /// So many at its end are what is left.
    left: usize,
}

/// Zeros, then all ones: 64 from some place on let so many pixels at their end through.
const MASKS: [u8; 128] = {
    let mut masks = [0; 128];
    let mut x = 64;
    while x < 128 {
        masks[x] = u8::MAX;
        x += 1;
    }
    masks
};

impl Sums {
    /// Of both.
    #[inline]
    fn and(self, other: Self) -> Self {
        Self {
            product: self.product + other.product,
            pixels: self.pixels + other.pixels,
        }
    }
}

/// `sum` + products of four neighbouring bytes each (the intrinsic is not stable yet).
#[inline]
#[target_feature(enable = "neon,dotprod")]
fn dot(mut sum: uint32x4_t, a: uint8x16_t, b: uint8x16_t) -> uint32x4_t {
    // SAFETY: registers only; the instruction is there, the function is compiled for it.
    unsafe {
        asm!("udot {0:v}.4s, {1:v}.16b, {2:v}.16b", inout(vreg) sum, in(vreg) a, in(vreg) b,
            options(pure, nomem, nostack, preserves_flags));
    }
    sum
}

/// h + 64, from 0 on.
#[inline]
#[target_feature(enable = "neon")]
fn unsigned(h: &[i8; 16]) -> uint8x16_t {
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    let h = unsafe { vld1q_s8(h.as_ptr()) };
    vreinterpretq_u8_s8(vaddq_s8(h, vdupq_n_s8(MAX_COEFFICIENT)))
}

/// [`unsigned`] of a step of 64.
#[inline]
#[target_feature(enable = "neon")]
fn unsigned_64(h: &[i8; 64]) -> [uint8x16_t; 4] {
    let (parts, _) = h.as_chunks::<16>();
    [0, 1, 2, 3].map(|k| unsigned(&parts[k]))
}

/// The sums of some steps, of which those of the products are too large by 64·Σ p.
#[inline]
fn offset_off(product: u64, pixels: u64) -> Sums {
    Sums {
        product: product as i64 - i64::from(MAX_COEFFICIENT) * pixels as i64,
        pixels,
    }
}

impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// All sums.
    #[target_feature(enable = "neon")]
    pub(super) fn sums_neon(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let steps = Self::steps(bytes, coefficients);
        if steps.len() > STEPS || steps.len() * 64 != coefficients.len() {
            return Self::uneven_neon(bytes, coefficients);
        }
        // SAFETY: `steps` are those that `bytes` has pixels for.
        unsafe { Self::block(bytes.as_ptr(), steps, None) }
    }

    #[inline(never)]
    #[target_feature(enable = "neon")]
    fn uneven_neon(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let steps = Self::steps(bytes, coefficients);
        if steps.len() > STEPS {
            // SAFETY: this processor has what this function needs.
            return unsafe { Self::in_parts(bytes, coefficients, STEPS, Self::sums_neon) };
        }
        let last = Self::last(bytes, coefficients, steps.len());
        // SAFETY: `steps` are those that `bytes` has pixels for.
        let sums = unsafe { Self::block(bytes.as_ptr(), steps, last.as_ref()) };
        match last {
            Some(_) => sums,
            None => Self::and_rest(sums, bytes, coefficients, steps.len()),
        }
    }

    /// As [`Self::sums_neon`], with the dot-product instructions.
    #[target_feature(enable = "neon,dotprod")]
    pub(super) fn sums_dot(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let steps = Self::steps(bytes, coefficients);
        if steps.len() > STEPS_DOT || steps.len() * 64 != coefficients.len() {
            return Self::uneven_dot(bytes, coefficients);
        }
        // SAFETY: `steps` are those that `bytes` has pixels for.
        unsafe { Self::block_dot(bytes.as_ptr(), steps, None) }
    }

    #[inline(never)]
    #[target_feature(enable = "neon,dotprod")]
    fn uneven_dot(bytes: &[u8], coefficients: &[i8]) -> Sums {
        let steps = Self::steps(bytes, coefficients);
        if steps.len() > STEPS_DOT {
            // SAFETY: this processor has what this function needs.
            return unsafe { Self::in_parts(bytes, coefficients, STEPS_DOT, Self::sums_dot) };
        }
        let last = Self::last(bytes, coefficients, steps.len());
        // SAFETY: `steps` are those that `bytes` has pixels for.
        let sums = unsafe { Self::block_dot(bytes.as_ptr(), steps, last.as_ref()) };
        match last {
            Some(_) => sums,
            None => Self::and_rest(sums, bytes, coefficients, steps.len()),
        }
    }

    /// The coefficients of the whole steps.
    #[inline(always)]
    fn steps<'a>(bytes: &[u8], coefficients: &'a [i8]) -> &'a [[i8; 64]] {
        let (steps, _) = coefficients.as_chunks::<64>();
        &steps[..steps.len().min(bytes.len() / Self::STEP_BYTES)]
    }

    /// More than so many steps.
    ///
    /// # Safety
    /// The processor has what `sums` needs.
    #[cold]
    #[inline(never)]
    unsafe fn in_parts(
        bytes: &[u8],
        coefficients: &[i8],
        steps: usize,
        sums: unsafe fn(&[u8], &[i8]) -> Sums,
    ) -> Sums {
        let pixels = bytes.chunks(steps * Self::STEP_BYTES);
        let parts = pixels.zip(coefficients.chunks(steps * 64));
        parts.fold(Sums::default(), |all, (bytes, coefficients)| {
            // SAFETY: the caller vouches for it.
            all.and(unsafe { sums(bytes, coefficients) })
        })
    }

    /// What so many steps leave, as the last 64 pixels of the line; none where they do not begin with a group.
    #[inline(always)]
    fn last<'a>(bytes: &'a [u8], coefficients: &'a [i8], steps: usize) -> Option<Last<'a>> {
        let n = coefficients.len();
        let left = n - steps * 64;
        if left == 0 || left >= 64 || !n.is_multiple_of(PIXELS) {
            return None;
        }
        let h = coefficients.last_chunk::<64>()?;
        let pixels = bytes.get(..n / PIXELS * BYTES)?;
        let pixels = pixels.get((n - 64) / PIXELS * BYTES..)?;
        Some(Last { pixels, h, left })
    }

    /// Its pixels, zeros in place of those that were in the steps before.
    #[inline]
    #[target_feature(enable = "neon")]
    fn last_pixels(last: &Last<'_>) -> [uint8x16_t; 4] {
        assert!(last.pixels.len() >= Self::STEP_BYTES);
        // SAFETY: a step's bytes are there, as was just asked.
        let p = unsafe { Self::pixels_64(last.pixels.as_ptr()) };
        let (masks, _) = MASKS[last.left.min(64)..].as_chunks::<16>();
        [0, 1, 2, 3].map(|k| {
            // SAFETY: the array is 16 bytes long and the load needs no alignment.
            vandq_u8(p[k], unsafe { vld1q_u8(masks[k].as_ptr()) })
        })
    }

    /// `sums` of the whole steps, and of what is left, brought together.
    #[cold]
    #[inline(never)]
    fn and_rest(sums: Sums, bytes: &[u8], coefficients: &[i8], steps: usize) -> Sums {
        let bytes = bytes.get(steps * Self::STEP_BYTES..).unwrap_or_default();
        let coefficients = coefficients.get(steps * 64..).unwrap_or_default();
        let mut pixels = [0; 64];
        // SAFETY: the program was compiled for processors with NEON.
        let there = unsafe { Self::gather_rest(bytes, &mut pixels) };
        let there = there.min(coefficients.len());
        sums.and(portable::sums_u8(&pixels[..there], coefficients))
    }

    /// # Safety
    /// From `from` on there are as many steps as of coefficients.
    #[inline]
    #[target_feature(enable = "neon")]
    unsafe fn block(
        mut from: *const u8,
        coefficients: &[[i8; 64]],
        last: Option<&Last<'_>>,
    ) -> Sums {
        let mut product = [vdupq_n_u32(0); 2];
        let mut pixels = [vdupq_n_u16(0); 2];
        let mut add = |p: [uint8x16_t; 4], h: [uint8x16_t; 4]| {
            for k in 0..4 {
                // Two products of at most 255·128 a lane stay in 16 bits.
                let pair = vmull_u8(vget_low_u8(p[k]), vget_low_u8(h[k]));
                let pair = vmlal_high_u8(pair, p[k], h[k]);
                product[k % 2] = vpadalq_u16(product[k % 2], pair);
                pixels[k % 2] = vpadalq_u8(pixels[k % 2], p[k]);
            }
        };
        for h in coefficients {
            // SAFETY: a step's bytes are there, as the caller says.
            add(unsafe { Self::pixels_64(from) }, unsigned_64(h));
            from = from.wrapping_add(Self::STEP_BYTES);
        }
        if let Some(last) = last {
            add(Self::last_pixels(last), unsigned_64(last.h));
        }
        // A lane of both products together fits, and so does the sum of all pixels.
        offset_off(
            vaddlvq_u32(vaddq_u32(product[0], product[1])),
            u64::from(vaddlvq_u16(pixels[0]) + vaddlvq_u16(pixels[1])),
        )
    }

    /// # Safety
    /// As of [`Self::block`].
    #[inline]
    #[target_feature(enable = "neon,dotprod")]
    unsafe fn block_dot(
        mut from: *const u8,
        coefficients: &[[i8; 64]],
        last: Option<&Last<'_>>,
    ) -> Sums {
        // Two sets of sums hide the latency of the dot products.
        let (mut product, mut pixels) = ([vdupq_n_u32(0); 2], [vdupq_n_u32(0); 2]);
        let ones = vdupq_n_u8(1);
        let mut add = |p: [uint8x16_t; 4], h: [uint8x16_t; 4]| {
            for k in 0..4 {
                product[k % 2] = dot(product[k % 2], p[k], h[k]);
                pixels[k % 2] = dot(pixels[k % 2], p[k], ones);
            }
        };
        for h in coefficients {
            // SAFETY: a step's bytes are there, as the caller says.
            add(unsafe { Self::pixels_64(from) }, unsigned_64(h));
            from = from.wrapping_add(Self::STEP_BYTES);
        }
        if let Some(last) = last {
            add(Self::last_pixels(last), unsigned_64(last.h));
        }
        // A lane of both together fits.
        offset_off(
            vaddlvq_u32(vaddq_u32(product[0], product[1])),
            vaddlvq_u32(vaddq_u32(pixels[0], pixels[1])),
        )
    }
}

/// Both rows' products, of pixels that are whole steps: they are loaded once.
///
/// # Safety
/// The processor has what `sums` needs.
#[inline(always)]
unsafe fn apart(
    pixels: &[u8],
    coefficients: &[i8],
    second: &[i8],
    sums: unsafe fn(&[u8], &[i8]) -> Sums,
) -> (Sums, i64) {
    // SAFETY: the caller vouches for it.
    unsafe { (sums(pixels, coefficients), sums(pixels, second).product) }
}

/// As [`Groups::sums_neon`] of pixels side by side, with a second row of coefficients; all of the same length.
#[target_feature(enable = "neon")]
pub(super) fn both_neon(pixels: &[u8], coefficients: &[i8], second: &[i8]) -> (Sums, i64) {
    let ((p, rest), (h, _), (g, _)) = (
        pixels.as_chunks::<64>(),
        coefficients.as_chunks::<64>(),
        second.as_chunks::<64>(),
    );
    if !rest.is_empty() || p.len() > STEPS {
        // SAFETY: this processor has what this function needs.
        return unsafe {
            apart(
                pixels,
                coefficients,
                second,
                super::spread::Bytes::sums_neon,
            )
        };
    }
    let (mut first, mut other) = ([vdupq_n_u32(0); 2], [vdupq_n_u32(0); 2]);
    let mut plain = [vdupq_n_u16(0); 2];
    for ((p, h), g) in p.iter().zip(h).zip(g) {
        let (parts, _) = p.as_chunks::<16>();
        let (h, g) = (unsigned_64(h), unsigned_64(g));
        for k in 0..4 {
            // SAFETY: the array is 16 bytes long and the load needs no alignment.
            let p = unsafe { vld1q_u8(parts[k].as_ptr()) };
            // Two products of at most 255·128 a lane stay in 16 bits.
            let pair = vmlal_high_u8(vmull_u8(vget_low_u8(p), vget_low_u8(h[k])), p, h[k]);
            first[k % 2] = vpadalq_u16(first[k % 2], pair);
            let pair = vmlal_high_u8(vmull_u8(vget_low_u8(p), vget_low_u8(g[k])), p, g[k]);
            other[k % 2] = vpadalq_u16(other[k % 2], pair);
            plain[k % 2] = vpadalq_u8(plain[k % 2], p);
        }
    }
    let pixels = u64::from(vaddlvq_u16(plain[0]) + vaddlvq_u16(plain[1]));
    let sums = offset_off(vaddlvq_u32(vaddq_u32(first[0], first[1])), pixels);
    let other = offset_off(vaddlvq_u32(vaddq_u32(other[0], other[1])), pixels);
    (sums, other.product)
}

/// As [`both_neon`], with the dot-product instructions.
#[target_feature(enable = "neon,dotprod")]
pub(super) fn both_dot(pixels: &[u8], coefficients: &[i8], second: &[i8]) -> (Sums, i64) {
    let ((p, rest), (h, _), (g, _)) = (
        pixels.as_chunks::<64>(),
        coefficients.as_chunks::<64>(),
        second.as_chunks::<64>(),
    );
    if !rest.is_empty() || p.len() > STEPS_DOT {
        // SAFETY: this processor has what this function needs.
        return unsafe { apart(pixels, coefficients, second, super::spread::Bytes::sums_dot) };
    }
    let zero = [vdupq_n_u32(0); 2];
    let (mut first, mut other, mut plain) = (zero, zero, zero);
    let ones = vdupq_n_u8(1);
    for ((p, h), g) in p.iter().zip(h).zip(g) {
        let (parts, _) = p.as_chunks::<16>();
        let (h, g) = (unsigned_64(h), unsigned_64(g));
        for k in 0..4 {
            // SAFETY: the array is 16 bytes long and the load needs no alignment.
            let p = unsafe { vld1q_u8(parts[k].as_ptr()) };
            first[k % 2] = dot(first[k % 2], p, h[k]);
            other[k % 2] = dot(other[k % 2], p, g[k]);
            plain[k % 2] = dot(plain[k % 2], p, ones);
        }
    }
    let pixels = vaddlvq_u32(vaddq_u32(plain[0], plain[1]));
    let sums = offset_off(vaddlvq_u32(vaddq_u32(first[0], first[1])), pixels);
    let other = offset_off(vaddlvq_u32(vaddq_u32(other[0], other[1])), pixels);
    (sums, other.product)
}

/// All sums; what is left of a block's steps of 16 is done in plain Rust.
#[target_feature(enable = "neon")]
pub(super) fn sums_u16(pixels: &[u16], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    let mut all = Sums::default();
    for (p, h) in pixels.chunks(BLOCK_U16).zip(coefficients.chunks(BLOCK_U16)) {
        let (p_steps, p_rest) = p.as_chunks::<16>();
        let (h_steps, h_rest) = h.as_chunks::<16>();
        let sums = steps_u16(p_steps, h_steps);
        all = all.and(sums).and(portable::sums_u16(p_rest, h_rest));
    }
    all
}

#[inline]
#[target_feature(enable = "neon")]
fn steps_u16(p_steps: &[[u16; 16]], h_steps: &[[i8; 16]]) -> Sums {
    let mut product = [vdupq_n_u32(0); 2];
    let mut pixels = [vdupq_n_u32(0); 2];
    for (p, h) in p_steps.iter().zip(h_steps) {
        let h = unsigned(h);
        let h = [vmovl_u8(vget_low_u8(h)), vmovl_high_u8(h)];
        for k in 0..2 {
            // SAFETY: the array is 16 words long and the loads need no alignment.
            let p = unsafe { vld1q_u16(p.as_ptr().add(8 * k)) };
            product[0] = vmlal_u16(product[0], vget_low_u16(p), vget_low_u16(h[k]));
            product[1] = vmlal_high_u16(product[1], p, h[k]);
            pixels[k] = vpadalq_u16(pixels[k], p);
        }
    }
    offset_off(
        vaddlvq_u32(product[0]) + vaddlvq_u32(product[1]),
        vaddlvq_u32(pixels[0]) + vaddlvq_u32(pixels[1]),
    )
}
