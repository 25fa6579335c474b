//! Where over the rows a tone moves most, how far, and along which way.

use num_complex::Complex32 as Complex;

use super::fit::Direction;
use super::shape::{BASIS, CONSTANTS, ORDERS, Shape, legendre};

/// Places looked at from the first row to the last.
const PLACES: u16 = 49;

/// A tone's motion at one place: an ellipse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Orbit {
    /// Complex amplitudes along x and y, px.
    pub(crate) amplitudes: [Complex; 2],
    /// Its semi-major axis, px.
    pub(crate) semi_major_px: f32,
    /// Along it, at the phase where it is reached: what each amplitude is multiplied by there.
    pub(crate) towards: [Complex; 2],
}

impl Orbit {
    /// The ellipse of these amplitudes: a² = ½(|X|² + |Y|² + |X² + Y²|).
    pub(crate) fn of(amplitudes: [Complex; 2]) -> Self {
        let [x, y] = amplitudes;
        let square = x * x + y * y;
        let size = crate::math::sqrtf(square.norm_sqr());
        let semi_major_px =
            crate::math::sqrtf((0.5 * (x.norm_sqr() + y.norm_sqr() + size)).max(0.0));
        // Half the phase of the square, by the root of the unit phasor.
        let unit = if size > 0.0 {
            square.unscale(size)
        } else {
            Complex::new(1.0, 0.0)
        };
        let re = crate::math::sqrtf((0.5 * (1.0 + unit.re)).max(0.0));
        let im = crate::math::sqrtf((0.5 * (1.0 - unit.re)).max(0.0));
        let phase = Complex::new(re, if unit.im < 0.0 { -im } else { im });
        let along = |c: Complex| {
            if semi_major_px > 0.0 {
                phase.scale((c * phase.conj()).re / semi_major_px)
            } else {
                Complex::new(0.0, 0.0)
            }
        };
        Self {
            amplitudes,
            semi_major_px,
            towards: [along(x), along(y)],
        }
    }
}

/// Where the shape is largest between the part's first and last row, η, and its orbit there.
pub(crate) fn largest(shape: &Shape, [first, last]: [f32; 2]) -> (f32, Orbit) {
    let at = |eta: f32| Orbit::of(shape.at(&legendre(eta)));
    let rigid = shape.orders().iter().all(|&orders| orders < 2);
    let mut best = (0.0, at(0.0));
    if rigid {
        return best;
    }
    for i in 0..PLACES {
        let eta = first + (last - first) * f32::from(i) / f32::from(PLACES - 1);
        let orbit = at(eta);
        if orbit.semi_major_px > best.1.semi_major_px {
            best = (eta, orbit);
        }
    }
    best
}

/// How an amplitude at `eta` follows the shape's coefficients; `towards`: how it follows those along x and y there.
pub(crate) fn direction(eta: f32, towards: [Complex; 2]) -> Direction {
    let mut direction = [Complex::new(0.0, 0.0); BASIS];
    let p = legendre(eta);
    for (axis, constant) in CONSTANTS.into_iter().enumerate() {
        for order in 0..ORDERS {
            direction[constant + order] = towards[axis].scale(p[order]);
        }
    }
    direction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_semi_major_axis_is_the_largest_deflection() {
        for i in 0..60_u8 {
            let turn = f32::from(i) * 0.7;
            let x = Complex::new(turn.cos(), 0.3 * turn.sin());
            let y = Complex::new(0.4 * (turn * 1.7).sin(), (turn * 0.3).cos() * 0.8);
            let orbit = Orbit::of([x, y]);
            let mut largest = 0.0_f32;
            for step in 0..2000_u16 {
                let angle = f32::from(step) * 0.001 * core::f32::consts::PI;
                let e = Complex::new(libm::cosf(angle), libm::sinf(angle));
                let square = (x * e).re.powi(2) + (y * e).re.powi(2);
                largest = largest.max(square.sqrt());
            }
            assert!((orbit.semi_major_px / largest - 1.0).abs() < 1e-4);
            // A little more of either amplitude changes it as `towards` says.
            let [a, b] = orbit.towards;
            let little = Complex::new(1e-3, -5e-4);
            let more = Orbit::of([x + little, y - little]).semi_major_px;
            let said = orbit.semi_major_px + (a.conj() * little - b.conj() * little).re;
            assert!((more - said).abs() < 1e-5, "{more} {said}");
        }
    }
}
