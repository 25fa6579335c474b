//! The spectrum of a recording and its noise floor as CSV.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rowtone::tracker::Axes;
use rowtone_files::WholeFile;
use rowtone_measure::analysis::{Event, Plan};
use rowtone_measure::periodogram::{AxisSpectrum, Periodogram, Spectrum};

use crate::failure::Failure;

/// A file of `--spectrum` in the making.
#[derive(Debug)]
pub(crate) struct SpectrumFile {
    path: PathBuf,
    periodogram: Periodogram,
    axes: Axes,
    um_per_px: Option<f64>,
}

impl SpectrumFile {
    /// What can be said before anything is measured: the ending, and whether the file can be written.
    ///
    /// # Errors
    /// [`Failure::Usage`] for another ending than `.csv`, [`Failure::Input`] where it cannot be written.
    pub(crate) fn check(path: &Path) -> Result<(), Failure> {
        let ending = path.extension().and_then(|ending| ending.to_str());
        if !ending.is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let path = path.display();
            return Err(Failure::usage(format!(
                "--spectrum {path}: give a name that ends with .csv"
            )));
        }
        Failure::unless_writable(path)
    }

    /// The spectrum of what is measured after this plan, with this scale in µm a pixel.
    pub(crate) fn new(path: PathBuf, plan: &Plan, axes: Axes, um_per_px: Option<f64>) -> Self {
        let band_hz = (plan.min_hz(), plan.max_hz());
        Self {
            path,
            periodogram: Periodogram::new(plan.groups(), axes, band_hz),
            axes,
            um_per_px,
        }
    }

    /// Takes what an analysis says.
    pub(crate) fn hear(&mut self, event: &Event<'_>) {
        match event {
            Event::Frame(start_ns) => self.periodogram.start(*start_ns),
            Event::Sample(sample) => self.periodogram.sample(sample),
            Event::Report(report, _) => self.periodogram.report(report),
            Event::Part(_) | Event::Note(_) => {}
        }
    }

    /// Writes the file, whole or not at all; none where nothing was measured.
    ///
    /// # Errors
    /// [`Failure::Input`] where it cannot be written.
    pub(crate) fn save(self) -> Result<(), Failure> {
        let Some(spectrum) = self.periodogram.spectrum() else {
            return Ok(());
        };
        let names: &[&str] = match self.axes {
            Axes::X => &["x"],
            Axes::Xy => &["x", "y"],
        };
        let written = WholeFile::create(&self.path).and_then(|mut file| {
            write(&mut file, &spectrum, names, self.um_per_px)?;
            file.finish()
        });
        written.map_err(|e| Failure::writing(&self.path.display().to_string(), &e))
    }
}

/// As CSV: `hz,x_px,x_floor_px,y_px,y_floor_px`, with a scale the same in µm behind; empty where nothing is known along an
/// axis.
fn write(
    to: &mut impl Write,
    spectrum: &Spectrum,
    names: &[&str],
    um_per_px: Option<f64>,
) -> io::Result<()> {
    let scales = [Some(("px", 1.0)), um_per_px.map(|um| ("um", um))];
    write!(to, "hz")?;
    for (unit, _) in scales.iter().flatten() {
        for name in names {
            write!(to, ",{name}_{unit},{name}_floor_{unit}")?;
        }
    }
    writeln!(to)?;
    for (i, hz) in spectrum.hz.iter().enumerate() {
        write!(to, "{hz:.4}")?;
        for (_, scale) in scales.iter().flatten() {
            for axis in spectrum.axes.iter().take(names.len()) {
                let at = |of: &AxisSpectrum| Some((*of.amplitude_px.get(i)?, *of.floor_px.get(i)?));
                match axis.as_ref().and_then(at) {
                    Some((px, floor)) => write!(to, ",{:.4e},{:.4e}", px * scale, floor * scale)?,
                    None => write!(to, ",,")?,
                }
            }
        }
        writeln!(to)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_the_header_and_what_is_not_known_is_empty() {
        let spectrum = Spectrum {
            hz: vec![1.0, 1.125],
            axes: [
                Some(AxisSpectrum {
                    amplitude_px: vec![0.25, 0.5],
                    floor_px: vec![1e-4, 2e-4],
                }),
                None,
            ],
        };
        let mut text = Vec::new();
        write(&mut text, &spectrum, &["x", "y"], Some(10.0)).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "hz,x_px,x_floor_px,y_px,y_floor_px,x_um,x_floor_um,y_um,y_floor_um\n\
             1.0000,2.5000e-1,1.0000e-4,,,2.5000e0,1.0000e-3,,\n\
             1.1250,5.0000e-1,2.0000e-4,,,5.0000e0,2.0000e-3,,\n"
        );
        let mut text = Vec::new();
        write(&mut text, &spectrum, &["x"], None).unwrap();
        assert!(text.starts_with(b"hz,x_px,x_floor_px\n1.0000,2.5000e-1,1.0000e-4\n"));
    }
}
