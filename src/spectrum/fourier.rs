//! The energies of an even grid's frequencies, in place.
//!
//! With the feature `grid-32768` the transform is microfft's, a function a size with a common table: on a desktop a
//! window takes a fifth less time so. Without it one loop serves all sizes, without a table, and a microcontroller's
//! flash is 14 KiB smaller: real points are taken in pairs as complex numbers, transformed by halves (radix 2,
//! decimation in time; Cooley and Tukey 1965) and untangled.

#[cfg(any(test, not(feature = "grid-32768")))]
mod compact;
#[cfg(feature = "grid-32768")]
mod unrolled;

#[cfg(not(feature = "grid-32768"))]
use compact::transform;
#[cfg(feature = "grid-32768")]
use unrolled::transform;

/// |Σ x\[t\]·e^(-2πi·kt/n)|² for k = 0 to n/2 - 1 of n = `points.len()` points: a power of two from 64 to
/// 32 768 (8192 without the feature `grid-32768`). `None` for other lengths.
pub(crate) fn energies(points: &mut [f32]) -> Option<&[f32]> {
    transform(points)?;
    let bins = points.len() / 2;
    for k in 0..bins {
        let (Some(&re), Some(&im)) = (points.get(2 * k), points.get(2 * k + 1)) else {
            break;
        };
        if let Some(energy) = points.get_mut(k) {
            *energy = re * re + im * im;
        }
    }
    points.get(..bins)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{compact, energies, transform};
    use std::vec::Vec;

    type Transform = fn(&mut [f32]) -> Option<()>;

    #[test]
    fn all_bins_are_those_of_the_sum_that_defines_them() {
        for n in [64usize, 128, 512, 2048] {
            let points: Vec<f32> = (0..n)
                .map(|t| ((t * t * 7 + 3 * t) % 101) as f32 / 50.0 - 1.0 + 0.3 * (t % 2) as f32)
                .collect();
            let size = points.iter().map(|&x| f64::from(x * x)).sum::<f64>().sqrt();
            for transform in [transform as Transform, compact::transform] {
                let mut work = points.clone();
                transform(&mut work).unwrap();
                for (k, bin) in work.chunks_exact(2).enumerate() {
                    let (mut re, mut im) = (0.0, 0.0);
                    for (t, &x) in points.iter().enumerate() {
                        let angle = std::f64::consts::TAU * (k * t % n) as f64 / n as f64;
                        re += f64::from(x) * angle.cos();
                        im -= f64::from(x) * angle.sin();
                    }
                    let error = (f64::from(bin[0]) - re).hypot(f64::from(bin[1]) - im);
                    assert!(error < 2e-6 * size, "bin {k} of {n} points: {error}");
                }
            }
        }
    }

    #[test]
    fn a_tone_stands_in_its_bin_of_a_long_grid() {
        let n = 8192;
        let mut points: Vec<f32> = (0..n)
            .map(|t| (std::f64::consts::TAU * (t * 1003 % n) as f64 / n as f64).cos() as f32)
            .collect();
        let energies = energies(&mut points).unwrap();
        assert_eq!(energies.len(), n / 2);
        for (k, energy) in energies.iter().enumerate() {
            let height = energy.sqrt() / (0.5 * n as f32);
            let expected = if k == 1003 { 1.0 } else { 0.0 };
            assert!((height - expected).abs() < 1e-6, "bin {k}: {height}");
        }
    }

    #[test]
    fn other_lengths_are_refused() {
        for n in [0, 1, 2, 3, 6, 100, 65_536] {
            assert!(transform(&mut std::vec![1.0; n]).is_none(), "{n}");
            assert!(compact::transform(&mut std::vec![1.0; n]).is_none(), "{n}");
        }
    }
}
