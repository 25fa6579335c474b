//! The command `rowtone`: its commands and what they print.
//!
//! - [`commands`]: one file a command, each with its options and what it does;
//! - [`failure`]: why a command stopped: one line and an exit status;
//! - [`output`]: displacements as files, standard output line by line, progress;
//! - [`stop`]: what a signal does;
//! - `terminal`: a screen of text for the live view.

mod alarm_args;
mod camera_args;
pub mod commands;
pub mod failure;
mod known_length;
pub mod output;
mod quantity;
mod reference;
pub mod stop;
mod terminal;
