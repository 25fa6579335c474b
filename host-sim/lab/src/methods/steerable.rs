//! The complex steerable pyramid (Simoncelli and Freeman 1995; Portilla and Simoncelli 2000), undecimated.
//!
//! Octaves by radius, orientations by cos θ, of which only the half that looks forwards is kept, so that coefficients
//! are complex; a high-pass rest in the corners and a low-pass rest in the middle.

use super::bank::{Bank, bump};
use super::fourier::Plane;
use std::f64::consts::PI;

/// Scales of the Visual Microphone's pyramid.
pub const SCALES: usize = 4;
/// Its orientations: across and down.
pub const ORIENTATIONS: usize = 2;

/// One sub-band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// 0 is the finest.
    pub scale: usize,
    /// Direction in which it looks, rad from across to down.
    pub angle: f64,
}

/// All sub-bands for one picture size.
#[derive(Debug)]
pub struct Pyramid {
    /// Sub-bands, finest first.
    pub bands: Vec<Band>,
    /// Their windows, in the same order; high-pass and low-pass rest.
    pub bank: Bank,
}

impl Pyramid {
    /// For pictures of this size.
    pub fn new(width: usize, height: usize, scales: usize, orientations: usize) -> Self {
        let plane = Plane::new(width, height);
        let frequencies: Vec<(f64, f64)> =
            (0..width * height).map(|b| plane.frequency(b)).collect();
        let mut bands = Vec::new();
        for scale in 0..scales {
            bands.extend((0..orientations).map(|k| Band {
                scale,
                angle: PI * k as f64 / orientations as f64,
            }));
        }
        let by_bin =
            |window: &dyn Fn((f64, f64)) -> f64| frequencies.iter().map(|&f| window(f)).collect();
        let windows = bands
            .iter()
            .map(|band| {
                by_bin(&|(x, y)| {
                    let turn = (y.atan2(x) - band.angle).cos().max(0.0);
                    bump(octave(x, y) + band.scale as f64) * turn.powi(orientations as i32 - 1)
                })
            })
            .collect();
        let high = by_bin(&|(x, y)| side(octave(x, y)));
        let low = by_bin(&|(x, y)| side(-(octave(x, y) + scales as f64 - 1.0)));
        Self {
            bank: Bank::new(plane, windows, vec![high, low]),
            bands,
        }
    }
}

/// Octaves above the middle of the finest scale, π/√2.
fn octave(x: f64, y: f64) -> f64 {
    (x.hypot(y) / PI).log2() + 0.5
}

/// What is left above 0: rises with the bump's falling side, one from 1 on.
fn side(u: f64) -> f64 {
    if u >= 1.0 {
        1.0
    } else if u > 0.0 {
        bump(u - 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::bank::tests::{shares, tightness, wave};
    use super::*;

    #[test]
    fn the_frame_is_tight_at_any_size() {
        for (width, height) in [(48, 36), (65, 131), (104, 64)] {
            let pyramid = Pyramid::new(width, height, SCALES, ORIENTATIONS);
            let (error, energy) = tightness(&pyramid.bank);
            assert!(
                error < 1e-12 && energy < 1e-12,
                "{width}x{height}: {error} {energy}"
            );
        }
    }

    /// Orientations take cos² and sin² of a wave's energy, wherever it looks: it is steerable.
    #[test]
    fn a_turned_wave_is_shared_by_its_angle() {
        let size = 96;
        let pyramid = Pyramid::new(size, size, SCALES, ORIENTATIONS);
        for (across, down) in [
            (12.0, 0.0),
            (12.0, 5.0),
            (9.0, 9.0),
            (4.0, 12.0),
            (0.0, 12.0),
        ] {
            let shares = shares(&pyramid.bank, &wave(size, size, across, down));
            let bands = pyramid.bands.iter().zip(shares);
            let first: f64 = bands.filter(|(b, _)| b.angle == 0.0).map(|(_, s)| s).sum();
            let expected = across * across / (across * across + down * down);
            assert!((first - expected).abs() < 1e-9, "{across} {down}: {first}");
        }
    }

    #[test]
    fn a_wave_lands_in_its_octave() {
        let size = 128;
        let pyramid = Pyramid::new(size, size, SCALES, ORIENTATIONS);
        for scale in 0..SCALES {
            let periods = (64.0 / f64::powf(2.0, scale as f64 + 0.5)).round();
            let shares = shares(&pyramid.bank, &wave(size, size, periods, 0.0));
            let bands = pyramid.bands.iter().zip(shares);
            let own: f64 = bands
                .filter(|(b, _)| b.scale == scale)
                .map(|(_, s)| s)
                .sum();
            assert!(own > 0.98, "scale {scale}: {own}");
        }
    }
}
