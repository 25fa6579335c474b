//! The core driven from a recording.
//!
//! - [`tracking`]: frames to displacements, on a thread of its own;
//! - [`analysis`]: displacements to reports, in memory that it lends;
//! - [`periodogram`]: samples and reports to a spectrum;
//! - [`restore`]: gaps filled, for the ear;
//! - [`shapes`]: what vibrates where.

pub mod analysis;
mod error;
mod keyed;
pub mod periodogram;
pub mod restore;
pub mod shapes;
mod since_frame;
pub mod tracking;
mod wander;

pub use error::{MeasureError, PartError, SettingsError};
