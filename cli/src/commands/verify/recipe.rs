//! `rowtone verify --recipe`: how to make a recording whose tones are known.

use std::f64::consts::TAU;
use std::path::Path;

use crate::failure::Failure;
use crate::output::Out;

/// The tones that are played, Hz: none is a harmonic of another, or lies near a multiple of 24, 25, 30 or 50 frames a second.
const TONES_HZ: [f64; 3] = [83.3, 131.7, 211.9];
const SECONDS: u32 = 60;
/// Samples a second, and the largest one: each tone has a third of it.
const RATE_HZ: u32 = 44_100;
const LARGEST: f64 = 32_000.0;

/// Writes the sound into a folder and says what to do with it.
///
/// # Errors
/// [`Failure::Input`] where the sound cannot be written.
pub(super) fn give(folder: &Path) -> Result<(), Failure> {
    let path = folder.join("tones.wav");
    let name = path.display().to_string();
    rowtone_files::write(&path, sound()).map_err(|e| Failure::writing(&name, &e))?;
    let tones = TONES_HZ.map(|hz| format!("{{\"hz\": {hz}, \"hz_tolerance\": 0.05}}"));
    Out::default().line(&format!(
        "A recording with known tones:\n\n\
         1. Put {name} on a phone, or play it by a loudspeaker: {SECONDS} s of {} Hz.\n\
         2. Stand a card with print or speckle on it, or lay it on the cone, so that it shakes: to be\n   \
            felt with a finger, hardly to be seen.\n\
         3. Fix the camera so that the card fills most of the picture and moves along the picture's\n   \
            rows. Short exposure (1/2000 s), much light. MJPEG, ProRes or raw video if there is a choice,\n   \
            else H.264 at its highest rate with key frames often.\n\
         4. Record 10 s beside the sound, into the folder, as card.mp4 (or what it is).\n\
         5. Beside it, write card.json, with the sensor's line time (rowtone calibrate measures it):\n\n\
         {{\"clip\": \"card.mp4\", \"line_time_us\": 18.9, \"exposure_us\": 500,\n \
         \"tones\": [{}],\n \
         \"harmonics_allowed\": true, \"nothing_else_above\": 0.1}}\n\n\
         6. rowtone verify {}\n\n\
         The frequencies are right to the millionths of the player's and the camera's clocks; amplitudes are\n\
         not known, but the same camera at another frame rate must find the same ones.",
        TONES_HZ.map(|hz| hz.to_string()).join(", "),
        tones.join(",\n           "),
        folder.display(),
    ))
}

/// A WAV file of 16-bit samples, one channel, which every player takes.
fn sound() -> Vec<u8> {
    let samples = RATE_HZ * SECONDS;
    let bytes = 2 * samples;
    let mut file = Vec::with_capacity(44 + bytes as usize);
    file.extend(b"RIFF");
    file.extend((36 + bytes).to_le_bytes());
    file.extend(b"WAVEfmt ");
    file.extend(16u32.to_le_bytes());
    file.extend([1u16, 1].map(u16::to_le_bytes).concat());
    file.extend([RATE_HZ, 2 * RATE_HZ].map(u32::to_le_bytes).concat());
    file.extend([2u16, 16].map(u16::to_le_bytes).concat());
    file.extend(b"data");
    file.extend(bytes.to_le_bytes());
    let each = LARGEST / TONES_HZ.len() as f64;
    for k in 0..samples {
        let t_s = f64::from(k) / f64::from(RATE_HZ);
        let sum: f64 = TONES_HZ
            .iter()
            .map(|hz| (TAU * (hz * t_s).fract()).sin())
            .sum();
        file.extend(((each * sum).round() as i16).to_le_bytes());
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sound_has_the_tones_and_a_header_that_fits() {
        let file = sound();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!(word(4) as usize + 8, file.len());
        assert_eq!((word(24), word(40) as usize), (RATE_HZ, file.len() - 44));
        let samples: Vec<f64> = (file[44..].chunks_exact(2))
            .map(|b| i16::from_le_bytes([b[0], b[1]]).into())
            .collect();
        let amplitude = |hz: f64| {
            let (mut c, mut s) = (0.0, 0.0);
            for (k, sample) in samples.iter().enumerate() {
                let (sin, cos) = (TAU * hz * k as f64 / f64::from(RATE_HZ)).sin_cos();
                c += sample * cos;
                s += sample * sin;
            }
            2.0 * f64::hypot(c, s) / samples.len() as f64
        };
        for hz in TONES_HZ {
            assert!((amplitude(hz) / (LARGEST / 3.0) - 1.0).abs() < 1e-3, "{hz}");
        }
        assert!(amplitude(100.0) < 10.0);
    }
}
