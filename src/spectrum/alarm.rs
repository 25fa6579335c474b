//! How large a peak must be not to be noise.
//!
//! The largest of a periodogram of pure noise over a band of B Hz and T s exceeds z (noise power 1) with
//! probability B·T_e·√z·e^(−z), T_e = √(4π·var(t)) (Baluev 2008, MNRAS 385, eq. 6: the extreme value of the
//! continuous periodogram, so the fineness of the grid does not enter). The noise's level is not known, only
//! what is left of the sum of squares: e^(−z) becomes (1 + 2z/ν)^(−ν/2) with ν degrees of freedom.

/// Share by which one tone must lower the sum of squares, as (before − after)/after, so that noise does it
/// in no more than `false_alarm` of the windows. `widths`: bandwidth times T_e. `freedom`: ν after the tone.
pub(crate) fn threshold(false_alarm: f32, widths: f32, freedom: f32) -> f32 {
    let one = false_alarm.clamp(1e-12, 0.5);
    let mut z = 10.0_f32;
    for _ in 0..4 {
        z = libm::logf((widths.max(0.0) * crate::math::sqrtf(z) + 1.0) / one).max(1.0);
    }
    libm::expf((2.0 * z / freedom.max(1.0)).min(60.0)) - 1.0
}

#[cfg(test)]
mod tests {
    use super::threshold;

    #[test]
    fn many_samples_give_the_exponential_limit() {
        // ln(1000·4·1000) + ½·ln(z) is about 16.6.
        let share = threshold(1e-3, 4000.0 / 4.0, 1e5);
        let z = 0.5 * share * 1e5;
        assert!((14.0..17.0).contains(&z), "{z}");
    }

    #[test]
    fn few_samples_ask_for_more() {
        assert!(threshold(1e-3, 100.0, 20.0) * 10.0 > threshold(1e-3, 100.0, 1e4) * 5e3);
    }
}
