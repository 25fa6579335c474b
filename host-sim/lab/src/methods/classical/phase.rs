//! Textbook phase correlation of a row, tapered.

use super::super::correlate::{PeakFit, PhaseCorrelation};
use super::super::fourier::C;

/// Where the peak of the phase correlation lies, px.
pub(super) fn shift(
    correlation: &PhaseCorrelation,
    row: &[f64],
    reference: &[f64],
    fit: PeakFit,
) -> f64 {
    let spectrum = |row: &[f64]| {
        let mean = row.iter().sum::<f64>() / row.len() as f64;
        let tapered: Vec<C> = row
            .iter()
            .enumerate()
            .map(|(x, v)| {
                let taper = (std::f64::consts::PI * (x as f64 + 0.5) / row.len() as f64)
                    .sin()
                    .powi(2);
                C::new(taper * (v - mean), 0.0)
            })
            .collect();
        correlation.spectrum(&tapered)
    };
    correlation.shift(&spectrum(row), &spectrum(reference), fit)
}

#[cfg(test)]
mod tests {
    use super::super::tests::gain;
    use super::*;

    /// White rows moved by whole pixels and tapered like a picture: a single high sample, which is no Gaussian.
    #[test]
    fn both_peaks_are_found_on_white_rows() {
        let correlation = PhaseCorrelation::new(160);
        let white = super::super::super::bank::tests::noise(160);
        for (fit, wide) in [(PeakFit::Foroosh, 0.1), (PeakFit::Gaussian, 0.5)] {
            for by in [-3.0, 0.0, 7.0] {
                let moved: Vec<f64> = (0..160)
                    .map(|x| white[(x as isize - by as isize).rem_euclid(160) as usize])
                    .collect();
                let found = shift(&correlation, &moved, &white, fit);
                assert!((found - by).abs() < wide, "{fit:?}: {found} for {by}");
            }
        }
    }

    /// On a blurred row most frequencies hold nothing that could be compared: both under-read parts of a pixel.
    #[test]
    fn smooth_rows_are_read_badly() {
        let correlation = PhaseCorrelation::new(160);
        for fit in [PeakFit::Foroosh, PeakFit::Gaussian] {
            let found = gain(|row, reference| shift(&correlation, row, reference, fit));
            assert!((0.3..1.3).contains(&found), "{fit:?}: {found}");
        }
    }
}
