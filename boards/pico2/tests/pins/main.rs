//! The camera's pins, simulated, and what the board makes of them.

mod camera;
mod capture;
mod lines;
mod machine;
