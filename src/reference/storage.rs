//! The memory that a tracker is lent.

use super::{ColumnLearning, RowLearning, RowTable, VerticalTable};

/// A buffer of [`Storage`] that holds less than the picture needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BufferTooShort {
    /// The field's name.
    pub(crate) name: &'static str,
    /// Number of elements that it has.
    pub(crate) has: usize,
    /// Number of elements that are needed.
    pub(crate) needs: usize,
}

/// Memory of a tracker, lent by the caller: 3·width + 32 bytes a row, and 16 bytes a column. The line
/// path itself reads width + 20 bytes a row.
#[derive(Debug)]
pub struct Storage<'a> {
    /// width × rows: the coefficients of the inner products, as the kernel keeps them
    /// ([`Kernel::keep`](crate::kernel::Kernel::keep)).
    pub coefficients: &'a mut [i8],
    /// rows: what the line path needs besides.
    pub tables: &'a mut [RowTable],
    /// width × rows: the reference picture, in counts.
    pub mean: &'a mut [u16],
    /// rows: what learning needs.
    pub learning: &'a mut [RowLearning],
    /// width: weight of each column, 0 = unused … 255. Kept as given, but for dead columns, which are
    /// masked.
    pub mask: &'a mut [u8],
    /// width: what learning needs of the columns.
    pub columns: &'a mut [ColumnLearning],
    /// width: the coefficients of a row that is being built again while its old ones still serve.
    pub fresh: &'a mut [i8],
    /// 2 × width: scratch of building coefficients.
    pub scratch: &'a mut [f32],
    /// What a tracker needs besides that measures along both axes; unused by others.
    pub vertical: Option<VerticalStorage<'a>>,
}

/// What a tracker is lent besides to measure along both axes: width + 32 bytes a row, and a byte a column.
#[derive(Debug)]
pub struct VerticalStorage<'a> {
    /// width × rows: the coefficients of the second inner products, as the kernel keeps them.
    pub coefficients: &'a mut [i8],
    /// rows: what the line path needs besides.
    pub tables: &'a mut [VerticalTable],
    /// width: the coefficients of a row that is being built again while its old ones still serve.
    pub fresh: &'a mut [i8],
}

impl VerticalStorage<'_> {
    fn cut(self, width: usize, rows: usize) -> Result<Self, BufferTooShort> {
        Ok(Self {
            coefficients: cut("vertical.coefficients", self.coefficients, width * rows)?,
            tables: cut("vertical.tables", self.tables, rows)?,
            fresh: cut("vertical.fresh", self.fresh, width)?,
        })
    }
}

impl<'a> Storage<'a> {
    /// The same, for a tracker that measures along both axes.
    #[must_use]
    pub fn with_vertical(self, vertical: VerticalStorage<'a>) -> Self {
        Self {
            vertical: Some(vertical),
            ..self
        }
    }
}

impl Storage<'_> {
    /// Cuts each buffer to what a picture of this size needs. `planar`: it is to be measured along both axes.
    pub(crate) fn cut(
        self,
        width: usize,
        rows: usize,
        planar: bool,
    ) -> Result<Self, BufferTooShort> {
        let pixels = width * rows;
        let vertical = match self.vertical {
            Some(vertical) if planar => Some(vertical.cut(width, rows)?),
            None if planar => {
                return Err(BufferTooShort {
                    name: "vertical",
                    has: 0,
                    needs: pixels,
                });
            }
            _ => None,
        };
        Ok(Self {
            coefficients: cut("coefficients", self.coefficients, pixels)?,
            tables: cut("tables", self.tables, rows)?,
            mean: cut("mean", self.mean, pixels)?,
            learning: cut("learning", self.learning, rows)?,
            mask: cut("mask", self.mask, width)?,
            columns: cut("columns", self.columns, width)?,
            fresh: cut("fresh", self.fresh, width)?,
            scratch: cut("scratch", self.scratch, 2 * width)?,
            vertical,
        })
    }
}

fn cut<'a, T>(
    name: &'static str,
    buffer: &'a mut [T],
    needs: usize,
) -> Result<&'a mut [T], BufferTooShort> {
    let has = buffer.len();
    buffer
        .get_mut(..needs)
        .ok_or(BufferTooShort { name, has, needs })
}

/// Arrays of fixed size for [`Storage`]: a `static` on a microcontroller, a local in a test.
///
/// For pictures of up to `PIXELS` pixels, `ROWS` rows and `WIDTH` columns; smaller ones fit too. All zeros at first, so
/// that a static lies in `.bss` and costs no flash.
///
/// ```
/// use rowtone::{camera::Timing, tracker::{Config, StaticStorage, Tracker}};
/// let mut storage = Box::new(StaticStorage::<{ 320 * 240 }, 240, 320>::new());
/// assert!(core::mem::size_of_val(&*storage) <= 3 * 320 * 240 + 68 * 240 + 16 * 320);
/// let config = Config::new(Timing::new(67_200_000, 500_000, 240)?, 320);
/// let tracker = Tracker::new(config, storage.lend())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// The coefficients come first and at a whole word: where the width is a multiple of four, every row of
// them lies so, and a Cortex-M loads two words at once.
#[derive(Clone, Debug)]
#[repr(C, align(8))]
pub struct StaticStorage<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> {
    coefficients: [i8; PIXELS],
    mean: [u16; PIXELS],
    tables: [RowTable; ROWS],
    learning: [RowLearning; ROWS],
    mask: [u8; WIDTH],
    columns: [ColumnLearning; WIDTH],
    fresh: [i8; WIDTH],
    scratch: [[f32; WIDTH]; 2],
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize>
    StaticStorage<PIXELS, ROWS, WIDTH>
{
    /// Empty memory.
    pub const fn new() -> Self {
        Self {
            coefficients: [0; PIXELS],
            mean: [0; PIXELS],
            tables: [RowTable::EMPTY; ROWS],
            learning: [RowLearning::EMPTY; ROWS],
            mask: [0; WIDTH],
            columns: [ColumnLearning::EMPTY; WIDTH],
            fresh: [0; WIDTH],
            scratch: [[0.0; WIDTH]; 2],
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
            scratch: self.scratch.as_flattened_mut(),
            vertical: None,
        }
    }
}

/// Arrays of fixed size for [`VerticalStorage`], beside a [`StaticStorage`] of the same size.
///
/// ```
/// use rowtone::{camera::Timing, tracker::{Axes, Config, StaticStorage, StaticVerticalStorage, Tracker}};
/// let mut storage = Box::new(StaticStorage::<{ 320 * 240 }, 240, 320>::new());
/// let mut vertical = Box::new(StaticVerticalStorage::<{ 320 * 240 }, 240, 320>::new());
/// assert!(core::mem::size_of_val(&*vertical) <= 320 * 240 + 32 * 240 + 320 + 8);
/// let mut config = Config::new(Timing::new(67_200_000, 500_000, 240)?, 320);
/// config.axes = Axes::Xy;
/// assert!(Tracker::new(config, storage.lend()).is_err(), "the second half is missing");
/// let tracker = Tracker::new(config, storage.lend().with_vertical(vertical.lend()))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[repr(C, align(8))]
pub struct StaticVerticalStorage<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> {
    coefficients: [i8; PIXELS],
    tables: [VerticalTable; ROWS],
    fresh: [i8; WIDTH],
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize>
    StaticVerticalStorage<PIXELS, ROWS, WIDTH>
{
    /// Empty memory.
    pub const fn new() -> Self {
        Self {
            coefficients: [0; PIXELS],
            tables: [VerticalTable::EMPTY; ROWS],
            fresh: [0; WIDTH],
        }
    }

    /// Lends all of it.
    pub fn lend(&mut self) -> VerticalStorage<'_> {
        VerticalStorage {
            coefficients: &mut self.coefficients,
            tables: &mut self.tables,
            fresh: &mut self.fresh,
        }
    }
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> Default
    for StaticVerticalStorage<PIXELS, ROWS, WIDTH>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const PIXELS: usize, const ROWS: usize, const WIDTH: usize> Default
    for StaticStorage<PIXELS, ROWS, WIDTH>
{
    fn default() -> Self {
        Self::new()
    }
}
