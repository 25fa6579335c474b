//! How the luma of a pixel format is cut out of the decoder's pictures.

/// The luma that ffmpeg is asked for: its depth and the filter that makes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Luma {
    /// Bits of a value, 8 to 16. Above 8 a value is a little-endian 16-bit word.
    pub bits: u8,
    /// ffmpeg's filter, behind the decoder.
    pub filter: String,
}

impl Luma {
    /// What to ask for where pictures have this pixel format, by ffmpeg's name for it.
    ///
    /// Formats with a luma plane keep the file's own numbers. RGB, palettes and the like are turned into
    /// full-range grey, of 16 bits where a component has more than 8.
    ///
    /// ```
    /// use rowtone_clip::ffmpeg::Luma;
    /// assert_eq!(Luma::of("yuv420p").filter, "extractplanes=y");
    /// assert_eq!(Luma::of("yuv420p10le").bits, 10);
    /// assert_eq!(Luma::of("gbrp12le").filter, "format=gray16le");
    /// ```
    pub fn of(pixel_format: &str) -> Self {
        let family = pixel_format.trim_end_matches("le").trim_end_matches("be");
        let grey = |bits| Self {
            bits,
            filter: if bits > 8 {
                "format=gray16le"
            } else {
                "format=gray"
            }
            .to_owned(),
        };
        if EIGHT_BIT_COLOURS.contains(&family) {
            return grey(8);
        }
        match luma_bits(family) {
            None => grey(16),
            Some(8) => Self {
                bits: 8,
                filter: "extractplanes=y".to_owned(),
            },
            Some(bits) => Self {
                bits,
                // Formats that keep their planes together, or their values in the upper bits, are first taken
                // apart, without a change to the numbers.
                filter: match sampling_of_packed(family) {
                    Some(sampling) => {
                        format!("format=yuv{sampling}p{bits}le,extractplanes=y,format=gray{bits}le")
                    }
                    None => format!("extractplanes=y,format=gray{bits}le"),
                },
            },
        }
    }
}

/// Formats without a luma plane whose components have 8 bits or fewer.
const EIGHT_BIT_COLOURS: [&str; 28] = [
    "rgb24",
    "bgr24",
    "argb",
    "rgba",
    "abgr",
    "bgra",
    "0rgb",
    "rgb0",
    "0bgr",
    "bgr0",
    "gbrp",
    "gbrap",
    "pal8",
    "monow",
    "monob",
    "rgb8",
    "bgr8",
    "rgb4",
    "bgr4",
    "rgb4_byte",
    "bgr4_byte",
    "rgb565",
    "bgr565",
    "rgb555",
    "bgr555",
    "rgb444",
    "bgr444",
    "gbr24p",
];

/// The planar sampling that a packed or half-planar format is taken apart to; `None` where it is planar.
fn sampling_of_packed(family: &str) -> Option<&'static str> {
    match family {
        "p010" | "p012" | "p016" => Some("420"),
        "y210" | "y212" | "p210" | "p212" | "p216" => Some("422"),
        "p410" | "p412" | "p416" => Some("444"),
        _ => None,
    }
}

/// Bits of the luma of a format that has such a plane, or one packed with the others; `None` for all else.
fn luma_bits(family: &str) -> Option<u8> {
    let depth = |digits: &str| match digits {
        "" => Some(8),
        "9" | "10" | "12" | "14" | "16" => digits.parse().ok(),
        _ => None,
    };
    match family {
        "nv12" | "nv21" | "nv16" | "nv24" | "nv42" | "yuyv422" | "yvyu422" | "uyvy422"
        | "uyyvyy411" | "ya8" => {
            return Some(8);
        }
        "nv20" | "p010" | "p210" | "p410" | "y210" => return Some(10),
        "p012" | "p212" | "p412" | "y212" => return Some(12),
        "p016" | "p216" | "p416" | "ya16" => return Some(16),
        _ => {}
    }
    if let Some(digits) = family.strip_prefix("gray") {
        return depth(digits);
    }
    // yuv420p, yuva444p16, yuvj422p
    let planes = family.strip_prefix("yuv")?.trim_start_matches(['a', 'j']);
    let (sampling, digits) = planes.split_once('p')?;
    let known = ["410", "411", "420", "422", "440", "444"].contains(&sampling);
    if known { depth(digits) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_s_own_numbers_wherever_there_is_a_luma_plane() {
        for (format, bits) in [
            ("yuv420p", 8),
            ("yuvj422p", 8),
            ("yuva444p", 8),
            ("gray", 8),
            ("nv12", 8),
            ("yuv420p10le", 10),
            ("yuv422p10be", 10),
            ("yuv444p12le", 12),
            ("yuva444p16le", 16),
            ("gray14le", 14),
            ("p010le", 10),
            ("y210le", 10),
        ] {
            let luma = Luma::of(format);
            assert_eq!(luma.bits, bits, "{format}");
            assert!(
                luma.filter.contains("extractplanes=y"),
                "{format}: {}",
                luma.filter
            );
            assert_eq!(luma.filter.contains("gray"), bits > 8, "{format}");
        }
    }

    #[test]
    fn what_has_none_is_made_grey() {
        for (format, bits) in [
            ("rgb24", 8),
            ("pal8", 8),
            ("gbrp", 8),
            ("gbrp10le", 16),
            ("rgb48be", 16),
            ("grayf32le", 16),
            ("xyz12le", 16),
            ("something-new", 16),
        ] {
            let luma = Luma::of(format);
            assert_eq!(luma.bits, bits, "{format}");
            assert!(luma.filter.starts_with("format=gray"), "{format}");
        }
    }
}
