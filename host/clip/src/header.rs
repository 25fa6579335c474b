//! The header of a Y4M file: its first line.

use std::fmt;
use std::io::{self, Write};

use super::PixelFormat;

/// What every Y4M file starts with.
pub(super) const MAGIC: &[u8] = b"YUV4MPEG2";

/// What the header says.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Columns.
    pub width: usize,
    /// Rows, at most 65 535.
    pub height: usize,
    /// Frame rate, Hz, where the file knows one.
    pub fps: Option<f64>,
    /// What stands there instead where that is no frame rate of a camera.
    pub unusable_rate: Option<String>,
    /// Layout of a frame.
    pub format: PixelFormat,
}

impl Header {
    /// Reads the header's line, without its line feed.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(line: &[u8]) -> Result<Self, HeaderError> {
        // Only a comment (X) may hold other characters, in whatever encoding.
        let text = String::from_utf8_lossy(line);
        if text.ends_with('\r') && line.starts_with(MAGIC) {
            return Err(HeaderError::CopiedAsText);
        }
        let mut words = text.split(' ');
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err(HeaderError::NotY4m);
        }
        let (mut width, mut height, mut fps) = (None, None, None);
        let mut unusable_rate = None;
        let mut format = PixelFormat::DEFAULT;
        for word in words {
            let Some(tag) = word.chars().next() else {
                continue;
            };
            let value = &word[tag.len_utf8()..];
            match tag {
                'W' => width = value.parse::<u16>().ok(),
                'H' => height = value.parse::<u16>().ok(),
                'F' => {
                    fps = ratio(value);
                    let is_unknown = value.starts_with("0:");
                    unusable_rate = (fps.is_none() && !is_unknown).then(|| value.to_owned());
                }
                'I' if matches!(value, "t" | "b" | "m") => {
                    return Err(HeaderError::Interlaced(value.to_owned()));
                }
                'C' => {
                    format = PixelFormat::from_tag(value)
                        .ok_or_else(|| HeaderError::Colour(value.to_owned()))?;
                }
                _ => {}
            }
        }
        match (width, height) {
            (Some(width), Some(height)) if width > 0 && height > 0 => Ok(Self {
                width: usize::from(width),
                height: usize::from(height),
                fps,
                unusable_rate,
                format,
            }),
            _ => Err(HeaderError::Size),
        }
    }

    /// Writes it as a progressive video of square pixels.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        // 0:0 is a rate that is not known.
        let (numerator, denominator) = self.fps.map_or((0, 0), rate);
        let (width, height, tag) = (self.width, self.height, self.format.tag());
        writeln!(
            out,
            "YUV4MPEG2 W{width} H{height} F{numerator}:{denominator} Ip A1:1 C{tag}"
        )
    }

    /// Bytes of the luma plane of one frame.
    pub(super) fn luma_bytes(&self) -> usize {
        self.width * self.height * if self.format.bits > 8 { 2 } else { 1 }
    }

    /// Bytes of the planes of one frame.
    pub(super) fn frame_bytes(&self) -> Result<usize, HeaderError> {
        self.format
            .frame_bytes(self.width, self.height)
            .ok_or(HeaderError::TooLarge)
    }
}

/// Why the header of a Y4M file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HeaderError {
    /// The file does not start as a Y4M file does.
    NotY4m,
    /// Its line ends with CRLF: it was copied as text.
    CopiedAsText,
    /// Its fields were exposed one after the other; the letter is the header's word for their order.
    Interlaced(String),
    /// A colour tag that is not known.
    Colour(String),
    /// No width and height from 1 to 65 535.
    Size,
    /// A frame does not fit into this machine's memory.
    TooLarge,
    /// Its line is longer than this many bytes.
    TooLong(usize),
    /// The file ends inside of it.
    Ended,
}

impl fmt::Display for HeaderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotY4m => f.write_str(
                "not a Y4M file (it does not start with YUV4MPEG2): give the video file itself, \
                 or pipe it as `ffmpeg -i FILE -f yuv4mpegpipe -strict -1 -` does",
            ),
            Self::CopiedAsText => f.write_str(
                "its header ends with a carriage return (CRLF line end): the file was copied as \
                 text, which harms its pixels too; copy it again, as it is (binary)",
            ),
            Self::Interlaced(order) => write!(
                f,
                "the video is interlaced (I{order}): its rows are out of time order; record it \
                 progressive"
            ),
            Self::Colour(tag) => write!(
                f,
                "the colour tag C{tag} is not known: convert it with `ffmpeg -pix_fmt gray`"
            ),
            Self::Size => f.write_str("the header gives no usable size (W and H, 1 to 65535 each)"),
            Self::TooLarge => f.write_str("a frame is larger than this machine's memory"),
            Self::TooLong(bytes) => write!(f, "its header is longer than {bytes} bytes"),
            Self::Ended => f.write_str("the file ends inside its header"),
        }
    }
}

impl std::error::Error for HeaderError {}

/// A frame rate as a ratio of whole numbers, to a part in 10⁹ or better below 2000 Hz.
fn rate(fps: f64) -> (u64, u64) {
    let denominators = [1u64, 1000, 1001, 1_000_000];
    let exact = |&d: &u64| ((fps * d as f64).round() / d as f64 - fps).abs() <= 1e-12 * fps;
    let d = denominators
        .iter()
        .copied()
        .find(exact)
        .unwrap_or(1_000_000);
    (((fps * d as f64).round() as u64).max(1), d)
}

/// `30000:1001` as a frame rate; `0:0`, nonsense and what no camera has are none.
fn ratio(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once(':')?;
    let fps = numerator.parse::<u64>().ok()? as f64 / denominator.parse::<u64>().ok()? as f64;
    FRAME_RATES_HZ.contains(&fps).then_some(fps)
}

/// Frame rates that can be measured at, Hz.
pub const FRAME_RATES_HZ: std::ops::RangeInclusive<f64> = 1e-3..=1e7;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_exact() {
        assert_eq!(rate(60.0), (60, 1));
        assert_eq!(rate(58.9), (58_900, 1000));
        assert_eq!(rate(30_000.0 / 1001.0), (30_000, 1001));
        assert_eq!(rate(0.1234567), (123_457, 1_000_000));
    }

    #[test]
    fn what_is_written_is_read() {
        for tag in [
            "mono", "mono10", "mono16", "420", "422p10", "411", "440p12", "444", "444alpha",
        ] {
            for fps in [None, Some(60.0), Some(30_000.0 / 1001.0), Some(58.9)] {
                let header = Header {
                    width: 1920,
                    height: 1080,
                    fps,
                    unusable_rate: None,
                    format: PixelFormat::from_tag(tag).expect(tag),
                };
                let mut line = Vec::new();
                header.write(&mut line).expect("memory");
                assert_eq!(line.pop(), Some(b'\n'));
                assert_eq!(Header::parse(&line), Ok(header));
            }
        }
    }
}
