//! From a row of the whole picture to the line of the part that is measured.

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::link::settings::Region;

/// Cuts the rows of a picture to a part of it. Rows of the part are counted from its top, as the
/// tracker wants them, and so is its timing.
///
/// ```
/// use rowtone::camera::{Pixels, Timing};
/// use rowtone::link::settings::Region;
/// use rowtone_board::cut::Cut;
///
/// let part = Region { x: 1, y: 10, width: 2, height: 5 };
/// let cut = Cut { part, timing: Timing::new(50_000_000, 0, 5)? };
/// let line = cut.line(7, 1_000_000, 12, &[1, 2, 3, 4]).expect("a row of the part");
/// assert_eq!((line.frame, line.row, line.start_ns), (7, 2, 1_100_000));
/// assert_eq!(line.pixels, Pixels::U8(&[2, 3]));
/// assert!(cut.line(7, 1_000_000, 9, &[1, 2, 3, 4]).is_none());
/// # Ok::<(), rowtone::camera::TimingError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The part of the picture, px.
    pub part: Region,
    /// When the rows of the part are exposed.
    pub timing: Timing,
}

impl Cut {
    /// The line of `row` of the whole picture (from 0, at most 65 535), whose 8-bit pixels are `pixels`.
    /// `frame` counts frames, lost ones too; `part_start_ns` is the start of exposure of the part's
    /// first row in this frame, ns on the camera's clock. `None` for a row outside the part, and for
    /// one that is too short.
    pub fn line<'p>(
        &self,
        frame: u32,
        part_start_ns: i64,
        row: u16,
        pixels: &'p [u8],
    ) -> Option<Line<'p>> {
        let Region {
            x,
            y,
            width,
            height,
        } = self.part;
        let row = row.checked_sub(y).filter(|&row| row < height)?;
        let pixels = pixels.get(usize::from(x)..)?.get(..usize::from(width))?;
        Some(Line {
            frame,
            row,
            start_ns: part_start_ns.saturating_add(self.timing.start_ns(row)),
            pixels: Pixels::U8(pixels),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_outside_the_part_and_short_rows_are_none() {
        let part = Region {
            x: 4,
            y: 2,
            width: 8,
            height: 3,
        };
        let timing = Timing::new(1_000_000, 0, 3).unwrap();
        let cut = Cut { part, timing };
        let pixels: [u8; 12] = core::array::from_fn(|x| x as u8);
        let rows: Vec<u16> = (0..8)
            .filter_map(|row| cut.line(0, 0, row, &pixels).map(|line| line.row))
            .collect();
        assert_eq!(rows, [0, 1, 2]);
        assert!(cut.line(0, 0, 3, &pixels[..11]).is_none());
        assert_eq!(
            cut.line(0, i64::MAX, 4, &pixels).map(|l| l.start_ns),
            Some(i64::MAX)
        );
    }
}
