//! Why there is no shape.

use std::fmt;

use rowtone::shape::{GridError, SumsError, TextureError};
use rowtone_clip::ClipError;

use super::mean::LEAST_FRAMES;
use crate::MeasureError;

/// Why the shapes of a recording cannot be had.
#[derive(Debug)]
pub enum ShapesError {
    /// The recording cannot be read or measured.
    Measure(MeasureError),
    /// The recording comes through a pipe, and must be read several times.
    Pipe,
    /// The tiles do not fit the picture.
    Grid(GridError),
    /// A frequency that was asked for is not known.
    Hidden(Hidden),
    /// Two frequencies that were asked for look alike to every row.
    Alike(Alike),
    /// What is wrong with the recording.
    Recording {
        /// What it is called in messages.
        name: String,
        /// What is wrong with it.
        why: RecordingError,
    },
    /// The core refused what it was lent, which is a fault of this crate.
    Core(String),
}

/// Two frequencies, Hz, whose sum or difference is a multiple of the frame rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alike {
    /// One of them, Hz.
    pub hz: f64,
    /// The other, Hz.
    pub other_hz: f64,
    /// Frame rate, Hz.
    pub fps: f64,
}

/// Why a tone cannot be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hidden {
    /// Above half the frame rate of a global shutter.
    Global {
        /// Frequency, Hz.
        hz: f64,
        /// Frame rate, Hz.
        fps: f64,
    },
    /// Too near a multiple of half the frame rate.
    Still {
        /// Frequency, Hz.
        hz: f64,
        /// Frame rate, Hz.
        fps: f64,
    },
    /// The exposure leaves too little of it.
    Exposure {
        /// Frequency, Hz.
        hz: f64,
        /// Exposure of a row, s.
        exposure_s: f64,
        /// What is left of the amplitude.
        gain: f64,
    },
}

/// What is wrong with a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingError {
    /// It has so few frames.
    Frames(usize),
    /// Nothing in it is a tone.
    NoTone,
    /// All of its tones were left out; why the last one was.
    LeftOut(String),
    /// Two of its tones look alike to every row.
    Alike(Alike),
    /// Its frames do not tell its tones apart.
    Singular,
    /// No tile has texture.
    Plain,
    /// The background has no tile with texture.
    Background,
}

impl ShapesError {
    pub(super) fn recording(name: &str, why: RecordingError) -> Self {
        Self::Recording {
            name: name.to_owned(),
            why,
        }
    }
}

impl From<MeasureError> for ShapesError {
    fn from(error: MeasureError) -> Self {
        Self::Measure(error)
    }
}

impl From<ClipError> for ShapesError {
    fn from(error: ClipError) -> Self {
        Self::Measure(error.into())
    }
}

impl From<TextureError> for ShapesError {
    fn from(error: TextureError) -> Self {
        Self::Core(error.to_string())
    }
}

impl From<SumsError> for ShapesError {
    fn from(error: SumsError) -> Self {
        Self::Core(error.to_string())
    }
}

impl fmt::Display for ShapesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Measure(error) => error.fmt(f),
            Self::Pipe => f.write_str(
                "shapes are made by reading the recording three times, and standard input comes \
                 once: give a file",
            ),
            Self::Grid(error) => write!(f, "--tile: {error}"),
            Self::Hidden(why) => write!(f, "--hz: {why}"),
            Self::Alike(both) => write!(f, "--hz: {both}"),
            Self::Recording { name, why } => write!(f, "{name}: {why}"),
            Self::Core(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for ShapesError {}

impl fmt::Display for Alike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hz, other_hz, fps } = self;
        write!(
            f,
            "{hz:.2} and {other_hz:.2} Hz cannot be told apart at {fps:.3} fps: their sum or \
             difference is a multiple of it (film at another frame rate)"
        )
    }
}

impl fmt::Display for Hidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Global { hz, fps } => write!(
                f,
                "{hz} Hz is above half of {fps:.3} fps, and a global shutter sees each frame at \
                 one time"
            ),
            Self::Still { hz, fps } => write!(
                f,
                "{hz} Hz is too near a multiple of half the frame rate ({fps:.3} fps): every \
                 frame sees it alike"
            ),
            Self::Exposure {
                hz,
                exposure_s,
                gain,
            } => write!(
                f,
                "{hz} Hz: an exposure of {:.0} µs averages all but {:.0} % of it away",
                exposure_s * 1e6,
                gain * 100.0
            ),
        }
    }
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frames(frames) => write!(
                f,
                "{frames} frames are too few for a shape: at least {LEAST_FRAMES}"
            ),
            Self::NoTone => f.write_str(
                "no tone was found, so there is no shape (--hz F measures at a frequency all the \
                 same)",
            ),
            Self::LeftOut(why) => write!(f, "no shape to measure: {why}"),
            Self::Alike(both) => both.fmt(f),
            Self::Singular => f.write_str("the frames are too few to tell the tones apart"),
            Self::Plain => f.write_str(
                "no tile has enough texture: edges, print, scratches or speckle are what moves",
            ),
            Self::Background => f.write_str("--background has no tile with enough texture"),
        }
    }
}
