//! The tracker's memory.

use rowtone::reference::{RowTable, VerticalTable};
use rowtone::tracker::{Axes, ColumnLearning, RowLearning, Storage, VerticalStorage};

/// Vectors to lend to a [`rowtone::tracker::Tracker`].
#[derive(Clone, Debug)]
pub struct TrackerMemory {
    coefficients: Vec<i8>,
    tables: Vec<RowTable>,
    mean: Vec<u16>,
    learning: Vec<RowLearning>,
    mask: Vec<u8>,
    columns: Vec<ColumnLearning>,
    fresh: Vec<i8>,
    scratch: Vec<f32>,
    vertical: Option<Vertical>,
}

/// What measuring along both axes needs besides.
#[derive(Clone, Debug)]
struct Vertical {
    coefficients: Vec<i8>,
    tables: Vec<VerticalTable>,
    fresh: Vec<i8>,
}

impl TrackerMemory {
    /// For a picture, or a part of one, of this size, px.
    pub fn new(width: usize, rows: usize) -> Self {
        Self {
            coefficients: vec![0; width * rows],
            tables: vec![RowTable::default(); rows],
            mean: vec![0; width * rows],
            learning: vec![RowLearning::default(); rows],
            mask: vec![0; width],
            columns: vec![ColumnLearning::default(); width],
            fresh: vec![0; width],
            scratch: vec![0.0; 2 * width],
            vertical: None,
        }
    }

    /// The same, for these axes.
    pub fn for_axes(width: usize, rows: usize, axes: Axes) -> Self {
        let vertical = Vertical {
            coefficients: vec![0; width * rows],
            tables: vec![VerticalTable::default(); rows],
            fresh: vec![0; width],
        };
        Self {
            vertical: (axes == Axes::Xy).then_some(vertical),
            ..Self::new(width, rows)
        }
    }

    /// Lends all of it, every column in use.
    pub fn lend(&mut self) -> Storage<'_> {
        self.mask.fill(u8::MAX);
        Storage {
            coefficients: &mut self.coefficients,
            tables: &mut self.tables,
            mean: &mut self.mean,
            learning: &mut self.learning,
            mask: &mut self.mask,
            columns: &mut self.columns,
            fresh: &mut self.fresh,
            scratch: &mut self.scratch,
            vertical: self.vertical.as_mut().map(|v| VerticalStorage {
                coefficients: &mut v.coefficients,
                tables: &mut v.tables,
                fresh: &mut v.fresh,
            }),
        }
    }
}
