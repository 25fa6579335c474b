//! What came of asking a source for a frame.

/// What came of asking for a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The buffer holds a frame; its luma plane starts at this byte.
    Frame {
        /// First byte of the luma plane.
        luma: usize,
    },
    /// The file ended where a frame would begin.
    End,
    /// The file ended inside a frame.
    Truncated {
        /// Bytes of the frame that were there.
        have: usize,
        /// Bytes it should have.
        need: usize,
    },
}
