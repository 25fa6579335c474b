//! libcamera's names of pixel formats, as far as lines can be read from them.

use rowtone::camera::RawFormat;

/// How the first plane of a format is read, and whether its neighbouring pixels differ in colour. `None` for
/// what cannot be read: compressed raw (`…_PISP_COMP1`), packed colour.
///
/// ```
/// use rowtone::camera::RawFormat;
/// use rowtone_rpi::capture::format::read_as;
/// assert_eq!(read_as("SRGGB10_CSI2P"), Some((RawFormat::Packed10, true)));
/// assert_eq!(read_as("NV12"), Some((RawFormat::Raw8, false)));
/// assert_eq!(read_as("BGGR_PISP_COMP1"), None);
/// ```
pub fn read_as(name: &str) -> Option<(RawFormat, bool)> {
    if [
        "NV12", "NV21", "NV16", "NV24", "YUV420", "YVU420", "YUV422", "YUV444",
    ]
    .contains(&name)
    {
        return Some((RawFormat::Raw8, false));
    }
    let (bayer, depth) = match name.strip_prefix('S') {
        Some(rest) => {
            let order = rest.get(..4)?;
            if !["RGGB", "BGGR", "GBRG", "GRBG"].contains(&order) {
                return None;
            }
            (true, rest.get(4..)?)
        }
        None => (false, name.strip_prefix('R')?),
    };
    let format = match depth {
        "8" => RawFormat::Raw8,
        "10_CSI2P" => RawFormat::Packed10,
        "12_CSI2P" => RawFormat::Packed12,
        "10" => RawFormat::Raw10,
        "12" => RawFormat::Raw12,
        "16" => RawFormat::Raw16,
        _ => return None,
    };
    Some((format, bayer))
}

/// Of what is offered the format to ask for: the fewest bytes that keep the sensor's depth.
pub fn best<'a>(names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let rank = |name: &&str| {
        let (format, _) = read_as(name)?;
        let order = [
            RawFormat::Packed10,
            RawFormat::Packed12,
            RawFormat::Raw10,
            RawFormat::Raw12,
            RawFormat::Raw16,
            RawFormat::Raw8,
        ];
        order.iter().position(|f| *f == format)
    };
    names.filter(|name| rank(name).is_some()).min_by_key(rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_is_refused() {
        for name in [
            "",
            "S",
            "SRGGB",
            "SXXXX10",
            "RGB888",
            "R",
            "MJPEG",
            "YUYV",
            "SRGGB14_CSI2P",
        ] {
            assert_eq!(read_as(name), None, "{name}");
        }
        assert_eq!(read_as("R10_CSI2P"), Some((RawFormat::Packed10, false)));
    }

    #[test]
    fn depth_before_bytes() {
        let pi4 = ["SRGGB8", "SRGGB10_CSI2P", "SRGGB10"];
        assert_eq!(best(pi4.into_iter()), Some("SRGGB10_CSI2P"));
        let pi5 = ["RGGB_PISP_COMP1", "SRGGB16"];
        assert_eq!(best(pi5.into_iter()), Some("SRGGB16"));
        assert_eq!(best(["RGGB_PISP_COMP1"].into_iter()), None);
    }
}
