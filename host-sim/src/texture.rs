//! The light pattern that reaches the sensor, finer than its pixels.
//!
//! Contract: a [`Texture`] answers what the pixels of a row would read if the pattern stood `d` px
//! to the right of its home, for any real `d`, and how fast that changes with `d`.
//!
//! Each row is a periodic strip. Lens blur, pixel area and a low-pass that removes everything above
//! one cycle per pixel are applied in the frequency domain; what lies between half a cycle and one
//! folds back in the pixels, as on a real sensor. The strip is then kept at [`FINENESS`] values a
//! pixel and read between those with six-point Lagrange interpolation: its error is below 2·10⁻⁵
//! of a component at half a cycle per pixel and 10⁻³ at one.

use std::ops::Range;

use rowtone_fourier::{Complex64, Fourier};

/// Values kept for each pixel.
pub const FINENESS: usize = 8;

/// Reflectance of the object, rows of a periodic strip.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Length of the period, px.
    pub period_px: usize,
    /// Values for each pixel: 1 or 2.
    pub fineness: usize,
    /// `rows` times `period_px · fineness` values, 0 to 1.
    pub values: Vec<f32>,
}

/// The blurred pattern of every row.
#[derive(Clone, Debug)]
pub struct Texture {
    period_px: usize,
    rows: usize,
    /// Row by row; in a row the values at offset `phase / FINENESS`, one array a phase.
    table: Vec<f32>,
}

impl Texture {
    /// Blurs a strip and maps its 0 to 1 onto `dark` to `bright` (fractions of white).
    ///
    /// # Panics
    /// When the strip's values are no whole number of rows: its maker is at fault.
    pub fn new(strip: &Strip, blur_px: f64, dark: f64, bright: f64) -> Self {
        let coarse = strip.period_px * strip.fineness;
        assert!(
            coarse > 0 && strip.values.len().is_multiple_of(coarse),
            "a strip is whole rows"
        );
        let rows = strip.values.len() / coarse;
        let fine = strip.period_px * FINENESS;
        let transfer = transfer_function(strip, blur_px);
        let mut table = vec![0.0; rows * fine];
        let mut buffers = Buffers::new(coarse, fine);
        for (values, out) in strip.values.chunks(coarse).zip(table.chunks_mut(fine)) {
            buffers.blur(values, &transfer);
            for (k, v) in buffers.fine.iter().enumerate() {
                let level = dark + (bright - dark) * v.re / coarse as f64;
                // Rounded so that the last bits of a Fourier transform do not matter.
                let level = ((level * RESOLUTION).round() / RESOLUTION).max(0.0) as f32;
                out[k % FINENESS * strip.period_px + k / FINENESS] = level;
            }
        }
        Self {
            period_px: strip.period_px,
            rows,
            table,
        }
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Length of the period, px.
    pub fn period_px(&self) -> usize {
        self.period_px
    }

    /// The value `fine` steps of 1/[`FINENESS`] px to the right of a row's beginning.
    pub(super) fn fine_value(&self, row: usize, fine: i64) -> f32 {
        let p = self.period_px;
        let phase = fine.rem_euclid(FINENESS as i64) as usize;
        let at = fine.div_euclid(FINENESS as i64).rem_euclid(p as i64) as usize;
        self.table[(row * FINENESS + phase) * p + at]
    }

    /// Adds to `out` what the pixels `cols` of `row` read through `kernel`.
    pub fn add(&self, row: usize, cols: Range<usize>, kernel: &Kernel, out: &mut [f32]) {
        let p = self.period_px;
        let Some(strip) = self.table.chunks(p * FINENESS).nth(row) else {
            return;
        };
        for (k, &weight) in kernel.weights.iter().enumerate() {
            let offset = kernel.first + k as i64;
            let phase = offset.rem_euclid(FINENESS as i64) as usize;
            let shift = offset.div_euclid(FINENESS as i64);
            let mut at = (cols.start as i64 + shift).rem_euclid(p as i64) as usize;
            let source = &strip[phase * p..][..p];
            let weight = weight as f32;
            let mut rest = &mut out[..cols.len()];
            while !rest.is_empty() {
                let n = rest.len().min(p - at);
                let (now, later) = rest.split_at_mut(n);
                for (o, s) in now.iter_mut().zip(&source[at..]) {
                    *o += weight * s;
                }
                rest = later;
                at = 0;
            }
        }
    }

    /// What the pixels `cols` of `row` read under steady light with the pattern `shift_px` to the
    /// right of its home: fractions of white.
    pub fn row(&self, row: usize, cols: Range<usize>, shift_px: f64) -> Vec<f32> {
        let mut kernel = Kernel::default();
        kernel.add(shift_px, 1.0);
        let mut out = vec![0.0; cols.len()];
        self.add(row, cols, &kernel, &mut out);
        out
    }

    /// Derivative of [`Texture::row`] with respect to the position in the picture, per px: central
    /// differences of eighth order on the fine grid.
    pub fn slope(&self, row: usize, cols: Range<usize>) -> Vec<f32> {
        let c = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0].map(|c| c * FINENESS as f64);
        let weights = vec![-c[3], -c[2], -c[1], -c[0], 0.0, c[0], c[1], c[2], c[3]];
        let mut out = vec![0.0; cols.len()];
        self.add(row, cols, &Kernel { first: -4, weights }, &mut out);
        out
    }
}

/// Grey levels are kept to this fraction of white.
const RESOLUTION: f64 = (1u32 << 22) as f64;

/// Transfer function at the strip's own frequencies, from 0 to one cycle per pixel at most.
fn transfer_function(strip: &Strip, blur_px: f64) -> Vec<f64> {
    let coarse = strip.period_px * strip.fineness;
    let pi = std::f64::consts::PI;
    let at = |k: usize| {
        let f = k as f64 / strip.period_px as f64;
        let lens = libm::exp(-2.0 * (pi * f * blur_px) * (pi * f * blur_px));
        let area = if k == 0 {
            1.0
        } else {
            libm::sin(pi * f) / (pi * f)
        };
        // Falls smoothly to nothing over the last quarter of what the strip can hold.
        let edge = ((f / (0.5 * strip.fineness as f64) - 0.75) / 0.25).clamp(0.0, 1.0);
        lens * area * (0.5 + 0.5 * libm::cos(pi * edge))
    };
    (0..=coarse / 2).map(at).collect()
}

struct Buffers {
    coarse: Vec<Complex64>,
    fine: Vec<Complex64>,
    forward: Fourier,
    backward: Fourier,
}

impl Buffers {
    fn new(coarse: usize, fine: usize) -> Self {
        let zero = Complex64::default();
        Self {
            coarse: vec![zero; coarse],
            fine: vec![zero; fine],
            forward: Fourier::forward(coarse),
            backward: Fourier::inverse(fine),
        }
    }

    /// Leaves the blurred row in `fine`, times the length of `values`.
    fn blur(&mut self, values: &[f32], transfer: &[f64]) {
        for (c, &v) in self.coarse.iter_mut().zip(values) {
            *c = Complex64::new(f64::from(v), 0.0);
        }
        self.forward.transform(&mut self.coarse);
        self.fine.fill(Complex64::default());
        let n = self.fine.len();
        for (k, (&c, &t)) in self.coarse.iter().zip(transfer).enumerate() {
            self.fine[k] = c * t;
            if k > 0 {
                self.fine[n - k] = c.conj() * t;
            }
        }
        self.backward.transform(&mut self.fine);
    }
}

/// How much each neighbour on the fine grid counts for a pixel: the average over all instants of an
/// exposure of the interpolation at that instant's displacement. As interpolation is linear in the
/// values, the motion blur costs no more than the neighbours it reaches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kernel {
    first: i64,
    weights: Vec<f64>,
}

impl Kernel {
    /// Empties it.
    pub fn clear(&mut self) {
        self.weights.clear();
    }

    /// Adds an instant at which the pattern stands `shift_px` to the right, with a weight.
    pub fn add(&mut self, shift_px: f64, weight: f64) {
        let u = -shift_px * FINENESS as f64;
        let whole = libm::floor(u);
        let first = whole as i64 - 2;
        let lagrange = lagrange6(u - whole);
        if self.weights.is_empty() {
            self.first = first;
        }
        if first < self.first {
            let more = (self.first - first) as usize;
            self.weights.splice(0..0, std::iter::repeat_n(0.0, more));
            self.first = first;
        }
        let at = (first - self.first) as usize;
        if self.weights.len() < at + 6 {
            self.weights.resize(at + 6, 0.0);
        }
        for (w, l) in self.weights[at..].iter_mut().zip(lagrange) {
            *w += weight * l;
        }
    }
}

/// Weights of the values at -2 to 3 for the point `x`, 0 to 1.
pub(super) fn lagrange6(x: f64) -> [f64; 6] {
    let (a, b, c, d, e, f) = (x + 2.0, x + 1.0, x, x - 1.0, x - 2.0, x - 3.0);
    [
        -b * c * d * e * f / 120.0,
        a * c * d * e * f / 24.0,
        -a * b * d * e * f / 12.0,
        a * b * c * e * f / 12.0,
        -a * b * c * d * f / 24.0,
        a * b * c * d * e / 120.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// A strip with one cosine of `cycles` periods.
    fn cosine(period_px: usize, cycles: f64) -> Strip {
        let n = period_px * 2;
        let value = |k: usize| (0.5 + 0.4 * (TAU * cycles * k as f64 / n as f64).cos()) as f32;
        Strip {
            period_px,
            fineness: 2,
            values: (0..n).map(value).collect(),
        }
    }

    #[test]
    fn a_cosine_is_blurred_and_shifted_as_the_formula_says() {
        let (period, blur) = (96, 0.6);
        for cycles in [3.0, 20.0, 47.0, 60.0] {
            let f = cycles / period as f64;
            let gain = (-2.0 * (PI * f * blur).powi(2)).exp() * (PI * f).sin() / (PI * f);
            let texture = Texture::new(&cosine(period, cycles), blur, 0.0, 1.0);
            for shift in [0.0, 0.3, -0.0625, 5.111, -1000.3] {
                let row = texture.row(0, 5..90, shift);
                let slope = texture.slope(0, 5..90);
                for (k, (v, s)) in row.iter().zip(slope).enumerate() {
                    let x = 5.0 + k as f64;
                    let want = 0.5 + 0.4 * gain * (TAU * f * (x - shift)).cos();
                    assert!(
                        (f64::from(*v) - want).abs() < 1e-4 * gain + 1e-6,
                        "{cycles} {shift} {k}: {v} {want}"
                    );
                    let want = -0.4 * gain * TAU * f * (TAU * f * x).sin();
                    assert!(
                        (f64::from(s) - want).abs() < 1e-4 * gain + 1e-5,
                        "{cycles} {k}: slope {s} {want}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_kernel_is_the_average_of_its_instants() {
        let texture = Texture::new(&cosine(64, 7.0), 0.0, 0.1, 0.9);
        let mut kernel = Kernel::default();
        let shifts = [0.2, -3.7, 1.9, 0.21];
        for s in shifts {
            kernel.add(s, 0.25);
        }
        let mut blurred = vec![0.0; 64];
        texture.add(0, 0..64, &kernel, &mut blurred);
        let rows = shifts.map(|s| texture.row(0, 0..64, s));
        for (x, b) in blurred.iter().enumerate() {
            let mean = rows.iter().map(|r| r[x]).sum::<f32>() / 4.0;
            assert!((b - mean).abs() < 1e-5);
        }
    }
}
