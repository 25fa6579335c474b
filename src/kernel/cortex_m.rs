//! Cortex-M with the DSP extension (M4, M7, M33): two products an instruction.
//!
//! Four pixels and four coefficients are a word each. `uxtb16` and `sxtb16` spread the even and the odd
//! bytes of a word over two half-words, `smlad` multiplies and adds two pairs, `usada8` adds four pixels:
//! nine instructions for four pixels. The sums are 32 bits wide: 64·255·4096 < 2³¹.

use super::{Sums, portable};
use core::arch::asm;

/// Pixels a block: its sums fit 32 bits.
const BLOCK: usize = 4096;

pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    let mut sums = Sums::default();
    let (Some(pixels), Some(coefficients)) = (pixels.get(..n), coefficients.get(..n)) else {
        return sums;
    };
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let (p_steps, p_rest) = p.as_chunks::<16>();
        let (h_steps, h_rest) = h.as_chunks::<16>();
        let (product, plain) = block(p_steps, h_steps);
        let rest = portable::sums_u8(p_rest, h_rest);
        sums.product += i64::from(product) + rest.product;
        sums.pixels += u64::from(plain) + rest.pixels;
    }
    sums
}

/// The instructions for four pixels at an offset.
macro_rules! quad {
    ($at:literal) => {
        concat!(
            "ldr {a}, [{p}, #",
            $at,
            "]\n",
            "ldr {b}, [{h}, #",
            $at,
            "]\n",
            "usada8 {plain}, {a}, {zero}, {plain}\n",
            "uxtb16 {c}, {a}\n",
            "sxtb16 {d}, {b}\n",
            "smlad {product}, {c}, {d}, {product}\n",
            "uxtb16 {a}, {a}, ror #8\n",
            "sxtb16 {b}, {b}, ror #8\n",
            "smlad {product}, {a}, {b}, {product}\n",
        )
    };
}

/// Sixteen pixels a turn: eight loads, sixteen extensions, eight `smlad`, four `usada8` and four to count.
fn block(pixels: &[[u8; 16]], coefficients: &[[i8; 16]]) -> (i32, u32) {
    let turns = pixels.len().min(coefficients.len());
    let (mut product, mut plain) = (0i32, 0u32);
    if turns == 0 {
        return (product, plain);
    }
    // SAFETY: the loop reads `turns` times 16 bytes from either pointer, and both slices hold so many;
    // single-word loads need no alignment on these cores (ARMv7-M and ARMv8-M with UNALIGN_TRP clear,
    // as after reset). Nothing is written, and no flag is assumed.
    unsafe {
        asm!(
            "2:",
            quad!("0"),
            quad!("4"),
            quad!("8"),
            quad!("12"),
            "adds {p}, #16",
            "adds {h}, #16",
            "subs {n}, #1",
            "bne 2b",
            p = inout(reg) pixels.as_ptr() => _,
            h = inout(reg) coefficients.as_ptr() => _,
            n = inout(reg) turns => _,
            product = inout(reg) product,
            plain = inout(reg) plain,
            zero = in(reg) 0,
            a = out(reg) _,
            b = out(reg) _,
            c = out(reg) _,
            d = out(reg) _,
            options(nostack, readonly),
        );
    }
    (product, plain)
}
