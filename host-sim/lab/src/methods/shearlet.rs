//! The two-dimensional cone-adapted complex shearlet pyramid.
//!
//! The plane of frequencies is cut into a horizontal cone (|ω_x| ≥ |ω_y|) and a vertical one; each into scales, an
//! octave apart, and each scale into directions (shears) (Kutyniok and Labate 2012, in the band-limited form). With
//! the low-pass rest the windows are a tight frame ([`super::bank`]).

use super::bank::{Bank, bump};
use super::fourier::Plane;

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Its cone.
    pub cone: Cone,
    /// 0 is the finest.
    pub scale: usize,
    /// Shear, ω_y/ω_x (horizontal cone) at its middle, −1 to 1.
    pub shear: f64,
    /// From one shear of this scale to the next.
    pub spacing: f64,
}

impl Band {
    /// Its window at a frequency, radians a pixel, before the frame is made tight.
    fn at(&self, (x, y): (f64, f64)) -> f64 {
        let (along, across) = match self.cone {
            Cone::Horizontal => (x, y),
            Cone::Vertical => (y, x),
        };
        if along <= 0.0 {
            return 0.0;
        }
        let octave = (along / std::f64::consts::PI).log2() + 0.5 + self.scale as f64;
        // The finest scale takes all that is above its middle.
        let radial = if self.scale == 0 && octave > 0.0 {
            1.0
        } else {
            bump(octave)
        };
        radial * bump((across / along - self.shear) / self.spacing)
    }
}

/// All sub-bands for one picture size.
#[derive(Debug)]
pub struct Pyramid {
    /// Sub-bands, the horizontal cone's first, finest first.
    pub bands: Vec<Band>,
    /// Their windows, in the same order, and the low-pass rest.
    pub bank: Bank,
}

impl Pyramid {
    /// For pictures of this size, with so many directions a scale and cone, finest scale first.
    pub fn new(width: usize, height: usize, directions: &[usize]) -> Self {
        let plane = Plane::new(width, height);
        let frequencies: Vec<(f64, f64)> =
            (0..width * height).map(|b| plane.frequency(b)).collect();
        let mut bands = Vec::new();
        for cone in [Cone::Horizontal, Cone::Vertical] {
            for (scale, &count) in directions.iter().enumerate() {
                let spacing = 2.0 / (count.max(2) - 1) as f64;
                bands.extend((0..count).map(|k| Band {
                    cone,
                    scale,
                    shear: -1.0 + k as f64 * spacing,
                    spacing,
                }));
            }
        }
        let by_bin =
            |window: &dyn Fn((f64, f64)) -> f64| frequencies.iter().map(|&f| window(f)).collect();
        let windows = bands.iter().map(|band| by_bin(&|f| band.at(f))).collect();
        let rest = by_bin(&|f| rest(f, directions.len()));
        Self {
            bank: Bank::new(plane, windows, vec![rest]),
            bands,
        }
    }
}

/// What lies below the coarsest scale.
fn rest((x, y): (f64, f64), scales: usize) -> f64 {
    let largest = x.abs().max(y.abs());
    if largest == 0.0 {
        return 1.0;
    }
    let octave = (largest / std::f64::consts::PI).log2() + scales as f64 - 0.5;
    if octave < 0.0 { 1.0 } else { bump(octave) }
}

#[cfg(test)]
mod tests {
    use super::super::bank::tests::{shares, tightness, wave};
    use super::*;

    #[test]
    fn the_frame_is_tight_at_any_size() {
        for (width, height) in [(48, 36), (65, 131), (104, 64)] {
            let (error, energy) = tightness(&Pyramid::new(width, height, &DIRECTIONS).bank);
            assert!(
                error < 1e-12 && energy < 1e-12,
                "{width}x{height}: {error} {energy}"
            );
        }
    }

    #[test]
    fn two_cones_of_sixteen_directions() {
        let bands = Pyramid::new(32, 32, &DIRECTIONS).bands;
        let of = |cone| bands.iter().filter(|b| b.cone == cone).count();
        assert_eq!((of(Cone::Horizontal), of(Cone::Vertical)), (16, 16));
        let shears: Vec<f64> = bands[..5].iter().map(|b| b.shear).collect();
        assert_eq!(shears, [-1.0, -0.5, 0.0, 0.5, 1.0]);
    }

    /// Share of a wave's energy in the directions of `cone` within `reach` spacings of `shear`, all scales.
    fn near(pyramid: &Pyramid, shares: &[f64], cone: Cone, shear: f64, reach: f64) -> f64 {
        let bands = pyramid.bands.iter().zip(shares);
        bands
            .filter(|(b, _)| b.cone == cone && ((b.shear - shear) / b.spacing).abs() <= reach)
            .map(|(_, s)| s)
            .sum()
    }

    /// A wave in the middle of a direction is nowhere else; from one direction to the next its energy goes over
    /// evenly and reaches no third one.
    #[test]
    fn a_sheared_wave_lands_in_its_direction() {
        let size = 64;
        let pyramid = Pyramid::new(size, size, &DIRECTIONS);
        // Sixteen periods along: between the two finest scales, which have five directions.
        let sheared = |cone, shear: f64| {
            let picture = match cone {
                Cone::Horizontal => wave(size, size, 16.0, 16.0 * shear),
                Cone::Vertical => wave(size, size, 16.0 * shear, 16.0),
            };
            shares(&pyramid.bank, &picture)
        };
        for cone in [Cone::Horizontal, Cone::Vertical] {
            for shear in [-0.5, 0.0, 0.5] {
                let own = near(&pyramid, &sheared(cone, shear), cone, shear, 0.01);
                assert!(own > 0.999_999, "{cone:?} {shear}: {own}");
            }
            for shear in [-0.25, 0.25] {
                let shares = sheared(cone, shear);
                let both = near(&pyramid, &shares, cone, shear, 0.51);
                let one = near(&pyramid, &shares, cone, shear.signum() * 0.5, 0.01);
                assert!(
                    both > 0.999_999 && (one - 0.5).abs() < 1e-6,
                    "{shear}: {both} {one}"
                );
            }
        }
        // On the diagonal the cones meet and share.
        let diagonal = sheared(Cone::Horizontal, 1.0);
        let [h, v] =
            [Cone::Horizontal, Cone::Vertical].map(|c| near(&pyramid, &diagonal, c, 1.0, 0.01));
        assert!((h - 0.5).abs() < 1e-6 && (v - 0.5).abs() < 1e-6, "{h} {v}");
    }

    #[test]
    fn a_wave_lands_in_its_octave() {
        let size = 128;
        let pyramid = Pyramid::new(size, size, &DIRECTIONS);
        // Middles of the scales: π/√2, and an octave lower each.
        for scale in 1..4 {
            let periods = (64.0 / f64::powf(2.0, scale as f64 + 0.5)).round();
            let shares = shares(&pyramid.bank, &wave(size, size, periods, 0.0));
            let own: f64 = pyramid
                .bands
                .iter()
                .zip(&shares)
                .filter(|(b, _)| b.scale == scale && b.shear == 0.0 && b.cone == Cone::Horizontal)
                .map(|(_, s)| s)
                .sum();
            assert!(own > 0.98, "scale {scale}: {own}");
        }
    }
}
