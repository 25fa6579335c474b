//! Serial lines to boards, both ends.
//!
//! [`port`] opens what the user named; [`mod@line`] follows a port that comes and goes, and [`receiver`]
//! understands what it says; [`sender`] is a board's end, for a command that measures.

mod error;
pub mod line;
pub mod port;
pub mod receiver;
pub mod sender;

pub use error::SerialError;
