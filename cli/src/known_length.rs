//! A scale from something of known length in the picture.

use std::str::FromStr;

/// Two places in the picture, px, and how far apart they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KnownLength {
    px: f64,
    um: f64,
}

/// Units, longest name first where one ends in another, and how many µm each is.
const UNITS: [(&str, f64); 5] = [
    ("mm", 1e3),
    ("cm", 1e4),
    ("µm", 1.0),
    ("um", 1.0),
    ("m", 1e6),
];

impl KnownLength {
    /// The scale, µm a pixel.
    pub(crate) fn um_per_px(&self) -> f64 {
        self.um / self.px
    }
}

impl FromStr for KnownLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let want =
            || "want two places and their distance: X1,Y1,X2,Y2=35mm (µm, mm, cm or m)".to_owned();
        let (places, length) = text.split_once('=').ok_or_else(want)?;
        let numbers: Option<Vec<f64>> = places.split(',').map(|s| s.trim().parse().ok()).collect();
        let Some([x1, y1, x2, y2]) = numbers
            .as_deref()
            .and_then(|n| n.first_chunk().filter(|_| n.len() == 4))
        else {
            return Err(want());
        };
        let length = length.trim();
        let unit = UNITS
            .iter()
            .find_map(|(name, um)| Some((length.strip_suffix(name)?, um)));
        let (count, um) = unit.ok_or_else(want)?;
        let um = count.trim().parse::<f64>().map_err(|_| want())? * um;
        let px = f64::hypot(x2 - x1, y2 - y1);
        let usable = px >= 1.0 && px.is_finite() && um > 0.0 && um.is_finite();
        usable.then_some(Self { px, um }).ok_or_else(|| {
            "want two places that are a pixel apart or more, and a length above 0".to_owned()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_in_every_unit_and_what_is_none() {
        let scale = |text: &str| text.parse::<KnownLength>().map(|known| known.um_per_px());
        for text in [
            "0,0,3,4=5mm",
            "0,0,-3,-4=0.5 cm",
            "3,4,0,0=5000um",
            "0,0,3,4=5000µm",
            "0,0,3,4=0.005m",
        ] {
            assert!((scale(text).unwrap() - 1000.0).abs() < 1e-9, "{text}");
        }
        for text in [
            "",
            "0,0,3,4",
            "0,0,3=5mm",
            "0,0,3,4,5=5mm",
            "0,0,3,4=5",
            "0,0,3,4=mm",
            "0,0,3,4=-5mm",
            "7,7,7,7=5mm",
            "0,0,nan,4=5mm",
        ] {
            assert!(scale(text).is_err(), "{text}");
        }
    }
}
