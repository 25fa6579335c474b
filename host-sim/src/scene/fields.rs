//! Random fields and their blurring: what speckle and photographs are made of.

use rand_distr::{Distribution, StandardNormal};
use rowtone_fourier::{Complex64, Fourier};

use crate::random::stream;

/// White noise of variance 1.
pub(super) fn noise(len: usize, seed: u64) -> Vec<f32> {
    let mut rng = stream(seed, 2, 0);
    (0..len).map(|_| StandardNormal.sample(&mut rng)).collect()
}

/// A periodic random field with amplitude 1/f^`power`, mean 0, standard deviation 1.
pub(super) fn one_over_f(width: usize, rows: usize, power: f64, seed: u64) -> Vec<f64> {
    // Twice the height, so that top and bottom are strangers.
    let height = rows * 2;
    let mut field: Vec<Complex64> = noise(width * height, seed)
        .iter()
        .map(|&v| Complex64::new(f64::from(v), 0.0))
        .collect();
    transform(&mut field, width, height, Fourier::forward);
    for (i, c) in field.iter_mut().enumerate() {
        let turn = |k: usize, n: usize| k.min(n - k) as f64 / n as f64;
        let (fx, fy) = (turn(i % width, width), turn(i / width, height));
        let f2 = fx * fx + fy * fy;
        let gain = if f2 > 0.0 {
            libm::pow(f2, -0.5 * power)
        } else {
            0.0
        };
        *c *= gain;
    }
    transform(&mut field, width, height, Fourier::inverse);
    let out: Vec<f64> = field.iter().take(width * rows).map(|c| c.re).collect();
    let n = out.len() as f64;
    let mean = out.iter().sum::<f64>() / n;
    let sd = (out.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
        .sqrt()
        .max(1e-300);
    out.iter().map(|v| (v - mean) / sd).collect()
}

/// Fourier transform over rows, then columns, in place.
pub(super) fn transform(
    field: &mut [Complex64],
    width: usize,
    height: usize,
    direction: fn(usize) -> Fourier,
) {
    direction(width).transform(field);
    let mut along = direction(height);
    let mut column = vec![Complex64::default(); height];
    for x in 0..width {
        for (c, row) in column.iter_mut().zip(field.chunks(width)) {
            *c = row[x];
        }
        along.transform(&mut column);
        for (c, row) in column.iter().zip(field.chunks_mut(width)) {
            row[x] = *c;
        }
    }
}

pub(super) fn gaussian(sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as i64;
    let weights: Vec<f64> = (-reach..=reach)
        .map(|k| libm::exp(-0.5 * (k as f64 / sigma).powi(2)))
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

/// Gaussian blur along each row, around the end.
pub(super) fn blur_rows(values: &mut [f32], width: usize, sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    let taps = gaussian(sigma);
    let reach = taps.len() / 2;
    for row in values.chunks_mut(width) {
        let source: Vec<f32> = (0..width + 2 * reach)
            .map(|k| row[(k + width * (reach / width + 1) - reach) % width])
            .collect();
        for (v, near) in row.iter_mut().zip(source.windows(taps.len())) {
            *v = near.iter().zip(&taps).map(|(a, b)| a * b).sum();
        }
    }
}

/// Gaussian blur down the columns; the first and last rows repeat beyond the edge.
pub(super) fn blur_cols(values: &mut [f32], width: usize, sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    let taps = gaussian(sigma);
    let reach = taps.len() as i64 / 2;
    let source = values.to_vec();
    let last = (source.len() / width) as i64 - 1;
    for (y, row) in values.chunks_mut(width).enumerate() {
        row.fill(0.0);
        for (k, t) in taps.iter().enumerate() {
            let from = (y as i64 + k as i64 - reach).clamp(0, last) as usize * width;
            for (v, s) in row.iter_mut().zip(&source[from..from + width]) {
                *v += t * s;
            }
        }
    }
}
