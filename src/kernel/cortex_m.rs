//! Cortex-M with the DSP extension (M4, M7, M33): two products an instruction.
//!
//! Coefficients that are kept lie two by two, as differences ([`super::pairs`]). For four pixels and what is kept, a word each,
//! `uxtab16` adds the even pixels to those so far, `eor` turns the uppermost bits of the pixels over, two `smlad` multiply and
//! add two pairs each, and `sxtab16` makes the next odd coefficients: five instructions for four pixels, and the even pixels
//! are added up. Loads come on top: two for sixteen pixels where the rows lie at whole words, else eight. A part of a row takes
//! two instructions more, for where it ends and for the sum of its odd coefficients. `boards/mps2-an505/kernel.sh` compares
//! the bits and counts.
//!
//! The functions are written as a whole, with all registers that there are: a compiler keeps two of them to itself.

use super::{LineSums, Sums, pairs};
use core::arch::naked_asm;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// The same of coefficients that are kept, whose sums are 256 times as large; every fourth pixel fits 15 bits, 128·255 < 2¹⁵.
const KEPT_BLOCK: usize = 1 << 9;

/// Of a line and its whole row, as it is kept; the shorter length of the two counts. Σ p is that of the even columns.
#[inline(always)]
pub(super) fn kept_u8(pixels: &[u8], row: &[i8]) -> LineSums {
    let n = pixels.len();
    let (p, h) = (pixels.as_ptr(), row.as_ptr());
    if n > KEPT_BLOCK || (p as usize | h as usize | n) % 4 != 0 || n != row.len() {
        return kept_anyhow_u8(pixels, row);
    }
    // SAFETY: both pointers lie at whole words and are good for n bytes, a multiple of four.
    apart(unsafe { whole(p, h, n) })
}

/// [`kept_u8`] of a line that lies anyhow; apart, or most lines would jump over it.
#[cold]
#[inline(never)]
fn kept_anyhow_u8(pixels: &[u8], row: &[i8]) -> LineSums {
    kept_part_u8(pixels, row, 0)
}

/// [`kept_u8`], and Σ h'·p with a second row that is kept: the pixels are loaded and added up once.
#[inline(always)]
pub(super) fn kept_both_u8(pixels: &[u8], row: &[i8], second: &[i8]) -> (LineSums, i32) {
    let n = pixels.len();
    let (p, h, g) = (pixels.as_ptr(), row.as_ptr(), second.as_ptr());
    let lies = (p as usize | h as usize | g as usize | n) % 4 == 0;
    if n > KEPT_BLOCK || !lies || n != row.len() || n != second.len() {
        let sums = kept_part_u8(pixels, row, 0);
        return (sums, kept_part_u8(pixels, second, 0).product);
    }
    let mut even = 0;
    // SAFETY: all three pointers lie at whole words and are good for n bytes, a multiple of four.
    let both = unsafe { both(p, h, g, n, &mut even) };
    let sums = LineSums {
        product: both as i32,
        pixels: even,
    };
    (sums, (both >> 32) as i32)
}

/// Of any part of a row that is kept, from column `from` on.
#[inline(never)]
pub(super) fn kept_part_u8(pixels: &[u8], row: &[i8], from: usize) -> LineSums {
    let n = pixels.len().min(row.len().saturating_sub(from));
    let mut all = LineSums::default();
    // To where two by two begin.
    let head = (from & 1).min(n);
    let whole = (n - head) & !3;
    if let (1, Some(&p)) = (head, pixels.first()) {
        let [_, odd, ..] = pairs::of_lanes(pairs::from(row, from - 1));
        all.product = i32::from(p) * i32::from(odd);
    }
    let first = from + head;
    let mut lanes = pairs::from(row, first);
    let mut done = 0;
    while done < whole {
        let block = (whole - done).min(KEPT_BLOCK);
        // SAFETY: `head + whole` is at most `n`, which is no more than the pixels are, nor than the columns from `from` on;
        // a block is a multiple of four.
        all.add(apart(unsafe {
            let line = pixels.as_ptr().add(head + done);
            part(line, row.as_ptr().add(first + done), block, &mut lanes)
        }));
        done += block;
    }
    if head + whole == n {
        return all;
    }
    let rest = pixels.get(head + whole..n).unwrap_or_default();
    for (x, (&p, h)) in rest.iter().zip(pairs::of_lanes(lanes)).enumerate() {
        all.add(LineSums {
            product: i32::from(p) * i32::from(h),
            pixels: if x % 2 == 0 { u32::from(p) } else { 0 },
        });
    }
    all
}

/// Of coefficients as they are.
pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let mut all = Sums::default();
    for (p, h) in pixels.chunks(BLOCK).zip(coefficients.chunks(BLOCK)) {
        let n = p.len().min(h.len());
        let whole = n & !3;
        // SAFETY: both pointers are good for `whole` bytes, a multiple of four.
        let block = apart(unsafe { anywhere(p.as_ptr(), h.as_ptr(), whole) });
        all.product += i64::from(block.product);
        all.pixels += u64::from(block.pixels);
        let rest = p.get(whole..n).into_iter().flatten();
        for (&p, &h) in rest.zip(h.get(whole..n).into_iter().flatten()) {
            all.product += i64::from(i32::from(p) * i32::from(h));
            all.pixels += u64::from(p);
        }
    }
    all
}

/// From what the functions below return: Σ h·p below, Σ p above.
#[inline(always)]
fn apart(both: u64) -> LineSums {
    LineSums {
        product: both as i32,
        pixels: (both >> 32) as u32,
    }
}

/// Four pixels in `$p`, lost, and what is kept of their coefficients in `$h`. The sum of both products is in r3, the odd
/// coefficients in r6, the even pixels so far in r7.
macro_rules! pairs {
    ($p:literal, $h:literal) => {
        concat!(
            "uxtab16 r7, r7, ",
            $p,
            "\nsmlad r3, r7, ",
            $h,
            ", r3\neor ",
            $p,
            ", ",
            $p,
            ", #0x80008000\nsmlad r3, ",
            $p,
            ", r6, r3\nsxtab16 r6, r6, ",
            $h,
            "\n",
        )
    };
}

/// Sixteen pixels of rows that lie at whole words.
macro_rules! sixteen {
    () => {
        concat!(
            "ldmia r0!, {{r8-r11}}\n",
            "ldmia r1!, {{r4, r5, r12, lr}}\n",
            pairs!("r8", "r4"),
            pairs!("r9", "r5"),
            pairs!("r10", "r12"),
            pairs!("r11", "lr"),
        )
    };
}

/// Four pixels that may lie anywhere: a single word's load needs no alignment on these cores (ARMv7-M and ARMv8-M with
/// UNALIGN_TRP clear, as after reset). Their coefficients are those of r9, two by two; the odd ones are added up in r4; 1 is
/// in both halves of r10.
macro_rules! part_of_four {
    () => {
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r12, [r1], #4\n",
            "uxtab16 r7, r7, r8\n",
            "smlad r3, r7, r12, r3\n",
            "sxtb16 r5, r9\n",
            "eor r8, r8, #0x80008000\n",
            "smlad r3, r8, r5, r3\n",
            "smlad r4, r5, r10, r4\n",
            "sadd16 r9, r9, r12\n",
        )
    };
}

/// Four pixels and coefficients as they are, anywhere. Σ h·p is in r3; r6 and r7 are lost.
macro_rules! four {
    () => {
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r12, [r1], #4\n",
            "usada8 r4, r8, r5, r4\n",
            "uxtb16 r6, r8\n",
            "sxtb16 r7, r12\n",
            "smlad r3, r6, r7, r3\n",
            "uxtb16 r8, r8, ror #8\n",
            "sxtb16 r12, r12, ror #8\n",
            "smlad r3, r8, r12, r3\n",
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

/// The sums of the r2 pixels at r0 and coefficients at r1: `$turn` of them a turn, `$pixels`, and what is left in fours,
/// `$four`. Then `$end` makes Σ h·p in r0 and Σ p in r1 of what is there.
macro_rules! whole_function {
    ($push:literal, $begin:expr, $turn:literal, $pixels:expr, $four:expr, $end:expr, $pop:literal) => {
        naked_asm!(
            ".cpu cortex-m33",
            $push,
            "movs r3, #0",
            $begin,
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
            $four,
            "subs r2, #4",
            "bne 4b",
            "5:",
            $end,
            $pop,
        )
    };
}

/// The even pixels so far make Σ p.
macro_rules! even_pixels {
    () => {
        "uxth r1, r7\nadd r1, r1, r7, lsr #16\n"
    };
}

/// A whole row that is kept; both sides lie at whole words. Σ p is that of the even columns.
///
/// # Safety
/// Both pointers must lie at a multiple of four and be good for `n` bytes, a multiple of four, at most [`KEPT_BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn whole(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!(
        "push {{r4-r11, lr}}",
        "movs r6, #0\nmovs r7, #0",
        "64",
        times!(4, sixteen!()),
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r4, [r1], #4\n",
            pairs!("r8", "r4")
        ),
        concat!("asrs r0, r3, #8\n", even_pixels!()),
        "pop {{r4-r11, pc}}"
    )
}

/// Four pixels in `$p`, lost, and what is kept of both rows' coefficients in `$h` and `$g`. The sums of the products are in r3
/// and r4, the odd coefficients in r5 and r6, the even pixels so far in r7.
macro_rules! both_pairs {
    ($p:literal, $h:literal, $g:literal) => {
        concat!(
            "uxtab16 r7, r7, ",
            $p,
            "\nsmlad r3, r7, ",
            $h,
            ", r3\nsmlad r4, r7, ",
            $g,
            ", r4\neor ",
            $p,
            ", ",
            $p,
            ", #0x80008000\nsmlad r3, ",
            $p,
            ", r5, r3\nsmlad r4, ",
            $p,
            ", r6, r4\nsxtab16 r5, r5, ",
            $h,
            "\nsxtab16 r6, r6, ",
            $g,
            "\n",
        )
    };
}

/// Eight pixels of rows that lie at whole words.
macro_rules! eight_of_both {
    () => {
        concat!(
            "ldrd r8, r9, [r0], #8\n",
            "ldrd r10, r11, [r1], #8\n",
            "ldrd r12, lr, [r2], #8\n",
            both_pairs!("r8", "r10", "r12"),
            both_pairs!("r9", "r11", "lr"),
        )
    };
}

/// Two whole rows that are kept; all sides lie at whole words. Σ h·p is below, Σ h'·p above, and Σ p of the even columns in
/// `even`. How many pixels are left is kept on the stack: there is no register for it.
///
/// # Safety
/// All pointers must lie at a multiple of four and be good for `n` bytes, a multiple of four, at most [`KEPT_BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn both(
    p: *const u8,
    h: *const i8,
    g: *const i8,
    n: usize,
    even: &mut u32,
) -> u64 {
    naked_asm!(
        ".cpu cortex-m33",
        "push {{r4-r11, lr}}",
        "push {{r3}}",
        "mov r8, r3",
        "movs r3, #0\nmovs r4, #0\nmovs r5, #0\nmovs r6, #0\nmovs r7, #0",
        "subs r8, r8, #64",
        "str r8, [sp]",
        "blo 3f",
        "2:",
        times!(8, eight_of_both!()),
        "ldr r8, [sp]",
        "subs r8, r8, #64",
        "str r8, [sp]",
        "bhs 2b",
        "3:",
        "adds r8, r8, #64",
        "beq 5f",
        "4:",
        "str r8, [sp]",
        "ldr r8, [r0], #4\nldr r10, [r1], #4\nldr r12, [r2], #4",
        both_pairs!("r8", "r10", "r12"),
        "ldr r8, [sp]",
        "subs r8, r8, #4",
        "bne 4b",
        "5:",
        "uxth r2, r7\nadd r2, r2, r7, lsr #16",
        "ldr r0, [sp, #40]",
        "str r2, [r0]",
        "asrs r0, r3, #8",
        "asrs r1, r4, #8",
        "add sp, #4",
        "pop {{r4-r11, pc}}",
    )
}

/// A part of a row that is kept, which begins at an even column; both sides lie anywhere. The coefficients of its first four
/// columns, two by two, are in `lanes`, and then those of the four columns behind it. Σ p is that of the even columns.
///
/// # Safety
/// `p` and `h` must be good for `n` bytes, a multiple of four, at most [`KEPT_BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn part(p: *const u8, h: *const i8, n: usize, lanes: &mut u32) -> u64 {
    whole_function!(
        "push {{r3-r11, lr}}",
        "ldr r9, [sp]\nldr r9, [r9]\nmovs r4, #0\nmovs r7, #0\nmov r10, #0x00010001",
        "32",
        times!(8, part_of_four!()),
        part_of_four!(),
        concat!(
            // What the sum by parts owes where it ends, and the odd pixels' uppermost bits.
            "smuad r5, r7, r9\n",
            "subs r3, r3, r5\n",
            "add r3, r3, r4, lsl #15\n",
            "asrs r0, r3, #8\n",
            even_pixels!(),
            "ldr r3, [sp]\n",
            "str r9, [r3]"
        ),
        "pop {{r3-r11, pc}}"
    )
}

/// Coefficients as they are; both sides lie anywhere.
///
/// # Safety
/// Both pointers must be good for `n` bytes, a multiple of four, at most [`BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn anywhere(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!(
        "push {{r4-r11, lr}}",
        "movs r4, #0\nmovs r5, #0",
        "32",
        times!(8, four!()),
        four!(),
        "mov r0, r3\nmov r1, r4",
        "pop {{r4-r11, pc}}"
    )
}
