//! Gaps filled by tones that are fitted to the samples that exist, a block at a time.
//!
//! In each block, the strongest tone of what is left is taken, all tones found so far are fitted together (amplitudes
//! by linear least squares, frequencies by Gauss–Newton), and so on. Blocks overlap by half and are cross-faded.

use rowtone_fourier::{Complex64, Fourier};
use rowtone_linear::{Symmetric, dot};
use std::f64::consts::TAU;

/// Samples in a block.
const BLOCK: usize = 1024;
/// Tones taken out before an autoregressive model.
pub const FEW: usize = 4;
/// Tones that stand alone.
pub const MANY: usize = 16;
/// A further tone must explain this part of what is left.
const WORTH: f64 = 0.02;

/// The tones' signal at every sample.
pub fn model(samples: &[Option<f64>], most: usize) -> Vec<f64> {
    let mut sum = vec![0.0; samples.len()];
    let mut weight = vec![1e-12; samples.len()];
    let hop = BLOCK / 2;
    let mut start = 0;
    while start < samples.len() {
        let end = (start + BLOCK).min(samples.len());
        let values = fit_block(&samples[start..end], most);
        for (i, value) in values.iter().enumerate() {
            let fade = (std::f64::consts::PI * (i as f64 + 0.5) / BLOCK as f64)
                .sin()
                .powi(2);
            sum[start + i] += fade * value;
            weight[start + i] += fade;
        }
        if end == samples.len() {
            break;
        }
        start += hop;
    }
    sum.iter().zip(&weight).map(|(s, w)| s / w).collect()
}

/// A mean and up to `most` tones; radians a sample.
fn fit_block(samples: &[Option<f64>], most: usize) -> Vec<f64> {
    let known: Vec<(f64, f64)> = samples
        .iter()
        .enumerate()
        .filter_map(|(i, s)| s.map(|s| (i as f64, s)))
        .collect();
    let mut model = vec![0.0; samples.len()];
    if known.len() < 16 {
        let mean = known.iter().map(|k| k.1).sum::<f64>() / known.len().max(1) as f64;
        model.fill(mean);
        return model;
    }
    let mut omegas: Vec<f64> = Vec::new();
    let mut best = amplitudes(&known, &omegas).unwrap_or((vec![0.0], f64::INFINITY));
    while omegas.len() < most && 4 * (omegas.len() + 1) * 3 < known.len() {
        let residual: Vec<(f64, f64)> = known
            .iter()
            .map(|&(t, v)| (t, v - value(t, &omegas, &best.0)))
            .collect();
        let mut trial = omegas.clone();
        trial.push(strongest(&residual, samples.len()));
        let Some(mut fitted) = amplitudes(&known, &trial) else {
            break;
        };
        for _ in 0..3 {
            let moved = refined(&known, &trial, &fitted.0);
            match amplitudes(&known, &moved) {
                Some(better) if better.1 < fitted.1 => (trial, fitted) = (moved, better),
                _ => break,
            }
        }
        if fitted.1 > (1.0 - WORTH) * best.1 {
            break;
        }
        (omegas, best) = (trial, fitted);
    }
    // A gap must not be filled with more than what stands beside it.
    let limit = known.iter().fold(0.0_f64, |m, k| m.max(k.1.abs())) * 1.5;
    for (i, slot) in model.iter_mut().enumerate() {
        *slot = value(i as f64, &omegas, &best.0).clamp(-limit, limit);
    }
    model
}

/// Mean, then cosine and sine amplitude of each tone; and the sum of squares left.
fn amplitudes(known: &[(f64, f64)], omegas: &[f64]) -> Option<(Vec<f64>, f64)> {
    let mut normal = Symmetric::zeros(1 + 2 * omegas.len());
    let mut right = vec![0.0; 1 + 2 * omegas.len()];
    let mut line = vec![1.0; 1 + 2 * omegas.len()];
    for &(t, v) in known {
        for (pair, omega) in line[1..].chunks_exact_mut(2).zip(omegas) {
            (pair[1], pair[0]) = (omega * t).sin_cos();
        }
        normal.add_outer(&line, 1.0);
        right.iter_mut().zip(&line).for_each(|(r, l)| *r += l * v);
    }
    for i in 0..normal.side() {
        let own = normal.at(i, i);
        normal.add(i, i, 1e-6 * own);
    }
    let solved = normal.factor()?.solve(&right);
    let rss = known
        .iter()
        .map(|&(t, v)| (v - value(t, omegas, &solved)).powi(2))
        .sum();
    Some((solved, rss))
}

fn value(t: f64, omegas: &[f64], amplitudes: &[f64]) -> f64 {
    let mut sum = amplitudes[0];
    for (pair, omega) in amplitudes[1..].chunks_exact(2).zip(omegas) {
        let (s, c) = (omega * t).sin_cos();
        sum += pair[0] * c + pair[1] * s;
    }
    sum
}

/// One Gauss–Newton step of all frequencies, each tone's amplitudes moving along.
fn refined(known: &[(f64, f64)], omegas: &[f64], amplitudes: &[f64]) -> Vec<f64> {
    let count = omegas.len();
    let middle = 0.5 * (known[0].0 + known[known.len() - 1].0);
    let mut normal = Symmetric::zeros(3 * count);
    let mut right = vec![0.0; 3 * count];
    let mut line = vec![0.0; 3 * count];
    for &(t, v) in known {
        for (k, omega) in omegas.iter().enumerate() {
            let (s, c) = (omega * t).sin_cos();
            let (a, b) = (amplitudes[1 + 2 * k], amplitudes[2 + 2 * k]);
            line[3 * k] = (t - middle) * (b * c - a * s);
            line[3 * k + 1] = c;
            line[3 * k + 2] = s;
        }
        normal.add_outer(&line, 1.0);
        let left = v - value(t, omegas, amplitudes);
        right
            .iter_mut()
            .zip(&line)
            .for_each(|(r, l)| *r += l * left);
    }
    for i in 0..normal.side() {
        let own = normal.at(i, i);
        normal.add(i, i, 1e-6 * own + f64::MIN_POSITIVE);
    }
    let Some(factor) = normal.factor() else {
        return omegas.to_vec();
    };
    let step = factor.solve(&right);
    let most = TAU / (known[known.len() - 1].0 - known[0].0).max(1.0);
    omegas
        .iter()
        .enumerate()
        .map(|(k, o)| (o + step[3 * k].clamp(-most, most)).clamp(1e-4, 3.1))
        .collect()
}

/// The strongest frequency of uneven samples, from a padded transform with zeros in the gaps.
fn strongest(residual: &[(f64, f64)], length: usize) -> f64 {
    let size = (4 * length).next_power_of_two();
    let mut buffer = vec![Complex64::default(); size];
    let mean = dot(
        &residual.iter().map(|r| r.1).collect::<Vec<_>>(),
        &vec![1.0; residual.len()],
    ) / residual.len() as f64;
    for &(t, v) in residual {
        buffer[t as usize].re = v - mean;
    }
    Fourier::forward(size).transform(&mut buffer);
    let peak = (2..size / 2)
        .max_by(|&a, &b| buffer[a].norm_sqr().total_cmp(&buffer[b].norm_sqr()))
        .unwrap_or(2);
    TAU * peak as f64 / size as f64
}
