//! Results out: displacements as CSV, NPY and WAV, spectra as CSV, reports line by line.
//!
//! Standard output carries results and nothing else. [`Out`] writes lines to it (or to a file), each
//! flushed as it is complete, and turns a closed pipe into [`Failure::OutputClosed`].

pub(crate) mod first_frame;
pub(crate) mod npy;
pub(crate) mod page;
pub mod progress;
pub mod series;
pub(crate) mod spectrum_csv;
pub mod wav;

use std::io::{self, Write};

use crate::failure::Failure;

/// Standard output, line by line.
#[derive(Debug)]
pub struct Out {
    to: io::Stdout,
}

impl Default for Out {
    fn default() -> Self {
        Self { to: io::stdout() }
    }
}

impl Out {
    /// Writes `text` and a line feed, and flushes: whoever reads has each line as soon as it is known.
    ///
    /// # Errors
    /// [`Failure::OutputClosed`] when the reader is gone, [`Failure::Input`] when writing fails.
    pub fn line(&mut self, text: &str) -> Result<(), Failure> {
        let mut to = self.to.lock();
        to.write_all(text.as_bytes())
            .and_then(|()| to.write_all(b"\n"))
            .and_then(|()| to.flush())
            .map_err(|e| Failure::writing("standard output", &e))
    }
}
