//! Power over time and frequency of an evenly sampled sound.

use rustfft::{FftPlanner, num_complex::Complex};

/// Powers, column by column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrogram {
    /// One column a hop: power by frequency bin, from 0.
    pub columns: Vec<Vec<f64>>,
    /// From column to column, s.
    pub hop_s: f64,
    /// From bin to bin, Hz.
    pub bin_hz: f64,
}

/// Hann windows of `length` samples, half of it apart, padded to four times their length.
///
/// ```
/// use rowtone_lab::sound::stft::spectrogram;
/// let tone: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.5).sin()).collect();
/// let found = spectrogram(&tone, 1000.0, 400).strongest_hz();
/// assert!(found.iter().all(|(_, hz)| (hz - 0.5 * 1000.0 / std::f64::consts::TAU).abs() < 0.3));
/// ```
pub fn spectrogram(sound: &[f64], rate_hz: f64, length: usize) -> Spectrogram {
    let size = 4 * length;
    let transform = FftPlanner::new().plan_fft_forward(size);
    let column = |part: &[f64]| -> Vec<f64> {
        let mean = part.iter().sum::<f64>() / length as f64;
        let mut data: Vec<Complex<f64>> = part
            .iter()
            .enumerate()
            .map(|(i, v)| {
                let taper = (std::f64::consts::PI * (i as f64 + 0.5) / length as f64).sin();
                Complex::new((v - mean) * taper * taper, 0.0)
            })
            .collect();
        data.resize(size, Complex::new(0.0, 0.0));
        transform.process(&mut data);
        data[..size / 2].iter().map(|v| v.norm_sqr()).collect()
    };
    let hop = (length / 2).max(1);
    Spectrogram {
        columns: sound
            .windows(length.max(1))
            .step_by(hop)
            .map(column)
            .collect(),
        hop_s: hop as f64 / rate_hz,
        bin_hz: rate_hz / size as f64,
    }
}

impl Spectrogram {
    /// In each column its middle, s, and the frequency that holds most, Hz (a parabola through three bins).
    pub fn strongest_hz(&self) -> Vec<(f64, f64)> {
        let peak = |column: &Vec<f64>| {
            let top = (1..column.len().saturating_sub(1))
                .max_by(|&a, &b| column[a].total_cmp(&column[b]))
                .unwrap_or(0);
            let at = |k: usize| column.get(k).map_or(0.0, |v| v.max(1e-300).ln());
            let (l, c, r) = (at(top.saturating_sub(1)), at(top), at(top + 1));
            let bend = l - 2.0 * c + r;
            let offset = if bend < 0.0 {
                0.5 * (l - r) / bend
            } else {
                0.0
            };
            self.bin_hz * (top as f64 + offset.clamp(-0.5, 0.5))
        };
        let columns = self.columns.iter().enumerate();
        columns
            .map(|(i, c)| (self.hop_s * (i as f64 + 1.0), peak(c)))
            .collect()
    }
}
