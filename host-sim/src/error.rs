//! What can be wrong with a configuration.

use std::fmt;

/// Why a configuration was refused; each names the field and the value.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SimError {
    /// A number outside what it may be.
    Range {
        /// The field, as in [`super::Config`].
        field: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// The rows of a frame take longer to read than a frame lasts.
    ReadoutTooLong {
        /// Read-out time, ms.
        readout_ms: f64,
        /// Frame time, ms.
        frame_ms: f64,
    },
    /// A rectangle or a row or column lies outside the picture.
    Outside {
        /// The field.
        field: &'static str,
        /// What was asked for.
        value: String,
        /// Columns of the picture.
        cols: u32,
        /// Rows of the picture.
        rows: u32,
    },
    /// A picture or sound file could not be used.
    File {
        /// The file.
        path: String,
        /// Why.
        why: String,
    },
}

impl fmt::Display for SimError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range {
                field,
                value,
                allowed,
            } => {
                write!(
                    f,
                    "simulated camera: {field} is {value}, but must be {allowed}"
                )
            }
            Self::ReadoutTooLong {
                readout_ms,
                frame_ms,
            } => write!(
                f,
                "simulated camera: reading the rows takes {readout_ms:.3} ms, longer than a frame of \
                 {frame_ms:.3} ms; lower the frame rate, the rows or the line time"
            ),
            Self::Outside {
                field,
                value,
                cols,
                rows,
            } => write!(
                f,
                "simulated camera: {field} {value} lies outside the picture of {cols}x{rows}"
            ),
            Self::File { path, why } => write!(f, "{path}: {why}"),
        }
    }
}

impl std::error::Error for SimError {}

/// `Ok` when `good`, otherwise a [`SimError::Range`]. NaN is never good if `good` is a comparison.
pub(super) fn check(
    good: bool,
    field: &'static str,
    value: f64,
    allowed: &'static str,
) -> Result<(), SimError> {
    if good {
        Ok(())
    } else {
        Err(SimError::Range {
            field,
            value,
            allowed,
        })
    }
}
