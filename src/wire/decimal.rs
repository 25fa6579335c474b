//! Reals as fixed decimals, in integers only.
//!
//! `write` rounds to the nearest decimal (halves to even) and `parse` to the nearest `f32`, both
//! exactly. So parsing what was written gives a value that is written the same way again.

use core::fmt;

use super::check::MAX_VALUE;

/// Most decimals a field can have.
pub(super) const MAX_DECIMALS: u32 = 6;

/// `10^decimals`.
fn scale(decimals: u32) -> u64 {
    10_u64.pow(decimals.min(MAX_DECIMALS))
}

/// Writes `value` with `decimals` decimals. Minus zero is written as zero; a value that is not
/// below [`MAX_VALUE`] is refused, so check before.
pub(super) fn write(out: &mut impl fmt::Write, value: f32, decimals: u32) -> fmt::Result {
    if value.is_nan() || value.abs() >= MAX_VALUE {
        return Err(fmt::Error);
    }
    let scale = scale(decimals);
    let steps = steps(value.abs(), scale);
    let sign = if value.is_sign_negative() && steps > 0 {
        "-"
    } else {
        ""
    };
    let (whole, part) = (steps / scale, steps % scale);
    if decimals == 0 {
        write!(out, "{sign}{whole}")
    } else {
        write!(
            out,
            "{sign}{whole}.{part:0width$}",
            width = decimals as usize
        )
    }
}

/// `value·scale` as the nearest integer, for a positive value below [`MAX_VALUE`].
fn steps(value: f32, scale: u64) -> u64 {
    let bits = value.to_bits();
    let exponent = bits >> 23;
    let fraction = u64::from(bits & 0x007f_ffff);
    // value = mantissa · 2^-shift; below 1e7 < 2^24 the shift is never negative.
    let (mantissa, shift) = match exponent {
        0 => (fraction, 149),
        e => (fraction | 0x0080_0000, 150_u32.saturating_sub(e)),
    };
    let product = mantissa * scale; // below 2^24 · 2^20
    if shift == 0 {
        return product;
    }
    if shift > 63 {
        return 0;
    }
    let floor = product >> shift;
    let rest = product & ((1 << shift) - 1);
    let half = 1 << (shift - 1);
    floor + u64::from(rest > half || (rest == half && floor & 1 == 1))
}

/// Reads what [`write`] writes: an optional minus, 1 to 7 digits without leading zeros, and
/// exactly `decimals` decimals. Anything else is `None`.
pub(super) fn parse(field: &str, decimals: u32) -> Option<f32> {
    let (negative, digits) = match field.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, field),
    };
    let (whole, part) = match decimals {
        0 => (digits, ""),
        _ => digits.split_once('.')?,
    };
    let wrong_zero = whole.len() > 1 && whole.starts_with('0');
    if whole.is_empty() || whole.len() > 7 || wrong_zero || part.len() != decimals as usize {
        return None;
    }
    let mut steps = 0_u64;
    for byte in whole.bytes().chain(part.bytes()) {
        if !byte.is_ascii_digit() {
            return None;
        }
        steps = steps * 10 + u64::from(byte - b'0'); // at most 13 digits
    }
    if steps == 0 {
        return if negative { None } else { Some(0.0) };
    }
    let value = nearest(steps, scale(decimals));
    // The nearest f32 of 9999999.9 is MAX_VALUE itself, which may not be written.
    if value >= MAX_VALUE {
        return None;
    }
    Some(if negative { -value } else { value })
}

/// `steps/scale` as the nearest `f32`, for `0 < steps < 2^44`.
fn nearest(steps: u64, scale: u64) -> f32 {
    let shift = steps.leading_zeros();
    let shifted = steps << shift;
    // At least 43 bits, so the bit that remembers a remainder is far below the rounding.
    let quotient = (shifted / scale) | u64::from(!shifted.is_multiple_of(scale));
    // 2^-shift, with shift ≤ 63: an exact power of two, and the product is never subnormal.
    quotient as f32 * f32::from_bits((127 - shift) << 23)
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
