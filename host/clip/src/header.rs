//! The header of a Y4M file: its first line.

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
    /// Layout of a frame.
    pub format: PixelFormat,
}

impl Header {
    /// Reads the header's line, without its line feed.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(line: &[u8]) -> Result<Self, String> {
        let not_y4m = || {
            "not a Y4M file (it does not start with YUV4MPEG2): convert it, as in \
             `ffmpeg -i FILE -f yuv4mpegpipe - | rowtone analyze -`"
                .to_owned()
        };
        let text = std::str::from_utf8(line).map_err(|_| not_y4m())?;
        let mut words = text.split(' ');
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err(not_y4m());
        }
        let (mut width, mut height, mut fps) = (None, None, None);
        let mut format = PixelFormat::DEFAULT;
        for word in words {
            let Some(tag) = word.chars().next() else {
                continue;
            };
            let value = &word[tag.len_utf8()..];
            match tag {
                'W' => width = value.parse::<u16>().ok(),
                'H' => height = value.parse::<u16>().ok(),
                'F' => fps = ratio(value),
                'I' if matches!(value, "t" | "b" | "m") => {
                    return Err(format!(
                        "the video is interlaced (I{value}): its rows are out of time order; \
                         record it progressive"
                    ));
                }
                'C' => {
                    format = PixelFormat::from_tag(value).ok_or_else(|| {
                        format!(
                            "the colour tag C{value} is not known: convert it with \
                             `ffmpeg -pix_fmt gray`"
                        )
                    })?;
                }
                _ => {}
            }
        }
        match (width, height) {
            (Some(width), Some(height)) if width > 0 && height > 0 => Ok(Self {
                width: usize::from(width),
                height: usize::from(height),
                fps,
                format,
            }),
            _ => Err("the header gives no usable size (W and H, 1 to 65535 each)".to_owned()),
        }
    }

    /// Bytes of the luma plane of one frame.
    pub(super) fn luma_bytes(&self) -> usize {
        self.width * self.height * if self.format.bits > 8 { 2 } else { 1 }
    }

    /// Bytes of the planes of one frame.
    pub(super) fn frame_bytes(&self) -> Result<usize, String> {
        self.format
            .frame_bytes(self.width, self.height)
            .ok_or_else(|| "a frame is larger than this machine's memory".to_owned())
    }
}

/// `30000:1001` as a frame rate; `0:0` and nonsense are none.
fn ratio(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once(':')?;
    let fps = numerator.parse::<u32>().ok()? as f64 / denominator.parse::<u32>().ok()? as f64;
    (fps.is_finite() && fps > 0.0).then_some(fps)
}
