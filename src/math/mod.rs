//! What arithmetic the stages share: square roots, sines and cosines, differences of times.

mod time;
mod trig;

// The instruction itself is unsafe code, which has its place in `kernel`.
pub(crate) use crate::kernel::sqrtf;
pub(crate) use time::{ns_of_s, since};
pub(crate) use trig::{cos_sin, sin, turns};
