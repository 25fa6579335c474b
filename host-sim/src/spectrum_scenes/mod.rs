//! Scenes with known tones, and what could at best be known of them.
//!
//! [`scene`] is the recipe for the spectrum alone: no picture is made, displacement samples are drawn as the line engine
//! would give them (offsets of slots, weights, blank time, lost frames, jitter, creep). [`cameras`] makes pictures
//! and takes the whole way from the file to the report. [`bound`] is the Cramér–Rao bound of what was drawn, [`score`]
//! compares the reports with it, [`table`] prints.

pub mod bound;
pub mod cameras;
pub mod scene;
pub mod score;
pub mod table;
