//! Speech and music to try the filling on. Speech from espeak-ng where it is installed, else made here.

use std::f64::consts::TAU;
use std::process::Command;

/// Sample rate of all sounds, Hz.
pub const RATE_HZ: f64 = 8000.0;

/// A sound, scaled to a peak of 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// What it is and where it comes from.
    pub name: &'static str,
    /// Samples at [`RATE_HZ`].
    pub samples: Vec<f64>,
}

/// Three seconds of four-part chords, plucked: eight harmonics a note, dying away.
pub fn music() -> Sound {
    let chords: [[f64; 4]; 6] = [
        [130.8, 196.0, 261.6, 329.6],
        [110.0, 220.0, 261.6, 329.6],
        [87.3, 174.6, 220.0, 261.6],
        [98.0, 196.0, 246.9, 293.7],
        [82.4, 164.8, 246.9, 329.6],
        [130.8, 196.0, 261.6, 392.0],
    ];
    let length = 0.5;
    let samples = (0..(RATE_HZ * length) as usize * chords.len())
        .map(|i| {
            let t = i as f64 / RATE_HZ;
            let chord = ((t / length) as usize).min(chords.len() - 1);
            let since = t - chord as f64 * length;
            let attack = (since / 0.01).min(1.0);
            chords[chord]
                .iter()
                .enumerate()
                .map(|(k, f)| {
                    (1..=8)
                        .map(|h| {
                            let h = f64::from(h);
                            (TAU * f * h * t + k as f64).sin() / (h * h)
                                * (-since * (2.0 + h)).exp()
                        })
                        .sum::<f64>()
                })
                .sum::<f64>()
                * attack
        })
        .collect();
    Sound {
        name: "music (synthesised)",
        samples: scaled(samples),
    }
}

/// Three seconds of speech.
pub fn speech() -> Sound {
    match espeak() {
        Some(samples) => Sound {
            name: "speech (espeak-ng)",
            samples,
        },
        None => formants(),
    }
}

/// What takes speech's place where espeak-ng is not installed.
pub fn formants() -> Sound {
    Sound {
        name: "speech-like (vowels by formants, hiss)",
        samples: vowels(),
    }
}

/// Three seconds of a tone that rises evenly from 100 to 1000 Hz.
pub fn ramp() -> Sound {
    let length = 3.0;
    let samples = (0..(RATE_HZ * length) as usize)
        .map(|i| i as f64 / RATE_HZ)
        .map(|t| (TAU * t * (100.0 + 450.0 * t / length)).sin())
        .collect();
    Sound {
        name: "ramp from 100 to 1000 Hz",
        samples,
    }
}

/// What espeak-ng says, resampled; `None` where it is not installed or says nothing usable.
fn espeak() -> Option<Vec<f64>> {
    let said = Command::new("espeak-ng")
        .args([
            "--stdout",
            "-s",
            "150",
            "Every row of a frame is a sample in time, and the machine hums.",
        ])
        .output()
        .ok()?;
    // A stream's header states no true length: the samples are what follows the word `data` and its size.
    let bytes = said.stdout;
    let start = bytes.windows(4).position(|w| w == b"data")? + 8;
    let rate = f64::from(u32::from_le_bytes(bytes.get(24..28)?.try_into().ok()?));
    let values: Vec<f64> = bytes
        .get(start..)?
        .chunks_exact(2)
        .map(|b| f64::from(i16::from_le_bytes([b[0], b[1]])))
        .collect();
    if values.len() < 1000 || !(4000.0..200_000.0).contains(&rate) {
        return None;
    }
    let mut soft = values;
    rowtone_measure::restore::butterworth::LowPass::new(8, 3400.0, rate).run_both_ways(&mut soft);
    let count = ((soft.len() as f64 / rate * RATE_HZ) as usize).min((3.0 * RATE_HZ) as usize);
    let at = |i: usize| {
        let x = i as f64 * rate / RATE_HZ;
        let k = (x as usize).min(soft.len() - 2);
        soft[k] + (x - k as f64) * (soft[k + 1] - soft[k])
    };
    Some(scaled((0..count).map(at).collect()))
}

/// Vowels (pulses through three resonances) with a gliding pitch, pauses and hiss between them.
pub fn vowels() -> Vec<f64> {
    let formants = [
        [730.0, 1090.0, 2440.0],
        [270.0, 2290.0, 3010.0],
        [300.0, 870.0, 2240.0],
        [530.0, 1840.0, 2480.0],
    ];
    let mut samples = vec![0.0; (3.0 * RATE_HZ) as usize];
    let mut state = 1u32;
    let mut phase = 0.0;
    let mut memory = [[0.0f64; 2]; 3];
    for (i, slot) in samples.iter_mut().enumerate() {
        let t = i as f64 / RATE_HZ;
        let syllable = (t / 0.3) as usize;
        let since = t - 0.3 * syllable as f64;
        let loudness = (since / 0.03).min(1.0) * ((0.25 - since) / 0.04).clamp(0.0, 1.0);
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 8) / f64::from(1 << 24) - 0.5;
        phase += (120.0 + 25.0 * (TAU * 0.7 * t).sin()) / RATE_HZ;
        let pulse = if phase >= 1.0 { 1.0 } else { 0.0 };
        phase -= pulse;
        let hiss = if since > 0.25 {
            0.15 * noise
        } else {
            0.004 * noise
        };
        let mut sum = 0.0;
        for (k, state) in memory.iter_mut().enumerate() {
            let w = TAU * formants[syllable % 4][k] / RATE_HZ;
            let r = 1.0 - 0.02 * (1.0 + k as f64);
            let value = pulse + 2.0 * r * w.cos() * state[0] - r * r * state[1];
            *state = [value, state[0]];
            sum += value * w.sin() / (1.0 + k as f64);
        }
        *slot = loudness * sum + hiss;
    }
    scaled(samples)
}

fn scaled(mut samples: Vec<f64>) -> Vec<f64> {
    let peak = samples.iter().fold(1e-12_f64, |m, v| m.max(v.abs()));
    samples.iter_mut().for_each(|v| *v /= peak);
    samples
}
