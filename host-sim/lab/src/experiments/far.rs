//! Far shifts (Figs. 5.8 and 5.9): what a phase tells once the picture has moved by more than half its wavelength.
//!
//! A still object is put at ever farther places; each frame is compared with the first. The shearlet's phase rows are
//! correlated, the steerable pyramid's phases subtracted. This project's tracker sees the same frames.

use std::fmt::Write;

use super::Folder;
use super::film::Setup;
use crate::LabError;
use crate::figure::lines::{Curve, Lines};
use crate::methods::thesis::{Reference, Thesis};
use crate::methods::visual::{By, VisualMicrophone};
use crate::methods::{Clip, Method, Shifts};
use host_sim::{Motion, Step};
use rowtone_linear::median;

/// Places of the object, px.
const PLACES: [f64; 12] = [
    0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 15.0, 20.0,
];

/// Each row's shift against the first frame, by one sub-band of the shearlet each.
fn shearlet(clip: &Clip, thesis: &Thesis) -> Vec<Shifts> {
    thesis.by_band(clip, Reference::First)
}

/// Median over all rows (and sub-bands) of each frame against the first, and the share within half a pixel of the truth.
fn read(all: &[Shifts]) -> Vec<(f64, f64)> {
    (0..PLACES.len())
        .map(|n| {
            let values: Vec<f64> = all
                .iter()
                .flat_map(|s| s[n].iter().zip(&s[0]).map(|(v, home)| v - home))
                .collect();
            let right = values
                .iter()
                .filter(|v| (*v - PLACES[n]).abs() < 0.5)
                .count();
            let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            (median(&known), right as f64 / values.len().max(1) as f64)
        })
        .collect()
}

/// A table and a figure.
///
/// # Errors
/// [`LabError`] for what cannot be simulated or written.
pub fn run(folder: &Folder) -> Result<(), LabError> {
    let mut setup = Setup::thesis(256, PLACES.len() as u32, 1);
    setup.sensor.rows = 96;
    let frame_s = 1.0 / setup.sensor.fps;
    let motion = Motion {
        steps: PLACES
            .iter()
            .enumerate()
            .map(|(n, &value)| Step {
                // In the blank time before the frame.
                t_s: (n as f64 - 0.1) * frame_s,
                value,
            })
            .collect(),
        ..Motion::default()
    };
    let film = setup.film(&motion)?;
    let clip = &film.recording.clip;
    let columns = [
        (
            "shearlet, all sub-bands",
            read(&shearlet(clip, &Thesis::default())),
        ),
        (
            "shearlet, coarse sub-bands",
            read(&shearlet(clip, &Thesis::coarse())),
        ),
        (
            "steerable pyramid, by frame",
            read(&[VisualMicrophone { by: By::Frame }.shifts(clip)]),
        ),
        ("rowtone", read(&[film.core.shifts(clip)])),
    ];
    let mut text = String::from(
        "Shift against the first frame, px (median over rows and sub-bands), and the share of them within half a pixel \
         of the truth; 256x96, seed 1\n\n| true |",
    );
    for (name, _) in &columns {
        // Writing to a string cannot fail.
        let _ = write!(text, " {name} | |");
    }
    text.push_str("\n| --: |");
    text.push_str(&" --: | --: |".repeat(columns.len()));
    for (n, place) in PLACES.iter().enumerate() {
        let _ = write!(text, "\n| {place} |");
        for (_, read) in &columns {
            let _ = write!(text, " {:.2} | {:.0} % |", read[n].0, 100.0 * read[n].1);
        }
    }
    text.push('\n');
    folder.table("far.md", &text)?;
    let curve = |(name, read): &(&str, Vec<(f64, f64)>)| Curve {
        name: (*name).to_owned(),
        points: PLACES.iter().zip(read).map(|(p, r)| (*p, r.0)).collect(),
    };
    let figure = Lines {
        title: "A still object put at farther and farther places".to_owned(),
        axes: ["true shift, px", "found, px"],
        across: (0.0, 21.0),
        up: (-5.0, 25.0),
        curves: columns.iter().map(curve).collect(),
        dots: false,
    };
    folder.drawing("far.svg", &figure)
}
