//! The thesis's pipeline: shearlet phases, phase correlation of phase rows, sub-bands aligned and summed.
//!
//! 1. Every frame is split by [`super::shearlet`]; of each sub-band of the horizontal cone only the phase is kept.
//! 2. Algorithm 1: the reference phase is the mean phase of all frames (of unit vectors, as phases wrap).
//! 3. Each row's phase is correlated with the reference's row ([`Reading`]); the peak is interpolated after Foroosh.
//! 4. Algorithm 2: the signals of all sub-bands are shifted to where their inner product with the strongest one is
//!    largest, and averaged.
//!
//! Algorithm 3 (gaps by an autoregressive model) and the Butterworth filter are in [`rowtone_measure::restore`].

use super::correlate::{PeakFit, PhaseCorrelation};
use super::fourier::C;
use super::shearlet::{Cone, DIRECTIONS, Pyramid};
use super::{Clip, Method, Shifts, remove_row_means};
use rowtone_linear::dot;

/// Furthest that one sub-band is shifted against another, rows.
const FURTHEST: isize = 8;

/// From so many columns on a row of coarse phases has jumps enough for its angles to be correlated.
const WIDE_COLS: usize = 128;

/// The thesis's method.
#[derive(Clone, Debug)]
pub struct Thesis {
    /// Directions of each scale, finest first.
    pub directions: Vec<usize>,
    /// Scales that are used; all of the pyramid's are split off all the same.
    pub scales: std::ops::Range<usize>,
}

impl Default for Thesis {
    fn default() -> Self {
        Self {
            directions: DIRECTIONS.to_vec(),
            scales: 0..DIRECTIONS.len(),
        }
    }
}

impl Thesis {
    /// Only the two coarse scales: a lens leaves little but noise in the fine ones, and a phase without its amplitude
    /// counts for as much there as anywhere.
    pub fn coarse() -> Self {
        Self {
            scales: 2..DIRECTIONS.len(),
            ..Self::default()
        }
    }
}

impl Method for Thesis {
    fn name(&self) -> &'static str {
        if self.scales.start == 0 {
            "thesis, all sub-bands"
        } else {
            "thesis, coarse sub-bands"
        }
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        align_and_sum(self.by_band(clip, Reference::Mean))
    }
}

/// What the rows of phases are correlated with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The mean phase of all frames (Algorithm 1).
    Mean,
    /// The first frame's phase.
    First,
}

impl Thesis {
    /// Each row's shift in every frame, by one sub-band that is used each.
    ///
    /// Frames are split anew for the mean and for the shifts: all coefficients of a long recording have no room.
    pub fn by_band(&self, clip: &Clip, reference: Reference) -> Vec<Shifts> {
        let pyramid = Pyramid::new(clip.width, clip.height, &self.directions);
        let used: Vec<usize> = self.used(&pyramid).collect();
        let split = |frame: &Vec<f64>| {
            let spectrum = pyramid.bank.spectrum(frame);
            let bands = used.iter().map(|&band| pyramid.bank.band(&spectrum, band));
            bands.collect::<Vec<_>>()
        };
        let mut means = vec![MeanPhase::default(); used.len()];
        let count = match reference {
            Reference::Mean => clip.frames.len(),
            Reference::First => 1,
        };
        for frame in clip.frames.iter().take(count) {
            let bands = split(frame);
            means.iter_mut().zip(&bands).for_each(|(m, b)| m.add(b));
        }
        let correlation = PhaseCorrelation::new(clip.width);
        let reading = self.reading(clip.width);
        let references: Vec<Vec<Vec<C>>> = means
            .into_iter()
            .map(|mean| phase_rows(&correlation, &mean.0, clip.width, reading))
            .collect();
        let mut shifts = vec![Shifts::new(); used.len()];
        for frame in &clip.frames {
            for ((band, reference), shifts) in split(frame).iter().zip(&references).zip(&mut shifts)
            {
                let rows = phase_rows(&correlation, band, clip.width, reading);
                let pairs = rows.iter().zip(reference);
                shifts.push(
                    pairs
                        .map(|(row, home)| correlation.shift(row, home, PeakFit::Foroosh))
                        .collect(),
                );
            }
        }
        shifts
    }

    /// The reading that does better (docs/results.md): angles for coarse sub-bands of a picture that is wide enough.
    fn reading(&self, width: usize) -> Reading {
        if self.scales.start > 0 && width >= WIDE_COLS {
            Reading::Angles
        } else {
            Reading::UnitVectors
        }
    }

    /// Sub-bands of the horizontal cone in the scales that are used.
    fn used(&self, pyramid: &Pyramid) -> impl Iterator<Item = usize> {
        (0..pyramid.bands.len()).filter(|&b| {
            let band = pyramid.bands[b];
            band.cone == Cone::Horizontal && self.scales.contains(&band.scale)
        })
    }
}

/// Algorithm 1: the mean phase of all frames, as a sum of unit vectors, for phases wrap.
#[derive(Clone, Debug, Default)]
struct MeanPhase(Vec<C>);

impl MeanPhase {
    fn add(&mut self, coefficients: &[C]) {
        self.0.resize(coefficients.len(), C::new(0.0, 0.0));
        for (sum, c) in self.0.iter_mut().zip(coefficients) {
            let size = c.norm();
            if size > 0.0 {
                *sum += c / size;
            }
        }
    }
}

/// What a row of a phase picture is made of. The thesis's words fit both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Angles, −π to π. Their jumps move with the picture and fill the spectrum, so that peaks are sharp; where a row has
    /// too few of them, or holds noise, peaks are taken far away.
    Angles,
    /// Unit vectors. They fill one side of the spectrum only, for which Foroosh's formula was not made, and their peaks are
    /// blunt; but few are taken far away.
    UnitVectors,
}

impl Reading {
    fn value(self, coefficient: C) -> C {
        let size = coefficient.norm();
        match self {
            Self::Angles => C::new(coefficient.arg(), 0.0),
            Self::UnitVectors if size > 0.0 => coefficient / size,
            Self::UnitVectors => C::new(1.0, 0.0),
        }
    }
}

/// Spectrum of every row of a phase picture.
fn phase_rows(
    correlation: &PhaseCorrelation,
    coefficients: &[C],
    width: usize,
    reading: Reading,
) -> Vec<Vec<C>> {
    let rows = coefficients.chunks_exact(width);
    rows.map(|row| {
        let phases: Vec<C> = row.iter().map(|&c| reading.value(c)).collect();
        correlation.spectrum(&phases)
    })
    .collect()
}

/// Algorithm 2: all signals moved to their largest inner product with the strongest, and averaged.
pub fn align_and_sum(mut signals: Vec<Shifts>) -> Shifts {
    signals.iter_mut().for_each(remove_row_means);
    let flat: Vec<Vec<f64>> = signals
        .iter()
        .map(|s| {
            s.iter()
                .flatten()
                .map(|v| if v.is_finite() { *v } else { 0.0 })
                .collect()
        })
        .collect();
    let Some(first) = flat.first() else {
        return Vec::new();
    };
    let height = signals[0].first().map_or(1, Vec::len).max(1);
    let mut sum = vec![0.0; first.len()];
    // The strongest among those that are not mere noise: the one that agrees best with the sum of all.
    let total: Vec<f64> = (0..first.len())
        .map(|i| flat.iter().map(|s| s[i]).sum())
        .collect();
    let agreement = |s: &[f64]| dot(s, &total) / dot(s, s).sqrt().max(f64::MIN_POSITIVE);
    let lead = (0..flat.len())
        .max_by(|&a, &b| agreement(&flat[a]).total_cmp(&agreement(&flat[b])))
        .unwrap_or(0);
    let furthest = FURTHEST.min(first.len() as isize / 8);
    for signal in &flat {
        let best = (-furthest..=furthest)
            .max_by(|&a, &b| {
                shifted_product(&flat[lead], signal, a).total_cmp(&shifted_product(
                    &flat[lead],
                    signal,
                    b,
                ))
            })
            .unwrap_or(0);
        for (i, slot) in sum.iter_mut().enumerate() {
            let from = (i as isize + best).clamp(0, signal.len() as isize - 1) as usize;
            *slot += signal[from] / flat.len() as f64;
        }
    }
    sum.chunks(height).map(<[f64]>::to_vec).collect()
}

/// Inner product of `a` with `b` moved by `lag`.
fn shifted_product(a: &[f64], b: &[f64], lag: isize) -> f64 {
    let (from_a, from_b) = ((-lag).max(0) as usize, lag.max(0) as usize);
    let count = a.len().saturating_sub(from_a.max(from_b));
    dot(&a[from_a..from_a + count], &b[from_b..from_b + count])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sub_bands_are_moved_together() {
        let wave = |lag: usize| -> Shifts {
            vec![(0..200).map(|y| (0.2 * (y + lag) as f64).sin()).collect(); 3]
        };
        let joined = align_and_sum(vec![wave(0), wave(0), wave(3)]);
        // Means over the three equal frames are removed, so nothing is left here...
        assert!(joined.iter().flatten().all(|v| v.abs() < 1e-9));
        // ...and with three different ones the late one falls into step.
        let mut signals = vec![wave(0), wave(0), wave(3)];
        for signal in &mut signals {
            for (n, frame) in signal.iter_mut().enumerate() {
                frame.iter_mut().for_each(|v| *v *= n as f64 - 1.0);
            }
        }
        let truth = signals[0].clone();
        let joined = align_and_sum(signals);
        let middle = 20..180;
        let error: f64 = middle
            .clone()
            .map(|y| (joined[2][y] - truth[2][y]).abs())
            .fold(0.0, f64::max);
        assert!(error < 0.02, "{error}");
    }

    /// The 15 pixels of Fig. 5.8: every sub-band of the horizontal cone tells them, row by row, where the phase of a
    /// sub-band as such has long turned round.
    #[test]
    fn fifteen_pixels_are_told_by_every_sub_band() {
        let (width, height, by) = (96, 48, 15);
        let picture = super::super::bank::tests::noise(width * height);
        let moved: Vec<f64> = (0..width * height)
            .map(|i| picture[i / width * width + (i % width + width - by) % width])
            .collect();
        let pyramid = Pyramid::new(width, height, &DIRECTIONS);
        let [home, moved] = [picture, moved].map(|p| pyramid.bank.spectrum(&p));
        let correlation = PhaseCorrelation::new(width);
        let used: Vec<usize> = Thesis::default().used(&pyramid).collect();
        assert_eq!(used.len(), 16);
        for (band, reading) in used
            .iter()
            .flat_map(|&b| [(b, Reading::Angles), (b, Reading::UnitVectors)])
        {
            let [home, moved] = [&home, &moved]
                .map(|s| phase_rows(&correlation, &pyramid.bank.band(s, band), width, reading));
            let shifts: Vec<f64> = moved
                .iter()
                .zip(&home)
                .map(|(m, h)| correlation.shift(m, h, PeakFit::Foroosh))
                .collect();
            // Coarse rows' phases are so smooth that some frequencies hold nothing but rounding.
            for (y, shift) in shifts.iter().enumerate() {
                assert!(
                    (shift - by as f64).abs() < 0.3,
                    "band {band}, {reading:?}, row {y}: {shift}"
                );
            }
            let mean = shifts.iter().sum::<f64>() / height as f64;
            assert!(
                (mean - by as f64).abs() < 0.03,
                "band {band}, {reading:?}: {mean}"
            );
        }
    }

    /// Behind a lens the finest sub-bands hold noise alone. In six frames the reference holds a good part of each frame's own
    /// noise, which keeps peaks at home; in many frames it does not, and they lie anywhere in the row.
    #[test]
    fn the_finest_sub_bands_are_lost_in_long_recordings() {
        use crate::methods::study::record;
        let far = |frames, scales| {
            let mut config = host_sim::Config::default();
            (config.sensor.cols, config.sensor.rows, config.frames) = (128, 16, frames);
            let clip = record(config).unwrap().clip;
            let thesis = Thesis {
                scales,
                ..Thesis::default()
            };
            let shifts = thesis.by_band(&clip, Reference::Mean);
            let all = shifts.iter().flatten().flatten();
            let far = all.clone().filter(|v| v.abs() > 2.0).count();
            far as f64 / all.count() as f64
        };
        let (few, many) = (far(6, 0..1), far(60, 0..1));
        assert!(many > 0.4 && few < 0.5 * many, "{few} {many}");
        let coarse = far(60, 2..4);
        assert!(coarse < 0.05, "{coarse}");
    }

    /// Algorithm 1: phases wrap, so their mean is that of unit vectors.
    #[test]
    fn the_reference_is_the_mean_around_the_circle() {
        let mut mean = MeanPhase::default();
        for (size, angle) in [(1.0, 3.1), (5.0, -3.1), (2.0, 3.1), (0.1, -3.1), (0.0, 0.0)] {
            mean.add(&[C::from_polar(size, angle)]);
        }
        assert!((mean.0[0].arg().abs() - std::f64::consts::PI).abs() < 1e-9);
    }

    /// A tone of half a pixel through the simulated camera.
    #[test]
    fn a_tone_is_heard() {
        use crate::methods::study::{record, score};
        let mut config = host_sim::Config::default();
        (config.sensor.cols, config.sensor.rows, config.frames) = (96, 100, 8);
        config.sensor.line_time_ps = 100_000_000;
        config.motion.tones.push(host_sim::Tone {
            hz: 83.0,
            amplitude_px: 0.5,
            phase_rad: 0.4,
        });
        let score = score(&Thesis::coarse(), &record(config).unwrap(), 83.0);
        assert!(score.amplitude_error.abs() < 0.35, "{score:?}");
        assert!(score.hz_error.is_some_and(|e| e.abs() < 2.0), "{score:?}");
    }
}
