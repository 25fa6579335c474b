//! NEON: 16 pixels a step, with the dot-product instructions of Armv8.2 (Raspberry Pi 5) or without
//! (Raspberry Pi 3, 4 and Zero 2).
//!
//! NEON multiplies signed by signed. A pixel with its top bit flipped is a signed number, smaller by half
//! the range, so Σ h·p = Σ h·(p − half) + half·Σ h, whatever Σ h is.

use super::{Sums, portable};
use core::arch::{aarch64::*, asm};

/// Pixels a block: 65536·64·128 = 2²⁹, so a whole block's sums fit 31 bits.
const BLOCK_U8: usize = 1 << 16;
/// The same for deep pixels, a lane of four: 2048/4·64·32768 = 2³⁰.
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

/// The sums of some steps, before the pixels' top bits are put back.
pub(super) struct Parts {
    /// Σ h·(p − half).
    pub(super) product: i64,
    /// Σ p.
    pub(super) pixels: u64,
    /// Σ h.
    pub(super) coefficients: i64,
}

impl Parts {
    pub(super) fn sums(self, half: i64, rest: Sums) -> Sums {
        Sums {
            product: self.product + half * self.coefficients + rest.product,
            pixels: self.pixels + rest.pixels,
        }
    }
}

/// Cuts both sides to the shorter length and into blocks, and adds up what `steps` makes of each.
#[inline(always)]
fn blocks<P, const STEP: usize>(
    pixels: &[P],
    coefficients: &[i8],
    block: usize,
    half: i64,
    steps: impl Fn(&[[P; STEP]], &[[i8; STEP]]) -> Parts,
    rest: impl Fn(&[P], &[i8]) -> Sums,
) -> Sums {
    let n = pixels.len().min(coefficients.len());
    let mut all = Sums::default();
    for (p, h) in pixels[..n]
        .chunks(block)
        .zip(coefficients[..n].chunks(block))
    {
        let (p_steps, p_rest) = p.as_chunks::<STEP>();
        let (h_steps, h_rest) = h.as_chunks::<STEP>();
        let sums = steps(p_steps, h_steps).sums(half, rest(p_rest, h_rest));
        all.product += sums.product;
        all.pixels += sums.pixels;
    }
    all
}

#[target_feature(enable = "neon")]
fn load_u8(bytes: &[u8; 16]) -> uint8x16_t {
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    unsafe { vld1q_u8(bytes.as_ptr()) }
}

#[target_feature(enable = "neon")]
pub(super) fn load_i8(bytes: &[i8; 16]) -> int8x16_t {
    // SAFETY: the array is 16 bytes long and the load needs no alignment.
    unsafe { vld1q_s8(bytes.as_ptr()) }
}

/// p − 128 as signed bytes.
#[target_feature(enable = "neon")]
pub(super) fn centred(p: uint8x16_t) -> int8x16_t {
    vreinterpretq_s8_u8(veorq_u8(p, vdupq_n_u8(0x80)))
}

/// `sum` + products of four neighbouring bytes each (the intrinsic is not stable yet).
#[target_feature(enable = "neon,dotprod")]
pub(super) fn dot_i8(mut sum: int32x4_t, a: int8x16_t, b: int8x16_t) -> int32x4_t {
    // SAFETY: registers only; the instruction is there, the function is compiled for it.
    unsafe {
        asm!("sdot {0:v}.4s, {1:v}.16b, {2:v}.16b", inout(vreg) sum, in(vreg) a, in(vreg) b,
            options(pure, nomem, nostack, preserves_flags));
    }
    sum
}

/// As [`dot_i8`], unsigned.
#[target_feature(enable = "neon,dotprod")]
pub(super) fn dot_u8(mut sum: uint32x4_t, a: uint8x16_t, b: uint8x16_t) -> uint32x4_t {
    // SAFETY: registers only; the instruction is there, the function is compiled for it.
    unsafe {
        asm!("udot {0:v}.4s, {1:v}.16b, {2:v}.16b", inout(vreg) sum, in(vreg) a, in(vreg) b,
            options(pure, nomem, nostack, preserves_flags));
    }
    sum
}

#[target_feature(enable = "neon,dotprod")]
fn steps_u8_dot(p_steps: &[[u8; 16]], h_steps: &[[i8; 16]]) -> Parts {
    let zero = vdupq_n_s32(0);
    // Two sets of sums hide the latency of the dot products.
    let (mut product, mut coefficients) = ([zero; 2], [zero; 2]);
    let mut pixels = [vdupq_n_u32(0); 2];
    let (ones, ones_u) = (vdupq_n_s8(1), vdupq_n_u8(1));
    let (p_pairs, p_last) = p_steps.as_chunks::<2>();
    let (h_pairs, h_last) = h_steps.as_chunks::<2>();
    for (p, h) in p_pairs.iter().zip(h_pairs) {
        for i in 0..2 {
            let (p, h) = (load_u8(&p[i]), load_i8(&h[i]));
            product[i] = dot_i8(product[i], centred(p), h);
            coefficients[i] = dot_i8(coefficients[i], ones, h);
            pixels[i] = dot_u8(pixels[i], p, ones_u);
        }
    }
    for (p, h) in p_last.iter().zip(h_last) {
        let (p, h) = (load_u8(p), load_i8(h));
        product[0] = dot_i8(product[0], centred(p), h);
        coefficients[0] = dot_i8(coefficients[0], ones, h);
        pixels[0] = dot_u8(pixels[0], p, ones_u);
    }
    Parts {
        product: vaddlvq_s32(product[0]) + vaddlvq_s32(product[1]),
        pixels: vaddlvq_u32(pixels[0]) + vaddlvq_u32(pixels[1]),
        coefficients: vaddlvq_s32(coefficients[0]) + vaddlvq_s32(coefficients[1]),
    }
}

#[target_feature(enable = "neon")]
fn steps_u8(p_steps: &[[u8; 16]], h_steps: &[[i8; 16]]) -> Parts {
    let (mut product, mut coefficients) = (vdupq_n_s32(0), vdupq_n_s32(0));
    let mut pixels = vdupq_n_u32(0);
    for (p, h) in p_steps.iter().zip(h_steps) {
        let (p, h) = (load_u8(p), load_i8(h));
        let c = centred(p);
        // Two products of at most 128·64 a lane stay in 16 bits.
        let pair = vmull_s8(vget_low_s8(c), vget_low_s8(h));
        let pair = vmlal_high_s8(pair, c, h);
        product = vpadalq_s16(product, pair);
        coefficients = vpadalq_s16(coefficients, vpaddlq_s8(h));
        pixels = vpadalq_u16(pixels, vpaddlq_u8(p));
    }
    Parts {
        product: vaddlvq_s32(product),
        pixels: vaddlvq_u32(pixels),
        coefficients: vaddlvq_s32(coefficients),
    }
}

#[target_feature(enable = "neon")]
fn steps_u16(p_steps: &[[u16; 16]], h_steps: &[[i8; 16]]) -> Parts {
    let zero = vdupq_n_s32(0);
    let (mut product, mut coefficients) = ([zero; 2], zero);
    let mut pixels = vdupq_n_u32(0);
    for (p, h) in p_steps.iter().zip(h_steps) {
        let h = load_i8(h);
        // SAFETY: the array is 32 bytes long and the loads need no alignment.
        let p = unsafe { [vld1q_u16(p.as_ptr()), vld1q_u16(p.as_ptr().add(8))] };
        for (p, h) in [(p[0], vmovl_s8(vget_low_s8(h))), (p[1], vmovl_high_s8(h))] {
            let c = vreinterpretq_s16_u16(veorq_u16(p, vdupq_n_u16(0x8000)));
            product[0] = vmlal_s16(product[0], vget_low_s16(c), vget_low_s16(h));
            product[1] = vmlal_high_s16(product[1], c, h);
            pixels = vpadalq_u16(pixels, p);
        }
        coefficients = vpadalq_s16(coefficients, vpaddlq_s8(h));
    }
    Parts {
        product: vaddlvq_s32(product[0]) + vaddlvq_s32(product[1]),
        pixels: vaddlvq_u32(pixels),
        coefficients: vaddlvq_s32(coefficients),
    }
}

#[target_feature(enable = "neon,dotprod")]
pub(super) fn sums_u8_dot(pixels: &[u8], coefficients: &[i8]) -> Sums {
    blocks(
        pixels,
        coefficients,
        BLOCK_U8,
        128,
        |p, h| steps_u8_dot(p, h),
        portable::sums_u8,
    )
}

#[target_feature(enable = "neon")]
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    blocks(
        pixels,
        coefficients,
        BLOCK_U8,
        128,
        |p, h| steps_u8(p, h),
        portable::sums_u8,
    )
}

#[target_feature(enable = "neon")]
pub(super) fn sums_u16(pixels: &[u16], coefficients: &[i8]) -> Sums {
    blocks(
        pixels,
        coefficients,
        BLOCK_U16,
        32768,
        |p, h| steps_u16(p, h),
        portable::sums_u16,
    )
}
