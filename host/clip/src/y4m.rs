//! Y4M (YUV4MPEG2) streams, read straight into frame buffers.
//!
//! [`Reader::open`] takes the header, [`Reader::read_frame`] one frame after the other. A frame is one
//! read of the marker and the planes together, into a buffer that the caller recycles, so the pixels
//! are copied once, by the operating system. A header that promises more than there is costs no memory:
//! the first buffer grows as its bytes arrive. (Files on disk need no copy at all: `mapped.rs`.)

use std::io::{self, Read};

use super::bytes::Bytes;
use super::error::InputError;
pub use super::frame_read::Next;
use super::header::{HeaderError, MAGIC};
use super::source::FrameSource;
use super::{ClipError, Header};

/// The marker in front of a frame, as nearly all writers write it (parameters may follow).
const MARKER: &[u8] = b"FRAME\n";
/// No header or frame marker is longer than this.
const LONGEST_LINE: usize = 4096;

/// How frames follow each other.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    name: String,
    header: Header,
    frame_bytes: usize,
    frames: u64,
}

impl Layout {
    /// What the header says.
    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    /// Bytes of the planes of a frame.
    pub(super) fn frame_bytes(&self) -> usize {
        self.frame_bytes
    }

    /// Bytes of a frame with the shortest marker.
    pub(super) fn stride(&self) -> usize {
        MARKER.len() + self.frame_bytes
    }

    /// A frame was found.
    pub(super) fn count(&mut self) {
        self.frames += 1;
    }

    /// Length of the marker at the start of `bytes`; `None` when the bytes end inside it.
    ///
    /// # Errors
    /// [`ClipError::Input`] when there is no marker, which is how a header that lies about its size shows.
    pub(super) fn check_marker(&self, bytes: &[u8]) -> Result<Option<usize>, ClipError> {
        if bytes.starts_with(MARKER) {
            return Ok(Some(MARKER.len()));
        }
        let head = &bytes[..bytes.len().min(LONGEST_LINE)];
        let word = MARKER.len() - 1;
        if head.len() <= word && MARKER.starts_with(head) {
            return Ok(None);
        }
        if head.starts_with(b"FRAME ") {
            match head.iter().position(|&b| b == b'\n') {
                Some(end) => return Ok(Some(end + 1)),
                None if head.len() < LONGEST_LINE => return Ok(None),
                None => {}
            }
        }
        let Header { width, height, .. } = self.header;
        let why = InputError::NoMarker {
            frame: self.frames,
            width,
            height,
        };
        Err(ClipError::input(&self.name, why))
    }

    /// The next frame cannot be read.
    pub(super) fn unreadable(&self, error: io::Error) -> ClipError {
        let frame = self.frames;
        ClipError::input(&self.name, InputError::Frame { frame, error })
    }
}

/// The frames of a Y4M stream, one after the other.
#[derive(Debug)]
pub struct Reader<R> {
    from: R,
    layout: Layout,
    header_bytes: usize,
}

impl<R: Read> Reader<R> {
    /// Reads the header. `name` stands in front of every message.
    ///
    /// # Errors
    /// [`ClipError::Input`] for an empty file, one that is no Y4M, and a header that cannot be used.
    pub fn open(mut from: R, name: &str) -> Result<Self, ClipError> {
        let refuse = |why| ClipError::input(name, why);
        let unusable = |error| refuse(InputError::Header(error));
        let line = read_line(&mut from).map_err(|error| refuse(InputError::Read(error)))?;
        if line.is_empty() {
            return Err(refuse(InputError::Empty));
        }
        let text = line.strip_suffix(b"\n").unwrap_or(&line);
        let header = Header::parse(text).map_err(unusable)?;
        if text.len() == line.len() {
            return Err(unusable(match line.len() {
                LONGEST_LINE => HeaderError::TooLong(LONGEST_LINE),
                _ => HeaderError::Ended,
            }));
        }
        let layout = Layout {
            name: name.to_owned(),
            frame_bytes: header.frame_bytes().map_err(unusable)?,
            header,
            frames: 0,
        };
        Ok(Self {
            from,
            layout,
            header_bytes: line.len(),
        })
    }

    /// What the header says.
    pub fn header(&self) -> &Header {
        self.layout.header()
    }

    /// Bytes of the file's header, line feed included.
    pub fn header_bytes(&self) -> usize {
        self.header_bytes
    }

    /// Bytes of a frame with the shortest marker.
    pub fn stride(&self) -> usize {
        self.layout.stride()
    }

    /// Where the bytes come from, and how the frames in them follow each other.
    pub(super) fn parts(&self) -> (&R, &Layout) {
        (&self.from, &self.layout)
    }

    /// Reads the next frame, marker and all, into `buffer`, which is only grown when it is too short.
    ///
    /// # Errors
    /// [`ClipError::Input`] when the stream cannot be read, or when there is no frame marker where one
    /// must be, which is how a header that lies about its size shows.
    pub fn read_frame(&mut self, buffer: &mut Vec<u8>) -> Result<Next, ClipError> {
        let stride = self.stride();
        let have = self.fill(buffer, 0, stride)?;
        if have == 0 {
            return Ok(Next::End);
        }
        let mut have = have;
        let mut need = stride;
        // A marker longer than a whole (tiny) frame: its end is yet to come.
        let marker = loop {
            match self.layout.check_marker(&buffer[..have])? {
                Some(marker) => break marker,
                None if have < need => return Ok(Next::Truncated { have, need }),
                None => need += 1,
            }
            have += self.fill(buffer, have, 1)?;
        };
        need = self.layout.frame_bytes() + marker;
        if have < need && have >= stride {
            have += self.fill(buffer, have, need - have)?;
        }
        if have < need {
            return Ok(Next::Truncated { have, need });
        }
        self.layout.count();
        Ok(Next::Frame { luma: marker })
    }

    /// Reads up to `count` bytes to `buffer[at..]`; fewer only at the end of the stream.
    fn fill(&mut self, buffer: &mut Vec<u8>, at: usize, count: usize) -> Result<usize, ClipError> {
        let end = at + count;
        let outcome = if buffer.len() < end && self.layout.frames == 0 {
            // Nothing has shown yet that frames are this large: let the buffer grow with the bytes.
            buffer.truncate(at);
            (&mut self.from).take(count as u64).read_to_end(buffer)
        } else {
            buffer.resize(end.max(buffer.len()), 0);
            read_full(&mut self.from, &mut buffer[at..end])
        };
        outcome.map_err(|error| self.layout.unreadable(error))
    }
}

impl<R: Read> FrameSource for Reader<R> {
    fn header(&self) -> &Header {
        self.layout.header()
    }

    fn next_frame(&mut self, bytes: &mut Bytes) -> Result<Next, ClipError> {
        self.read_frame(bytes.buffer())
    }
}

/// Fills `buffer` as far as the stream goes.
fn read_full(from: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut have = 0;
    while have < buffer.len() {
        match from.read(&mut buffer[have..]) {
            Ok(0) => break,
            Ok(n) => have += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(have)
}

/// Everything up to and with the first line feed, at most [`LONGEST_LINE`] bytes. Byte by byte, so
/// that nothing of the first frame is swallowed.
fn read_line(from: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    let mut byte = [0];
    while line.len() < LONGEST_LINE && read_full(from, &mut byte)? == 1 {
        line.push(byte[0]);
        if byte[0] == b'\n' || (line.len() == MAGIC.len() && line != MAGIC) {
            break;
        }
    }
    Ok(line)
}

#[cfg(test)]
mod tests {
    use super::super::PixelFormat;
    use super::*;

    fn open(bytes: &[u8]) -> Result<Reader<&[u8]>, ClipError> {
        Reader::open(bytes, "clip")
    }

    fn refusal(bytes: &[u8]) -> String {
        open(bytes).unwrap_err().to_string()
    }

    #[test]
    fn reads_what_ffmpeg_writes() {
        let mut bytes = b"YUV4MPEG2 W2 H1 F30000:1001 Ip A1:1 C420jpeg XYSCSS=420JPEG\n".to_vec();
        bytes.extend(b"FRAME\nab\x80\x80FRAME Ip Xnote\ncd\x80\x80");
        let mut reader = open(&bytes).unwrap();
        assert!((reader.header().fps.unwrap() - 29.97).abs() < 0.001);
        let mut buffer = Vec::new();
        assert_eq!(
            reader.read_frame(&mut buffer).unwrap(),
            Next::Frame { luma: 6 }
        );
        assert_eq!(&buffer[6..8], b"ab");
        assert_eq!(
            reader.read_frame(&mut buffer).unwrap(),
            Next::Frame { luma: 15 }
        );
        assert_eq!(&buffer[15..17], b"cd");
        assert_eq!(reader.read_frame(&mut buffer).unwrap(), Next::End);
    }

    #[test]
    fn says_what_is_wrong_with_a_header() {
        assert_eq!(refusal(b""), "clip: the file is empty");
        assert!(refusal(b"RIFF....WAVE").contains("not a Y4M"));
        assert!(refusal(b"YUV4MPEG2 W2").contains("no usable size"));
        assert!(refusal(b"YUV4MPEG2 W2 H2").contains("ends inside its header"));
        assert!(refusal(b"YUV4MPEG2 W0 H2\n").contains("no usable size"));
        assert!(refusal(b"YUV4MPEG2 W99999 H2\n").contains("no usable size"));
        assert!(refusal(b"YUV4MPEG2 W2 H2 It\n").contains("interlaced"));
        assert!(refusal(b"YUV4MPEG2 W2 H2 Crgb\n").contains("Crgb"));
        assert!(refusal(b"YUV4MPEG2 W2 H2\r\n").contains("CRLF"));
        let long = [&b"YUV4MPEG2 W2 H2 X"[..], &[b'a'; LONGEST_LINE], b"\n"].concat();
        assert!(refusal(&long).contains("longer than 4096 bytes"));
    }

    #[test]
    fn a_frame_rate_of_nothing_is_none() {
        let header = Header::parse(b"YUV4MPEG2 W2 H2 F0:0").unwrap();
        assert_eq!(header.fps, None);
        assert_eq!(header.format, PixelFormat::DEFAULT);
    }

    #[test]
    fn a_comment_may_be_in_any_encoding() {
        let header = Header::parse(b"YUV4MPEG2 W2 H2 F60:1 Xcaf\xe9 Cmono").unwrap();
        assert_eq!((header.fps, header.format.bits), (Some(60.0), 8));
    }

    #[test]
    fn a_rate_that_no_camera_has_is_named() {
        for (text, fps, unusable) in [
            ("F60000:1001", Some(60000.0 / 1001.0), None),
            ("F0:0", None, None),
            ("F99999999999:1", None, Some("99999999999:1")),
            ("F1:99999999", None, Some("1:99999999")),
            ("F60", None, Some("60")),
        ] {
            let header = Header::parse(format!("YUV4MPEG2 W2 H2 {text}").as_bytes()).unwrap();
            assert_eq!(header.fps, fps, "{text}");
            assert_eq!(header.unusable_rate.as_deref(), unusable, "{text}");
        }
    }

    #[test]
    fn a_truncated_frame_is_told_from_the_end() {
        for (tail, have) in [("F", 1), ("FRAME", 5), ("FRAME\n", 6), ("FRAME\nabc", 9)] {
            let bytes = format!("YUV4MPEG2 W2 H2 Cmono\nFRAME\nabcd{tail}");
            let mut reader = open(bytes.as_bytes()).unwrap();
            let mut buffer = Vec::new();
            assert!(matches!(
                reader.read_frame(&mut buffer).unwrap(),
                Next::Frame { .. }
            ));
            assert_eq!(
                reader.read_frame(&mut buffer).unwrap(),
                Next::Truncated { have, need: 10 }
            );
        }
    }

    #[test]
    fn a_header_that_lies_about_its_size_shows_at_the_next_frame() {
        let mut reader = open(b"YUV4MPEG2 W3 H2 Cmono\nFRAME\nabcdFRAME\nabcdFRAME\nabcd").unwrap();
        let mut buffer = Vec::new();
        reader.read_frame(&mut buffer).unwrap();
        let text = reader.read_frame(&mut buffer).unwrap_err().to_string();
        assert!(text.contains("frame 1") && text.contains("3x2"), "{text}");
    }

    #[test]
    fn a_promise_of_gigabytes_costs_nothing() {
        let mut reader = open(b"YUV4MPEG2 W65535 H65535 C444p16\nFRAME\nabcd").unwrap();
        let mut buffer = Vec::new();
        let next = reader.read_frame(&mut buffer).unwrap();
        assert!(matches!(next, Next::Truncated { have: 10, .. }));
        assert!(buffer.capacity() < 1 << 20);
    }
}
