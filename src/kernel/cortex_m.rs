//! Cortex-M with the DSP extension (M4, M7, M33): two products an instruction.
//!
//! Four pixels and four coefficients are a word each. `uxtb16` and `sxtb16` spread the even and the odd
//! bytes of a word over two half-words, `smlad` multiplies and adds two pairs, `usada8` adds four pixels:
//! seven instructions for four pixels. Loads come on top: three for sixteen pixels where both rows lie at whole
//! words, else eight. `boards/mps2-an505/kernel.sh` compares the bits and counts.
//!
//! The functions are written as a whole, with all registers that there are: a compiler keeps two of them to itself.

use super::Sums;
use core::arch::naked_asm;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

#[inline(always)]
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    let (p, h) = (pixels.as_ptr(), coefficients.as_ptr());
    if (p as usize | h as usize | n) % 4 != 0 || n > BLOCK {
        return general(pixels, coefficients);
    }
    // SAFETY: both pointers lie at whole words and are good for n bytes, a multiple of four.
    sums(unsafe { aligned(p, h, n) })
}

/// Of any length, beginning anywhere.
#[inline(never)]
fn general(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    if n > BLOCK {
        return long(pixels, coefficients);
    }
    let whole = n & !3;
    // SAFETY: both pointers are good for `whole` bytes, a multiple of four.
    let mut all = sums(unsafe { anywhere(pixels.as_ptr(), coefficients.as_ptr(), whole) });
    if whole < n
        && let (Some(p), Some(h)) = (pixels.get(whole..n), coefficients.get(whole..n))
    {
        for (&p, &h) in p.iter().zip(h) {
            all.product += i64::from(i32::from(p) * i32::from(h));
            all.pixels += u64::from(p);
        }
    }
    all
}

/// Longer than any line: block by block.
#[cold]
fn long(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let mut all = Sums::default();
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let block = sums_u8(p, h);
        all.product += block.product;
        all.pixels += block.pixels;
    }
    all
}

/// From what `aligned` and `anywhere` return: Σ h·p below, Σ p above.
#[inline(always)]
fn sums(both: u64) -> Sums {
    Sums {
        product: i64::from(both as i32),
        pixels: both >> 32,
    }
}

/// Four pixels in `$p` and their coefficients in `$h`, both lost. Σ h·p is in r3, Σ p in r4, 0 in r5; r6 and r7 are
/// lost.
macro_rules! quad {
    ($p:literal, $h:literal) => {
        concat!(
            "usada8 r4, ",
            $p,
            ", r5, r4\n",
            "uxtb16 r6, ",
            $p,
            "\n",
            "sxtb16 r7, ",
            $h,
            "\n",
            "smlad r3, r6, r7, r3\n",
            "uxtb16 ",
            $p,
            ", ",
            $p,
            ", ror #8\n",
            "sxtb16 ",
            $h,
            ", ",
            $h,
            ", ror #8\n",
            "smlad r3, ",
            $p,
            ", ",
            $h,
            ", r3\n",
        )
    };
}

/// Sixteen pixels of rows that lie at whole words.
macro_rules! sixteen {
    () => {
        concat!(
            "ldmia r0!, {{r8-r11}}\n",
            "ldrd r12, lr, [r1], #8\n",
            quad!("r8", "r12"),
            quad!("r9", "lr"),
            "ldrd r12, lr, [r1], #8\n",
            quad!("r10", "r12"),
            quad!("r11", "lr"),
        )
    };
}

/// Four pixels that may lie anywhere: a single word's load needs no alignment on these cores (ARMv7-M and ARMv8-M with
/// UNALIGN_TRP clear, as after reset).
macro_rules! four {
    () => {
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r12, [r1], #4\n",
            quad!("r8", "r12"),
        )
    };
}

macro_rules! times {
    (4, $x:expr) => {
        concat!($x, $x, $x, $x)
    };
    (8, $x:expr) => {
        concat!(times!(4, $x), times!(4, $x))
    };
}

/// Σ h·p and Σ p of the r2 pixels at r0 and coefficients at r1, `$turn` of them a turn and what is left in fours.
macro_rules! whole_function {
    ($turn:literal, $pixels:expr) => {
        naked_asm!(
            ".cpu cortex-m33",
            "push {{r4-r11, lr}}",
            "movs r3, #0",
            "movs r4, #0",
            "movs r5, #0",
            concat!("subs r2, #", $turn),
            "blo 3f",
            "2:",
            $pixels,
            concat!("subs r2, #", $turn),
            "bhs 2b",
            "3:",
            concat!("adds r2, #", $turn),
            "beq 5f",
            "4:",
            four!(),
            "subs r2, #4",
            "bne 4b",
            "5:",
            "mov r0, r3",
            "mov r1, r4",
            "pop {{r4-r11, pc}}",
        )
    };
}

/// Rows that lie at whole words.
///
/// # Safety
/// Both pointers must lie at a multiple of four and be good for `n` bytes, a multiple of four, at most [`BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn aligned(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!("64", times!(4, sixteen!()))
}

/// Rows that lie anywhere.
///
/// # Safety
/// Both pointers must be good for `n` bytes, a multiple of four, at most [`BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn anywhere(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!("32", times!(8, four!()))
}
