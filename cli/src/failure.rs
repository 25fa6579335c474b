//! Why a command stopped: one line of text and the exit status that goes with it.

use std::fmt;
use std::io;
use std::path::Path;

use rowtone_clip::{ClipError, OptionError};
use rowtone_files::WholeFile;
#[cfg(feature = "lab")]
use rowtone_lab::LabError;
use rowtone_measure::MeasureError;
use rowtone_measure::shapes::ShapesError;
use rowtone_plot::PlotError;
use rowtone_serial::SerialError;

/// Why a command stopped before its work was done.
///
/// The text says what is wrong, where, and what to do about it, in one line and without the
/// program's name: [`crate::commands::main`] prints `rowtone: ` in front of it.
///
/// ```
/// use rowtone_cli::failure::Failure;
/// assert_eq!(Failure::input("clip.y4m: the file is empty").status(), 1);
/// assert_eq!(Failure::usage("--roi wants X,Y,W,H").status(), 2);
/// assert_eq!(Failure::OutputClosed.status(), 0);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The input is unusable: exit status 1.
    Input(String),
    /// The command line is wrong: exit status 2.
    Usage(String),
    /// Whoever read our output has seen enough (as `rowtone analyze … | head -1` has): not an error,
    /// exit status 0, nothing printed.
    OutputClosed,
}

impl Failure {
    /// The input is unusable.
    pub fn input(text: impl Into<String>) -> Self {
        Self::Input(text.into())
    }

    /// The command line is wrong.
    pub fn usage(text: impl Into<String>) -> Self {
        Self::Usage(text.into())
    }

    /// Writing `place` failed. A closed pipe is [`Failure::OutputClosed`].
    pub fn writing(place: &str, error: &io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            Self::OutputClosed
        } else {
            Self::Input(format!("{place}: cannot be written: {error}"))
        }
    }

    /// Says before anything is measured that this file cannot be written.
    ///
    /// # Errors
    /// [`Failure::Input`] where it cannot.
    pub fn unless_writable(path: &Path) -> Result<(), Self> {
        WholeFile::check(path).map_err(|e| Self::writing(&path.display().to_string(), &e))
    }

    /// What the process exits with.
    pub const fn status(&self) -> u8 {
        match self {
            Self::OutputClosed => 0,
            Self::Input(_) => 1,
            Self::Usage(_) => 2,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // One line, whatever a library put into its own message.
            Self::Input(text) | Self::Usage(text) => {
                for (i, word) in text.split_whitespace().enumerate() {
                    if i > 0 {
                        f.write_str(" ")?;
                    }
                    f.write_str(word)?;
                }
                Ok(())
            }
            Self::OutputClosed => f.write_str("the output was closed"),
        }
    }
}

impl std::error::Error for Failure {}

impl From<OptionError> for Failure {
    fn from(error: OptionError) -> Self {
        Self::usage(error.to_string())
    }
}

impl From<ClipError> for Failure {
    fn from(error: ClipError) -> Self {
        match error {
            ClipError::Options(error) => error.into(),
            _ => Self::input(error.to_string()),
        }
    }
}

impl From<MeasureError> for Failure {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Clip(error) => error.into(),
            MeasureError::Settings(error) => Self::usage(error.to_string()),
            _ => Self::input(error.to_string()),
        }
    }
}

/// Shapes that cannot be had.
impl From<ShapesError> for Failure {
    fn from(error: ShapesError) -> Self {
        match error {
            ShapesError::Measure(error) => error.into(),
            ShapesError::Pipe
            | ShapesError::Grid(_)
            | ShapesError::Hidden(_)
            | ShapesError::Alike(_) => Self::usage(error.to_string()),
            _ => Self::input(error.to_string()),
        }
    }
}

/// A picture of `--plot`.
impl From<PlotError> for Failure {
    fn from(error: PlotError) -> Self {
        match &error {
            PlotError::Ending(_) => Self::usage(format!("--plot {error}")),
            PlotError::Write { path, why } => Self::writing(&path.display().to_string(), why),
            PlotError::Draw { .. } => Self::input(error.to_string()),
        }
    }
}

/// A port of `--serial`.
impl From<SerialError> for Failure {
    fn from(error: SerialError) -> Self {
        match &error {
            SerialError::Settings(_) => Self::usage(format!("--serial: {error}")),
            _ => Self::input(error.to_string()),
        }
    }
}

#[cfg(feature = "lab")]
impl From<LabError> for Failure {
    fn from(error: LabError) -> Self {
        match error {
            LabError::Measure(error) => error.into(),
            LabError::Simulation(_) | LabError::Timing(_) => Self::usage(error.to_string()),
            LabError::Write { path, why } => Self::writing(&path.display().to_string(), &why),
            _ => Self::input(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line() {
        let failure = Failure::input("clip.y4m:\n  odd\tthing");
        assert_eq!(failure.to_string(), "clip.y4m: odd thing");
    }

    #[test]
    fn a_closed_pipe_is_no_error() {
        let closed = io::Error::from(io::ErrorKind::BrokenPipe);
        assert_eq!(
            Failure::writing("standard output", &closed),
            Failure::OutputClosed
        );
        let full = io::Error::from(io::ErrorKind::StorageFull);
        assert_eq!(Failure::writing("out.csv", &full).status(), 1);
    }
}
