//! The newest report and the state of a board as registers of a Modbus RTU server, and its frames.
//!
//! A PLC reads what was measured from the input registers ([`State`]); the settings in the holding registers and
//! the server itself are the board's ([`crate::link::modbus`]). `docs/wire.md` has the whole map. A 32-bit
//! value (a real is IEEE 754 binary32) lies in two registers, the upper half first. Function codes
//! 03, 04, 06 and 16 and their exceptions follow *Modbus Application Protocol V1.1b3*; frames,
//! CRC-16 and silences follow *Modbus over Serial Line V1.02*.
//!
//! The crate rmodbus was weighed for this (0.13): its server answers unknown functions before it
//! has checked the CRC, does not compare the byte count of function 16 with its quantity, and adds
//! 7 to that byte count in 8 bits, which panics on outside input where overflow is checked. So the
//! server is written here, and rmodbus' client is its counterpart in the tests.

mod input;
mod rtu;

pub use input::{State, decode_report};
pub use rtu::FrameReader;

/// Longest RTU frame, bytes.
pub const MAX_FRAME: usize = 256;

/// CRC-16 of Modbus.
pub(crate) static CRC: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS);

/// The upper (`0`) or lower (`1`) register of a 32-bit value.
pub(crate) fn half(value: u32, which: u16) -> u16 {
    if which == 0 {
        (value >> 16) as u16
    } else {
        value as u16
    }
}
