//! The Visual Microphone (Davis et al. 2014) on a complex steerable pyramid (Simoncelli and Freeman 1995; Portilla
//! and Simoncelli 2000): phase against the first frame, weighted by squared amplitude, sub-bands aligned and summed.
//!
//! Row by row for a rolling shutter. The original sums phases in radians, whose scale depends on the texture; here
//! each sub-band's phase is divided by its own frequency across (in its energy's middle), so the result is in px.

use super::fourier::{C, Plane};
use super::thesis::align_and_sum;
use super::{Clip, Method, Shifts};
use std::f64::consts::{FRAC_PI_2, PI};

/// Scales of the pyramid.
const SCALES: usize = 4;
/// Orientations: across and down.
const ORIENTATIONS: usize = 2;

/// The Visual Microphone.
#[derive(Clone, Copy, Debug)]
pub struct VisualMicrophone;

impl Method for VisualMicrophone {
    fn name(&self) -> &'static str {
        "Visual Microphone"
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let plane = Plane::new(clip.width, clip.height);
        let spectra: Vec<Vec<C>> = clip.frames.iter().map(|f| plane.forward(f)).collect();
        let mut signals = Vec::new();
        for scale in 0..SCALES {
            for orientation in 0..ORIENTATIONS {
                let window = window(&plane, scale, orientation);
                let across = mean_frequency(&plane, &spectra[0], &window);
                // Down: what moves sideways does not show there.
                if across < 1e-2 {
                    continue;
                }
                signals.push(row_phases(&plane, &spectra, &window, across));
            }
        }
        align_and_sum(signals)
    }
}

/// One-sided window of an octave and an orientation (cos θ, its other half cut off).
fn window(plane: &Plane, scale: usize, orientation: usize) -> Vec<f64> {
    (0..plane.width * plane.height)
        .map(|bin| {
            let (x, y) = plane.frequency(bin);
            let radius = x.hypot(y);
            if radius == 0.0 {
                return 0.0;
            }
            let octave = (radius / PI).log2() + 0.5 + scale as f64;
            let radial = if octave.abs() < 1.0 {
                (FRAC_PI_2 * octave).cos()
            } else {
                0.0
            };
            let angle = y.atan2(x) - PI * orientation as f64 / ORIENTATIONS as f64;
            radial * angle.cos().max(0.0)
        })
        .collect()
}

/// Frequency across that a shift turns this band's phase by, rad/px, by energy.
fn mean_frequency(plane: &Plane, spectrum: &[C], window: &[f64]) -> f64 {
    let (mut sum, mut weight) = (0.0, 1e-300);
    for (bin, (s, w)) in spectrum.iter().zip(window).enumerate() {
        let energy = s.norm_sqr() * w * w;
        sum += energy * plane.frequency(bin).0;
        weight += energy;
    }
    sum / weight
}

/// Mean phase of each row against the first frame, weighted by squared amplitude, in px.
fn row_phases(plane: &Plane, spectra: &[Vec<C>], window: &[f64], across: f64) -> Shifts {
    let band = |s: &Vec<C>| plane.inverse(s.iter().zip(window).map(|(s, w)| s * w).collect());
    let reference = band(&spectra[0]);
    spectra
        .iter()
        .map(|spectrum| {
            band(spectrum)
                .chunks_exact(plane.width)
                .zip(reference.chunks_exact(plane.width))
                .map(|(row, reference)| {
                    let (mut sum, mut weight) = (0.0, 1e-300);
                    for (c, r) in row.iter().zip(reference) {
                        let amplitude = c.norm_sqr();
                        sum += amplitude * (c * r.conj()).arg();
                        weight += amplitude;
                    }
                    // A shift to the right turns phases back.
                    -sum / weight / across
                })
                .collect()
        })
        .collect()
}
