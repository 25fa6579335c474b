//! The clip as a camera would deliver it: line after line, each with its time.

use rowtone::camera::{Line, Pixels, Timing};
use rowtone_mps2_an505::board::host::{File, FileError};
use rowtone_mps2_an505::y4m::{Clip, MAX_HEADER, Y4mError};

/// Longest line that is read, px: the budget's picture is 320 x 240.
pub(crate) const MAX_WIDTH: usize = 320;

/// A line's pixels, at a whole word as the DMA of the RP2350 leaves them.
#[repr(align(4))]
pub(crate) struct Pixels8(pub(crate) [u8; MAX_WIDTH]);

/// Reads a clip's lines in order.
pub(crate) struct Lines {
    file: File,
    clip: Clip,
    frames: u32,
    frame: u32,
    row: u16,
}

/// Why a clip cannot be read.
#[derive(Debug)]
pub(crate) enum ClipError {
    /// The file.
    File(FileError),
    /// Its header.
    Header(Y4mError),
    /// Its lines are longer than [`MAX_WIDTH`].
    TooWide(u16),
    /// What stands between two frames is not `FRAME`.
    Frame(u32),
}

impl core::fmt::Display for ClipError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::File(e) => e.fmt(f),
            Self::Header(e) => e.fmt(f),
            Self::TooWide(w) => write!(
                f,
                "clip: {w} px wide, but this board has memory for {MAX_WIDTH}"
            ),
            Self::Frame(n) => write!(f, "clip: no frame marker before frame {n}"),
        }
    }
}

impl From<FileError> for ClipError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}

const MARK: &[u8; 6] = b"FRAME\n";

impl Lines {
    /// Open a clip; the next line is the first of frame 0.
    pub(crate) fn open(path: &str, fps_uhz: Option<u64>) -> Result<Self, ClipError> {
        let mut file = File::open(path)?;
        let mut head = [0u8; MAX_HEADER];
        let n = file.read(&mut head)?;
        let mut clip = Clip::parse(head.get(..n).unwrap_or(&[])).map_err(ClipError::Header)?;
        if usize::from(clip.width) > MAX_WIDTH {
            return Err(ClipError::TooWide(clip.width));
        }
        if let Some(uhz) = fps_uhz {
            (clip.fps_num, clip.fps_den) = (uhz, 1_000_000);
        }
        let frames = (file.len() - clip.header_bytes as usize) / Self::frame_bytes(&clip);
        let mut lines = Self {
            file,
            clip,
            frames: frames as u32,
            frame: 0,
            row: 0,
        };
        lines.rewind()?;
        Ok(lines)
    }

    fn frame_bytes(clip: &Clip) -> usize {
        MARK.len() + usize::from(clip.width) * usize::from(clip.rows) + clip.chroma_bytes as usize
    }

    /// Size, rate and layout.
    pub(crate) fn clip(&self) -> &Clip {
        &self.clip
    }

    /// Start again at the first line.
    pub(crate) fn rewind(&mut self) -> Result<(), ClipError> {
        (self.frame, self.row) = (0, 0);
        Ok(self.file.seek(self.clip.header_bytes as usize)?)
    }

    /// The next line, its pixels in `pixels`; `None` at the end.
    pub(crate) fn next<'a>(
        &mut self,
        pixels: &'a mut Pixels8,
        timing: &Timing,
    ) -> Result<Option<Line<'a>>, ClipError> {
        if self.frame >= self.frames {
            return Ok(None);
        }
        if self.row == 0 {
            let mut mark = [0u8; MARK.len()];
            self.file.read_exact(&mut mark)?;
            if &mark != MARK {
                return Err(ClipError::Frame(self.frame));
            }
        }
        let (frame, row) = (self.frame, self.row);
        let pixels = &mut pixels.0[..usize::from(self.clip.width)];
        self.file.read_exact(pixels)?;
        self.row += 1;
        if self.row == self.clip.rows {
            (self.frame, self.row) = (self.frame + 1, 0);
            let next = self.clip.header_bytes as usize
                + self.frame as usize * Self::frame_bytes(&self.clip);
            if self.clip.chroma_bytes != 0 {
                self.file.seek(next)?;
            }
        }
        let start_ns = self.clip.frame_start_ns(frame) + timing.start_ns(row);
        Ok(Some(Line {
            frame,
            row,
            start_ns,
            pixels: Pixels::U8(pixels),
        }))
    }
}
