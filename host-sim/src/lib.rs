//! The host's side of rowtone: a simulated camera at a simulated machine, video files, and the
//! command `rowtone`.
//!
//! The core (package `rowtone`) knows no file, no serial port and no clock; all of that is here. A
//! recording goes through it in this order:
//!
//! - [`sim`]: a simulated rolling-shutter camera, with the truth about what it saw;
//! - [`input`]: videos and the camera options;
//! - [`tracking`]: frames to displacements, on a thread of its own ([`ring`] is between threads);
//! - [`analysis`]: displacements to reports, in the memory that [`memory`] lends;
//! - [`output`]: reports, displacements and pictures; [`serial`]: serial ports;
//!   [`sender`]: a board's end of one;
//! - [`calibrate`]: what a flashing light tells about a camera; [`linear`]: small linear algebra;
//! - [`line_scenes`]: recordings with known motion through the tracker, for the line engine's figures;
//! - [`spectrum_scenes`]: random displacement samples with known tones, for the spectrum's figures;
//! - [`restore`]: gaps filled, for the ear; [`methods`]: the thesis's methods and others, to compare with;
//!   [`experiments`]: the thesis's chapter 5 again; [`figure`]: drawings for both;
//! - [`commands`]: one file a command, each with its options and what it does;
//! - [`failure`]: what every command says, and exits with, when it cannot go on.
//! - [`mod@line`] follows a port that comes and goes, and [`receiver`] understands what it says; [`gateway`]:
//!   many lines to an MQTT broker.

pub mod analysis;
pub mod calibrate;
pub mod commands;
pub mod experiments;
pub mod failure;
pub mod figure;
pub mod gateway;
pub mod input;
pub mod line;
pub mod line_scenes;
pub mod linear;
pub mod memory;
pub mod methods;
pub mod output;
pub mod receiver;
pub mod restore;
pub mod ring;
pub mod sender;
pub mod serial;
pub mod sim;
pub mod spectrum_scenes;
pub mod tracking;
