//! Sines and cosines of phases and angles.

use core::f32::consts::TAU;

/// Cosine and sine of a phase in turns of 2³², to about 1·10⁻⁷ (Taylor within an eighth of a turn).
pub(crate) fn cos_sin(phase: u32) -> (f32, f32) {
    let quadrant = phase.wrapping_add(1 << 29) >> 30;
    let rest = phase.wrapping_sub(quadrant << 30) as i32;
    let x = rest as f32 * (TAU / 4_294_967_296.0);
    let x2 = x * x;
    let sin =
        x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0 - x2 / 362_880.0))));
    let cos = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 / 40_320.0)));
    match quadrant & 3 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

/// Sine of an angle, rad, to about 2·10⁻⁷ of its own size where that is small. (libm's works in `f64`, which a
/// microcontroller has no hardware for.)
pub(crate) fn sin(angle: f32) -> f32 {
    if angle.abs() < 0.5 {
        let x2 = angle * angle;
        return angle * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 / 5040.0)));
    }
    cos_sin(turns(angle * (1.0 / TAU))).1
}

/// Part of a turn as a phase, for what is added to a frequency's own phase.
pub(crate) fn turns(turns: f32) -> u32 {
    let whole = libm::floorf(turns);
    ((turns - whole) * 4_294_967_296.0) as u32
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn cos_sin_is_as_good_as_f32() {
        for i in 0..10_000_u32 {
            let phase = i.wrapping_mul(429_497 + 13);
            let angle = f64::from(phase) / 4_294_967_296.0 * core::f64::consts::TAU;
            let (c, s) = cos_sin(phase);
            assert!((f64::from(c) - angle.cos()).abs() < 2e-7);
            assert!((f64::from(s) - angle.sin()).abs() < 2e-7);
        }
    }

    #[test]
    fn sin_is_as_good_as_f32() {
        for i in -20_000..20_000_i32 {
            let angle = i as f32 * 1.003e-3;
            let exact = f64::from(angle).sin();
            let error = (f64::from(sin(angle)) - exact).abs();
            assert!(
                error < 2e-6 && (angle.abs() > 0.5 || error <= 2e-7 * exact.abs()),
                "{angle}"
            );
        }
    }
}
