//! Numbers on the command line, in the unit that their option names.

use core::ops::RangeBounds;

/// What an option's number counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    /// Frequency, Hz.
    Hertz,
    /// Time, s.
    Seconds,
    /// Time, µs.
    Microseconds,
    /// Something that nobody writes a unit behind.
    Bare,
}

/// Units that people write behind a number, those first that end in another one.
const HERTZ: [(&str, f64); 3] = [("mhz", 1e6), ("khz", 1e3), ("hz", 1.0)];
const SECONDS: [(&str, f64); 5] = [
    ("ns", 1e-9),
    ("us", 1e-6),
    ("µs", 1e-6),
    ("ms", 1e-3),
    ("s", 1.0),
];

/// The number, if it is finite and in the range.
///
/// # Errors
/// `want`, or what to type instead where a unit stands behind the number.
pub(crate) fn number(
    text: &str,
    unit: Unit,
    range: impl RangeBounds<f64>,
    want: impl FnOnce() -> String,
) -> Result<f64, String> {
    let sound = |x: &f64| x.is_finite() && range.contains(x);
    let text = text.trim();
    if let Some(number) = text.parse().ok().filter(sound) {
        return Ok(number);
    }
    Err(match with_unit(text, unit).filter(sound) {
        Some(number) => format!("give the number alone, in {}: {number}", unit.name()),
        None => want(),
    })
}

impl Unit {
    const fn name(self) -> &'static str {
        match self {
            Self::Hertz => "Hz",
            Self::Seconds => "s",
            Self::Microseconds => "µs",
            Self::Bare => "its own unit",
        }
    }
}

/// The number that is meant in `unit` where a unit of the same kind stands behind it.
fn with_unit(text: &str, unit: Unit) -> Option<f64> {
    let (units, one): (&[_], f64) = match unit {
        Unit::Hertz => (&HERTZ, 1.0),
        Unit::Seconds => (&SECONDS, 1.0),
        Unit::Microseconds => (&SECONDS, 1e-6),
        Unit::Bare => return None,
    };
    let text = text.to_lowercase();
    let (number, factor) = units
        .iter()
        .find_map(|(name, factor)| Some((text.strip_suffix(name)?, factor)))?;
    let number: f64 = number.trim().parse().ok()?;
    // Twelve digits: 80 us are 80 µs, not 79.99999999999999.
    format!("{:.11e}", number * factor / one).parse().ok()
}

/// A frequency above 0, Hz.
pub(crate) fn hertz(text: &str) -> Result<f64, String> {
    number(text, Unit::Hertz, 1e-9..1e12, || {
        "want a frequency above 0, Hz".to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str, unit: Unit) -> Result<f64, String> {
        number(text, unit, 0.0..1e6, || "want a number".to_owned())
    }

    #[test]
    fn a_unit_behind_a_number_is_answered_with_the_number_to_type() {
        assert_eq!(said("80", Unit::Microseconds), Ok(80.0));
        for (text, unit, number) in [
            ("80us", Unit::Microseconds, "in µs: 80"),
            ("80 µs", Unit::Microseconds, "in µs: 80"),
            ("0.5ms", Unit::Microseconds, "in µs: 500"),
            ("18.9ns", Unit::Microseconds, "in µs: 0.0189"),
            ("1kHz", Unit::Hertz, "in Hz: 1000"),
            ("59.94Hz", Unit::Hertz, "in Hz: 59.94"),
            ("500ms", Unit::Seconds, "in s: 0.5"),
        ] {
            let answer = said(text, unit).unwrap_err();
            assert!(answer.ends_with(number), "{text}: {answer}");
        }
    }

    #[test]
    fn what_is_no_number_of_the_kind_is_told_what_is_wanted() {
        for text in ["", "us", "-3us", "80kg", "nan", "infs", "1e9", "2 3us"] {
            assert_eq!(
                said(text, Unit::Microseconds).unwrap_err(),
                "want a number",
                "{text}"
            );
        }
        assert!(hertz("0").is_err() && hertz("-1").is_err() && hertz("1000") == Ok(1000.0));
    }
}
