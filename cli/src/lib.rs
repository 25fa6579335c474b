//! The command `rowtone`: its commands and what they print.
//!
//! - [`commands`]: one file a command, each with its options and what it does;
//! - [`output`]: displacements as files, standard output line by line, progress;
//! - [`stop`]: what a signal does;
//! - `terminal`: a screen of text for the live view.

pub mod commands;
mod failures;
pub mod output;
pub mod stop;
mod terminal;
