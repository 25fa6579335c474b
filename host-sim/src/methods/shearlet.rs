//! The two-dimensional cone-adapted complex shearlet pyramid.
//!
//! The plane of frequencies is cut into a horizontal cone (|ω_x| ≥ |ω_y|) and a vertical one; each into scales, an
//! octave apart, and each scale into directions (shears) (Kutyniok and Labate 2012, in the band-limited form). A window
//! covers one side of a cone only, so its coefficients are complex and have a phase. All windows are divided by
//! the root of the sum of their squares: with the low-pass rest they are a tight frame, so [`Pyramid::join`] gives the
//! picture back. Nothing is decimated: a coefficient stands for every pixel.

use super::fourier::{C, Plane};

/// Directions of each scale, finest first, as in the thesis.
pub const DIRECTIONS: [usize; 4] = [5, 5, 3, 3];

/// Which way a window looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// Structure that changes across: what moves sideways.
    Horizontal,
    /// Structure that changes down.
    Vertical,
}

/// One sub-band.
#[derive(Clone, Debug)]
pub struct Band {
    /// Its cone.
    pub cone: Cone,
    /// 0 is the finest.
    pub scale: usize,
    /// Shear, ω_y/ω_x (horizontal cone) at its middle, −1 to 1.
    pub shear: f64,
    /// Window by frequency bin, of the tight frame.
    window: Vec<f64>,
}

/// All sub-bands for one picture size.
#[derive(Debug)]
pub struct Pyramid {
    plane: Plane,
    /// Sub-bands, the horizontal cone's first, finest first.
    pub bands: Vec<Band>,
    rest: Vec<f64>,
}

impl Pyramid {
    /// For pictures of this size, with so many directions a scale and cone, finest scale first.
    pub fn new(width: usize, height: usize, directions: &[usize]) -> Self {
        let plane = Plane::new(width, height);
        let bins = width * height;
        let mut bands = Vec::new();
        for cone in [Cone::Horizontal, Cone::Vertical] {
            for (scale, &count) in directions.iter().enumerate() {
                for k in 0..count {
                    let spacing = 2.0 / (count.max(2) - 1) as f64;
                    let shear = -1.0 + k as f64 * spacing;
                    let window = (0..bins)
                        .map(|bin| raw(&plane, bin, cone, scale, shear, spacing))
                        .collect();
                    bands.push(Band {
                        cone,
                        scale,
                        shear,
                        window,
                    });
                }
            }
        }
        let mut rest: Vec<f64> = (0..bins)
            .map(|bin| rest_window(&plane, bin, directions.len()))
            .collect();
        // A window and its mirror image (a real picture's other half) together make one.
        let mirror = |bin: usize| {
            let (x, y) = (bin % width, bin / width);
            (height - y) % height * width + (width - x) % width
        };
        let power: Vec<f64> = (0..bins)
            .map(|bin| {
                let both = |b: &Band| b.window[bin].powi(2) + b.window[mirror(bin)].powi(2);
                rest[bin].powi(2) + bands.iter().map(both).sum::<f64>()
            })
            .collect();
        for window in bands.iter_mut().map(|b| &mut b.window).chain([&mut rest]) {
            window
                .iter_mut()
                .zip(&power)
                .for_each(|(w, p)| *w /= p.sqrt());
        }
        Self { plane, bands, rest }
    }

    /// Spectrum of a picture, for [`Self::band`].
    pub fn spectrum(&self, picture: &[f64]) -> Vec<C> {
        self.plane.forward(picture)
    }

    /// Complex coefficients of one sub-band, one a pixel.
    pub fn band(&self, spectrum: &[C], band: usize) -> Vec<C> {
        let window = &self.bands[band].window;
        self.plane
            .inverse(spectrum.iter().zip(window).map(|(s, w)| s * w).collect())
    }

    /// Coefficients of all sub-bands, and the low-pass rest.
    pub fn split(&self, picture: &[f64]) -> (Vec<Vec<C>>, Vec<f64>) {
        let spectrum = self.spectrum(picture);
        let bands = (0..self.bands.len())
            .map(|b| self.band(&spectrum, b))
            .collect();
        let rest = spectrum
            .iter()
            .zip(&self.rest)
            .map(|(s, w)| s * w)
            .collect();
        (
            bands,
            self.plane.inverse(rest).iter().map(|v| v.re).collect(),
        )
    }

    /// The picture of its coefficients.
    pub fn join(&self, bands: &[Vec<C>], rest: &[f64]) -> Vec<f64> {
        let mut sum: Vec<C> = self
            .plane
            .forward(rest)
            .iter()
            .zip(&self.rest)
            .map(|(s, w)| s * w)
            .collect();
        let mut one_sided = vec![C::new(0.0, 0.0); sum.len()];
        for (band, coefficients) in self.bands.iter().zip(bands) {
            // Forward transform of complex coefficients: of their real and imaginary parts.
            let re = self
                .plane
                .forward(&coefficients.iter().map(|c| c.re).collect::<Vec<_>>());
            let im = self
                .plane
                .forward(&coefficients.iter().map(|c| c.im).collect::<Vec<_>>());
            for (i, slot) in one_sided.iter_mut().enumerate() {
                *slot += (re[i] + C::i() * im[i]) * band.window[i];
            }
        }
        let rest: Vec<f64> = self
            .plane
            .inverse(std::mem::take(&mut sum))
            .iter()
            .map(|v| v.re)
            .collect();
        let detail = self.plane.inverse(one_sided);
        rest.iter()
            .zip(&detail)
            .map(|(r, d)| r + 2.0 * d.re)
            .collect()
    }
}

/// A bump over −1 to 1 whose shifted squares sum to one.
fn bump(u: f64) -> f64 {
    if u.abs() < 1.0 {
        (0.5 * std::f64::consts::PI * u).cos()
    } else {
        0.0
    }
}

fn raw(plane: &Plane, bin: usize, cone: Cone, scale: usize, shear: f64, spacing: f64) -> f64 {
    let (x, y) = plane.frequency(bin);
    let (along, across) = match cone {
        Cone::Horizontal => (x, y),
        Cone::Vertical => (y, x),
    };
    if along <= 0.0 {
        return 0.0;
    }
    let octave = (along / std::f64::consts::PI).log2() + 0.5 + scale as f64;
    // The finest scale takes all that is above its middle.
    let radial = if scale == 0 && octave > 0.0 {
        1.0
    } else {
        bump(octave)
    };
    radial * bump((across / along - shear) / spacing)
}

/// What lies below the coarsest scale.
fn rest_window(plane: &Plane, bin: usize, scales: usize) -> f64 {
    let (x, y) = plane.frequency(bin);
    let largest = x.abs().max(y.abs());
    if largest == 0.0 {
        return 1.0;
    }
    let octave = (largest / std::f64::consts::PI).log2() + scales as f64 - 0.5;
    if octave < 0.0 { 1.0 } else { bump(octave) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_is_tight() {
        let (width, height) = (48, 36);
        let pyramid = Pyramid::new(width, height, &DIRECTIONS);
        let mut state = 1u32;
        let picture: Vec<f64> = (0..width * height)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1 << 24)
            })
            .collect();
        let (bands, rest) = pyramid.split(&picture);
        let back = pyramid.join(&bands, &rest);
        let worst = back
            .iter()
            .zip(&picture)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-10, "{worst}");
        // Energy is kept: a one-sided band counts for both sides.
        let energy = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        let detail: f64 = bands.iter().flatten().map(|c| 2.0 * c.norm_sqr()).sum();
        assert!((detail + energy(&rest) - energy(&picture)).abs() < 1e-8 * energy(&picture));
    }

    #[test]
    fn a_sheared_wave_lands_in_its_direction() {
        let size = 64;
        let pyramid = Pyramid::new(size, size, &DIRECTIONS);
        for shear in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            // 16 periods across; shear·16 down: the octave of scale 0 to 1.
            let wave: Vec<f64> = (0..size * size)
                .map(|i| {
                    let (x, y) = ((i % size) as f64, (i / size) as f64);
                    (std::f64::consts::TAU * 16.0 / size as f64 * (x + shear * y)).cos()
                })
                .collect();
            let spectrum = pyramid.spectrum(&wave);
            let energy = |b: usize| {
                pyramid
                    .band(&spectrum, b)
                    .iter()
                    .map(|c| c.norm_sqr())
                    .sum::<f64>()
            };
            let own: f64 = (0..pyramid.bands.len())
                .filter(|&b| (pyramid.bands[b].shear - shear).abs() < 1e-9 || shear.abs() > 0.9)
                .map(energy)
                .sum();
            let all: f64 = (0..pyramid.bands.len()).map(energy).sum();
            assert!(own > 0.99 * all, "shear {shear}: {}", own / all);
        }
    }
}
