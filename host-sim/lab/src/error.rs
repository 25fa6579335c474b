//! Why a figure of the laboratory cannot be had.

use std::path::PathBuf;
use std::{fmt, io};

use host_sim::SimError;
use rowtone::camera::TimingError;
use rowtone_clip::ClipError;
use rowtone_measure::MeasureError;
use rowtone_measure::shapes::ShapesError;
use rowtone_plot::PlotError;

/// Why a recording cannot be made, measured or written down.
#[derive(Debug)]
pub enum LabError {
    /// What was asked for cannot be simulated.
    Simulation(SimError),
    /// A recording that the laboratory chose itself cannot be simulated.
    Recording {
        /// Which one.
        what: String,
        /// What is wrong with it.
        why: SimError,
    },
    /// The core cannot hold the camera's timing.
    Timing(TimingError),
    /// A recording cannot be measured.
    Measure(MeasureError),
    /// The shapes of a recording cannot be had.
    Shapes(ShapesError),
    /// No frame of a simulated recording arrives.
    NoFrame,
    /// No report came of a simulated recording.
    NoReport,
    /// A recording cannot be opened.
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        why: io::Error,
    },
    /// A recording has other than 8 bits a pixel, or no frame rate in its header.
    Depth(PathBuf),
    /// A result cannot be written.
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        why: io::Error,
    },
    /// A sound cannot be written.
    Sound {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        why: hound::Error,
    },
    /// A figure cannot be drawn or written.
    Plot(PlotError),
}

impl From<SimError> for LabError {
    fn from(error: SimError) -> Self {
        Self::Simulation(error)
    }
}

impl From<TimingError> for LabError {
    fn from(error: TimingError) -> Self {
        Self::Timing(error)
    }
}

impl From<MeasureError> for LabError {
    fn from(error: MeasureError) -> Self {
        Self::Measure(error)
    }
}

impl From<ShapesError> for LabError {
    fn from(error: ShapesError) -> Self {
        Self::Shapes(error)
    }
}

impl From<ClipError> for LabError {
    fn from(error: ClipError) -> Self {
        Self::Measure(error.into())
    }
}

impl From<PlotError> for LabError {
    fn from(error: PlotError) -> Self {
        Self::Plot(error)
    }
}

impl fmt::Display for LabError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulation(error) => error.fmt(f),
            Self::Recording { what, why } => write!(f, "{what}: {why}"),
            Self::Timing(error) => error.fmt(f),
            Self::Measure(error) => error.fmt(f),
            Self::Shapes(error) => error.fmt(f),
            Self::NoFrame => f.write_str("the simulated recording: no frame arrives"),
            Self::NoReport => f.write_str("the simulated recording: no report came"),
            Self::Open { path, why } => write!(f, "{}: cannot be opened: {why}", path.display()),
            Self::Depth(path) => write!(
                f,
                "{}: want 8 bits and a frame rate in the header",
                path.display()
            ),
            Self::Write { path, why } => write!(f, "{}: cannot be written: {why}", path.display()),
            Self::Sound { path, why } => write!(f, "{}: cannot be written: {why}", path.display()),
            Self::Plot(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for LabError {}
