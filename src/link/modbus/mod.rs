//! A board as a Modbus RTU server: the settings as its holding registers, and its answers.
//!
//! A PLC reads what was measured from the input registers ([`crate::wire::modbus::State`]) and reads and
//! writes the settings in the holding registers.

mod holding;
mod server;

pub use server::{Exception, answer};
