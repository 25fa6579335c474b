//! All the memory that measuring takes, got once.

use rowtone::camera::UpperBytes;
use rowtone::spectrum::Storage as SpectrumStorage;
use rowtone::tracker::{Axes, Storage as TrackerStorage};
use rowtone_memory::{SpectrumMemory, TrackerMemory};

use crate::setup::Setup;

/// The core's memory, and room for a line.
#[derive(Debug)]
pub struct Memory {
    tracker: TrackerMemory,
    spectrum: SpectrumMemory,
    line: Vec<u8>,
}

impl Memory {
    /// As much as this setup needs.
    pub fn new(setup: &Setup) -> Self {
        let (width, rows) = (setup.part.width.into(), setup.part.height.into());
        Self {
            tracker: TrackerMemory::new(width, rows),
            spectrum: SpectrumMemory::for_frames(Axes::X, setup.group, setup.window_frames),
            line: vec![0; width + UpperBytes::SPARE],
        }
    }

    /// Lends all of it: the tracker's buffers with the room for a line, and the spectrum's.
    pub fn lend(&mut self) -> ((TrackerStorage<'_>, &mut [u8]), SpectrumStorage<'_>) {
        let tracker = (self.tracker.lend(), &mut self.line[..]);
        (tracker, self.spectrum.lend())
    }
}
