//! Butterworth's low-pass: flat below the corner, 6 dB an octave and order above it.

use std::f64::consts::PI;

/// A cascade of second-order sections (transposed direct form II).
#[derive(Clone, Debug)]
pub struct LowPass {
    sections: Vec<[f64; 5]>,
}

impl LowPass {
    /// `order` is even, 2 to 12 (rounded up and bounded to that); the corner lies below half the sample rate, or the
    /// filter passes everything. By the bilinear transform, its corner put where it belongs.
    ///
    /// ```
    /// use rowtone_measure::restore::butterworth::LowPass;
    /// let filter = LowPass::new(4, 1000.0, 8000.0);
    /// assert!((filter.gain(1000.0 / 8000.0) - 0.5_f64.sqrt()).abs() < 1e-9);
    /// ```
    pub fn new(order: usize, corner_hz: f64, rate_hz: f64) -> Self {
        let order = order.clamp(2, 12).next_multiple_of(2);
        if !(corner_hz > 0.0 && corner_hz < 0.499 * rate_hz) {
            return Self {
                sections: Vec::new(),
            };
        }
        let k = (PI * corner_hz / rate_hz).tan();
        let sections = (0..order / 2)
            .map(|i| {
                let damping = 2.0 * (PI * (2 * i + 1) as f64 / (2 * order) as f64).sin();
                let norm = 1.0 / (1.0 + damping * k + k * k);
                let b0 = k * k * norm;
                [
                    b0,
                    2.0 * b0,
                    b0,
                    2.0 * (k * k - 1.0) * norm,
                    (1.0 - damping * k + k * k) * norm,
                ]
            })
            .collect();
        Self { sections }
    }

    /// Gain at a frequency in cycles a sample.
    pub fn gain(&self, cycles: f64) -> f64 {
        let w = 2.0 * PI * cycles;
        self.sections
            .iter()
            .map(|[b0, b1, b2, a1, a2]| {
                let top = (b0 + b1 * w.cos() + b2 * (2.0 * w).cos())
                    .hypot(b1 * w.sin() + b2 * (2.0 * w).sin());
                let bottom = (1.0 + a1 * w.cos() + a2 * (2.0 * w).cos())
                    .hypot(a1 * w.sin() + a2 * (2.0 * w).sin());
                top / bottom
            })
            .product()
    }

    /// Filters forwards.
    pub fn run(&self, signal: &mut [f64]) {
        for [b0, b1, b2, a1, a2] in &self.sections {
            // As if the first value had been there for ever.
            let first = signal.first().copied().unwrap_or(0.0);
            let (mut s1, mut s2) = ((1.0 - b0) * first, (b2 - a2) * first);
            for value in signal.iter_mut() {
                let out = b0 * *value + s1;
                s1 = b1 * *value - a1 * out + s2;
                s2 = b2 * *value - a2 * out;
                *value = out;
            }
        }
    }

    /// Filters forwards and backwards: no delay, and the gain squared.
    pub fn run_both_ways(&self, signal: &mut [f64]) {
        self.run(signal);
        signal.reverse();
        self.run(signal);
        signal.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_below_passes_and_one_above_does_not() {
        let filter = LowPass::new(6, 1000.0, 8000.0);
        for (hz, expected) in [(100.0, 1.0), (3000.0, 0.0)] {
            let mut signal: Vec<f64> = (0..4000)
                .map(|i| (2.0 * PI * hz * f64::from(i) / 8000.0).sin())
                .collect();
            filter.run_both_ways(&mut signal);
            let rms =
                (rowtone_linear::dot(&signal[1000..3000], &signal[1000..3000]) / 1000.0).sqrt();
            assert!((rms - expected).abs() < 0.01, "{hz}: {rms}");
        }
    }

    #[test]
    fn a_constant_is_not_disturbed() {
        let mut signal = vec![3.0; 50];
        LowPass::new(4, 1000.0, 8000.0).run_both_ways(&mut signal);
        assert!(signal.iter().all(|v| (v - 3.0).abs() < 1e-9), "{signal:?}");
    }
}
