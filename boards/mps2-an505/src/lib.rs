//! What the firmware for QEMU's Cortex-M33 board is made of, as far as a host can test it.
#![cfg_attr(not(test), no_std)]

pub mod args;
pub mod figures;
pub mod y4m;
