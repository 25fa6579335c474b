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
}

impl Schedule {
    pub(super) fn new() -> Self {
        Self {
            fast_path: FastPath::default(),
            turn: usize::MAX,
            background: false,
            next_check: 0,
        }
    }
}
