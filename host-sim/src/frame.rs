//! A frame as it arrives.

use rowtone::camera::{Line, Pixels};

/// The pixels of a frame, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PixelBuffer {
    /// 8 bits.
    U8(Vec<u8>),
    /// 10 to 16 bits, one pixel a word, not scaled up.
    U16(Vec<u16>),
}

/// One frame as it arrives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its number; lost frames leave a gap.
    pub number: u32,
    /// Start of exposure of the row that is read first, ns.
    pub start_ns: i64,
    /// Columns.
    pub cols: u32,
    /// Its pixels.
    pub pixels: PixelBuffer,
    pub(super) line_time_ps: u32,
    pub(super) rows: u32,
    pub(super) bottom_up: bool,
}

impl Frame {
    /// Rows.
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// The line of `row`, as the core takes it; `None` beyond the last.
    pub fn line(&self, row: u32) -> Option<Line<'_>> {
        let cols = self.cols as usize;
        let pixels = match &self.pixels {
            PixelBuffer::U8(p) => Pixels::U8(p),
            PixelBuffer::U16(p) => Pixels::U16(p),
        };
        let pixels = pixels.part(row as usize * cols, cols)?;
        let order = if self.bottom_up {
            self.rows - 1 - row
        } else {
            row
        };
        let start_ns =
            self.start_ns + (u64::from(order) * u64::from(self.line_time_ps) / 1000) as i64;
        Some(Line {
            frame: self.number,
            row: u16::try_from(row).ok()?,
            start_ns,
            pixels,
        })
    }
}
