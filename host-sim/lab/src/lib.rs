//! The paper laboratory: what shows how well rowtone and others measure, on recordings with known truth.
//!
//! - [`methods`]: the thesis's methods and others, to compare with;
//! - [`experiments`]: the thesis's chapter 5 again; [`figure`]: drawings for both;
//! - [`line_scenes`]: recordings with known motion through the tracker, for the line engine's figures;
//! - [`spectrum_scenes`]: random displacement samples with known tones, for the spectrum's figures;
//! - [`shape_scenes`]: parts that vibrate in known shapes, for the figures of `rowtone shapes`;
//! - [`machine_scenes`]: machines that bend, turn and move in parts, and cameras with faults, to the report;
//! - [`alarm_scenes`]: days of reports through the alarms, with steps;
//! - [`calibrations`]: calibrations of simulated cameras, with the truth;
//! - [`sound`]: speech and music, and how well a recovered sound agrees with them.

pub mod alarm_scenes;
pub mod calibrations;
mod error;
pub mod experiments;
pub mod figure;
mod filmed;
pub mod line_scenes;
pub mod machine_scenes;
pub mod methods;
pub mod shape_scenes;
pub mod sound;
pub mod spectrum_scenes;

pub use error::LabError;
