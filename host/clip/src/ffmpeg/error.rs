//! Why a video file cannot be read through ffmpeg.

use std::fmt;
use std::io;

/// What is wrong with a video file, or with the programs that read it. The file's name is not in it.
#[derive(Debug)]
pub enum Error {
    /// ffprobe or ffmpeg, whichever this names, is not installed.
    Missing(&'static str),
    /// The program named first could not be started, or its answer not be read.
    Program(&'static str, io::Error),
    /// ffprobe or ffmpeg gave up; the text is its own reason, one line.
    Refused(String),
    /// There is no moving picture in the file.
    NoVideo,
    /// A picture of this size cannot be measured.
    Size(u64, u64),
    /// The fields of a picture were exposed one after the other; the text is ffprobe's word for their
    /// order.
    Interlaced(String),
    /// The file's format, which the text names, holds no frame times: a frame rate must be given.
    NoTimes(String),
    /// The size of the picture changes within the file.
    SizeChanges {
        /// Number of the first frame of the other size, from 0.
        frame: u64,
        /// Columns and rows before.
        from: (usize, usize),
        /// Columns and rows from there on.
        to: (usize, usize),
    },
    /// ffmpeg said less of a frame than is needed to use it; the text says what.
    Garbled(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(program) => write!(
                f,
                "reading this file needs the program {program}, which is not installed: \
                 `sudo apt install ffmpeg` (Debian, Ubuntu, Raspberry Pi OS) installs it; Y4M files \
                 are read without it"
            ),
            Self::Program(program, error) => write!(f, "{program} cannot be run: {error}"),
            Self::Refused(reason) => write!(f, "ffmpeg cannot read it: {reason}"),
            Self::NoVideo => f.write_str("there is no video in it"),
            Self::Size(width, height) => write!(
                f,
                "its picture of {width}x{height} px cannot be measured: 1 to 65535 columns and rows"
            ),
            Self::Interlaced(order) => write!(
                f,
                "the video is interlaced ({order}): its rows are out of time order; record it \
                 progressive"
            ),
            Self::NoTimes(format) => write!(
                f,
                "a file of the format {format} holds no frame times: give --fps F or --pts FILE"
            ),
            Self::SizeChanges { frame, from, to } => write!(
                f,
                "the picture's size changes from {}x{} to {}x{} at frame {frame}: cut the file there",
                from.0, from.1, to.0, to.1
            ),
            Self::Garbled(what) => {
                write!(f, "ffmpeg's report of its frames is not understood: {what}")
            }
        }
    }
}

impl std::error::Error for Error {}
