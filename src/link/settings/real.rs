//! Numbers as people type them: `0.25`, `12`, `1e-3`, by the standard library's exact conversions.

/// Reads a whole number from 0 to 2³² − 1, a plus in front of it or not; anything else is `None`.
pub(super) fn whole(text: &str) -> Option<u32> {
    text.parse().ok()
}

/// Reads an optional sign, digits with at most one point among them, and an optional exponent.
/// Anything else, and what is beyond an `f32`, is `None`.
pub(super) fn parse(text: &str) -> Option<f32> {
    // The standard library also takes `inf` and `nan`, which are no settings.
    let is_number = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'+' | b'-' | b'e' | b'E');
    let value: f32 = text.parse().ok()?;
    (value.is_finite() && text.bytes().all(is_number)).then_some(value)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use proptest::prelude::*;
    use std::{format, string::String, string::ToString};

    /// As settings are said.
    fn said(value: f32) -> String {
        value.to_string()
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
            assert_eq!(whole(text), expected, "{text}");
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
