//! Cortex-M with the DSP extension (M4, M7, M33): two products an instruction.
//!
//! Four pixels and four coefficients are a word each. `uxtb16` and `sxtb16` spread the even and the odd
//! bytes of a word over two half-words, `smlad` multiplies and adds two pairs, `usada8` adds four pixels:
//! seven instructions for four pixels. Loads come on top: one for two words where both rows lie at whole
//! words, else one a word. 256 pixels take 520 and 584 instructions.

use super::Sums;
use core::arch::asm;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// Pixels a turn of the long loop.
const TURN: usize = 64;

#[inline(always)]
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let n = pixels.len().min(coefficients.len());
    if n > BLOCK {
        return long(pixels, coefficients);
    }
    let (mut product, mut plain) = words(pixels.as_ptr(), coefficients.as_ptr(), n);
    if n % 4 != 0 {
        (product, plain) = rest(product, plain, pixels, coefficients);
    }
    Sums {
        product: i64::from(product),
        pixels: u64::from(plain),
    }
}

/// Longer than any line: block by block.
#[cold]
fn long(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let block = sums_u8(p, h);
        sums.product += block.product;
        sums.pixels += block.pixels;
    }
    sums
}

/// Adds the pixels beyond the last whole word.
#[cold]
fn rest(product: i32, plain: u32, pixels: &[u8], coefficients: &[i8]) -> (i32, u32) {
    let n = pixels.len().min(coefficients.len());
    let rest = n - n % 4..n;
    let (Some(p), Some(h)) = (pixels.get(rest.clone()), coefficients.get(rest)) else {
        return (product, plain);
    };
    let pairs = p.iter().zip(h);
    pairs.fold((product, plain), |(product, plain), (&p, &h)| {
        (
            product.wrapping_add(i32::from(p) * i32::from(h)),
            plain.wrapping_add(u32::from(p)),
        )
    })
}

/// Four pixels in `$a` and their coefficients in `$b`, both lost.
macro_rules! quad {
    ($a:literal, $b:literal) => {
        concat!(
            "usada8 {plain}, {",
            $a,
            "}, {zero}, {plain}\n",
            "uxtb16 {t}, {",
            $a,
            "}\n",
            "sxtb16 {u}, {",
            $b,
            "}\n",
            "smlad {product}, {t}, {u}, {product}\n",
            "uxtb16 {",
            $a,
            "}, {",
            $a,
            "}, ror #8\n",
            "sxtb16 {",
            $b,
            "}, {",
            $b,
            "}, ror #8\n",
            "smlad {product}, {",
            $a,
            "}, {",
            $b,
            "}, {product}\n",
        )
    };
}

/// Eight pixels of rows that lie at whole words.
macro_rules! aligned {
    () => {
        concat!(
            "ldrd {a}, {c}, [{p}], #8\n",
            "ldrd {b}, {d}, [{h}], #8\n",
            quad!("a", "b"),
            quad!("c", "d"),
        )
    };
}

/// Four pixels that may lie anywhere.
macro_rules! anywhere {
    () => {
        concat!(
            "ldr {a}, [{p}], #4\n",
            "ldr {b}, [{h}], #4\n",
            quad!("a", "b"),
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
    (16, $x:expr) => {
        concat!(times!(8, $x), times!(8, $x))
    };
}

/// The sums over all whole words of the `n` ≤ [`BLOCK`] pixels and coefficients that both pointers must be
/// good for. A call costs less than a second copy in flash.
#[inline(never)]
fn words(mut p: *const u8, mut h: *const i8, n: usize) -> (i32, u32) {
    let (mut product, mut plain) = (0i32, 0u32);
    let turns = n / TURN;
    if turns > 0 {
        // SAFETY: either loop reads `turns` times 64 bytes from either pointer, and both are good
        // for so many. `ldrd` needs whole words, which is asked for; single-word loads need no alignment on
        // these cores (ARMv7-M and ARMv8-M with UNALIGN_TRP clear, as after reset). Nothing is written.
        unsafe {
            if (p as usize | h as usize) % 4 == 0 {
                asm!(
                    "2:",
                    times!(8, aligned!()),
                    "subs {n}, #1",
                    "bne 2b",
                    p = inout(reg) p,
                    h = inout(reg) h,
                    n = inout(reg) turns => _,
                    product = inout(reg) product,
                    plain = inout(reg) plain,
                    zero = in(reg) 0,
                    a = out(reg) _,
                    b = out(reg) _,
                    c = out(reg) _,
                    d = out(reg) _,
                    t = out(reg) _,
                    u = out(reg) _,
                    options(nostack, readonly),
                );
            } else {
                asm!(
                    "2:",
                    times!(16, anywhere!()),
                    "subs {n}, #1",
                    "bne 2b",
                    p = inout(reg) p,
                    h = inout(reg) h,
                    n = inout(reg) turns => _,
                    product = inout(reg) product,
                    plain = inout(reg) plain,
                    zero = in(reg) 0,
                    a = out(reg) _,
                    b = out(reg) _,
                    t = out(reg) _,
                    u = out(reg) _,
                    options(nostack, readonly),
                );
            }
        }
    }
    let left = n % TURN / 4;
    if left > 0 {
        // SAFETY: as above; `turns`·64 + `left`·4 ≤ n bytes are read in all.
        unsafe {
            asm!(
                "2:",
                anywhere!(),
                "subs {n}, #1",
                "bne 2b",
                p = inout(reg) p => _,
                h = inout(reg) h => _,
                n = inout(reg) left => _,
                product = inout(reg) product,
                plain = inout(reg) plain,
                zero = in(reg) 0,
                a = out(reg) _,
                b = out(reg) _,
                t = out(reg) _,
                u = out(reg) _,
                options(nostack, readonly),
            );
        }
    }
    (product, plain)
}
