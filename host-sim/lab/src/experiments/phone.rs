//! A phone: 30 frames a second, 720 rows of 27.8 µs, so that 40 % of the time nothing is recorded.

use std::fmt::Write;

use super::film::Setup;
use super::voices::{HEAD, heard};
use super::{Folder, Scale, working_on};
use crate::LabError;
use crate::methods::study::score;
use crate::sound::sounds;
use host_sim::{Motion, Tone};

/// The phone's camera.
fn setup(cols: u32, frames: u32, seed: u64) -> Setup {
    let mut setup = Setup::thesis(cols, frames, seed);
    let sensor = &mut setup.sensor;
    (sensor.rows, sensor.fps) = (720, 30.0);
    (sensor.line_time_ps, sensor.exposure_ns) = (27_777_778, 250_000);
    (sensor.full_well_e, sensor.read_noise_e) = (5_000.0, 8.0);
    setup
}

/// Tables and sounds.
///
/// # Errors
/// [`LabError`] for what cannot be simulated or written.
pub fn run(folder: &Folder, scale: Scale) -> Result<(), LabError> {
    let mut text = format!(
        "30 fps, {}x720, 27.8 µs a row (40 % blank), exposed for 0.25 ms. Tones of 0.3 px, 30 frames, seed {}\n\n\
         | Hz | method | noise / bound | amplitude | frequency error, Hz | largest ghost at ±30, 60, 90 Hz |\n\
         | --: | --- | --: | --: | --: | --: |\n",
        scale.sound_cols, scale.seed
    );
    // None a multiple of 30: that stands still in the picture and cannot be seen.
    for hz in [83.0, 217.0, 437.0] {
        let tone = Tone {
            hz,
            amplitude_px: 0.3,
            phase_rad: 0.7,
        };
        let motion = Motion {
            tones: vec![tone],
            ..Motion::default()
        };
        let film = setup(scale.sound_cols, 30, scale.seed).film(&motion)?;
        for method in film.methods() {
            working_on(&format!("phone: {hz} Hz, {}", method.name()));
            let s = score(method.as_ref(), &film.recording, hz);
            let error = s
                .hz_error
                .map_or("not found".to_owned(), |e| format!("{e:+.4}"));
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| {hz} | {} | {:.2} | {:+.1} % | {error} | {:.2} % |",
                s.method,
                s.noise_over_bound,
                100.0 * s.amplitude_error,
                100.0 * s.ghost
            );
        }
    }
    let _ = write!(text, "\n{} frames. {HEAD}", scale.sound_frames / 4);
    let setup = setup(scale.sound_cols, scale.sound_frames / 4, scale.seed);
    for (name, sound) in [
        ("phone-music", sounds::music()),
        ("phone-speech", sounds::speech()),
    ] {
        heard(folder, &setup, &sound, name, &mut text)?;
    }
    folder.table("phone.md", &text)
}
