//! Why a recording cannot be measured.

use std::fmt;

use rowtone::camera::TimingError;
use rowtone::timeline::BinnerError;
use rowtone::{spectrum, tracker};
use rowtone_clip::{ClipError, OptionError, Rect};

/// A part narrower than this has hardly a column whose surroundings stay in it while it moves, px.
const NARROW_PX: usize = 32;

/// Why a recording cannot be measured, or not any further.
#[derive(Debug)]
pub enum MeasureError {
    /// The recording cannot be read, or the options contradict it.
    Clip(ClipError),
    /// What is asked for cannot be had from this camera.
    Settings(SettingsError),
    /// A part of the picture cannot be measured.
    Part {
        /// What the recording is called in messages.
        name: String,
        /// What is wrong with it.
        why: PartError,
    },
    /// The recording has one frame, and motion shows only from frame to frame.
    OneFrame {
        /// What the recording is called in messages.
        name: String,
    },
    /// No row of the part had enough texture to be measured.
    NothingMeasured {
        /// What the recording is called in messages.
        name: String,
        /// The part that was tried, in the turned picture.
        part: Rect,
    },
}

impl From<ClipError> for MeasureError {
    fn from(error: ClipError) -> Self {
        Self::Clip(error)
    }
}

impl From<OptionError> for MeasureError {
    fn from(error: OptionError) -> Self {
        Self::Clip(error.into())
    }
}

impl From<TimingError> for MeasureError {
    fn from(error: TimingError) -> Self {
        Self::Settings(error.into())
    }
}

impl From<BinnerError> for MeasureError {
    fn from(error: BinnerError) -> Self {
        Self::Settings(error.into())
    }
}

impl From<spectrum::ConfigError> for MeasureError {
    fn from(error: spectrum::ConfigError) -> Self {
        Self::Settings(error.into())
    }
}

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clip(error) => error.fmt(f),
            Self::Settings(error) => error.fmt(f),
            Self::Part { name, why } => write!(f, "{name}: {why}"),
            Self::OneFrame { name } => write!(
                f,
                "{name}: only one frame: motion shows only from frame to frame"
            ),
            Self::NothingMeasured { name, part } if part.width < NARROW_PX => write!(
                f,
                "{name}: no row could be measured: the part of {}x{} px is too narrow, since some \
                 ten columns at either edge only tell what moves in: make it at least {NARROW_PX} \
                 px wide (--roi)",
                part.width, part.height
            ),
            Self::NothingMeasured { name, .. } => write!(
                f,
                "{name}: no row could be measured: the picture has too little texture across: \
                 edges, print, scratches or speckle are what moves"
            ),
        }
    }
}

impl std::error::Error for MeasureError {}

/// Why an analysis cannot be had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingsError {
    /// The core cannot hold the timing of the part.
    Timing(TimingError),
    /// The rows of a sample.
    Group(BinnerError),
    /// The windows and what is looked for in them.
    Spectrum(spectrum::ConfigError),
}

impl From<TimingError> for SettingsError {
    fn from(error: TimingError) -> Self {
        Self::Timing(error)
    }
}

impl From<BinnerError> for SettingsError {
    fn from(error: BinnerError) -> Self {
        Self::Group(error)
    }
}

impl From<spectrum::ConfigError> for SettingsError {
    fn from(error: spectrum::ConfigError) -> Self {
        Self::Spectrum(error)
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Timing(error) => error.fmt(f),
            Self::Group(error) => error.fmt(f),
            Self::Spectrum(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SettingsError {}

/// Why a part of a picture cannot be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartError {
    /// Its size or depth.
    Tracker(tracker::ConfigError),
    /// The rows of a sample.
    Group(BinnerError),
}

impl From<tracker::ConfigError> for PartError {
    fn from(error: tracker::ConfigError) -> Self {
        Self::Tracker(error)
    }
}

impl From<BinnerError> for PartError {
    fn from(error: BinnerError) -> Self {
        Self::Group(error)
    }
}

impl fmt::Display for PartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tracker(error) => error.fmt(f),
            Self::Group(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for PartError {}
