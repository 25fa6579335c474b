//! A function a size, and a table: microfft.

use microfft::real;

/// From n points, a power of two from 64 to 32 768, to real and imaginary part of bins 0 to n/2 - 1. `None` for other
/// lengths.
pub(super) fn transform(points: &mut [f32]) -> Option<()> {
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
