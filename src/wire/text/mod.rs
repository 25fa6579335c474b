//! Reports as lines that a person, a script and a terminal can read.
//!
//! One message is one sentence in the manner of NMEA 0183: `$`, a name, fields parted by commas,
//! `*`, the checksum, carriage return and line feed. All of it is printable ASCII:
//!
//! ```text
//! $RTRPT,3,12,13000,1.0000,60.0000,18000,0,0.013100,0000,,,1,49.2003/0.0004/0.399800/0.000200/61.2/1/-/-*DC889184
//! ```
//!
//! The checksum is CRC-32 (the one of zip, PNG and Ethernet) of all that stands between `$` and
//! `*`, as 8 upper-case hexadecimal digits. NMEA's own XOR of 8 bits misses one fault in 256;
//! this one misses one in 4·10⁹ of the faults it does not catch with certainty.
//!
//! Reals are fixed decimals, rounded exactly ([`resolution`]). What was encoded and decoded is
//! encoded to the same line again, and what is decoded differs from what was encoded by at most
//! half a resolution and half an f32 step. A line of another program may hold more digits than an
//! f32 can; it is read as the nearest.
//!
//! ```
//! use rowtone::wire::{Message, Reply, text};
//!
//! let said = Message::Reply(Reply { ok: true, text: "window=1.0000 s".try_into()? });
//! let mut line = [0; text::MAX_LINE];
//! let line = text::encode_to_slice(&said, &mut line)?;
//! assert_eq!(line, b"$RTACK,window=1.0000 s*80002B68\r\n");
//!
//! let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
//! let mut heard = line.iter().filter_map(|&byte| decoder.push(byte));
//! assert_eq!(heard.next(), Some(Ok(said)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod decode;
mod encode;
mod fields;

use super::check::CRC_32;
pub(crate) use decode::command_in_sentence;
pub use decode::{DecodeError, Decoder, decode_line};
pub use encode::{encode, encode_command, encode_to_slice};

/// Decimals of each kind of value.
pub mod resolution {
    /// Frequencies (and their standard deviations, and frame rates), Hz: 0.1 mHz.
    pub const HZ: u32 = 4;
    /// Lengths in the picture, px: a millionth.
    pub const PX: u32 = 6;
    /// Signal-to-noise ratio: 0.1 dB.
    pub const DB: u32 = 1;
    /// Length of the window: 0.1 ms.
    pub const WINDOW_S: u32 = 4;
    /// Scale of the picture, µm a pixel.
    pub const UM_PER_PX: u32 = 4;
    /// Velocity, mm/s.
    pub const MM_S: u32 = 4;
}

/// Longest line, its line end included, bytes: a report with [`crate::report::MAX_PEAKS`] peaks
/// and every number as long as it gets.
pub const MAX_LINE: usize = 1536;
