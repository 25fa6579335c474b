//! Simulated recordings with known motion, for the line engine's figures: the real tracker on frames made
//! in memory, held against the truth and the Cramér–Rao bound of each row.

pub mod case;
pub mod measure;
pub mod region;
pub mod slips;
pub mod table;
