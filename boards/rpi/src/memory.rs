//! All the memory that measuring takes, got once.

use rowtone::camera::UpperBytes;
use rowtone::reference::RowTable;
use rowtone::report::MAX_PEAKS;
use rowtone::spectrum::{EstimatorStorage, FrameMark, SampleBuffer, Storage as SpectrumStorage};
use rowtone::timeline::{Group, Spread};
use rowtone::tracker::{ColumnLearning, RowLearning, Storage as TrackerStorage};

/// Longest transform, points: that of the core.
const GRID: usize = 32_768;

/// The tracker's.
#[derive(Debug)]
pub struct TrackerMemory {
    coefficients: Vec<i8>,
    tables: Vec<RowTable>,
    mean: Vec<u16>,
    learning: Vec<RowLearning>,
    mask: Vec<u8>,
    columns: Vec<ColumnLearning>,
    fresh: Vec<i8>,
    scratch: Vec<f32>,
    line: Vec<u8>,
}

impl TrackerMemory {
    /// For a part of the picture of this size.
    pub fn new(width: u16, rows: u16) -> Self {
        let (width, rows) = (usize::from(width), usize::from(rows));
        Self {
            coefficients: vec![0; width * rows],
            tables: vec![RowTable::default(); rows],
            mean: vec![0; width * rows],
            learning: vec![RowLearning::default(); rows],
            mask: vec![u8::MAX; width],
            columns: vec![ColumnLearning::default(); width],
            fresh: vec![0; width],
            scratch: vec![0.0; 2 * width],
            line: vec![0; width + UpperBytes::SPARE],
        }
    }

    /// Lends all of it: the tracker's buffers, and the room for a line.
    pub fn lend(&mut self) -> (TrackerStorage<'_>, &mut [u8]) {
        let storage = TrackerStorage {
            coefficients: &mut self.coefficients,
            tables: &mut self.tables,
            mean: &mut self.mean,
            learning: &mut self.learning,
            mask: &mut self.mask,
            columns: &mut self.columns,
            fresh: &mut self.fresh,
            scratch: &mut self.scratch,
            vertical: None,
        };
        (storage, &mut self.line)
    }
}

#[derive(Debug)]
struct Samples {
    shift_px: Vec<f32>,
    weight: Vec<u16>,
    skew: Vec<i16>,
    spread: Vec<Spread>,
    frames: Vec<FrameMark>,
}

impl Samples {
    fn new(frames: usize, slots: usize) -> Self {
        Self {
            shift_px: vec![0.0; frames * slots],
            weight: vec![0; frames * slots],
            skew: vec![0; frames * slots],
            spread: vec![Spread::default(); slots],
            frames: vec![FrameMark::default(); frames],
        }
    }

    fn lend(&mut self) -> SampleBuffer<'_> {
        SampleBuffer {
            shift_px: &mut self.shift_px,
            weight: &mut self.weight,
            skew: &mut self.skew,
            spread: &mut self.spread,
            couplings: &mut [],
            frames: &mut self.frames,
        }
    }
}

/// The spectrum's.
#[derive(Debug)]
pub struct SpectrumMemory {
    samples: [Samples; 2],
    frame_ns: Vec<i64>,
    slot_ns: Vec<i64>,
    frame_rows: Vec<f32>,
    slot_rows: Vec<f32>,
    frame_phasors: Vec<f32>,
    slot_phasors: Vec<f32>,
    grid: Vec<f32>,
}

impl SpectrumMemory {
    /// For windows of so many frames.
    pub fn new(group: Group, frames: usize) -> Self {
        let frames = frames.clamp(4, 65_000);
        let slots = usize::from(group.slots());
        let rows = MAX_PEAKS + 1;
        Self {
            samples: [Samples::new(frames, slots), Samples::new(frames, slots)],
            frame_ns: vec![0; frames],
            slot_ns: vec![0; slots],
            frame_rows: vec![0.0; 6 * frames],
            slot_rows: vec![0.0; 5 * slots],
            frame_phasors: vec![0.0; 2 * rows * frames],
            slot_phasors: vec![0.0; 2 * rows * slots],
            grid: vec![0.0; GRID],
        }
    }

    /// Lends all of it.
    pub fn lend(&mut self) -> SpectrumStorage<'_> {
        let [collected, computed] = &mut self.samples;
        SpectrumStorage {
            collected: collected.lend(),
            estimator: EstimatorStorage {
                samples: computed.lend(),
                frame_ns: &mut self.frame_ns,
                slot_ns: &mut self.slot_ns,
                frame_rows: &mut self.frame_rows,
                slot_rows: &mut self.slot_rows,
                frame_phasors: &mut self.frame_phasors,
                slot_phasors: &mut self.slot_phasors,
                grid: &mut self.grid,
            },
        }
    }
}
