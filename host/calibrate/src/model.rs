//! What a flashing light looks like to a rolling shutter: one wave form, the same in every frame.
//!
//! The mean of row `y` of frame `n` is `b(y) + g(y)·s(ψ)` with ψ = 2π(ν·(y − y_c) + φ_n): ν stripes a row,
//! φ_n the phase of frame `n` at the middle row `y_c`, and s a sinusoid with harmonics, scaled so that its
//! fundamental is cos ψ. `b` and `g` (the unlit picture and the light's own share) do not change in time.

use std::f64::consts::TAU;

/// What is known of `b(y)` and `g(y)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Nothing: every row has its own. The general "average picture subtracted"; needs stripes that move.
    PerRow,
    /// Smooth: polynomials of this degree in `y`. For a single frame, or stripes that stand still.
    Smooth(usize),
}

/// The parameters that are not linear.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Stripes a row, ν.
    pub per_row: f64,
    /// Phase of every frame at the middle row, cycles.
    pub phases: Vec<f64>,
    /// Cosine and sine amplitude of every harmonic against the fundamental; the first is [1, 0].
    pub harmonics: Vec<[f64; 2]>,
}

impl Model {
    /// Parameters, in the order of [`Model::moved`]: ν, phases, harmonics from the second on.
    pub fn parameters(&self) -> usize {
        1 + self.phases.len() + 2 * (self.harmonics.len() - 1)
    }

    /// ψ of row `y` (from the middle row) in frame `n`, radians.
    pub fn psi(&self, n: usize, y: f64) -> f64 {
        TAU * (self.per_row * y + self.phases[n]).fract()
    }

    /// s(ψ).
    pub fn wave(&self, psi: f64) -> f64 {
        let mut sum = 0.0;
        walk(psi, self.harmonics.len(), |h, c, s| {
            let [a, b] = self.harmonics[h - 1];
            sum += a * c + b * s;
        });
        sum
    }

    /// s and its derivatives: with respect to ψ/2π, and to each harmonic from the second on (into `out`).
    pub fn wave_and_slopes(&self, psi: f64, out: &mut [f64]) -> (f64, f64) {
        let (mut sum, mut slope) = (0.0, 0.0);
        walk(psi, self.harmonics.len(), |h, c, s| {
            let [a, b] = self.harmonics[h - 1];
            sum += a * c + b * s;
            slope += h as f64 * (b * c - a * s);
            if h > 1 {
                out[2 * (h - 2)] = c;
                out[2 * (h - 2) + 1] = s;
            }
        });
        (sum, TAU * slope)
    }

    /// The model after a step of the parameters.
    pub fn moved(&self, step: &[f64]) -> Self {
        let mut model = self.clone();
        model.per_row += step[0];
        let frames = self.phases.len();
        for (phase, d) in model.phases.iter_mut().zip(&step[1..=frames]) {
            *phase += d;
        }
        for (h, d) in model.harmonics[1..]
            .iter_mut()
            .zip(step[1 + frames..].chunks_exact(2))
        {
            h[0] += d[0];
            h[1] += d[1];
        }
        model
    }
}

/// Calls `f(h, cos hψ, sin hψ)` for h = 1..=count, by rotation.
fn walk(psi: f64, count: usize, mut f: impl FnMut(usize, f64, f64)) {
    let (s1, c1) = psi.sin_cos();
    let (mut c, mut s) = (c1, s1);
    for h in 1..=count {
        f(h, c, s);
        (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
    }
}

/// Legendre polynomials P_0..P_degree at `u` in −1..=1.
pub fn legendre(u: f64, degree: usize) -> Vec<f64> {
    let mut p = vec![1.0, u];
    for k in 1..degree {
        let k1 = k as f64;
        p.push(((2.0 * k1 + 1.0) * u * p[k] - k1 * p[k - 1]) / (k1 + 1.0));
    }
    p.truncate(degree + 1);
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_derivatives() {
        let model = Model {
            per_row: 0.01,
            phases: vec![0.2],
            harmonics: vec![[1.0, 0.0], [0.3, -0.2], [0.1, 0.4]],
        };
        let mut out = [0.0; 4];
        let psi = 1.234;
        let (value, slope) = model.wave_and_slopes(psi, &mut out);
        assert!((value - model.wave(psi)).abs() < 1e-12);
        let step = 1e-6;
        let numeric = (model.wave(psi + TAU * step) - model.wave(psi - TAU * step)) / (2.0 * step);
        assert!((slope - numeric).abs() < 1e-6, "{slope} {numeric}");
        assert!((out[2] - (3.0 * psi).cos()).abs() < 1e-12);
        assert_eq!(model.parameters(), 6);
    }

    #[test]
    fn legendre_by_hand() {
        let p = legendre(0.5, 3);
        assert!((p[2] + 0.125).abs() < 1e-15 && (p[3] + 0.4375).abs() < 1e-15);
        assert_eq!(legendre(0.5, 0), vec![1.0]);
    }
}
