//! What boards without an operating system have in common.
//!
//! - [`memory`]: the memory of a window, of a size for a microcontroller with half a megabyte of RAM;
//! - [`plan`]: what settings and a camera's timing mean for the core;
//! - [`cut`]: from a row as the camera delivers it to the [`Line`](rowtone::camera::Line) of the part
//!   that is measured.
//!
//! `boards/README.md` says how a board is made of them, in nine steps; `examples/made_up.rs` is one.
#![cfg_attr(not(test), no_std)]

pub mod cut;
pub mod memory;
pub mod plan;
