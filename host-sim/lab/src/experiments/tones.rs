//! The thesis's single tones (Figs. 5.2 and 5.3): six frames at 120 fps of 1048 rows, 75 to 325 Hz.

use std::fmt::Write;

use super::film::Setup;
use super::{Folder, Scale};
use crate::LabError;
use crate::figure::lines::{Curve, Lines};
use crate::methods::remove_row_means;
use crate::methods::study::Fit;
use host_sim::{Motion, Tone};

/// Where the strongest tone is looked for, Hz.
const BAND_HZ: (f64, f64) = (40.0, 400.0);
/// A tone that is found farther away is another one, Hz.
const OTHER_HZ: f64 = 10.0;

/// One tone by one method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The strongest frequency, Hz.
    pub hz: f64,
    /// Its amplitude over the true one.
    pub gain: f64,
}

/// Films and measures one tone: by each method in turn, with its name.
///
/// # Errors
/// [`LabError`] for what cannot be simulated.
pub fn measure(
    hz: f64,
    amplitude_px: f64,
    setup: &Setup,
) -> Result<Vec<(&'static str, Option<Found>)>, LabError> {
    let tone = Tone {
        hz,
        amplitude_px,
        phase_rad: 0.7,
    };
    let motion = Motion {
        tones: vec![tone],
        ..Motion::default()
    };
    let film = setup.film(&motion)?;
    Ok(film
        .measured(&format!("{hz} Hz"))
        .into_iter()
        .map(|(name, mut shifts)| {
            remove_row_means(&mut shifts);
            let fit = Fit::new(&film.recording, &shifts);
            let found = fit.strongest(&shifts, BAND_HZ).map(|hz| Found {
                hz,
                gain: {
                    let [c, s] = fit.amplitude(&shifts, hz);
                    c.hypot(s) / amplitude_px
                },
            });
            (name, found)
        })
        .collect())
}

/// The whole sweep: a table and a figure.
///
/// # Errors
/// [`LabError`] for what cannot be simulated or written.
pub fn run(folder: &Folder, scale: Scale, amplitude_px: f64) -> Result<(), LabError> {
    let cols = scale.tone_cols;
    let setup = Setup::thesis(cols, 6, 1).sharp(scale.sharp);
    let mut text = format!(
        "Error of the strongest frequency between {} and {} Hz, Hz, and amplitude over the true one; {amplitude_px} px, \
         six frames of {cols}x1048 at 120 fps, seed 1{}\n\n| Hz |",
        BAND_HZ.0,
        BAND_HZ.1,
        scale.of_what()
    );
    let mut curves: Vec<Curve> = Vec::new();
    for k in 0..=10 {
        let hz = 75.0 + 25.0 * f64::from(k);
        let line = measure(hz, amplitude_px, &setup)?;
        // Writing to a string cannot fail.
        if k == 0 {
            line.iter().for_each(|(name, _)| {
                let _ = write!(text, " {name} | |");
                curves.push(Curve {
                    name: (*name).to_owned(),
                    points: Vec::new(),
                });
            });
            text.push_str("\n| --: |");
            text.push_str(&" --: | --: |".repeat(line.len()));
        }
        let _ = write!(text, "\n| {hz} |");
        for ((_, found), curve) in line.iter().zip(&mut curves) {
            match found {
                Some(f) if (f.hz - hz).abs() < OTHER_HZ => {
                    let _ = write!(text, " {:+.3} | {:.2} |", f.hz - hz, f.gain);
                }
                Some(f) => {
                    let _ = write!(text, " hears {:.0} Hz | {:.2} |", f.hz, f.gain);
                }
                None => text.push_str(" nothing | |"),
            }
            curve.points.extend(found.map(|f| (hz, f.hz)));
        }
    }
    text.push('\n');
    folder.table("tones.md", &text)?;
    let figure = Lines {
        title: format!("Strongest frequency found, six frames of {cols}x1048"),
        axes: ["true frequency, Hz", "found, Hz"],
        across: (60.0, 340.0),
        up: (0.0, BAND_HZ.1),
        curves,
        dots: true,
    };
    folder.drawing("tones.svg", &figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The thesis's hardest tone for it, close to a multiple of the frame rate, in a narrow picture.
    #[test]
    fn a_tone_near_the_frame_rate_is_found_in_six_frames() {
        let found = measure(125.0, 0.5, &Setup::thesis(48, 6, 3)).unwrap();
        let (name, ours) = found[0];
        assert_eq!((name, found.len()), ("rowtone", 4));
        let ours = ours.unwrap();
        assert!((ours.hz - 125.0).abs() < 0.5, "{ours:?}");
        assert!((ours.gain - 1.0).abs() < 0.1, "{ours:?}");
    }
}
