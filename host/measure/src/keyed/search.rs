//! Which tones the key frames hold.

use rowtone_fourier::{Complex64, Fourier};

use super::data::Data;
use super::fit::{Design, Fitted, Orbit};

/// A tone counts at so many standard deviations and so large a fall of χ²; where all frames do not show it, at a larger one:
/// key frames alone are few, and there are many frequencies.
const SURE_SD: f64 = 5.0;
const SURE: f64 = 28.0;
const SURE_ALONE: f64 = 44.0;
/// Frequencies that differ by less than this in χ² cannot be told apart.
const ALIKE: f64 = 20.0;
/// Then the one that all frames show so many times as large as the others is taken.
const LARGER: f64 = 2.0;
/// Images of a tone at multiples of the key frames' rate are tried so far away, Hz.
const IMAGES_HZ: f64 = 70.0;
/// Most tones.
const MOST_TONES: usize = 8;
/// Peaks of the key rows' own spectrum that are tried in each round.
const PEAKS: usize = 8;
/// The best so many of all that are tried are refined.
const REFINED: usize = 6;
/// Most points of that spectrum.
const POINTS: usize = 1 << 20;

/// A tone of the whole recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tone {
    pub(super) hz: f64,
    pub(super) orbit: Orbit,
    /// Its frequency cannot be told from an image of it.
    pub(super) ambiguous: bool,
}

/// What all frames show, though too small: a frequency and an amplitude, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hint {
    pub(super) hz: f64,
    pub(super) px: f64,
}

/// What a search found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) tones: Vec<Tone>,
    /// Times of the stated noise along either axis.
    pub(super) scatter: [f64; 2],
}

/// Searches the key rows for tones between two frequencies, Hz, led by what all frames show.
pub(super) fn search(data: &Data, hints: &[Hint], band_hz: (f64, f64)) -> Option<Found> {
    let mut search = Search {
        data,
        hints,
        band_hz,
        design: Design::new(data, [1.0; 2]),
        tones: Vec::new(),
    };
    let mut fitted = search.design.fit()?;
    let mut scatter = data.scatter(&fitted.residual);
    search.design.reweigh(scatter);
    while search.tones.len() < MOST_TONES {
        fitted = search.design.fit()?;
        let Some(found) = search.next(&fitted) else {
            break;
        };
        search.design.push(found.0);
        search.tones.push(found);
        fitted = search.design.fit()?;
        scatter = data.scatter(&fitted.residual);
        search.design.reweigh(scatter);
    }
    let fitted = search.design.fit()?;
    let tones = search.tones.iter().zip(&fitted.orbits);
    Some(Found {
        tones: tones
            .map(|(&(hz, ambiguous), &orbit)| Tone {
                hz,
                orbit,
                ambiguous,
            })
            .filter(|tone| {
                let (px, sd) = tone.orbit.amplitude();
                px > SURE_SD * sd
            })
            .collect(),
        scatter,
    })
}

struct Search<'a> {
    data: &'a Data,
    hints: &'a [Hint],
    band_hz: (f64, f64),
    design: Design<'a>,
    /// Frequency, and whether it is ambiguous.
    tones: Vec<(f64, bool)>,
}

impl Search<'_> {
    /// The tone that explains most of what is left, if it is sure.
    fn next(&mut self, fitted: &Fitted) -> Option<(f64, bool)> {
        let before = fitted.chi2;
        let hints = self.hints.iter().map(|hint| hint.hz);
        let peaks = peaks(self.data, &fitted.residual, self.band_hz);
        let free = hints.chain(peaks).filter(|&hz| self.is_free(hz));
        let places: Vec<f64> = free.collect();
        let mut places: Vec<(f64, f64)> =
            places.into_iter().map(|hz| (hz, self.chi2(hz))).collect();
        places.sort_by(|a, b| b.1.total_cmp(&a.1));
        places.truncate(REFINED);
        let mut best: Option<(f64, f64)> = None;
        for (hz, _) in places {
            if let Some((hz, chi2)) = self.refine(hz)
                && best.is_none_or(|(_, most)| chi2 > most)
            {
                best = Some((hz, chi2));
            }
        }
        let (hz, chi2) = best?;
        if chi2 - before < SURE {
            return None;
        }
        let (hz, ambiguous) = self.among_images(hz, chi2);
        let alone = self.shown_px(hz) == 0.0;
        self.design.push(hz);
        let sure = self.design.fit().is_some_and(|fitted| {
            let least = if alone { SURE_ALONE } else { SURE };
            let last = fitted.orbits.last().map(Orbit::amplitude);
            fitted.chi2 - before > least && last.is_some_and(|(px, sd)| px > SURE_SD * sd)
        });
        self.design.pop();
        sure.then_some((hz, ambiguous))
    }

    /// No tone that is known is here, nor do key frames stand still.
    fn is_free(&self, hz: f64) -> bool {
        let cell = 1.0 / self.data.span_s().max(1e-9);
        let (low, high) = self.band_hz;
        let away = |(known, _): &(f64, bool)| (hz - known).abs() > cell;
        (low..=high).contains(&hz) && self.tones.iter().all(away)
    }

    /// χ² with a tone of this frequency; what is no fit explains nothing.
    fn chi2(&mut self, hz: f64) -> f64 {
        self.design.push(hz);
        let chi2 = self.design.chi2();
        self.design.pop();
        chi2
    }

    /// The best frequency near this one, and χ² there.
    fn refine(&mut self, hz: f64) -> Option<(f64, f64)> {
        let reach = (0.2 * self.data.rate_hz()).min(0.25 / self.data.span_s().max(1e-9));
        let (mut best, mut step) = ((hz, self.chi2(hz)), 0.5 * reach);
        let middle = hz;
        while step > 0.02 * reach {
            let mut moved = false;
            for hz in [best.0 - step, best.0 + step] {
                if (hz - middle).abs() <= 1.5 * reach {
                    let chi2 = self.chi2(hz);
                    if chi2 > best.1 {
                        (best, moved) = ((hz, chi2), true);
                    }
                }
            }
            if !moved {
                step *= 0.4;
            }
        }
        (best.1 > 0.0).then_some(best)
    }

    /// The frequency itself or one that lies multiples of the key frames' rate away, and whether they cannot be told apart.
    fn among_images(&mut self, hz: f64, chi2: f64) -> (f64, bool) {
        let rate = self.data.rate_hz();
        let mut alike = vec![(hz, chi2)];
        let most = (IMAGES_HZ / rate) as i32;
        for m in (-most..=most).filter(|&m| m != 0) {
            let there = hz + f64::from(m) * rate;
            // Only what comes near is refined.
            if self.is_free(there) && self.chi2(there) > chi2 - 3.0 * ALIKE {
                alike.extend(self.refine(there));
            }
        }
        let most = alike.iter().map(|(_, chi2)| *chi2).fold(0.0, f64::max);
        alike.retain(|(_, chi2)| *chi2 > most - ALIKE);
        alike.sort_by(|a, b| b.1.total_cmp(&a.1));
        if alike.len() == 1 {
            return (alike[0].0, false);
        }
        let mut shown: Vec<(f64, f64)> = alike
            .iter()
            .map(|(hz, _)| (*hz, self.shown_px(*hz)))
            .collect();
        shown.sort_by(|a, b| b.1.total_cmp(&a.1));
        if shown[0].1 > 0.0 && shown[0].1 >= LARGER * shown[1].1 {
            (shown[0].0, false)
        } else {
            (alike[0].0, true)
        }
    }

    /// How large all frames show a tone of this frequency, px.
    fn shown_px(&self, hz: f64) -> f64 {
        let reach = 0.5_f64.min(0.4 * self.data.rate_hz());
        let near = self
            .hints
            .iter()
            .filter(|hint| (hint.hz - hz).abs() < reach);
        near.map(|hint| hint.px).fold(0.0, f64::max)
    }
}

/// The largest peaks of the spectrum of what is left, Hz.
fn peaks(data: &Data, residual: &[f64], (low, high): (f64, f64)) -> Vec<f64> {
    let span_s =
        data.all.last().map_or(0.0, |datum| datum.t_s) - data.all.first().map_or(0.0, |d| d.t_s);
    let step_s = 0.1 / high.max(1.0);
    let n = ((2.0 * span_s / step_s) as usize + 1)
        .next_power_of_two()
        .min(POINTS);
    let first_s = data.all.first().map_or(0.0, |datum| datum.t_s);
    let mut fourier = Fourier::forward(n);
    let mut found: Vec<(f64, f64)> = Vec::new();
    for axis in 0..2 {
        let mut line = vec![Complex64::default(); n];
        let mut total = 0.0;
        for (datum, r) in data
            .all
            .iter()
            .zip(residual)
            .filter(|(d, _)| d.axis == axis)
        {
            let at = ((datum.t_s - first_s) / step_s).round() as usize;
            if let Some(slot) = line.get_mut(at) {
                slot.re += datum.weight * r;
                total += datum.weight;
            }
        }
        if total <= 0.0 {
            continue;
        }
        fourier.transform(&mut line);
        let power: Vec<f64> = line[..n / 2].iter().map(|z| z.norm_sqr() / total).collect();
        let bin_hz = 1.0 / (step_s * n as f64);
        for (k, w) in (1..).zip(power.windows(3)) {
            let hz = k as f64 * bin_hz;
            if (low..=high).contains(&hz) && w[1] > w[0] && w[1] >= w[2] {
                found.push((hz, w[1]));
            }
        }
    }
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.iter().take(PEAKS).map(|(hz, _)| *hz).collect()
}
