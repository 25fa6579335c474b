//! Frequencies and phases as fixed-point turns: exact over any time, cheap, without trigonometry tables.
//!
//! A frequency is 2⁶⁴ times its turns a nanosecond, so a frequency times a time in ns, wrapping, *is*
//! the phase in turns with the whole turns gone. The step is 5·10⁻¹¹ Hz.

/// Steps of [`Frequency`] a hertz: 2⁶⁴ / 10⁹.
const STEPS_PER_HZ: f32 = 1.844_674_4e10;

/// A frequency that multiplies exactly with a time in ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Frequency(i64);

impl Frequency {
    /// From Hz; what an `f32` cannot hold is added with [`Frequency::plus`].
    pub(crate) fn from_hz(hz: f32) -> Self {
        let whole = hz as i32;
        let rest = ((hz - whole as f32) * STEPS_PER_HZ) as i64;
        Self(
            i64::from(whole)
                .wrapping_mul(18_446_744_074)
                .wrapping_add(rest),
        )
    }

    /// This frequency and a little.
    pub(crate) fn plus(self, hz: f32) -> Self {
        Self(self.0.wrapping_add((hz * STEPS_PER_HZ) as i64))
    }

    /// Its mirror image, as much below 0.
    pub(crate) fn mirrored(self) -> Self {
        Self(self.0.wrapping_neg())
    }

    /// In Hz.
    pub(crate) fn hz(self) -> f32 {
        self.0 as f32 / STEPS_PER_HZ
    }

    /// How far above `other`, Hz.
    pub(crate) fn above(self, other: Self) -> f32 {
        self.0.wrapping_sub(other.0) as f32 / STEPS_PER_HZ
    }

    /// Phase after `time_ns`, turns of 2³².
    pub(crate) fn phase(self, time_ns: i64) -> u32 {
        ((self.0 as u64).wrapping_mul(time_ns as u64) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phase_wraps_rightly_over_days() {
        let frequency = Frequency::from_hz(1000.0);
        let ten_days_ns = 864_000_000_000_000;
        // The frequency itself is right to 2·10⁻¹¹; over 8.64·10⁸ turns that is 0.017 turns.
        let turns = f64::from(frequency.phase(ten_days_ns) as i32) / 4_294_967_296.0;
        assert!(turns.abs() < 0.017, "{turns}");
        assert_eq!(frequency.hz(), 1000.0);
        assert!((frequency.plus(0.25).above(frequency) - 0.25).abs() < 1e-6);
    }
}
