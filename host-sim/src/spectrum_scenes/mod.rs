//! Random displacement samples with known tones, and what could at best be known of them.
//!
//! For the spectrum alone: no picture is made, samples are drawn as the line engine would give them (offsets of
//! slots, weights, blank time, lost frames, jitter, creep). [`scene`] is the recipe, [`bound`] the Cramér–Rao
//! bound of what it drew, [`score`] runs the analyzer on it and compares.

pub mod bound;
pub mod scene;
pub mod score;
pub mod table;
