//! Vibration from the rows of a rolling-shutter camera: *lines go in, peaks come out*.
#![no_std]
#![deny(unsafe_code)]

pub mod camera;
pub mod report;
pub mod timeline;
