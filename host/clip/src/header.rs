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
    /// What stands there instead where that is no frame rate of a camera.
    pub unusable_rate: Option<String>,
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
            "not a Y4M file (it does not start with YUV4MPEG2): give the video file itself, or pipe it as \
             `ffmpeg -i FILE -f yuv4mpegpipe -strict -1 -` does"
                .to_owned()
        };
        // Only a comment (X) may hold other characters, in whatever encoding.
        let text = String::from_utf8_lossy(line);
        if text.ends_with('\r') && line.starts_with(MAGIC) {
            return Err(
                "its header ends with a carriage return (CRLF line end): the file was copied as text, \
                 which harms its pixels too; copy it again, as it is (binary)"
                    .to_owned(),
            );
        }
        let mut words = text.split(' ');
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err(not_y4m());
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
                unusable_rate,
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

/// `30000:1001` as a frame rate; `0:0`, nonsense and what no camera has are none.
fn ratio(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once(':')?;
    let fps = numerator.parse::<u64>().ok()? as f64 / denominator.parse::<u64>().ok()? as f64;
    FPS.contains(&fps).then_some(fps)
}

/// Frame rates that can be measured at, Hz.
pub(super) const FPS: std::ops::RangeInclusive<f64> = 1e-3..=1e7;
