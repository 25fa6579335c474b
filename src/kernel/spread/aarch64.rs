//! On 64-bit Arm: 64 pixels are four table look-ups, each in two neighbouring vectors of 16 bytes.

use super::{Groups, Packed10};
use core::arch::aarch64::*;

/// Bytes of a step of any kind, at most.
const MOST: usize = 128;

impl<const PIXELS: usize, const BYTES: usize, const FIRST: usize> Groups<PIXELS, BYTES, FIRST> {
    /// Bytes of a step of 64 pixels: whole groups, and whole vectors.
    pub(in crate::kernel) const STEP_BYTES: usize = 64 / PIXELS * BYTES;

    /// In which vector of a step the look-up of each 16 pixels begins.
    const VECTORS: [usize; 4] = {
        let mut vectors = [0; 4];
        let mut k = 0;
        while k < 4 {
            vectors[k] = Self::place(16 * k) / 16;
            k += 1;
        }
        vectors
    };

    /// The places of the pixels in those two vectors.
    const PLACES: [[u8; 16]; 4] = {
        let mut places = [[0; 16]; 4];
        let mut x = 0;
        while x < 64 {
            let place = Self::place(x) - 16 * Self::VECTORS[x / 16];
            assert!(
                place < 32 && 16 * Self::VECTORS[x / 16] + 32 <= Self::STEP_BYTES
                    || PIXELS == BYTES
            );
            places[x / 16][x % 16] = place as u8;
            x += 1;
        }
        places
    };

    /// The pixels of a step.
    ///
    /// # Safety
    /// From `step` on there are [`Self::STEP_BYTES`] bytes.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(in crate::kernel) unsafe fn pixels_64(step: *const u8) -> [uint8x16_t; 4] {
        let pick = |k: usize| {
            if PIXELS == BYTES {
                // SAFETY: the vector lies within the step.
                return unsafe { vld1q_u8(step.add(16 * k)) };
            }
            // SAFETY: the caller says so.
            unsafe { Self::pick(step, k, &const { Self::PLACES }[k]) }
        };
        [pick(0), pick(1), pick(2), pick(3)]
    }

    /// Of a step the bytes at `places`, as [`Self::PLACES`] says.
    ///
    /// # Safety
    /// As of [`Self::pixels_64`].
    #[inline]
    #[target_feature(enable = "neon")]
    unsafe fn pick(step: *const u8, k: usize, places: &[u8; 16]) -> uint8x16_t {
        let first = 16 * const { Self::VECTORS }[k];
        // SAFETY: both vectors lie within the step, as `PLACES` made sure, and the array is 16 bytes long; no load needs
        // alignment.
        let (both, places) = unsafe {
            (
                uint8x16x2_t(vld1q_u8(step.add(first)), vld1q_u8(step.add(first + 16))),
                vld1q_u8(places.as_ptr()),
            )
        };
        vqtbl2q_u8(both, places)
    }

    /// See [`super::Kernel::gather`].
    #[target_feature(enable = "neon")]
    pub(super) fn gather_neon(from: &[u8], to: &mut [u8], pixels: usize) -> usize {
        let wanted = pixels.min(to.len());
        let (steps, rest) = to[..wanted].as_chunks_mut::<64>();
        let mut done = 0;
        for (p, step) in from.chunks_exact(Self::STEP_BYTES).zip(steps) {
            // SAFETY: the chunk is a step.
            store(unsafe { Self::pixels_64(p.as_ptr()) }, step);
            done += 64;
        }
        if !rest.is_empty() && done + rest.len() == wanted {
            let mut last = [0; 64];
            let from = from.get(done / PIXELS * BYTES..).unwrap_or_default();
            let there = Self::gather_rest(from, &mut last).min(rest.len());
            rest[..there].copy_from_slice(&last[..there]);
            done += there;
        }
        done
    }

    /// Less than a step: how many pixels there are, of whole groups.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(in crate::kernel) fn gather_rest(from: &[u8], to: &mut [u8; 64]) -> usize {
        let mut step = [0; MOST];
        let there = from.len().min(Self::STEP_BYTES);
        step[..there].copy_from_slice(&from[..there]);
        const { assert!(Self::STEP_BYTES <= MOST) };
        // SAFETY: the array is at least a step.
        store(unsafe { Self::pixels_64(step.as_ptr()) }, to);
        there / BYTES * PIXELS
    }
}

impl Packed10 {
    /// Where the lower bits of each pixel are, as [`Self::PLACES`].
    const PLACES_OF_LOWER: [[u8; 16]; 4] = {
        let mut places = [[0; 16]; 4];
        let mut x = 0;
        while x < 64 {
            let place = x / 4 * 5 + 4 - 16 * Self::VECTORS[x / 16];
            assert!(place < 32);
            places[x / 16][x % 16] = place as u8;
            x += 1;
        }
        places
    };

    /// See [`super::unpack_10`].
    #[target_feature(enable = "neon")]
    pub(super) fn unpack_neon(from: &[u8], to: &mut [u16]) -> usize {
        const RIGHT: [i8; 16] = [0, -2, -4, -6, 0, -2, -4, -6, 0, -2, -4, -6, 0, -2, -4, -6];
        // SAFETY: the array is 16 bytes long and the load needs no alignment.
        let right = unsafe { vld1q_s8(RIGHT.as_ptr()) };
        let (steps, _) = to.as_chunks_mut::<64>();
        let mut done = 0;
        for (p, step) in from.chunks_exact(Self::STEP_BYTES).zip(steps) {
            // SAFETY: the chunk is a step.
            let high = unsafe { Self::pixels_64(p.as_ptr()) };
            let (parts, _) = step.as_chunks_mut::<16>();
            for (k, part) in parts.iter_mut().enumerate() {
                // SAFETY: the chunk is a step.
                let low = unsafe { Self::pick(p.as_ptr(), k, &const { Self::PLACES_OF_LOWER }[k]) };
                let low = vandq_u8(vshlq_u8(low, right), vdupq_n_u8(3));
                let (high, to) = (high[k], part.as_mut_ptr());
                let first = vaddw_u8(vshll_n_u8::<2>(vget_low_u8(high)), vget_low_u8(low));
                let second = vaddw_high_u8(vshll_high_n_u8::<2>(high), low);
                // SAFETY: the array is 16 words long and the stores need no alignment.
                unsafe {
                    vst1q_u16(to, first);
                    vst1q_u16(to.add(8), second);
                }
            }
            done += 64;
        }
        done
    }
}

#[inline]
#[target_feature(enable = "neon")]
fn store(pixels: [uint8x16_t; 4], to: &mut [u8; 64]) {
    let (parts, _) = to.as_chunks_mut::<16>();
    for (part, p) in parts.iter_mut().zip(pixels) {
        // SAFETY: the array is 16 bytes long and the store needs no alignment.
        unsafe { vst1q_u8(part.as_mut_ptr(), p) };
    }
}
