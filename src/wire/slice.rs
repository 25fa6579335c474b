//! A lent byte slice that can be written to as text.

use core::fmt;

/// Writes text into a lent slice and remembers how much of it is used.
#[derive(Debug)]
pub(crate) struct SliceWriter<'a> {
    buffer: &'a mut [u8],
    used: usize,
}

impl<'a> SliceWriter<'a> {
    /// Starts at the slice's first byte.
    pub(crate) fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, used: 0 }
    }

    /// What was written, for as long as the slice was lent.
    pub(crate) fn into_written(self) -> &'a [u8] {
        self.buffer.get(..self.used).unwrap_or_default()
    }
}

impl fmt::Write for SliceWriter<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = self.used.checked_add(text.len()).ok_or(fmt::Error)?;
        let room = self.buffer.get_mut(self.used..end).ok_or(fmt::Error)?;
        room.copy_from_slice(text.as_bytes());
        self.used = end;
        Ok(())
    }
}
