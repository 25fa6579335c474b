//! A ramp from 100 to 1000 Hz (Fig. 5.4).

use std::fmt::Write;

use super::film::{Film, Setup};
use super::sound::{Sound, compared, hear, truth};
use super::{Folder, Scale};
use crate::LabError;
use crate::figure::shades::Panels;
use crate::sound::stft::spectrogram;
use host_sim::{Chirp, Motion};

/// A window of the spectrogram, s.
const WINDOW_S: f64 = 0.05;
/// A window whose strongest frequency is farther off than this is wrong, Hz.
const WRONG_HZ: f64 = 20.0;

/// The ramp, over a whole recording.
fn ramp(seconds: f64) -> Chirp {
    Chirp {
        from_hz: 100.0,
        to_hz: 1000.0,
        start_s: 0.0,
        duration_s: seconds,
        amplitude_px: 0.5,
    }
}

/// Share of the windows whose strongest frequency is wrong, and the rms error of the others, Hz.
fn followed(sound: &Sound, ramp: &Chirp) -> (f64, f64) {
    let length = (WINDOW_S * sound.rate_hz) as usize;
    let errors: Vec<f64> = spectrogram(&sound.samples, sound.rate_hz, length)
        .strongest_hz()
        .iter()
        .filter_map(|(t, hz)| Some(hz - ramp.hz_at(*t)?))
        .collect();
    let right: Vec<f64> = errors
        .iter()
        .copied()
        .filter(|e| e.abs() < WRONG_HZ)
        .collect();
    let rms = (right.iter().map(|e| e * e).sum::<f64>() / right.len().max(1) as f64).sqrt();
    (1.0 - right.len() as f64 / errors.len().max(1) as f64, rms)
}

/// A table, a figure of spectrograms, and sounds.
///
/// # Errors
/// [`LabError`] for what cannot be simulated or written.
pub fn run(folder: &Folder, scale: Scale) -> Result<(), LabError> {
    let setup = Setup::thesis(scale.sound_cols, scale.sound_frames, scale.seed).sharp(scale.sharp);
    let ramp = ramp(f64::from(scale.sound_frames) / setup.sensor.fps);
    let motion = Motion {
        chirps: vec![ramp],
        ..Motion::default()
    };
    let film = setup.film(&motion)?;
    let mut text = format!(
        "Ramp from 100 to 1000 Hz in {:.2} s, 0.5 px, {}x1048 at 120 fps, gaps filled, below 1000 Hz, seed {}{}; \
         strongest frequency of windows of {WINDOW_S} s\n\n\
         | method | SNR, dB | windows off by more than {WRONG_HZ} Hz | rms error of the others, Hz |\n| --- | --: | --: | --: |\n",
        ramp.duration_s,
        scale.sound_cols,
        scale.seed,
        scale.of_what()
    );
    let mut panels = Vec::new();
    for (name, heard) in all(&film, "chirp") {
        let (wrong, rms) = followed(&heard, &ramp);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {name} | {:.1} | {:.0} % | {rms:.1} |",
            compared(&film, &heard).snr_db,
            100.0 * wrong
        );
        folder.wav(
            &format!("chirp-{}.wav", file_name(name)),
            &heard.samples,
            heard.rate_hz,
        )?;
        if panels.is_empty() {
            let truth = truth(&film, &heard);
            folder.wav("chirp-truth.wav", &truth, heard.rate_hz)?;
            panels.push(("truth".to_owned(), truth, heard.rate_hz));
        } else {
            panels.push((name.to_owned(), heard.samples, heard.rate_hz));
        }
    }
    folder.table("chirp.md", &text)?;
    let figure = Panels {
        title: "A ramp from 100 to 1000 Hz, as each method hears it".to_owned(),
        panels: panels
            .into_iter()
            .map(|(name, s, rate)| (name, spectrogram(&s, rate, (WINDOW_S * rate) as usize)))
            .collect(),
        top_hz: 1200.0,
        range_db: 50.0,
    };
    folder.drawing("chirp.png", &figure)
}

/// What every method hears in a film; first what is heard where every row is known exactly.
pub(super) fn all(film: &Film, what: &str) -> Vec<(&'static str, Sound)> {
    let mut heard = vec![(
        "true rows, gaps filled",
        hear(film, &film.recording.truth_px),
    )];
    let measured = film.measured(what);
    heard.extend(
        measured
            .into_iter()
            .map(|(name, shifts)| (name, hear(film, &shifts))),
    );
    heard
}

/// A method's name as part of a file's.
pub(super) fn file_name(name: &str) -> String {
    let words: Vec<&str> = name
        .split(|c: char| !c.is_alphanumeric())
        .filter(|w| !w.is_empty())
        .collect();
    words.join("-").to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::Method;

    #[test]
    fn names_become_files() {
        assert_eq!(file_name("thesis, all sub-bands"), "thesis-all-sub-bands");
    }

    /// A short ramp through camera and tracker is followed.
    #[test]
    fn rowtone_follows_the_ramp() {
        let ramp = ramp(0.25);
        let motion = Motion {
            chirps: vec![ramp],
            ..Motion::default()
        };
        let film = Setup::thesis(48, 30, 2).film(&motion).unwrap();
        let heard = hear(&film, &film.core.shifts(&film.recording.clip));
        let (wrong, rms) = followed(&heard, &ramp);
        assert!(wrong < 0.3 && rms < 10.0, "{wrong} {rms}");
    }
}
