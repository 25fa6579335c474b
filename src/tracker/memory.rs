//! How much memory a picture takes.

use super::{Axes, ColumnLearning, RowLearning};
use crate::reference::{RowTable, VerticalTable};

/// Bytes that a tracker is lent ([`Storage`](super::Storage)) for a picture of this many columns and rows, measured along
/// these axes: 3 a pixel and some tens a row and a column, and a third more for both axes.
///
/// ```
/// use rowtone::tracker::{Axes, picture_bytes};
/// const QVGA: usize = picture_bytes(320, 240, Axes::X);
/// assert!(QVGA > 3 * 320 * 240 && QVGA < 256 * 1024);
/// assert!(picture_bytes(320, 240, Axes::Xy) < QVGA * 7 / 5);
/// ```
pub const fn picture_bytes(width: usize, rows: usize, axes: Axes) -> usize {
    let pixels = width * rows;
    let of_a_row = size_of::<RowTable>() + size_of::<RowLearning>();
    // Mask, coefficients of the row that is built again, two rows of scratch, what learning keeps.
    let of_a_column = 1 + 1 + 2 * size_of::<f32>() + size_of::<ColumnLearning>();
    let along_rows = 3 * pixels + of_a_row * rows + of_a_column * width;
    match axes {
        Axes::X => along_rows,
        Axes::Xy => along_rows + pixels + size_of::<VerticalTable>() * rows + width,
    }
}

#[cfg(test)]
mod tests {
    use core::mem::size_of_val;

    use super::*;
    use crate::tracker::{StaticStorage, StaticVerticalStorage};

    #[test]
    fn it_is_what_the_buffers_take() {
        let mut storage = StaticStorage::<{ 48 * 20 }, 20, 48>::new();
        let mut vertical = StaticVerticalStorage::<{ 48 * 20 }, 20, 48>::new();
        let lent = storage.lend();
        let along_rows = size_of_val(lent.coefficients)
            + size_of_val(lent.tables)
            + size_of_val(lent.mean)
            + size_of_val(lent.learning)
            + size_of_val(lent.mask)
            + size_of_val(lent.columns)
            + size_of_val(lent.fresh)
            + size_of_val(lent.scratch);
        assert_eq!(picture_bytes(48, 20, Axes::X), along_rows);
        let lent = vertical.lend();
        let both = along_rows
            + size_of_val(lent.coefficients)
            + size_of_val(lent.tables)
            + size_of_val(lent.fresh);
        assert_eq!(picture_bytes(48, 20, Axes::Xy), both);
    }
}
