//! Tones as Hann's window shows them where no time is missing.

use std::f64::consts::PI;

use rowtone::report::Peak;

/// Zero-to-peak amplitude of a tone along axis 0, x, or 1, y, px; 0 where it is not known.
pub(super) fn along_px(peak: &Peak, axis: usize) -> f64 {
    let whole = f64::from(peak.amplitude_px);
    let Some(motion) = &peak.motion else {
        return if axis == 0 { whole } else { 0.0 };
    };
    if let Some(across) = motion.across_rad {
        let across = f64::from(across);
        return whole * [across.cos(), across.sin()][axis & 1].abs();
    }
    [motion.x_px, motion.y_px][axis & 1].map_or(0.0, f64::from)
}

/// What Hann's window of this length, s, shows of a tone so far away, Hz: 1 at it, 0 from two cells on but for side lobes.
pub(super) fn hann(away_hz: f64, window_s: f64) -> f64 {
    let cells = away_hz * window_s;
    if cells.abs() < 1e-6 {
        return 1.0;
    }
    if (cells.abs() - 1.0).abs() < 1e-6 {
        return 0.5;
    }
    (PI * cells).sin() / (PI * cells) / (1.0 - cells * cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_is_that_of_the_sum_over_its_times() {
        for cells in [0.0, 0.25, 0.5, 0.999_999_9, 1.0, 1.5, 2.0, 3.5, 20.5] {
            let n = 4000;
            let (mut sum, mut total) = (0.0, 0.0);
            for i in 0..n {
                let t = (f64::from(i) + 0.5) / f64::from(n) - 0.5;
                let w = (PI * t).cos().powi(2);
                sum += w * (2.0 * PI * cells * t).cos();
                total += w;
            }
            let want = sum / total;
            assert!((hann(cells / 4.0, 4.0) - want).abs() < 1e-5, "{cells}");
        }
    }
}
