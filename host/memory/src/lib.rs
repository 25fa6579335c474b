//! Memory to lend to the core on a machine that has plenty: vectors, sized for the picture and the
//! window, got once.

mod spectrum;
mod tracker;

pub use spectrum::SpectrumMemory;
pub use tracker::TrackerMemory;
