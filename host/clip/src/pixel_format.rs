//! How a Y4M file lays out a frame: its colour tag.

/// Bytes of a frame: the luma plane first, then whatever chroma there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelFormat {
    /// Bits of a luma value, 8 to 16. Above 8 a value is a little-endian 16-bit word.
    pub bits: u8,
    chroma: Chroma,
}

/// What follows the luma plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Chroma {
    None,
    /// Two planes, halved in both directions.
    C420,
    /// Two planes, halved across.
    C422,
    /// Two planes, a quarter of the columns.
    C411,
    /// Two planes, halved down.
    C440,
    /// Two planes of full size.
    C444,
    /// Three planes of full size, the last one transparency.
    C444Alpha,
}

impl PixelFormat {
    /// What a file without a colour tag means: 8-bit 4:2:0.
    pub const DEFAULT: Self = Self {
        bits: 8,
        chroma: Chroma::C420,
    };

    /// Luma alone, of so many bits, 8 to 16.
    pub const fn luma(bits: u8) -> Self {
        Self {
            bits,
            chroma: Chroma::None,
        }
    }

    /// Reads the colour tag without its `C`: `mono`, `mono10`, `420jpeg`, `422p10`, …
    /// `None` for one that is not known.
    ///
    /// ```
    /// use rowtone_clip::PixelFormat;
    /// assert_eq!(PixelFormat::from_tag("420p10").unwrap().bits, 10);
    /// assert_eq!(PixelFormat::from_tag("mono").unwrap().frame_bytes(128, 300), Some(38400));
    /// assert_eq!(PixelFormat::from_tag("rgb"), None);
    /// ```
    pub fn from_tag(tag: &str) -> Option<Self> {
        if let Some(depth) = tag.strip_prefix("mono") {
            let bits = if depth.is_empty() {
                8
            } else {
                depth_of(depth)?
            };
            return Some(Self {
                bits,
                chroma: Chroma::None,
            });
        }
        let (family, rest) = tag.split_at_checked(3)?;
        let chroma = match family {
            "420" => Chroma::C420,
            "422" => Chroma::C422,
            "411" => Chroma::C411,
            "440" => Chroma::C440,
            "444" if rest == "alpha" => Chroma::C444Alpha,
            "444" => Chroma::C444,
            _ => return None,
        };
        let bits = match rest {
            "" | "jpeg" | "mpeg2" | "paldv" | "alpha" => 8,
            deep => depth_of(deep.strip_prefix('p')?)?,
        };
        Some(Self { bits, chroma })
    }

    /// The tag that [`PixelFormat::from_tag`] reads.
    pub fn tag(&self) -> String {
        let (family, deep) = match self.chroma {
            Chroma::None => ("mono", ""),
            Chroma::C420 => ("420", "p"),
            Chroma::C422 => ("422", "p"),
            Chroma::C411 => ("411", "p"),
            Chroma::C440 => ("440", "p"),
            Chroma::C444 => ("444", "p"),
            Chroma::C444Alpha => return "444alpha".to_owned(),
        };
        match self.bits {
            8 => family.to_owned(),
            bits => format!("{family}{deep}{bits}"),
        }
    }

    /// Bytes of one value.
    pub const fn bytes_per_value(&self) -> usize {
        if self.bits > 8 { 2 } else { 1 }
    }

    /// Bytes of the luma plane; `None` when that does not fit a `usize`.
    pub fn luma_bytes(&self, width: usize, height: usize) -> Option<usize> {
        width
            .checked_mul(height)?
            .checked_mul(self.bytes_per_value())
    }

    /// Bytes of a whole frame; a halved odd size is rounded up. `None` when that does not fit a `usize`.
    pub fn frame_bytes(&self, width: usize, height: usize) -> Option<usize> {
        let (planes, chroma_width, chroma_height) = match self.chroma {
            Chroma::None => (0, 0, 0),
            Chroma::C420 => (2, width.div_ceil(2), height.div_ceil(2)),
            Chroma::C422 => (2, width.div_ceil(2), height),
            Chroma::C411 => (2, width.div_ceil(4), height),
            Chroma::C440 => (2, width, height.div_ceil(2)),
            Chroma::C444 => (2, width, height),
            Chroma::C444Alpha => (3, width, height),
        };
        let chroma = self
            .luma_bytes(chroma_width, chroma_height)?
            .checked_mul(planes)?;
        self.luma_bytes(width, height)?.checked_add(chroma)
    }
}

/// The depths that Y4M writers use.
fn depth_of(text: &str) -> Option<u8> {
    match text {
        "9" => Some(9),
        "10" => Some(10),
        "12" => Some(12),
        "14" => Some(14),
        "16" => Some(16),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(tag: &str, width: usize, height: usize) -> usize {
        PixelFormat::from_tag(tag)
            .unwrap()
            .frame_bytes(width, height)
            .unwrap()
    }

    #[test]
    fn odd_sizes_round_chroma_up() {
        assert_eq!(bytes("420jpeg", 5, 3), 15 + 2 * 3 * 2);
        assert_eq!(bytes("422", 5, 3), 15 + 2 * 3 * 3);
        assert_eq!(bytes("444", 5, 3), 45);
        assert_eq!(bytes("411", 5, 3), 15 + 2 * 2 * 3);
        assert_eq!(bytes("420p10", 5, 3), 2 * (15 + 12));
        assert_eq!(bytes("444alpha", 5, 3), 60);
        assert_eq!(bytes("mono16", 5, 3), 30);
    }

    #[test]
    fn unknown_tags_are_refused() {
        for tag in ["", "4", "mono11", "420p11", "420x", "rgb24", "444p", "é"] {
            assert_eq!(PixelFormat::from_tag(tag), None, "{tag}");
        }
    }

    #[test]
    fn a_size_beyond_memory_is_none() {
        let format = PixelFormat::from_tag("444p16").unwrap();
        assert_eq!(format.frame_bytes(usize::MAX / 2, 3), None);
    }
}
