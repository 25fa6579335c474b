//! Music and speech (Figs. 5.5, 5.6, Tables 5.1, 5.2).

use std::fmt::Write;

use super::chirp::{all, file_name};
use super::film::Setup;
use super::sound::{compared, truth};
use super::{Folder, Scale};
use crate::LabError;
use crate::figure::shades::Panels;
use crate::sound::sounds::{self, RATE_HZ};
use crate::sound::stft::spectrogram;
use host_sim::{Motion, Sound};

/// A sound as a motion of at most 0.5 px.
pub(super) fn motion(samples: &[f64]) -> Motion {
    Motion {
        sound: Some(Sound {
            rate_hz: RATE_HZ,
            amplitude_px: 0.5,
            samples: samples.iter().map(|&v| v as f32).collect(),
        }),
        ..Motion::default()
    }
}

/// A table line for each method, of one sound filmed with one set-up.
pub(super) fn heard(
    folder: &Folder,
    setup: &Setup,
    sound: &sounds::Sound,
    prefix: &str,
    text: &mut String,
) -> Result<Panels, LabError> {
    let seconds = f64::from(setup.frames) / setup.sensor.fps;
    let count = ((seconds * RATE_HZ) as usize).min(sound.samples.len());
    let film = setup.film(&motion(&sound.samples[..count]))?;
    let mut panels = Vec::new();
    for (name, heard) in all(&film, prefix) {
        let found = compared(&film, &heard);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {name} | {:.1} | {:.1e} | {:.2} | {:+.2} |",
            sound.name,
            found.snr_db,
            found.mse,
            found.gain * peak(&truth(&film, &heard)),
            1e3 * found.delay_s
        );
        let spectrum = |s: &[f64]| spectrogram(s, heard.rate_hz, (0.06 * heard.rate_hz) as usize);
        if panels.is_empty() {
            let truth = truth(&film, &heard);
            folder.wav(&format!("{prefix}-truth.wav"), &truth, heard.rate_hz)?;
            panels.push(("truth".to_owned(), spectrum(&truth)));
        } else {
            let file = format!("{prefix}-{}.wav", file_name(name));
            folder.wav(&file, &heard.samples, heard.rate_hz)?;
            panels.push((name.to_owned(), spectrum(&heard.samples)));
        }
    }
    Ok(Panels {
        title: format!("{}, as each method hears it", sound.name),
        panels,
        top_hz: 1200.0,
        range_db: 50.0,
    })
}

fn peak(samples: &[f64]) -> f64 {
    samples.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// Head of the table.
pub(super) const HEAD: &str = "SNR = 10·log10(Σ I² / Σ (Î − I)²) and mean of (Î − I)² after gain and delay of Î are fitted, I scaled to a peak of 1, \
    both below 1000 Hz\n\n\
    | sound | method | SNR, dB | MSE | gain fitted | delay fitted, ms |\n| --- | --- | --: | --: | --: | --: |\n";

/// A table, figures and sounds.
///
/// # Errors
/// [`LabError`] for what cannot be simulated or written.
pub fn run(folder: &Folder, scale: Scale) -> Result<(), LabError> {
    let setup = Setup::thesis(scale.sound_cols, scale.sound_frames, scale.seed).sharp(scale.sharp);
    let mut text = format!(
        "0.5 px at the loudest, {}x1048 at 120 fps, {} frames, seed {}{}. {HEAD}",
        scale.sound_cols,
        scale.sound_frames,
        scale.seed,
        scale.of_what()
    );
    let music = heard(folder, &setup, &sounds::music(), "music", &mut text)?;
    let speech = heard(folder, &setup, &sounds::speech(), "speech", &mut text)?;
    folder.table("voices.md", &text)?;
    folder.drawing("music.png", &music)?;
    folder.drawing("speech.png", &speech)
}
