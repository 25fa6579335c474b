//! Where the stripes are: a first guess of their number in a frame, from the periodogram.

use rowtone_fourier::{Complex64, Fourier};

/// Power of all frames against stripes per row: `(stripes per row of bin 1, power of each bin)`, up to half a stripe a row.
///
/// Each frame is tapered (Hann) and padded to at least eight times its length, so that a peak is met within 1/16 stripe.
pub fn periodogram(frames: &[Vec<f64>]) -> (f64, Vec<f64>) {
    let rows = frames.first().map_or(0, Vec::len);
    let size = (8 * rows.max(1)).next_power_of_two();
    let mut fourier = Fourier::forward(size);
    let mut power = vec![0.0; size / 2];
    for frame in frames {
        let mut buffer = vec![Complex64::default(); size];
        for (y, (slot, &value)) in buffer.iter_mut().zip(frame).enumerate() {
            let taper = (std::f64::consts::PI * (y as f64 + 0.5) / rows as f64)
                .sin()
                .powi(2);
            slot.re = value * taper;
        }
        fourier.transform(&mut buffer);
        for (sum, value) in power.iter_mut().zip(&buffer) {
            *sum += value.norm_sqr();
        }
    }
    (1.0 / size as f64, power)
}

/// The `count` highest local maxima at or above `min_per_row`, highest first, stripes per row.
pub fn candidates(step: f64, power: &[f64], min_per_row: f64, count: usize) -> Vec<f64> {
    let first = ((min_per_row / step).ceil() as usize).max(1);
    let mut peaks: Vec<(f64, f64)> = (first..power.len().saturating_sub(1))
        .filter(|&k| power[k] >= power[k - 1] && power[k] > power[k + 1])
        .map(|k| {
            // A parabola through the logarithms of three bins.
            let [a, b, c] =
                [power[k - 1], power[k], power[k + 1]].map(|p| p.max(f64::MIN_POSITIVE).ln());
            let bend = a - 2.0 * b + c;
            let offset = if bend < 0.0 {
                0.5 * (a - c) / bend
            } else {
                0.0
            };
            ((k as f64 + offset.clamp(-0.5, 0.5)) * step, power[k])
        })
        .collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.truncate(count);
    peaks.into_iter().map(|p| p.0).collect()
}

/// Share of the power that lies in the peak at `per_row` and its multiples, 0 to 1.
pub fn share(step: f64, power: &[f64], rows: usize, per_row: f64) -> f64 {
    let total: f64 = power.iter().sum();
    let half_width = (2.0 / (rows as f64 * step)) as isize;
    let mut inside = 0.0;
    for harmonic in 1..=8 {
        let centre = (harmonic as f64 * per_row / step).round() as isize;
        let low = (centre - half_width).max(0) as usize;
        let high = ((centre + half_width).max(0) as usize).min(power.len().saturating_sub(1));
        if low < high {
            inside += power[low..=high].iter().sum::<f64>();
        }
    }
    if total > 0.0 {
        (inside / total).min(1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_stripes() {
        let frame: Vec<f64> = (0..480).map(|y| (0.131 * y as f64).sin()).collect();
        let (step, power) = periodogram(&[frame]);
        let found = candidates(step, &power, 1.0 / 480.0, 3);
        let truth = 0.131 / std::f64::consts::TAU;
        assert!(
            (found[0] - truth).abs() < 0.05 / 480.0,
            "{} for {truth}",
            found[0]
        );
        assert!(share(step, &power, 480, found[0]) > 0.9);
    }
}
