//! Numbers as people type and read them: `0.25`, `12`, `1e-3`.
//!
//! The standard library's conversions are exact for every number there is, and take 27 KiB of a
//! microcontroller's flash for it. These are right to the last bit for up to seven digits and ten
//! decimals, which is what settings have, and to a few bits beyond.

use core::fmt;

/// Powers of ten that an `f32` holds exactly.
const POWERS: [f32; 11] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10];

/// Largest power that is multiplied by: twice it leaves the range of an `f32`.
const MOST_POWER: i32 = 40;

/// `value · 10^power`.
fn scaled(mut value: f32, power: i32) -> f32 {
    let mut left = power.unsigned_abs().min(MOST_POWER.unsigned_abs()) as usize;
    while left > 0 {
        let step = left.min(POWERS.len() - 1);
        let factor = POWERS.get(step).copied().unwrap_or(1.0);
        if power > 0 {
            value *= factor;
        } else {
            value /= factor;
        }
        left -= step;
    }
    value
}

/// Whether a minus stands in front, and what stands behind the sign.
fn signed(text: &[u8]) -> (bool, &[u8]) {
    match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    }
}

/// One or more digits.
fn digits(text: &[u8]) -> Option<u32> {
    if text.is_empty() {
        return None;
    }
    text.iter().try_fold(0_u32, |number, &byte| {
        let digit = byte.is_ascii_digit().then(|| u32::from(byte - b'0'))?;
        number.checked_mul(10)?.checked_add(digit)
    })
}

/// Reads a whole number from 0 to 2³² − 1, a plus in front of it or not; anything else is `None`. One such
/// function for all: the standard library's has a copy for each type.
pub(super) fn whole(text: &[u8]) -> Option<u32> {
    match signed(text) {
        (true, _) => None,
        (false, text) => digits(text),
    }
}

/// Reads an optional sign, digits with at most one point among them, and an optional exponent.
/// Anything else, and what is beyond an `f32`, is `None`.
pub(super) fn parse(text: &str) -> Option<f32> {
    let (negative, mut rest) = signed(text.as_bytes());
    let (mut mantissa, mut power) = (0_u32, 0_i32);
    let (mut is_number, mut is_part) = (false, false);
    while let [byte, behind @ ..] = rest {
        rest = behind;
        match byte {
            b'0'..=b'9' => {
                // Beyond nine digits they only count for the power.
                let taken = mantissa < 100_000_000;
                if taken {
                    mantissa = mantissa * 10 + u32::from(byte - b'0');
                }
                power = power.saturating_add(i32::from(!taken) - i32::from(is_part));
                is_number = true;
            }
            b'.' if !is_part => is_part = true,
            b'e' | b'E' => {
                let (down, exponent) = signed(rest);
                let exponent = i32::from(i8::try_from(digits(exponent)?).ok()?);
                power = power.saturating_add(if down { -exponent } else { exponent });
                break;
            }
            _ => return None,
        }
    }
    let value = scaled(mantissa as f32, power);
    let value = if negative { -value } else { value };
    (is_number && value.is_finite()).then_some(value)
}

/// Writes a number in as few digits as tell it from its neighbours, never with an exponent.
pub(super) struct Real(pub(super) f32);

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.0.abs();
        if value == 0.0 || !value.is_finite() {
            return f.write_str(match value {
                0.0 => "0",
                v if v.is_nan() => "NaN",
                _ => "inf",
            });
        }
        if self.0 < 0.0 {
            f.write_str("-")?;
        }
        // 10^magnitude ≤ value < 10^(magnitude + 1), or nearly.
        let mut magnitude = 0;
        while scaled(value, -magnitude) >= 10.0 {
            magnitude += 1;
        }
        while scaled(value, -magnitude) < 1.0 && magnitude > -MOST_POWER {
            magnitude -= 1;
        }
        let (mut mantissa, mut decimals) = (0, 0);
        for digits in 0..9 {
            decimals = digits - magnitude;
            mantissa = libm::roundf(scaled(value, decimals)) as u32;
            if scaled(mantissa as f32, -decimals) == value {
                break;
            }
        }
        write_decimal(f, mantissa, decimals)
    }
}

/// `mantissa / 10^decimals`.
fn write_decimal(f: &mut fmt::Formatter<'_>, mantissa: u32, decimals: i32) -> fmt::Result {
    let decimals = decimals.clamp(-MOST_POWER, MOST_POWER + 9);
    if decimals <= 0 {
        write!(f, "{mantissa}")?;
        return (decimals..0).try_for_each(|_| f.write_str("0"));
    }
    let places = decimals.unsigned_abs();
    let (whole, part) = match 10_u32.checked_pow(places) {
        Some(one) => (mantissa / one, mantissa % one),
        None => (0, mantissa),
    };
    write!(f, "{whole}.{part:0width$}", width = places as usize)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use proptest::prelude::*;
    use std::{format, string::String, string::ToString};

    fn said(value: f32) -> String {
        Real(value).to_string()
    }

    #[test]
    fn numbers_as_people_write_them() {
        for (text, value) in [
            ("0", 0.0),
            ("1", 1.0),
            ("0.5", 0.5),
            (".5", 0.5),
            ("5.", 5.0),
            ("1e-3", 0.001),
            ("-2.5E2", -250.0),
            ("+0.1", 0.1),
            ("100000", 100_000.0),
            ("0.0000000010", 1e-9),
            ("1.000000000000000000", 1.0),
        ] {
            assert_eq!(parse(text), Some(value), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in [
            "", ".", "-", "e3", "1e", "1e400", "1e99", "nan", "inf", "1,5", "0x1", "1.2.3", " 1",
            "1 ", "--1", "1e1.5",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn whole_numbers_as_the_standard_library_reads_them() {
        for text in [
            "0",
            "7",
            "+7",
            "007",
            "4294967295",
            "4294967296",
            "99999999999",
            "",
            "+",
            "-0",
            "-1",
            "1.0",
            "1e3",
            " 1",
            "0x1",
        ] {
            let expected = text.parse::<u32>().ok().filter(|_| !text.starts_with('-'));
            assert_eq!(whole(text.as_bytes()), expected, "{text}");
        }
    }

    #[test]
    fn few_digits() {
        for (value, text) in [
            (1.0, "1"),
            (0.1, "0.1"),
            (0.25, "0.25"),
            (1e-3, "0.001"),
            (1e-9, "0.000000001"),
            (100_000.0, "100000"),
            (-12.5, "-12.5"),
            (0.0, "0"),
            (f32::NAN, "NaN"),
            (f32::INFINITY, "inf"),
            (-1.5e20, "-150000000000000000000"),
        ] {
            assert_eq!(said(value), text);
        }
    }

    proptest! {
        #[test]
        fn seven_digits_are_exact(mantissa in 0_u32..10_000_000, decimals in 0_usize..=10) {
            let text = format!("{mantissa}e-{decimals}");
            prop_assert_eq!(parse(&text), text.parse().ok());
        }

        #[test]
        fn what_is_said_is_read_again(value in -1e6_f32..1e6) {
            let read = parse(&said(value)).unwrap();
            prop_assert!((read - value).abs() <= value.abs() * 1.2e-7, "{} {}", value, read);
        }

        #[test]
        fn nothing_breaks_it(bits: u32, text in ".{0,20}") {
            let _ = said(f32::from_bits(bits));
            let _ = parse(&text);
        }
    }
}
