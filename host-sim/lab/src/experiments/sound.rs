//! Rows to a sound: combined by information, gaps filled, low-passed. The same for every method.

use super::film::Film;
use crate::methods::{Shifts, remove_row_means};
use crate::sound::agreement::{Agreement, agree};
use rowtone_measure::restore::butterworth::LowPass;
use rowtone_measure::restore::long::{ORDER, Restoration, USUAL_CORNER_HZ};

/// Samples a second that are aimed at.
const USUAL_RATE_HZ: f64 = 8000.0;
/// A sample needs this part of its rows.
const ENOUGH: f64 = 0.7;
/// Furthest delay that is fitted, s.
const REACH_S: f64 = 0.005;

/// An evenly sampled sound, px.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Its samples.
    pub samples: Vec<f64>,
    /// How many there are a second.
    pub rate_hz: f64,
}

/// Samples of a whole number of rows, weighted by what each row can know (its bound), with `None` for blank time.
pub fn samples(film: &Film, shifts: &Shifts) -> (Vec<Option<f64>>, f64) {
    let mut shifts = shifts.clone();
    remove_row_means(&mut shifts);
    let recording = &film.recording;
    let rows = (1.0 / (USUAL_RATE_HZ * film.row_s)).round().max(1.0);
    let rate_hz = 1.0 / (rows * film.row_s);
    let weights: Vec<f64> = recording
        .bounds_px
        .iter()
        .map(|b| b.map_or(0.0, |b| 1.0 / (b * b)))
        .collect();
    let end_s = recording
        .times_s
        .last()
        .and_then(|t| t.last())
        .copied()
        .unwrap_or(0.0);
    let mut sums = vec![(0.0, 0.0, 0.0); (end_s * rate_hz) as usize + 1];
    for (times, values) in recording.times_s.iter().zip(&shifts) {
        for ((t, v), w) in times.iter().zip(values).zip(&weights) {
            if let Some(slot) = sums
                .get_mut((t * rate_hz) as usize)
                .filter(|_| v.is_finite())
            {
                *slot = (slot.0 + w * v, slot.1 + w, slot.2 + 1.0);
            }
        }
    }
    let samples = sums
        .into_iter()
        .map(|(sum, weight, count)| (count > ENOUGH * rows && weight > 0.0).then(|| sum / weight))
        .collect();
    (samples, rate_hz)
}

/// What is heard, as `displacement --format wav` does it.
pub fn hear(film: &Film, shifts: &Shifts) -> Sound {
    let (samples, rate_hz) = samples(film, shifts);
    let mut heard = Vec::with_capacity(samples.len());
    Restoration::default().run(samples, rate_hz, |v| heard.push(v));
    Sound {
        samples: heard,
        rate_hz,
    }
}

/// The motion itself at the middles of the samples, low-passed alike.
pub fn truth(film: &Film, like: &Sound) -> Vec<f64> {
    let mut truth: Vec<f64> = (0..like.samples.len())
        .map(|i| film.motion.at((i as f64 + 0.5) / like.rate_hz))
        .collect();
    LowPass::new(ORDER, USUAL_CORNER_HZ, like.rate_hz).run_both_ways(&mut truth);
    truth
}

/// How well the heard sound agrees with the truth; the mean square error is that of a truth with a peak of 1.
pub fn compared(film: &Film, heard: &Sound) -> Agreement {
    let mut truth = truth(film, heard);
    let peak = truth.iter().fold(1e-12_f64, |m, v| m.max(v.abs()));
    truth.iter_mut().for_each(|v| *v /= peak);
    agree(&truth, &heard.samples, heard.rate_hz, REACH_S)
}

#[cfg(test)]
mod tests {
    use super::super::film::Setup;
    use super::*;
    use host_sim::{Motion, Tone};

    /// The true shifts of every row give the motion back, but for the gaps.
    #[test]
    fn true_rows_sound_like_the_motion() {
        let tone = Tone {
            hz: 210.0,
            amplitude_px: 0.5,
            phase_rad: 1.0,
        };
        let motion = Motion {
            tones: vec![tone],
            ..Motion::default()
        };
        let film = Setup::thesis(16, 24, 1).film(&motion).unwrap();
        let (samples, rate_hz) = samples(&film, &film.recording.truth_px);
        assert!((rate_hz - 8117.0).abs() < 1.0, "{rate_hz}");
        let missing = samples.iter().filter(|s| s.is_none()).count() as f64;
        let share = missing / samples.len() as f64;
        assert!((0.02..0.07).contains(&share), "{share}");
        let found = compared(&film, &hear(&film, &film.recording.truth_px));
        assert!(
            found.snr_db > 30.0 && found.delay_s.abs() < 1e-5,
            "{found:?}"
        );
    }
}
