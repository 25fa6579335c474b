//! What can be wrong with a picture.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// What drawing says when it cannot.
pub type DrawError = Box<dyn std::error::Error>;

/// Why there is no picture. The text is one line that names the file.
#[derive(Debug)]
pub enum PlotError {
    /// The file's name ends in neither `.svg` nor `.png`.
    Ending(PathBuf),
    /// It cannot be drawn.
    Draw {
        /// The file.
        path: PathBuf,
        /// What the drawing library says.
        why: DrawError,
    },
    /// It cannot be written.
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        why: io::Error,
    },
}

impl fmt::Display for PlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ending(path) => {
                let path = path.display();
                write!(f, "{path}: want a file that ends in .svg or .png")
            }
            Self::Draw { path, why } => write!(f, "{}: cannot be drawn: {why}", path.display()),
            Self::Write { path, why } => write!(f, "{}: cannot be written: {why}", path.display()),
        }
    }
}

impl std::error::Error for PlotError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Ending(_) => None,
            Self::Draw { why, .. } => Some(why.as_ref()),
            Self::Write { why, .. } => Some(why),
        }
    }
}
