//! Memory on a machine that has plenty: vectors, sized for the picture and the window.

mod spectrum;
mod tracker;

pub use spectrum::SpectrumMemory;
pub use tracker::TrackerMemory;
