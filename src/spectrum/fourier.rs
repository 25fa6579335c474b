//! The energies of an even grid's frequencies, in place: microfft's transforms, a function a size with
//! a common table.

use microfft::real;

/// Most points of [`EstimatorStorage::grid`](super::EstimatorStorage::grid) that are used.
pub(crate) const MAX_GRID: usize = 32_768;

/// |Σ x\[t\]·e^(-2πi·kt/n)|² for k = 0 to n/2 - 1 of n = `points.len()` points: a power of two from 64 to
/// 32 768. `None` for other lengths.
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

/// From n points, a power of two from 64 to 32 768, to real and imaginary part of bins 0 to n/2 - 1. `None` for other
/// lengths.
fn transform(points: &mut [f32]) -> Option<()> {
    macro_rules! by_size {
        ($($size:literal => $fft:ident),*) => {
            match points.len() {
                $($size => {
                    let points: &mut [f32; $size] = points.try_into().ok()?;
                    let bins = real::$fft(points);
                    // There the highest frequency's is kept.
                    bins[0].im = 0.0;
                })*
                _ => return None,
            }
        };
    }
    by_size!(
        64 => rfft_64, 128 => rfft_128, 256 => rfft_256, 512 => rfft_512, 1024 => rfft_1024,
        2048 => rfft_2048, 4096 => rfft_4096, 8192 => rfft_8192, 16384 => rfft_16384, 32768 => rfft_32768
    );
    Some(())
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{energies, transform};
    use std::vec::Vec;

    #[test]
    fn all_bins_are_those_of_the_sum_that_defines_them() {
        for n in [64usize, 128, 512, 2048] {
            let points: Vec<f32> = (0..n)
                .map(|t| ((t * t * 7 + 3 * t) % 101) as f32 / 50.0 - 1.0 + 0.3 * (t % 2) as f32)
                .collect();
            let size = points.iter().map(|&x| f64::from(x * x)).sum::<f64>().sqrt();
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
        }
    }
}
