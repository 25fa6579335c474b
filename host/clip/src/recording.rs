//! Opening a recording: which way its frames are read, and what is known before the first of them.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use super::ClipError;
use super::decoded::{self, Decoded};
use super::error::InputError;
use super::ffmpeg::{self, Probe};
use super::header::MAGIC;
use super::mapped::MappedReader;
use super::source::FrameSource;
use super::y4m::Reader;

/// What is known of a recording beforehand, beside its header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// How many frames there are.
    pub frames: Option<u64>,
    /// Behind the last whole frame there is part of another.
    pub ends_in_a_frame: bool,
    /// What ffprobe says of a video file; `None` for Y4M.
    pub probe: Option<Probe>,
}

/// A recording, opened.
pub(super) struct Recording {
    /// Where its frames come from.
    pub(super) source: Box<dyn FrameSource + Send>,
    /// What is known of it.
    pub(super) about: About,
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording")
            .field("header", self.source.header())
            .field("about", &self.about)
            .finish_non_exhaustive()
    }
}

impl Recording {
    /// Opens a file, or standard input where `input` is `-`: a Y4M stream is read as it is, and a file of
    /// another kind through ffmpeg. `name` stands in front of every message.
    ///
    /// # Errors
    /// [`ClipError::Input`] for what cannot be opened or is no video.
    pub(super) fn open(input: &str, name: &str) -> Result<Self, ClipError> {
        if input == "-" {
            return Self::read(io::stdin(), name);
        }
        let refuse = |why| ClipError::input(name, why);
        let unreadable = |error| refuse(InputError::Read(error));
        let mut file = File::open(input).map_err(|error| refuse(InputError::Open(error)))?;
        let meta = file.metadata().map_err(unreadable)?;
        if meta.is_dir() {
            return Err(refuse(InputError::Folder));
        }
        if !meta.is_file() {
            return Self::read(file, name);
        }
        let start = first_bytes(&mut file).map_err(unreadable)?;
        if start.is_empty() {
            return Err(refuse(InputError::Empty));
        }
        let path = Path::new(input);
        let is_called_y4m = path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("y4m"));
        if start == MAGIC || is_called_y4m {
            return Self::y4m(file, meta.len(), name);
        }
        let probe = ffmpeg::probe(path).map_err(|error| decoded::refused(name, error))?;
        Ok(Self {
            source: Box::new(Decoded::open(path, name, &probe)?),
            about: About {
                frames: Some(probe.frames).filter(|&frames| frames > 0),
                ends_in_a_frame: false,
                probe: Some(probe),
            },
        })
    }

    /// A stream of Y4M.
    ///
    /// # Errors
    /// [`ClipError::Input`] for what is none.
    pub(super) fn read(from: impl Read + Send + 'static, name: &str) -> Result<Self, ClipError> {
        Ok(Self {
            source: Box::new(Reader::open(from, name)?),
            about: About::default(),
        })
    }

    /// A file of Y4M with this many bytes.
    fn y4m(file: File, bytes: u64, name: &str) -> Result<Self, ClipError> {
        let reader = Reader::open(file, name)?;
        let behind_header = bytes.saturating_sub(reader.header_bytes() as u64);
        let stride = reader.stride() as u64;
        let about = About {
            frames: Some(behind_header / stride),
            ends_in_a_frame: !behind_header.is_multiple_of(stride),
            probe: None,
        };
        let source: Box<dyn FrameSource + Send> = match MappedReader::new(&reader) {
            Ok(mapped) => Box::new(mapped),
            Err(_) => Box::new(reader),
        };
        Ok(Self { source, about })
    }
}

/// As many bytes of a file's start as tell a Y4M, and back to it.
fn first_bytes(file: &mut File) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut start)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(start)
}
