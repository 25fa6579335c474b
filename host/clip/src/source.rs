//! Where frames come from, whatever the way.

use super::bytes::Bytes;
use super::ffmpeg::FrameKind;
use super::frame_read::Next;
use super::{ClipError, Header};

/// How a frame was coded in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coding {
    /// Decoding can start here: the frame needs no other.
    pub key: bool,
    /// By which means.
    pub kind: FrameKind,
}

/// What a file says of one of its frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Start of exposure by the file's clock, ns.
    pub(super) time_ns: Option<i64>,
    /// How it was coded; `None` in files of plain pixels.
    pub(super) coding: Option<Coding>,
}

/// Frames, one after the other.
pub(super) trait FrameSource {
    /// How a frame is laid out.
    fn header(&self) -> &Header;

    /// Puts the next frame, whatever stands in front of its luma with it, into `bytes`.
    ///
    /// # Errors
    /// [`ClipError::Input`] when the source cannot be read, or turns out not to be what it said.
    fn next_frame(&mut self, bytes: &mut Bytes) -> Result<Next, ClipError>;

    /// What the file says of the frame that was delivered last.
    fn stamp(&self) -> Stamp {
        Stamp::default()
    }

    /// Something to tell the user after the last frame, without the name of the recording.
    fn warning(&self) -> Option<String> {
        None
    }
}
