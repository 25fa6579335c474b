//! What is left of a window when its tones are taken out: the noise floor of the picture.
//!
//! A plain spectrum of samples with gaps shows ghosts of every tone at multiples of the frame rate. So
//! the tones that were reported are fitted to the samples (least squares, weighted by information, each
//! slot's mean projected out) and only the rest is transformed.

use std::f64::consts::TAU;

use rowtone::timeline::Sample;

/// A tone as it was fitted: `cosine·cos(2πft) + sine·sin(2πft)`, t from the start of the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tone {
    /// Frequency, Hz.
    pub hz: f64,
    /// Factor of the cosine, px.
    pub cosine: f64,
    /// Factor of the sine, px.
    pub sine: f64,
}

/// A window's samples, their slots' means removed, and the tones in them.
#[derive(Clone, Debug, Default)]
pub(super) struct Fit {
    /// Time of each sample after that, s.
    pub times_s: Vec<f64>,
    /// Frame of each sample.
    pub frames: Vec<u32>,
    /// Shift of each sample, px.
    pub shifts_px: Vec<f64>,
    /// Relative weight of each sample; they sum to 1.
    weights: Vec<f64>,
    /// Slot of each sample.
    slots: Vec<usize>,
    /// What is left without the tones, px.
    rest_px: Vec<f64>,
    /// The tones.
    pub tones: Vec<Tone>,
}

impl Fit {
    /// Fits tones of these frequencies, the same in all rows.
    #[cfg(test)]
    pub(super) fn new(samples: &[Sample], hz: &[f64]) -> Self {
        let tones: Vec<(f64, bool)> = hz.iter().map(|&hz| (hz, false)).collect();
        Self::bending(samples, &tones)
    }

    /// Fits tones of these frequencies; of those that bend, amplitude and phase are parabolas over the slots.
    pub(super) fn bending(samples: &[Sample], tones: &[(f64, bool)]) -> Self {
        let total: f64 = samples
            .iter()
            .map(|s| f64::from(s.information_per_px2))
            .sum();
        let origin_ns = samples.first().map_or(0, |s| s.time_ns);
        let mut fit = Self {
            times_s: samples
                .iter()
                .map(|s| (s.time_ns - origin_ns) as f64 * 1e-9)
                .collect(),
            frames: samples.iter().map(|s| s.frame).collect(),
            shifts_px: samples.iter().map(|s| s.shift_px.into()).collect(),
            weights: samples
                .iter()
                .map(|s| f64::from(s.information_per_px2) / total)
                .collect(),
            slots: samples.iter().map(|s| s.slot.into()).collect(),
            ..Self::default()
        };
        let mut shifts = std::mem::take(&mut fit.shifts_px);
        fit.remove_means(&mut shifts);
        fit.shifts_px = shifts;
        fit.rest_px = fit.shifts_px.clone();
        fit.fit_tones(tones);
        fit
    }

    /// Subtracts each slot's weighted mean.
    fn remove_means(&self, values: &mut [f64]) {
        let slots = self.slots.iter().max().map_or(0, |&slot| slot + 1);
        let mut sums = vec![(0.0, 0.0); slots];
        for ((value, w), &slot) in values.iter().zip(&self.weights).zip(&self.slots) {
            sums[slot].0 += w * value;
            sums[slot].1 += w;
        }
        for (value, &slot) in values.iter_mut().zip(&self.slots) {
            let (sum, weight) = sums[slot];
            if weight > 0.0 {
                *value -= sum / weight;
            }
        }
    }

    fn fit_tones(&mut self, tones: &[(f64, bool)]) {
        let last = self.slots.iter().max().map_or(1, |&slot| slot.max(1)) as f64;
        let mut columns = Vec::new();
        let orders = |bends: bool| if bends { 3 } else { 1 };
        for &(hz, bends) in tones {
            for order in 0..orders(bends) {
                for wave in [f64::cos, f64::sin] {
                    let place = |slot: usize| (2.0 * slot as f64 / last - 1.0).powi(order);
                    let values = self.times_s.iter().zip(&self.slots);
                    let mut column: Vec<f64> = values
                        .map(|(t, &slot)| place(slot) * wave(TAU * hz * t))
                        .collect();
                    self.remove_means(&mut column);
                    columns.push(column);
                }
            }
        }
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let pairs = a.iter().zip(b).zip(&self.weights);
            pairs.map(|((a, b), w)| a * b * w).sum()
        };
        let mut normal: Vec<Vec<f64>> = columns
            .iter()
            .map(|a| {
                let mut row: Vec<f64> = columns.iter().map(|b| product(a, b)).collect();
                row.push(product(a, &self.shifts_px));
                row
            })
            .collect();
        let factors = solve(&mut normal);
        for (column, factor) in columns.iter().zip(&factors) {
            for (rest, value) in self.rest_px.iter_mut().zip(column) {
                *rest -= factor * value;
            }
        }
        let mut from = 0;
        for &(hz, bends) in tones {
            // At the middle of the rows.
            self.tones.push(Tone {
                hz,
                cosine: factors[from],
                sine: factors[from + 1],
            });
            from += 2 * orders(bends) as usize;
        }
    }

    /// The tones together at a time after the origin, px.
    pub(super) fn model_px(&self, t_s: f64) -> f64 {
        let value = |tone: &Tone| {
            let (sine, cosine) = (TAU * tone.hz * t_s).sin_cos();
            tone.cosine * cosine + tone.sine * sine
        };
        self.tones.iter().map(value).sum()
    }

    /// Amplitude of what is left at one frequency, px.
    pub(super) fn rest_amplitude_px(&self, hz: f64) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        for ((rest, w), t) in self.rest_px.iter().zip(&self.weights).zip(&self.times_s) {
            let (sine, cosine) = (TAU * hz * t).sin_cos();
            re += rest * w * cosine;
            im += rest * w * sine;
        }
        2.0 * re.hypot(im)
    }
}

/// Solves a small set of linear equations, given as rows with the right-hand side last. An unknown that
/// the equations say nothing of is 0.
fn solve(rows: &mut [Vec<f64>]) -> Vec<f64> {
    let n = rows.len();
    let mut solved = vec![0.0; n];
    for k in 0..n {
        let best = (k..n).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs()));
        rows.swap(k, best.unwrap_or(k));
        if rows[k][k].abs() < 1e-12 {
            continue;
        }
        let pivot = rows[k].clone();
        for row in &mut rows[k + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(a, b)| *a -= factor * b);
        }
    }
    for k in (0..n).rev() {
        if rows[k][k].abs() >= 1e-12 {
            let known: f64 = (k + 1..n).map(|j| rows[k][j] * solved[j]).sum();
            solved[k] = (rows[k][n] - known) / rows[k][k];
        }
    }
    solved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_are_found_in_spite_of_gaps_and_offsets() {
        // 60 frames of 50 samples at 60 fps, 30 % of the time blank, an offset for each slot.
        let samples: Vec<Sample> = (0..3000)
            .map(|i: u32| {
                let (frame, slot) = (i / 50, i % 50);
                let t = f64::from(frame) / 60.0 + f64::from(slot) * 0.7 / 60.0 / 50.0;
                let tone = 0.4 * (TAU * 49.2 * t + 0.3).sin();
                Sample {
                    curvature: Default::default(),
                    frame,
                    slot: slot as u16,
                    time_ns: (t * 1e9) as i64,
                    shift_px: (tone + f64::from(slot) * 0.01) as f32,
                    information_per_px2: 1e4,
                    spread: Default::default(),
                    vertical: None,
                }
            })
            .collect();
        let fit = Fit::new(&samples, &[49.2]);
        let tone = fit.tones[0];
        assert!((tone.cosine.hypot(tone.sine) - 0.4).abs() < 1e-4);
        for hz in [10.8, 49.2, 70.8, 109.2] {
            assert!(fit.rest_amplitude_px(hz) < 1e-4, "{hz}");
        }
        // Not fitted, it is all in the rest, with its ghosts.
        assert!(Fit::new(&samples, &[]).rest_amplitude_px(109.2) > 0.03);
    }

    #[test]
    fn nothing_to_fit_is_no_trouble() {
        let fit = Fit::new(&[], &[10.0]);
        assert_eq!(fit.model_px(0.1), 0.0);
    }
}
