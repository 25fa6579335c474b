//! Differences of times, and seconds as nanoseconds.

/// `later_ns − earlier_ns`, saturating. On a microcontroller it is called: 34 bytes in each of thirty places
/// are 1 KiB.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(crate) fn since(later_ns: i64, earlier_ns: i64) -> i64 {
    later_ns.saturating_sub(earlier_ns)
}

/// Seconds as the nearest whole nanoseconds, exactly and without `f64`; 0 below 0 and of what is no number, saturating.
pub(crate) fn ns_of_s(seconds: f32) -> i64 {
    // Neither is true of what is no number.
    if !(seconds > 0.0 && seconds < 9e9) {
        return if seconds >= 9e9 { i64::MAX } else { 0 };
    }
    let bits = seconds.to_bits();
    let exponent = (bits >> 23) as i32 - 127 - 23;
    // 24 bits times 30.
    let product = u64::from((bits & 0x7F_FFFF) | 0x80_0000) * 1_000_000_000;
    if exponent >= 0 {
        return i64::try_from(u128::from(product) << exponent).unwrap_or(i64::MAX);
    }
    let shift = exponent.unsigned_abs();
    if shift > 63 {
        return 0;
    }
    ((product + (1 << (shift - 1))) >> shift) as i64
}

#[cfg(test)]
mod tests {
    use super::ns_of_s;

    proptest::proptest! {
        #[test]
        fn seconds_are_rounded_to_the_nearest_nanosecond(seconds in 0.0_f32..1e6) {
            // A product of 24 and 30 bits, of which nine are zeros, is exact in f64.
            let exact = f64::from(seconds) * 1e9;
            proptest::prop_assert!((ns_of_s(seconds) as f64 - exact).abs() <= 0.5);
        }

        #[test]
        fn any_bits_are_some_time(bits in proptest::prelude::any::<u32>()) {
            proptest::prop_assert!(ns_of_s(f32::from_bits(bits)) >= 0);
        }
    }

    #[test]
    fn usual_windows_are_exact() {
        for (seconds, ns) in [
            (1.0, 1_000_000_000),
            (0.5, 500_000_000),
            (0.0, 0),
            (10.0, 10_000_000_000),
        ] {
            assert_eq!(ns_of_s(seconds), ns);
        }
        assert_eq!(ns_of_s(f32::INFINITY), i64::MAX);
        assert_eq!(ns_of_s(f32::NAN), 0);
        assert_eq!(ns_of_s(0.1), 100_000_001); // 0.1 s is 0.100000001490… in an f32
    }
}
