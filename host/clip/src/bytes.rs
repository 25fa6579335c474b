//! The bytes of one frame, wherever they are.

use std::ops::{Deref, Range};
use std::sync::Arc;

use super::window::Window;

/// A frame's bytes, marker and all: in memory of their own, or in a window of a file.
#[derive(Debug)]
pub(super) enum Bytes {
    /// Copied here.
    Read(Vec<u8>),
    /// Part of a window, which stays mapped for as long as a frame holds it.
    Mapped(Arc<Window>, Range<usize>),
}

impl Bytes {
    /// The file was cut short, and zeros were read where pages of these bytes were.
    pub(super) fn are_cut(&self) -> bool {
        match self {
            Self::Read(_) => false,
            Self::Mapped(window, _) => window.is_cut(),
        }
    }

    /// A buffer to read into, that of the frame before if there was one.
    pub(super) fn buffer(&mut self) -> &mut Vec<u8> {
        if let Self::Mapped(..) = self {
            *self = Self::default();
        }
        match self {
            Self::Read(bytes) => bytes,
            Self::Mapped(..) => unreachable!("replaced above"),
        }
    }
}

impl Default for Bytes {
    fn default() -> Self {
        Self::Read(Vec::new())
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Read(bytes) => bytes,
            Self::Mapped(window, range) => &window[range.clone()],
        }
    }
}
