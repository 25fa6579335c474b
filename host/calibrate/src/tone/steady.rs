//! Steady tones from frame to frame: their frequencies below half the frame rate, and how each cell moves at one.

use super::motion::Motion;
use rowtone_fourier::{Complex64, Fourier};
use rowtone_linear::{dot, median, orthonormal, remove};
use std::f64::consts::{PI, TAU};

/// Tones that are looked for.
const MOST_TONES: usize = 5;
/// A tone stands out from the median of what lies about it by so much.
const STANDS_OUT: f64 = 6.0;
/// Bins on either side of which that median is.
const ABOUT: usize = 40;
/// Periods in the recording below which a tone is a drift.
const LEAST_PERIODS: f64 = 8.0;
/// Cells looked at for the spectrum, at most.
const MOST_CELLS: usize = 4000;
/// A cell counts for no more than this many times its own floor: one is not to drown the others.
const MOST_OF_A_CELL: f64 = 1e4;

/// How the cells move at one frequency.
#[derive(Clone, Debug)]
pub(super) struct Moves {
    /// The frequency, Hz, below half the frame rate.
    pub(super) hz: f64,
    /// Amplitude and phase of every cell, px: x = Re(z·e^{2πi·hz·t}).
    pub(super) cells: Vec<Complex64>,
    /// Power of the noise in each of those, px².
    pub(super) noise: Vec<f64>,
}

/// Frequencies of the steady tones, Hz, the strongest first.
pub(super) fn tones(motion: &Motion, times_s: &[f64]) -> Vec<f64> {
    let count = motion.frames.len();
    let step = span(times_s) / (count - 1) as f64;
    let points = (2 * count).next_power_of_two();
    let mut fourier = Fourier::forward(points);
    let drift = orthonormal(drifts(times_s));
    let taper: Vec<f64> = (0..count)
        .map(|n| (PI * (n as f64 + 0.5) / count as f64).sin().powi(2))
        .collect();
    let mut total = vec![0.0; points / 2];
    let every = motion.rows.len().div_ceil(MOST_CELLS).max(1);
    for cell in (0..motion.rows.len()).step_by(every) {
        let mut values = series(motion, cell);
        remove(&drift, &mut values);
        let mut buffer = vec![Complex64::default(); points];
        for ((slot, value), w) in buffer.iter_mut().zip(&values).zip(&taper) {
            slot.re = value * w;
        }
        fourier.transform(&mut buffer);
        let power: Vec<f64> = buffer[..points / 2].iter().map(|v| v.norm_sqr()).collect();
        let floor = median(&power).max(f64::MIN_POSITIVE);
        let shares = total.iter_mut().zip(&power);
        shares.for_each(|(t, p)| *t += (p / floor).min(MOST_OF_A_CELL));
    }
    let bin_hz = 1.0 / (step * points as f64);
    let first = ((LEAST_PERIODS / span(times_s)) / bin_hz).ceil() as usize;
    let mut peaks: Vec<(f64, f64)> = (first.max(2)..total.len().saturating_sub(2))
        .filter(|&k| total[k] > total[k - 1] && total[k] >= total[k + 1])
        .filter_map(|k| {
            let about = &total[k.saturating_sub(ABOUT)..(k + ABOUT + 1).min(total.len())];
            let stands = total[k] / median(about).max(f64::MIN_POSITIVE);
            (stands > STANDS_OUT).then_some((k as f64 * bin_hz, total[k]))
        })
        .collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut tones: Vec<f64> = Vec::new();
    for (hz, _) in peaks {
        // The taper's own width, and what little the next bins hold of a strong tone.
        let apart = |t: &f64| (t - hz).abs() * span(times_s) > 4.0;
        if tones.len() < MOST_TONES && tones.iter().all(apart) {
            tones.push(hz);
        }
    }
    tones
        .iter()
        .map(|&hz| refined(motion, times_s, hz, bin_hz))
        .collect()
}

/// The frequency near `hz` at which the cells move most, all by their own floor.
fn refined(motion: &Motion, times_s: &[f64], hz: f64, bin_hz: f64) -> f64 {
    let every = motion.rows.len().div_ceil(MOST_CELLS / 8).max(1);
    let drift = orthonormal(drifts(times_s));
    let cells: Vec<Vec<f64>> = (0..motion.rows.len())
        .step_by(every)
        .map(|cell| {
            let mut values = series(motion, cell);
            remove(&drift, &mut values);
            let scale = 1.0 / dot(&values, &values).sqrt().max(f64::MIN_POSITIVE);
            values.iter_mut().for_each(|v| *v *= scale);
            values
        })
        .collect();
    let power = |hz: f64| {
        let [mut c, mut s] = waves(times_s, hz);
        remove(&drift, &mut c);
        remove(&drift, &mut s);
        let own = orthonormal(vec![c, s]);
        let of = |v: &Vec<f64>| own.iter().map(|o| dot(v, o).powi(2)).sum::<f64>();
        cells.iter().map(of).sum::<f64>()
    };
    let (mut at, mut width) = (hz, bin_hz);
    for _ in 0..12 {
        let values = [at - width, at, at + width].map(power);
        let bend = values[0] - 2.0 * values[1] + values[2];
        if bend < 0.0 {
            at += (0.5 * (values[0] - values[2]) / bend).clamp(-1.0, 1.0) * width;
        }
        width *= 0.6;
    }
    at
}

/// How every cell moves at `tones[which]`, all tones and a drift fitted together.
pub(super) fn moves(motion: &Motion, times_s: &[f64], tones: &[f64], which: usize) -> Moves {
    let mut others = drifts(times_s);
    for (i, &hz) in tones.iter().enumerate() {
        if i != which {
            others.extend(waves(times_s, hz));
        }
    }
    let hz = tones[which];
    let own = duals(times_s, hz, &orthonormal(others.clone()));
    others.extend(waves(times_s, hz));
    let all = orthonormal(others);
    // What lies beside the tone is the noise in it.
    let beside: Vec<[Vec<f64>; 2]> = [-4.0, -3.0, -2.0, 2.0, 3.0, 4.0]
        .iter()
        .map(|k| hz + 1.5 * k / span(times_s))
        .filter(|at| *at > 0.0)
        .map(|at| duals(times_s, at, &all))
        .collect();
    let read =
        |[c, s]: &[Vec<f64>; 2], values: &[f64]| Complex64::new(dot(c, values), -dot(s, values));
    let mut found = Moves {
        hz,
        cells: Vec::with_capacity(motion.rows.len()),
        noise: Vec::with_capacity(motion.rows.len()),
    };
    for cell in 0..motion.rows.len() {
        let values = series(motion, cell);
        found.cells.push(read(&own, &values));
        let power = beside.iter().map(|d| read(d, &values).norm_sqr());
        found
            .noise
            .push(power.sum::<f64>() / beside.len().max(1) as f64);
    }
    found
}

/// Vectors whose inner products with a series are the amplitudes of cosine and sine beside what `others` span.
fn duals(times_s: &[f64], hz: f64, others: &[Vec<f64>]) -> [Vec<f64>; 2] {
    let [mut c, mut s] = waves(times_s, hz);
    remove(others, &mut c);
    remove(others, &mut s);
    let (cc, cs, ss) = (dot(&c, &c), dot(&c, &s), dot(&s, &s));
    let determinant = (cc * ss - cs * cs).max(f64::MIN_POSITIVE);
    let mix = |a: f64, b: f64| {
        c.iter()
            .zip(&s)
            .map(move |(c, s)| (a * c + b * s) / determinant)
    };
    [mix(ss, -cs).collect(), mix(-cs, cc).collect()]
}

fn waves(times_s: &[f64], hz: f64) -> [Vec<f64>; 2] {
    let turn = |t: &f64| (TAU * hz * (t - times_s[0])).sin_cos();
    let both: Vec<(f64, f64)> = times_s.iter().map(turn).collect();
    [
        both.iter().map(|b| b.1).collect(),
        both.iter().map(|b| b.0).collect(),
    ]
}

/// A constant, a slope and a bend over the recording.
fn drifts(times_s: &[f64]) -> Vec<Vec<f64>> {
    let middle = times_s[0] + 0.5 * span(times_s);
    let half = 0.5 * span(times_s);
    let u: Vec<f64> = times_s.iter().map(|t| (t - middle) / half).collect();
    vec![
        vec![1.0; u.len()],
        u.clone(),
        u.iter().map(|u| u * u).collect(),
    ]
}

pub(super) fn span(times_s: &[f64]) -> f64 {
    times_s[times_s.len() - 1] - times_s[0]
}

fn series(motion: &Motion, cell: usize) -> Vec<f64> {
    motion.frames.iter().map(|f| f64::from(f[cell])).collect()
}
