//! On 64-bit Arm: a table look-up picks 16 pixels of two vectors of 16 bytes.

use super::{Groups, STEP};
use crate::kernel::Sums;
use crate::kernel::aarch64::{Parts, centred, dot_i8, dot_u8, load_i8};
use core::arch::aarch64::*;

/// Steps a block: 65536·64·128 = 2²⁹, so a whole block's sums fit 31 bits.
const BLOCK_STEPS: usize = (1 << 16) / STEP;

impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// Where steps of 16 pixels lie.
    #[inline(always)]
    fn windows(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
        bytes.windows(Self::HALF + 16).step_by(2 * Self::HALF)
    }

    /// The pixels of one of [`Self::windows`].
    #[inline]
    #[target_feature(enable = "neon")]
    fn pick(window: &[u8]) -> uint8x16_t {
        assert!(window.len() == Self::HALF + 16);
        // SAFETY: 16 bytes from the window's start on and from `HALF` on lie within it, as was just asked; the array is 16
        // bytes long.
        let (both, places) = unsafe {
            let from = window.as_ptr();
            (
                uint8x16x2_t(vld1q_u8(from), vld1q_u8(from.add(Self::HALF))),
                vld1q_u8(Self::PLACES_IN_TWO.as_ptr()),
            )
        };
        vqtbl2q_u8(both, places)
    }

    /// See [`super::Kernel::gather`].
    #[target_feature(enable = "neon")]
    pub(super) fn gather_neon(from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        let (steps, _) = to.as_chunks_mut::<STEP>();
        let wanted = pixels.div_ceil(STEP);
        let mut done = 0;
        for (window, step) in Self::windows(from).zip(steps).take(wanted) {
            // SAFETY: the array is 16 bytes long and the store needs no alignment.
            unsafe { vst1q_u8(step.as_mut_ptr(), Self::pick(window)) };
            done += STEP;
        }
        pixels.min(done)
    }

    /// Sums of as many whole steps as can be read, and how many pixels that are.
    #[target_feature(enable = "neon")]
    pub(super) fn sums_neon(bytes: &[u8], coefficients: &[i8]) -> (Sums, usize) {
        Self::blocks(bytes, coefficients, |bytes, h| Self::block(bytes, h))
    }

    /// As [`Self::sums_neon`], with the dot-product instructions.
    #[target_feature(enable = "neon,dotprod")]
    pub(super) fn sums_dot(bytes: &[u8], coefficients: &[i8]) -> (Sums, usize) {
        Self::blocks(bytes, coefficients, |bytes, h| Self::block_dot(bytes, h))
    }

    #[inline(always)]
    fn blocks(
        bytes: &[u8],
        coefficients: &[i8],
        block: impl Fn(&[u8], &[[i8; STEP]]) -> Parts,
    ) -> (Sums, usize) {
        let readable = (bytes.len() + Self::HALF).saturating_sub(16) / (2 * Self::HALF);
        let (steps, _) = coefficients.as_chunks::<STEP>();
        let steps = steps.get(..readable).unwrap_or(steps);
        let mut all = Sums::default();
        for (number, h) in steps.chunks(BLOCK_STEPS).enumerate() {
            let from = bytes.get(number * BLOCK_STEPS * 2 * Self::HALF..);
            let sums = block(from.unwrap_or_default(), h).sums(128, Sums::default());
            all.product += sums.product;
            all.pixels += sums.pixels;
        }
        (all, steps.len() * STEP)
    }

    /// `bytes` must hold all steps that there are coefficients for.
    #[target_feature(enable = "neon")]
    fn block(bytes: &[u8], steps: &[[i8; STEP]]) -> Parts {
        let (mut product, mut coefficients) = (vdupq_n_s32(0), vdupq_n_s32(0));
        let mut pixels = vdupq_n_u32(0);
        for (window, h) in Self::windows(bytes).zip(steps) {
            let (p, h) = (Self::pick(window), load_i8(h));
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

    /// As [`Self::block`], with the dot-product instructions.
    #[target_feature(enable = "neon,dotprod")]
    fn block_dot(bytes: &[u8], steps: &[[i8; STEP]]) -> Parts {
        let (mut product, mut coefficients) = (vdupq_n_s32(0), vdupq_n_s32(0));
        let mut pixels = vdupq_n_u32(0);
        let (ones, ones_u) = (vdupq_n_s8(1), vdupq_n_u8(1));
        for (window, h) in Self::windows(bytes).zip(steps) {
            let (p, h) = (Self::pick(window), load_i8(h));
            product = dot_i8(product, centred(p), h);
            coefficients = dot_i8(coefficients, ones, h);
            pixels = dot_u8(pixels, p, ones_u);
        }
        Parts {
            product: vaddlvq_s32(product),
            pixels: vaddlvq_u32(pixels),
            coefficients: vaddlvq_s32(coefficients),
        }
    }
}
