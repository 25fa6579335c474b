//! What the RP2350's firmware is made of, as far as it knows no chip: all of it is tested on the host.
//!
//! The way of a line: [`capture`] (PIO program, pins to words) → [`handover`] (two buffers between the
//! interrupt and core 0) → [`frames`] (words to [`rowtone::camera::Line`]: row, frame, time) → the core.
//! Beside it: [`hm01b0`] sets the camera up, [`health`] says what is wrong and what to do about it, [`led`]
//! shows it.
#![cfg_attr(not(test), no_std)]

pub mod boot;
pub mod capture;
pub mod clock;
pub mod frames;
pub mod handover;
pub mod health;
pub mod hm01b0;
pub mod led;
pub mod losses;
pub mod plan;
