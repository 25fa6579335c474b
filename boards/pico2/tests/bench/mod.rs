//! A bench without a board: a camera's pins in time, and a PIO state machine that runs a program against them.

pub mod camera;
pub mod machine;
