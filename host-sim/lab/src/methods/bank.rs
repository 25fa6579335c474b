//! A bank of windows in the plane of frequencies that is a tight frame: the picture comes back from its coefficients.
//!
//! A window covers one side of the plane only, so its coefficients are complex and have a phase; a rest covers both
//! sides and its coefficients are real. Nothing is decimated: a coefficient stands for every pixel.

use super::fourier::{C, Plane};

/// Windows and rests for one picture size.
#[derive(Debug)]
pub struct Bank {
    plane: Plane,
    windows: Vec<Vec<f64>>,
    /// Columns in which a window is not zero.
    columns: Vec<Vec<usize>>,
    rests: Vec<Vec<f64>>,
}

/// Coefficients of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// Of each window, one a pixel.
    pub bands: Vec<Vec<C>>,
    /// Of each rest, one a pixel.
    pub rests: Vec<Vec<f64>>,
}

impl Coefficients {
    /// Sum of squares: of a tight frame, that of the picture. A one-sided window counts for both sides.
    pub fn energy(&self) -> f64 {
        let bands = self.bands.iter().flatten().map(|c| 2.0 * c.norm_sqr());
        let rests = self.rests.iter().flatten().map(|v| v * v);
        bands.chain(rests).sum()
    }
}

impl Bank {
    /// Of windows and rests by frequency bin, all divided by the root of the sum of their squares (a window and its
    /// mirror image, a real picture's other half, together make one). No bin may be without any.
    pub fn new(plane: Plane, mut windows: Vec<Vec<f64>>, mut rests: Vec<Vec<f64>>) -> Self {
        let power: Vec<f64> = (0..plane.width * plane.height)
            .map(|bin| {
                let mirror = plane.mirror(bin);
                let both = |w: &Vec<f64>| w[bin].powi(2) + w[mirror].powi(2);
                windows.iter().map(both).sum::<f64>()
                    + rests.iter().map(|r| r[bin].powi(2)).sum::<f64>()
            })
            .collect();
        for window in windows.iter_mut().chain(&mut rests) {
            window
                .iter_mut()
                .zip(&power)
                .for_each(|(w, p)| *w /= p.sqrt());
        }
        let width = plane.width;
        let columns = windows
            .iter()
            .map(|window| {
                let used = |&x: &usize| window.iter().skip(x).step_by(width).any(|v| *v != 0.0);
                (0..width).filter(used).collect()
            })
            .collect();
        Self {
            plane,
            windows,
            columns,
            rests,
        }
    }

    /// The pictures' size and transforms.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// A window, by frequency bin.
    pub fn window(&self, band: usize) -> &[f64] {
        &self.windows[band]
    }

    /// Spectrum of a picture, for [`Self::band`].
    pub fn spectrum(&self, picture: &[f64]) -> Vec<C> {
        self.plane.forward(picture)
    }

    /// Complex coefficients of one window, one a pixel.
    pub fn band(&self, spectrum: &[C], band: usize) -> Vec<C> {
        self.plane
            .inverse_within(spectrum, &self.windows[band], &self.columns[band])
    }

    /// Coefficients of all windows and rests.
    pub fn split(&self, picture: &[f64]) -> Coefficients {
        let spectrum = self.spectrum(picture);
        let real = |rest: &Vec<f64>| {
            let coefficients = self.plane.inverse(times(&spectrum, rest));
            coefficients.iter().map(|v| v.re).collect()
        };
        Coefficients {
            bands: (0..self.windows.len())
                .map(|b| self.band(&spectrum, b))
                .collect(),
            rests: self.rests.iter().map(real).collect(),
        }
    }

    /// The picture of its coefficients.
    pub fn join(&self, coefficients: &Coefficients) -> Vec<f64> {
        let mut sum = vec![C::new(0.0, 0.0); self.plane.width * self.plane.height];
        let mut add = |spectrum: Vec<C>, window: &[f64], times: f64| {
            for ((slot, s), w) in sum.iter_mut().zip(spectrum).zip(window) {
                *slot += s * w * times;
            }
        };
        for (band, window) in coefficients.bands.iter().zip(&self.windows) {
            add(self.plane.forward_complex(band.clone()), window, 2.0);
        }
        for (rest, window) in coefficients.rests.iter().zip(&self.rests) {
            add(self.plane.forward(rest), window, 1.0);
        }
        self.plane.inverse(sum).iter().map(|v| v.re).collect()
    }
}

fn times(spectrum: &[C], window: &[f64]) -> Vec<C> {
    spectrum.iter().zip(window).map(|(s, w)| s * w).collect()
}

/// A bump over −1 to 1 whose squares, shifted by one, sum to one.
pub fn bump(u: f64) -> f64 {
    if u.abs() < 1.0 {
        (std::f64::consts::FRAC_PI_2 * u).cos()
    } else {
        0.0
    }
}

/// Shared by the tests of the banks.
#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// White noise, the same every time.
    pub(crate) fn noise(count: usize) -> Vec<f64> {
        let mut chance = rowtone_chance::Quick(1);
        (0..count).map(|_| chance.unit()).collect()
    }

    /// A wave of so many periods across and down.
    pub(crate) fn wave(width: usize, height: usize, across: f64, down: f64) -> Vec<f64> {
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64, (i / width) as f64);
                let turns = across * x / width as f64 + down * y / height as f64;
                (std::f64::consts::TAU * turns).cos()
            })
            .collect()
    }

    /// Reconstruction error (largest, of noise from 0 to 1), and how far the energy is off, relative.
    pub(crate) fn tightness(bank: &Bank) -> (f64, f64) {
        let picture = noise(bank.plane.width * bank.plane.height);
        let coefficients = bank.split(&picture);
        let worst = bank
            .join(&coefficients)
            .iter()
            .zip(&picture)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        let energy: f64 = picture.iter().map(|v| v * v).sum();
        (worst, (coefficients.energy() / energy - 1.0).abs())
    }

    /// Energy of each window's coefficients of a picture, over the sum of all.
    pub(crate) fn shares(bank: &Bank, picture: &[f64]) -> Vec<f64> {
        let spectrum = bank.spectrum(picture);
        let energies: Vec<f64> = (0..bank.windows.len())
            .map(|b| bank.band(&spectrum, b).iter().map(|c| c.norm_sqr()).sum())
            .collect();
        let all: f64 = energies.iter().sum();
        energies.iter().map(|e| e / all).collect()
    }
}
