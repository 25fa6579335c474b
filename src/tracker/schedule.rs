//! What the next line is in for, settled by the line before.

use crate::camera::Line;

/// Which lines take the fast path: rows of this frame below this one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FastPath {
    pub(super) frame: u32,
    pub(super) until_row: u16,
    /// Rows below this one would, but for a check or a background job.
    pub(super) background_until_row: u16,
}

impl FastPath {
    /// The line takes it.
    #[inline(always)]
    pub(super) fn has(&self, line: &Line<'_>) -> bool {
        line.row < self.until_row && line.frame == self.frame
    }

    /// No line takes it.
    pub(super) fn end(&mut self) {
        self.until_row = 0;
        self.background_until_row = 0;
    }
}

/// Rows of a frame that take the fast path where both axes are measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FastRows {
    pub(super) frame: u32,
    pub(super) until_row: u16,
}

impl FastRows {
    #[inline(always)]
    pub(super) fn has(&self, line: &Line<'_>) -> bool {
        line.row < self.until_row && line.frame == self.frame
    }
}

/// What the next line is in for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    pub(super) fast_path: FastPath,
    /// The row of this frame from which the reference is followed; `usize::MAX` for none.
    pub(super) turn: usize,
    /// A background job waits for the next line: the reference is followed, or a lost picture is searched for.
    pub(super) background: bool,
    /// The row from which on the next line is checked.
    pub(super) next_check: usize,
    /// A row of this frame that does not take the fast path, so that whoever pushes lines has something to do with it;
    /// 0 for none.
    pub(super) pause_row: u16,
}

impl Schedule {
    pub(super) fn new() -> Self {
        Self {
            fast_path: FastPath::default(),
            turn: usize::MAX,
            background: false,
            next_check: 0,
            pause_row: 0,
        }
    }

    /// The row before which the fast path ends, of a picture of so many rows, after a line of row `after`.
    pub(super) fn fast_until(&self, after: u16, rows: usize) -> u16 {
        let until = self.next_check.min(rows) as u16;
        match self.pause_row > after {
            true => until.min(self.pause_row),
            false => until,
        }
    }
}
