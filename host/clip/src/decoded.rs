//! The frames that ffmpeg decodes, as every other source has them.

use std::path::Path;

use super::bytes::Bytes;
use super::error::InputError;
use super::ffmpeg::{self, Luma, Probe, Video};
use super::frame_read::Next;
use super::source::{Coding, FrameSource, Stamp};
use super::{ClipError, Header, PixelFormat};

/// A video file that ffmpeg decodes.
#[derive(Debug)]
pub(super) struct Decoded {
    video: Video,
    header: Header,
    name: String,
    stamp: Stamp,
    warning: Option<String>,
}

impl Decoded {
    /// Starts decoding a file that ffprobe has looked at. `name` stands in front of every message.
    ///
    /// # Errors
    /// [`ClipError::Input`] when ffmpeg cannot.
    pub(super) fn open(path: &Path, name: &str, probe: &Probe) -> Result<Self, ClipError> {
        let video = Video::open(path, probe).map_err(|error| refused(name, error))?;
        Ok(Self {
            header: Header {
                width: probe.width.into(),
                height: probe.height.into(),
                fps: probe.fps,
                unusable_rate: None,
                format: PixelFormat::luma(Luma::of(&probe.pixel_format).bits),
            },
            video,
            name: name.to_owned(),
            stamp: Stamp::default(),
            warning: None,
        })
    }
}

impl FrameSource for Decoded {
    fn header(&self) -> &Header {
        &self.header
    }

    fn next_frame(&mut self, bytes: &mut Bytes) -> Result<Next, ClipError> {
        let shown = self
            .video
            .next_frame(bytes.buffer())
            .map_err(|error| refused(&self.name, error))?;
        let Some(shown) = shown else {
            self.warning = self.video.warning();
            return Ok(Next::End);
        };
        let base = self.video.time_base();
        self.stamp = Stamp {
            time_ns: shown.pts.and_then(|pts| base?.times_in_ns(pts)),
            coding: Some(Coding {
                key: shown.key,
                kind: shown.kind,
            }),
        };
        Ok(Next::Frame { luma: 0 })
    }

    fn stamp(&self) -> Stamp {
        self.stamp
    }

    fn warning(&self) -> Option<String> {
        self.warning.clone()
    }
}

/// The file's name in front.
pub(super) fn refused(name: &str, error: ffmpeg::Error) -> ClipError {
    ClipError::input(name, InputError::Ffmpeg(error))
}
