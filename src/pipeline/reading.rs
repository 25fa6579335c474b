//! What goes from the line side to the report side.

use crate::timeline::{Sample, Tally};

/// What the line side measured since its last reading, and what became of the rows meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// A group of rows, where one is complete.
    pub sample: Option<Sample>,
    /// What became of the rows of the frames that ended since the last reading.
    pub tally: Tally,
    /// Number of the last of these frames.
    pub frame: u32,
}

impl From<Sample> for Reading {
    /// A sample of which nothing further is known.
    fn from(sample: Sample) -> Self {
        Self {
            sample: Some(sample),
            tally: Tally::NONE,
            frame: sample.frame,
        }
    }
}
