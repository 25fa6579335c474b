//! Simulated parts that vibrate in known shapes, through `rowtone shapes`: how near the shapes are to the truth.
//!
//! Contract: a [`Case`](case::Case) is one shape at one frequency and amplitude; [`score`](score::score) simulates it from a
//! seed, measures it as the command does and compares each tile with the mean of the true shape over it.

pub mod case;
pub mod score;
