//! Scenes with known tones, and what could at best be known of them.
//!
//! [`scene`] is the recipe for the spectrum alone: no picture is made, displacement samples are drawn as the line engine
//! would give them (offsets of slots, weights, blank time, lost frames, jitter, creep). [`cameras`] makes pictures
//! and takes the whole way from the file to the report. [`bound`] is the Cramér–Rao bound of what was drawn, [`few`] is
//! the thesis's test of a handful of frames, [`days`] many days on end. [`score`] compares the reports with it, [`table`] prints.

pub mod bound;
pub mod broadband;
pub mod cameras;
pub mod days;
pub mod few;
pub mod noise;
pub mod scene;
pub mod score;
pub mod table;
