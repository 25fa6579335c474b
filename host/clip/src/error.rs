//! Why a recording cannot be used.

use std::fmt;
use std::io;

use rowtone::camera::TimingError;
use rowtone_calibrate::file::FileError as CalibrationError;

use super::ffmpeg;
use super::header::HeaderError;
use super::option_error::OptionError;
use super::pts::PtsError;

/// Why a recording cannot be used, or not any further.
#[derive(Debug)]
pub enum ClipError {
    /// The options cannot be right, whatever the recording holds, or contradict it.
    Options(OptionError),
    /// The recording itself.
    Input {
        /// What the recording is called in messages.
        name: String,
        /// What is wrong with it.
        why: InputError,
    },
    /// The file of frame times.
    Times {
        /// The file's path, as it was given.
        path: String,
        /// What is wrong with it.
        why: PtsError,
    },
    /// The calibration file.
    Calibration {
        /// The file's path, as it was given.
        path: String,
        /// What is wrong with it.
        why: CalibrationError,
    },
}

impl ClipError {
    /// Something is wrong with the recording of this name.
    pub(crate) fn input(name: &str, why: InputError) -> Self {
        Self::Input {
            name: name.to_owned(),
            why,
        }
    }
}

impl From<OptionError> for ClipError {
    fn from(error: OptionError) -> Self {
        Self::Options(error)
    }
}

impl fmt::Display for ClipError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Options(error) => error.fmt(f),
            Self::Input { name, why } => write!(f, "{name}: {why}"),
            Self::Times { path, why } => write!(f, "{path}: {why}"),
            Self::Calibration { path, why } => write!(f, "{path}: {why}"),
        }
    }
}

impl std::error::Error for ClipError {}

/// What is wrong with a recording.
#[derive(Debug)]
pub enum InputError {
    /// It cannot be opened.
    Open(io::Error),
    /// It cannot be read.
    Read(io::Error),
    /// It is a folder.
    Folder,
    /// There is not one byte in it.
    Empty,
    /// Its Y4M header cannot be used.
    Header(HeaderError),
    /// No frame starts where one must: the file is damaged, or its header is wrong about the size.
    NoMarker {
        /// Number of the frame, from 0.
        frame: u64,
        /// Columns that the header promises.
        width: usize,
        /// Rows that the header promises.
        height: usize,
    },
    /// A frame cannot be read.
    Frame {
        /// Number of the frame, from 0.
        frame: u64,
        /// What the operating system says.
        error: io::Error,
    },
    /// What ffprobe and ffmpeg say of it.
    Ffmpeg(ffmpeg::Error),
    /// Nothing gives a frame rate.
    NoRate {
        /// What the header gives in its place, if anything.
        unusable: Option<String>,
    },
    /// The core cannot hold its timing.
    Timing(TimingError),
    /// It ends before its first frame.
    NoFrame {
        /// What the decoder complained of.
        complaint: Option<String>,
    },
    /// It ends inside its first frame.
    FirstFrameCut {
        /// Bytes of the frame that are there.
        have: usize,
        /// Bytes it should have.
        need: usize,
        /// Columns of the frame.
        width: usize,
        /// Rows of the frame.
        height: usize,
    },
    /// Another program cut the file short while this frame was read.
    CutWhileRead {
        /// Number of the frame, from 0.
        frame: u32,
    },
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open(error) => write!(f, "cannot be opened: {error}"),
            Self::Read(error) => write!(f, "cannot be read: {error}"),
            Self::Folder => f.write_str("is a folder: give a video file"),
            Self::Empty => f.write_str("the file is empty"),
            Self::Header(error) => error.fmt(f),
            Self::NoMarker {
                frame,
                width,
                height,
            } => write!(
                f,
                "frame {frame} does not start with FRAME: the file is damaged, or its header is \
                 wrong about the size of {width}x{height}"
            ),
            Self::Frame { frame, error } => write!(f, "frame {frame} cannot be read: {error}"),
            Self::Ffmpeg(error) => error.fmt(f),
            Self::NoRate {
                unusable: Some(rate),
            } => write!(
                f,
                "the header's frame rate F{rate} is none of a camera: give --fps F"
            ),
            Self::NoRate { unusable: None } => {
                f.write_str("the header gives no frame rate: give --fps F")
            }
            Self::Timing(error) => error.fmt(f),
            Self::NoFrame {
                complaint: Some(complaint),
            } => f.write_str(complaint),
            Self::NoFrame { complaint: None } => f.write_str("there is no frame in it"),
            Self::FirstFrameCut {
                have,
                need,
                width,
                height,
            } => write!(
                f,
                "not even one frame: {have} bytes where a frame of {width}x{height} has {need}"
            ),
            Self::CutWhileRead { frame } => write!(
                f,
                "was cut short by another program while it was read, at frame {frame}"
            ),
        }
    }
}

impl std::error::Error for InputError {}
