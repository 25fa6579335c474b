//! A report as bytes on a serial line, and back.
//!
//! Everything a board says is a [`Message`]; every wire carries the same messages:
//!
//! | wire | one message is | for |
//! | --- | --- | --- |
//! | [`text`] | one line of printable ASCII, `$RT…*` and a CRC-32 | people, scripts (default) |
//! | [`binary`] | postcard, CRC-32 and COBS between zero bytes | slow lines, programs |
//! | [`modbus`] | registers of a Modbus RTU server, asked for by a master | PLCs |
//!
//! Both directions are here, so what can be written can be read, and what is read has passed its
//! checksum *and* every range check. Nothing allocates: encoders write into what the caller
//! lends, decoders take bytes as they come and keep at most one message. `docs/wire.md` says
//! the same precisely enough to write a decoder in another language.

pub mod binary;
mod check;
mod decimal;
mod format;
mod message;
pub mod modbus;
mod sequence;
mod slice;
pub mod text;

pub(crate) use check::CRC_32;
pub use check::{EncodeError, MAX_VALUE, check_report};
pub use format::Format;
pub use message::{Message, REPLY_LEN, Reply, SettingsOrigin, Status};
pub use sequence::{Arrival, Sequence};
