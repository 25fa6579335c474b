//! What the programs for QEMU's Cortex-M33 board are made of: what a host can test, and the board itself.
#![cfg_attr(not(test), no_std)]

pub mod args;
#[cfg(target_os = "none")]
pub mod board;
pub mod figures;
pub mod y4m;
