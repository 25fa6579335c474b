//! Lines out of the camera's pins, by a PIO state machine.
//!
//! Pins, upwards from D0: the bus's data pins are the lowest of eight, then PCLK ([`PCLK`]), then HREF
//! ([`HREF`], the datasheet's LVLD). HREF is the state machine's `jmp` pin as well. PCLK runs on between lines.
//!
//! The program hands over the same number of words for each rise of HREF, whatever happens in the line: the
//! pixels, then one word that says how many samples were missing when HREF fell (all ones: none; else one less
//! than were missing). A line that lost clock edges
//! is therefore short by itself and never shifts the line after it, and the DMA, which counts words, never
//! gets out of step with the rows.

use crate::hm01b0::Bus;
use pio::{Program, pio_asm};

/// PCLK's pin, counted from D0.
pub const PCLK: u8 = 8;
/// HREF's pin, counted from D0.
pub const HREF: u8 = 9;
/// Pixels that are taken of a row; the sensor sends [`crate::hm01b0::WIDTH`], the rest is not looked at.
pub const LINE_PIXELS: usize = 320;
/// Words of a line: four pixels a word, the first in the lowest byte, and the word of missing samples.
pub const LINE_WORDS: usize = LINE_PIXELS / 4 + 1;
/// Samples of a line, less 1: what the program is told first, through its TX FIFO.
pub const fn samples_less_one(bus: Bus) -> u32 {
    LINE_PIXELS as u32 * bus.clocks_per_pixel() - 1
}

/// Samples that were missing, from a line's last word.
pub const fn missing_samples(last_word: u32) -> u32 {
    last_word.wrapping_add(1)
}

macro_rules! program {
    ($take:tt, $pad:tt) => {
        pio_asm!(
            "    pull block", // samples a line, less 1: kept in OSR
            ".wrap_target",
            "    mov x, osr",
            "    mov y, ~null", // nothing missing yet
            "    wait 0 pin 9",
            "    wait 1 pin 9",
            "sample:",
            "    wait 0 pin 8",
            "    wait 1 pin 8",
            $take,
            "    jmp pin more",
            "    mov y, x", // HREF had fallen: this sample and x more are missing
            "short:",
            "    jmp x-- pad",
            "    jmp done",
            "pad:",
            $pad,
            "    jmp short",
            "more:",
            "    jmp x-- sample",
            "done:",
            "    in y, 32",
            ".wrap"
        )
        .program
    };
}

/// The program for a bus. Shift right, autopush at 32 bits, `in` base D0, `jmp` pin HREF, full speed.
pub fn program(bus: Bus) -> Program<32> {
    match bus {
        Bus::Bits1 => program!("in pins, 1", "in null, 1"),
        Bus::Bits4 => program!("in pins, 4", "in null, 4"),
        Bus::Bits8 => program!("in pins, 8", "in null, 8"),
    }
}
