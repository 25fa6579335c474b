//! A light (or a machine tone) of unknown frequency: what the stripes say in a frame and from frame to frame.
//!
//! In a frame, P = f·(read-out) periods are seen; from frame to frame, f·Δt up to whole periods. With frames at one
//! spacing T every f = (k ± θ)/T explains the recording, k whole, as long as the read-out P/f fits into T: this is the
//! ambiguity. Frame times with more than one spacing (two frame rates, or a camera whose frames jitter by a good part
//! of the light's period and says so in its timestamps) leave one f; else a guess nearer than half a frame rate does.

use super::Refusal;
use super::frames::Rolling;
use std::f64::consts::TAU;

/// The shortest read-out that is believed, part of the frame period.
pub(super) const SHORTEST_READOUT: f64 = 0.1;

/// The light, found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Frequency, Hz, by the clock of the frame times.
    pub hz: f64,
    /// Standard deviation.
    pub hz_sd: f64,
    /// Which row is read first.
    pub rolling: Rolling,
}

/// One frequency that explains the phases.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    hz: f64,
    hz_sd: f64,
    rms: f64,
    rolling: Rolling,
}

/// Finds the one frequency that explains `phases` (cycles) at `times_s` and `periods` seen in a frame.
///
/// # Errors
/// [`Refusal::NoFrameTimes`] with fewer than 4 frames, [`Refusal::Incoherent`] where no frequency fits,
/// [`Refusal::Ambiguous`] where several do.
pub fn solve(
    phases: &[f64],
    times_s: &[f64],
    periods: f64,
    about_hz: Option<f64>,
) -> Result<Found, Refusal> {
    let count = phases.len().min(times_s.len());
    if count < 4 {
        return Err(Refusal::NoFrameTimes);
    }
    let span = times_s[count - 1] - times_s[0];
    let step = times_s
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(f64::INFINITY, f64::min);
    if !(span > 0.0 && step > 0.0) {
        return Err(Refusal::NoFrameTimes);
    }
    // The read-out fits into the shortest frame.
    let lowest = periods / step * 0.999;
    let highest = (periods / (SHORTEST_READOUT * step))
        .min(20_000.0)
        .max(lowest * 1.01);
    let mut candidates = Vec::new();
    for rolling in [Rolling::Down, Rolling::Up] {
        scan(phases, times_s, rolling, lowest, highest, &mut candidates);
    }
    let best = candidates
        .iter()
        .map(|c| c.rms)
        .fold(f64::INFINITY, f64::min);
    if candidates.is_empty() || best > 0.05 {
        return Err(Refusal::Incoherent);
    }
    // As good as the best one, by what the noise of the phases can do.
    candidates.retain(|c| c.rms < (2.0 * best).max(1e-4));
    if let Some(about) = about_hz {
        candidates.sort_by(|a, b| (a.hz - about).abs().total_cmp(&(b.hz - about).abs()));
        // The runner-up must be clearly further from the guess.
        if candidates.len() > 1
            && (candidates[1].hz - about).abs() < 2.0 * (candidates[0].hz - about).abs()
        {
            return Err(ambiguous(&candidates));
        }
        candidates.truncate(1);
    }
    match candidates[..] {
        [one] => Ok(Found {
            hz: one.hz,
            hz_sd: one.hz_sd,
            rolling: one.rolling,
        }),
        _ => Err(ambiguous(&candidates)),
    }
}

fn ambiguous(candidates: &[Candidate]) -> Refusal {
    let mut candidates_hz: Vec<f64> = candidates.iter().map(|c| c.hz).take(6).collect();
    candidates_hz.sort_by(f64::total_cmp);
    Refusal::Ambiguous { candidates_hz }
}

/// All frequencies from `lowest` to `highest` at which the phases advance steadily.
fn scan(
    phases: &[f64],
    times_s: &[f64],
    rolling: Rolling,
    lowest: f64,
    highest: f64,
    out: &mut Vec<Candidate>,
) {
    let sign = if rolling == Rolling::Down { 1.0 } else { -1.0 };
    let count = phases.len().min(times_s.len());
    let span = times_s[count - 1] - times_s[0];
    let coherence = |hz: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (phase, time) in phases.iter().zip(times_s) {
            let (s, c) = (TAU * (phase - sign * hz * (time - times_s[0])).fract()).sin_cos();
            re += c;
            im += s;
        }
        re.hypot(im) / count as f64
    };
    let fine = 0.2 / span;
    let steps = ((highest - lowest) / fine).ceil() as usize;
    let values: Vec<f64> = (0..=steps)
        .map(|k| coherence(lowest + k as f64 * fine))
        .collect();
    for k in 0..values.len() {
        let left = if k > 0 { values[k - 1] } else { 0.0 };
        let right = values.get(k + 1).copied().unwrap_or(0.0);
        if values[k] > 0.8 && values[k] >= left && values[k] > right {
            out.push(refine(
                phases,
                times_s,
                rolling,
                sign,
                lowest + k as f64 * fine,
            ));
        }
    }
}

/// A straight line through the phases, unwrapped about `hz`.
fn refine(phases: &[f64], times_s: &[f64], rolling: Rolling, sign: f64, mut hz: f64) -> Candidate {
    let count = phases.len().min(times_s.len()) as f64;
    let mean_time = times_s.iter().sum::<f64>() / count;
    let sxx: f64 = times_s.iter().map(|t| (t - mean_time).powi(2)).sum();
    let mut rss = 0.0;
    for _ in 0..4 {
        let raw: Vec<f64> = phases
            .iter()
            .zip(times_s)
            .map(|(p, t)| sign * p - hz * (t - mean_time))
            .collect();
        let (re, im) = raw.iter().fold((0.0, 0.0), |(re, im), r| {
            (re + (TAU * r).cos(), im + (TAU * r).sin())
        });
        let centre = im.atan2(re) / TAU;
        let off: Vec<f64> = raw
            .iter()
            .map(|r| r - centre - (r - centre).round())
            .collect();
        let mean = off.iter().sum::<f64>() / count;
        let slope = off
            .iter()
            .zip(times_s)
            .map(|(o, t)| o * (t - mean_time))
            .sum::<f64>()
            / sxx;
        rss = off
            .iter()
            .zip(times_s)
            .map(|(o, t)| (o - mean - slope * (t - mean_time)).powi(2))
            .sum();
        hz += slope;
    }
    let variance = rss / (count - 2.0).max(1.0);
    Candidate {
        hz,
        hz_sd: (variance / sxx).sqrt(),
        rms: variance.sqrt(),
        rolling,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases(times: &[f64], hz: f64) -> Vec<f64> {
        times
            .iter()
            .enumerate()
            .map(|(n, t)| hz * t + 1e-3 * (n as f64 * 5.1).sin())
            .collect()
    }

    #[test]
    fn two_frame_rates_leave_one_frequency() {
        let mut times: Vec<f64> = (0..20).map(|n| n as f64 / 30.0).collect();
        let last = times[19];
        times.extend((1..20).map(|n| last + n as f64 / 28.7));
        let found = solve(&phases(&times, 437.21), &times, 437.21 * 0.02, None).unwrap();
        assert!((found.hz - 437.21).abs() < 5.0 * found.hz_sd, "{found:?}");
        assert_eq!(found.rolling, Rolling::Down);
    }

    #[test]
    fn one_frame_rate_is_ambiguous_without_a_guess() {
        let times: Vec<f64> = (0..30).map(|n| n as f64 / 30.0).collect();
        let phases = phases(&times, 437.21);
        assert!(matches!(
            solve(&phases, &times, 8.7442, None),
            Err(Refusal::Ambiguous { .. })
        ));
        let found = solve(&phases, &times, 8.7442, Some(438.0)).unwrap();
        assert!((found.hz - 437.21).abs() < 5.0 * found.hz_sd, "{found:?}");
    }
}
