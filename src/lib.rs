//! Vibration from the rows of a rolling-shutter camera: *lines go in, peaks come out*.
#![no_std]
#![deny(unsafe_code)]

mod align;
pub mod analyzer;
pub mod band;
pub mod camera;
pub mod kernel;
pub mod link;
pub mod noise;
pub mod outbox;
mod pixel;
pub mod reference;
pub mod report;
pub mod settings;
pub mod spectrum;
pub mod timeline;
pub mod tracker;
pub mod wire;
