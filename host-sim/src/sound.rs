//! A movement as a sound file holds it.

use std::path::Path;

use serde::Serialize;

use super::error::SimError;

/// A recorded movement, from a sound file; still before its start and after its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sound {
    /// Samples a second.
    pub rate_hz: f64,
    /// Zero-to-peak displacement of a full-scale sample, px.
    pub amplitude_px: f64,
    /// Samples, -1 to 1.
    #[serde(skip)]
    pub samples: Vec<f32>,
}

impl Sound {
    /// Reads a WAV file (any integer depth, or 32-bit float; the first channel).
    ///
    /// # Errors
    /// [`SimError::File`] when it cannot be read.
    pub fn read(path: &Path, amplitude_px: f64) -> Result<Self, SimError> {
        let fail = |why: String| SimError::File {
            path: path.display().to_string(),
            why,
        };
        let mut reader = hound::WavReader::open(path).map_err(|e| fail(e.to_string()))?;
        let spec = reader.spec();
        let channels = usize::from(spec.channels.max(1));
        let samples: Result<Vec<f32>, hound::Error> = match spec.sample_format {
            hound::SampleFormat::Float => reader.samples::<f32>().step_by(channels).collect(),
            hound::SampleFormat::Int => {
                let scale = 1.0 / (1u64 << (spec.bits_per_sample - 1)) as f32;
                let whole = reader.samples::<i32>().step_by(channels);
                whole.map(|s| s.map(|v| v as f32 * scale)).collect()
            }
        };
        let samples = samples.map_err(|e| fail(e.to_string()))?;
        if samples.is_empty() || spec.sample_rate == 0 {
            return Err(fail("the sound file holds no samples".into()));
        }
        Ok(Self {
            rate_hz: f64::from(spec.sample_rate),
            amplitude_px,
            samples,
        })
    }

    /// Cubic interpolation between samples (Catmull–Rom).
    pub(super) fn at(&self, t_s: f64) -> f64 {
        let u = t_s * self.rate_hz;
        if !(0.0..self.samples.len() as f64).contains(&u) {
            return 0.0;
        }
        let i = u as usize;
        let f = u - i as f64;
        let get = |k: usize| {
            k.checked_sub(1)
                .and_then(|k| self.samples.get(k))
                .map_or(0.0, |&v| f64::from(v))
        };
        let (a, b, c, d) = (get(i), get(i + 1), get(i + 2), get(i + 3));
        let inner = f * (2.0 * a - 5.0 * b + 4.0 * c - d + f * (3.0 * (b - c) + d - a));
        self.amplitude_px * (b + 0.5 * f * (c - a + inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_sound_passes_through_its_samples_and_follows_a_sine_between_them() {
        let rate_hz = 8000.0;
        let wave = |t: f64| (TAU * 200.0 * t).sin();
        let samples = (0..800)
            .map(|k| wave(f64::from(k) / rate_hz) as f32)
            .collect();
        let sound = Sound {
            rate_hz,
            amplitude_px: 0.5,
            samples,
        };
        assert!((sound.at(10.0 / rate_hz) - 0.5 * wave(10.0 / rate_hz)).abs() < 1e-6);
        assert!((sound.at(10.37 / rate_hz) - 0.5 * wave(10.37 / rate_hz)).abs() < 2e-4);
        assert_eq!((sound.at(-1e-9), sound.at(0.2)), (0.0, 0.0));
    }
}
