//! The header of a Y4M clip, as far as the firmware needs it: where each row of luma lies.

/// Longest header line that is read.
pub const MAX_HEADER: usize = 256;

/// Where the rows of a clip lie, and how fast its frames come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clip {
    /// Pixels of a row.
    pub width: u16,
    /// Rows of a frame.
    pub rows: u16,
    /// Frames a second, numerator.
    pub fps_num: u64,
    /// Frames a second, denominator.
    pub fps_den: u64,
    /// Bytes of chroma that follow each frame's luma.
    pub chroma_bytes: u32,
    /// Bytes before the first frame's `FRAME` line.
    pub header_bytes: u32,
}

/// Why a header was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Y4mError {
    /// It does not start with `YUV4MPEG2 ` or has no end within [`MAX_HEADER`] bytes.
    NotY4m,
    /// `W`, `H` or `F` is missing or zero or too large.
    BadField(char),
    /// A colour space that is not 8-bit.
    ColourSpace,
}

impl core::fmt::Display for Y4mError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotY4m => f.write_str("clip: not a Y4M file"),
            Self::BadField(c) => write!(f, "clip: header field {c} is missing or out of range"),
            Self::ColourSpace => {
                f.write_str("clip: only 8-bit mono, 420, 422 and 444 are read here; convert it with ffmpeg -pix_fmt gray")
            }
        }
    }
}

impl Clip {
    /// Read the header from the first bytes of the file.
    ///
    /// # Errors
    /// See [`Y4mError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Y4mError> {
        let end = bytes
            .iter()
            .take(MAX_HEADER)
            .position(|&b| b == b'\n')
            .ok_or(Y4mError::NotY4m)?;
        let line = bytes
            .get(..end)
            .and_then(|b| core::str::from_utf8(b).ok())
            .ok_or(Y4mError::NotY4m)?;
        let mut words = line.split_ascii_whitespace();
        if words.next() != Some("YUV4MPEG2") {
            return Err(Y4mError::NotY4m);
        }
        let (mut width, mut rows, mut fps, mut space) = (0, 0, None, "420jpeg");
        for word in words {
            let Some((key, value)) = word.split_at_checked(1) else {
                continue;
            };
            match key {
                "W" => width = value.parse().map_err(|_| Y4mError::BadField('W'))?,
                "H" => rows = value.parse().map_err(|_| Y4mError::BadField('H'))?,
                "F" => {
                    fps = value
                        .split_once(':')
                        .and_then(|(n, d)| Some((n.parse().ok()?, d.parse().ok()?)))
                }
                "C" => space = value,
                _ => {}
            }
        }
        if width == 0 {
            return Err(Y4mError::BadField('W'));
        }
        if rows == 0 {
            return Err(Y4mError::BadField('H'));
        }
        let (fps_num, fps_den): (u32, u32) = fps.ok_or(Y4mError::BadField('F'))?;
        if fps_num == 0 || fps_den == 0 {
            return Err(Y4mError::BadField('F'));
        }
        let (w, h): (u32, u32) = (u32::from(width), u32::from(rows));
        let half = |n: u32| n.div_ceil(2);
        let chroma_bytes = match space {
            "mono" => 0,
            "420" | "420jpeg" | "420mpeg2" | "420paldv" => 2 * half(w) * half(h),
            "422" => 2 * half(w) * h,
            "444" => w.checked_mul(2 * h).ok_or(Y4mError::BadField('W'))?,
            _ => return Err(Y4mError::ColourSpace),
        };
        Ok(Self {
            width,
            rows,
            fps_num: fps_num.into(),
            fps_den: fps_den.into(),
            chroma_bytes,
            header_bytes: end as u32 + 1,
        })
    }

    /// Frames that start within a time, rounded up.
    pub fn frames_within(&self, ns: i64) -> u32 {
        let ns = u64::try_from(ns).unwrap_or(0);
        let frames = (ns as f32 * 1e-9) * (self.fps_num as f32 / self.fps_den as f32);
        frames as u32 + 1
    }

    /// Start of exposure of a frame's first row, ns after that of frame 0, rounded down.
    pub fn frame_start_ns(&self, frame: u32) -> i64 {
        // Whole seconds first: the products stay below 2⁶³ for every 32-bit numerator.
        let ticks = u64::from(frame) * self.fps_den;
        let (seconds, rest) = (ticks / self.fps_num, ticks % self.fps_num);
        (seconds * 1_000_000_000 + rest * 1_000_000_000 / self.fps_num) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mono_header() {
        let clip = Clip::parse(b"YUV4MPEG2 W128 H300 F60000:1000 Ip A1:1 Cmono\nFRAME\n").unwrap();
        assert_eq!(
            (clip.width, clip.rows, clip.chroma_bytes, clip.header_bytes),
            (128, 300, 0, 46)
        );
        assert_eq!(clip.frames_within(1_500_000_000), 91);
        assert_eq!(clip.frame_start_ns(0), 0);
        assert_eq!(clip.frame_start_ns(1), 16_666_666);
        assert_eq!(clip.frame_start_ns(u32::MAX), 71_582_788_250_000_000);
    }

    #[test]
    fn chroma_is_skipped() {
        let chroma = |space: &str| {
            Clip::parse(std::format!("YUV4MPEG2 W5 H3 F25:1 {space}\n").as_bytes())
                .map(|c| c.chroma_bytes)
        };
        assert_eq!(chroma(""), Ok(12));
        assert_eq!(chroma("C420mpeg2"), Ok(12));
        assert_eq!(chroma("C422"), Ok(18));
        assert_eq!(chroma("C444"), Ok(30));
        assert_eq!(chroma("C420p10"), Err(Y4mError::ColourSpace));
    }

    #[test]
    fn bad_headers_are_refused() {
        for (bytes, error) in [
            (&b""[..], Y4mError::NotY4m),
            (b"RIFF\n", Y4mError::NotY4m),
            (b"YUV4MPEG2 W0 H3 F25:1\n", Y4mError::BadField('W')),
            (b"YUV4MPEG2 W5 F25:1\n", Y4mError::BadField('H')),
            (b"YUV4MPEG2 W5 H3 F25:0\n", Y4mError::BadField('F')),
            (b"YUV4MPEG2 W5 H70000 F25:1\n", Y4mError::BadField('H')),
        ] {
            assert_eq!(Clip::parse(bytes), Err(error));
        }
    }
}
