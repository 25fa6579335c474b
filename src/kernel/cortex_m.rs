//! Cortex-M with the DSP extension (M4, M7, M33): two products an instruction.
//!
//! Coefficients that are kept lie two by two ([`super::pairs`]). For four pixels and their coefficients, a word each, `uxtb16`
//! and `sxtb16` spread the even bytes of the words over two half-words, `eor` turns the pixels round, and two `smlad` multiply
//! and add two pairs each; `usada8` adds four pixels: six instructions for four pixels. Loads come on top: three for
//! sixteen pixels where the rows lie at whole words, else eight. A part of a row takes one instruction more, for the sum of its
//! odd coefficients; coefficients as they are take two extensions more. `boards/mps2-an505/kernel.sh` compares the bits and
//! counts.
//!
//! The functions are written as a whole, with all registers that there are: a compiler keeps two of them to itself.

use super::{LineSums, Sums, pairs};
use core::arch::naked_asm;

/// Pixels a block: its sums fit 32 bits, 64·255·2¹⁶ < 2³¹.
const BLOCK: usize = 1 << 16;

/// The same of coefficients that are kept, whose sums are 256 times as large.
const KEPT_BLOCK: usize = 1 << 9;

/// Of a line and its whole row, as it is kept; the shorter length of the two counts.
#[inline(always)]
pub(super) fn kept_u8(pixels: &[u8], row: &[i8]) -> LineSums {
    let n = pixels.len();
    let (p, h) = (pixels.as_ptr(), row.as_ptr());
    if n > KEPT_BLOCK || (p as usize | h as usize | n) % 4 != 0 || n != row.len() {
        return kept_part_u8(pixels, row, 0);
    }
    // SAFETY: both pointers lie at whole words and are good for n bytes, a multiple of four.
    apart(unsafe { whole(p, h, n) })
}

/// Of any part of a row that is kept, from column `from` on.
#[inline(never)]
pub(super) fn kept_part_u8(pixels: &[u8], row: &[i8], from: usize) -> LineSums {
    let n = pixels.len().min(row.len().saturating_sub(from));
    let mut all = LineSums::default();
    let mut one_by_one = |span: core::ops::Range<usize>| {
        let line = pixels.get(span.clone()).unwrap_or_default();
        for (&p, h) in line.iter().zip(pairs::plain(row, from + span.start)) {
            all.add(LineSums {
                product: i32::from(p) * i32::from(h),
                pixels: u32::from(p),
            });
        }
    };
    // To where two by two begin.
    let head = (from & 1).min(n);
    let whole = (n - head) & !3;
    one_by_one(0..head);
    one_by_one(head + whole..n);
    let (line, coefficients) = (
        pixels.get(head..head + whole).unwrap_or_default(),
        row.get(from + head..from + head + whole)
            .unwrap_or_default(),
    );
    for (p, h) in line.chunks(KEPT_BLOCK).zip(coefficients.chunks(KEPT_BLOCK)) {
        // SAFETY: both slices are of the same length, a multiple of four.
        all.add(apart(unsafe { part(p.as_ptr(), h.as_ptr(), p.len()) }));
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

/// Four pixels in `$p` and their coefficients as they are kept in `$h`, both lost. The sum over pairs is in r3, Σ p in r4,
/// 0 in r5, 0x7FFF in both halves of r6; r7 is lost. `$h` has Σ o to be taken of, with its sign changed.
macro_rules! pairs {
    ($p:literal, $h:literal) => {
        concat!(
            "usada8 r4, ",
            $p,
            ", r5, r4\n",
            "uxtb16 r7, ",
            $p,
            "\n",
            "smlad r3, r7, ",
            $h,
            ", r3\n",
            "sxtb16 ",
            $h,
            ", ",
            $h,
            "\n",
            "eor ",
            $p,
            ", ",
            $p,
            ", r6\n",
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
            pairs!("r8", "r12"),
            pairs!("r9", "lr"),
            "ldrd r12, lr, [r1], #8\n",
            pairs!("r10", "r12"),
            pairs!("r11", "lr"),
        )
    };
}

/// Four pixels that may lie anywhere: a single word's load needs no alignment on these cores (ARMv7-M and ARMv8-M with
/// UNALIGN_TRP clear, as after reset). Their odd coefficients are added up in r9, with the sign changed; 1 is in both
/// halves of r10.
macro_rules! part_of_four {
    () => {
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r12, [r1], #4\n",
            pairs!("r8", "r12"),
            "smlad r9, r12, r10, r9\n",
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
/// `$four`. Then `$end` makes Σ h·p in r0 of what is there.
macro_rules! whole_function {
    ($begin:expr, $turn:literal, $pixels:expr, $four:expr, $end:expr) => {
        naked_asm!(
            ".cpu cortex-m33",
            "push {{r4-r11, lr}}",
            "movs r3, #0",
            "movs r4, #0",
            "movs r5, #0",
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
            "mov r1, r4",
            "pop {{r4-r11, pc}}",
            ".ltorg",
        )
    };
}

/// A whole row that is kept, of which |Σ o| < 128; both sides lie at whole words.
///
/// # Safety
/// Both pointers must lie at a multiple of four and be good for `n` bytes, a multiple of four, at most [`KEPT_BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn whole(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!(
        "ldr r6, =0x7FFF7FFF",
        "64",
        times!(4, sixteen!()),
        concat!(
            "ldr r8, [r0], #4\n",
            "ldr r12, [r1], #4\n",
            pairs!("r8", "r12")
        ),
        // The last byte is Σ o, and what stands before it 128·Σ o too small.
        "sxtb r2, r3\nsubs r0, r3, r2\nasrs r0, r0, #8\nadd r0, r0, r2, lsl #7"
    )
}

/// A part of a row that is kept, which begins at an even column; both sides lie anywhere.
///
/// # Safety
/// Both pointers must be good for `n` bytes, a multiple of four, at most [`KEPT_BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn part(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!(
        "ldr r6, =0x7FFF7FFF\nmovs r9, #0\nmov r10, #0x00010001",
        "32",
        times!(8, part_of_four!()),
        part_of_four!(),
        "movw r2, #32767\nmls r0, r9, r2, r3\nasrs r0, r0, #8"
    )
}

/// Coefficients as they are; both sides lie anywhere.
///
/// # Safety
/// Both pointers must be good for `n` bytes, a multiple of four, at most [`BLOCK`].
#[unsafe(naked)]
unsafe extern "C" fn anywhere(p: *const u8, h: *const i8, n: usize) -> u64 {
    whole_function!("", "32", times!(8, four!()), four!(), "mov r0, r3")
}
