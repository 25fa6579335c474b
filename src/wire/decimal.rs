//! Reals as fixed decimals: the standard library's exact conversions, in the one form a wire allows.
//!
//! `write` rounds to the nearest decimal (halves to even) and `parse` to the nearest `f32`, both
//! exactly. So parsing what was written gives a value that is written the same way again.

use core::fmt::{self, Write as _};

use heapless::String;

use super::check::MAX_VALUE;

/// Most decimals a field can have.
pub(super) const MAX_DECIMALS: u32 = 6;

/// Most characters of a field: a sign, seven digits, a point and the decimals.
const MAX_FIELD: usize = 9 + MAX_DECIMALS as usize;

/// Writes `value` with `decimals` decimals. Minus zero is written as zero; a value that is not
/// below [`MAX_VALUE`] is refused, so check before.
pub(super) fn write(out: &mut impl fmt::Write, value: f32, decimals: u32) -> fmt::Result {
    if value.is_nan() || value.abs() >= MAX_VALUE {
        return Err(fmt::Error);
    }
    let decimals = decimals.min(MAX_DECIMALS) as usize;
    let mut field = String::<MAX_FIELD>::new();
    write!(field, "{value:.decimals$}")?;
    let is_zero = field.bytes().all(|b| matches!(b, b'0' | b'-' | b'.'));
    let unsigned = field.strip_prefix('-').filter(|_| is_zero);
    out.write_str(unsigned.unwrap_or(&field))
}

/// Reads what [`write`] writes: an optional minus, 1 to 7 digits without leading zeros, and
/// exactly `decimals` decimals. Anything else is `None`.
pub(super) fn parse(field: &str, decimals: u32) -> Option<f32> {
    let digits = field.strip_prefix('-').unwrap_or(field);
    let (whole, part) = match decimals {
        0 => (digits, ""),
        _ => digits.split_once('.')?,
    };
    let wrong_zero = whole.len() > 1 && whole.starts_with('0');
    if whole.is_empty() || whole.len() > 7 || wrong_zero || part.len() != decimals as usize {
        return None;
    }
    let mut all = whole.bytes().chain(part.bytes());
    if !all.clone().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let is_zero = all.all(|byte| byte == b'0');
    if is_zero && field.starts_with('-') {
        return None;
    }
    // The nearest f32 of 9999999.9 is MAX_VALUE itself, which may not be written.
    let value: f32 = field.parse().ok()?;
    (value.abs() < MAX_VALUE).then_some(value)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use proptest::prelude::*;

    fn written(value: f32, decimals: u32) -> heapless::String<32> {
        let mut text = heapless::String::new();
        write(&mut text, value, decimals).unwrap();
        text
    }

    #[test]
    fn writes_as_one_expects() {
        assert_eq!(written(49.2003, 4), "49.2003");
        assert_eq!(written(0.0, 4), "0.0000");
        assert_eq!(written(-0.00001, 4), "0.0000");
        assert_eq!(written(-3.25, 1), "-3.2"); // a half goes to even
        assert_eq!(written(9_999_999.0, 6), "9999999.000000");
        assert_eq!(written(12.0, 0), "12");
    }

    #[test]
    fn refuses_other_spellings() {
        for text in [
            "",
            "-",
            ".5",
            "1.",
            "01.0",
            "+1.0",
            "-0.0",
            "1.00",
            "1e3",
            "12345678.0",
            "1.a",
            "nan",
        ] {
            assert_eq!(parse(text, 1), None, "{text}");
        }
        assert_eq!(parse("9999999.9", 1), None);
        assert_eq!(parse("-2.5", 1), Some(-2.5));
    }

    proptest! {
        /// The standard library rounds exactly as well, so it serves as the judge.
        #[test]
        fn agrees_with_the_standard_library(bits in any::<u32>(), decimals in 0..=MAX_DECIMALS) {
            let value = f32::from_bits(bits);
            prop_assume!(value.abs() < MAX_VALUE);
            let ours = written(value, decimals);
            let theirs = std::format!("{:.*}", decimals as usize, f64::from(value));
            let zero = theirs.bytes().all(|b| matches!(b, b'0' | b'-' | b'.'));
            prop_assert_eq!(ours.as_str(), if zero { theirs.trim_start_matches('-') } else { &theirs });
            let back = parse(&ours, decimals);
            let judged = theirs.parse::<f32>().unwrap();
            if judged.abs() < MAX_VALUE {
                prop_assert_eq!(back, Some(judged));
                prop_assert_eq!(written(judged, decimals), ours);
            }
        }
    }
}
