//! How right the reports on a recording are.

use rowtone::report::{Peak, Report};

use super::truth::{Tone, Truth};

/// A report on less than this share of the longest window is an odd end and not scored.
const WHOLE: f32 = 0.9;

/// What a recording's reports came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Score {
    windows: usize,
    /// Tones in all windows, and those of them that were found with the right amplitude.
    tones: usize,
    found: usize,
    /// The largest error of a frequency, in tolerances, and of an amplitude, as a share.
    worst_hz: f64,
    worst_amplitude: Option<f64>,
    /// Peaks that are nothing true and not marked as ambiguous, in all windows, and the largest, Hz and px.
    false_peaks: usize,
    largest_false: Option<(f32, f32)>,
    /// What the tones' amplitudes were, until they are judged.
    sizes: Vec<Size>,
}

/// A tone's amplitude in one window.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size {
    /// Which of the tones.
    tone: usize,
    t_s: f64,
    px: f64,
}

/// An amplitude that dies away.
struct Decay {
    /// Logarithm of the amplitude at t = 0, and how fast it falls, 1/s.
    log: f64,
    rate: f64,
}

impl Decay {
    /// Through amplitudes at times, s, by least squares of their logarithms; `None` where there are too few, or they do not
    /// fall.
    fn through(seen: &[(f64, f64)]) -> Option<Self> {
        if seen.len() < 3 || seen.iter().any(|(_, px)| *px <= 0.0) {
            return None;
        }
        let n = seen.len() as f64;
        let middle = seen.iter().map(|(t, _)| t).sum::<f64>() / n;
        let mean = seen.iter().map(|(_, px)| px.ln()).sum::<f64>() / n;
        let (mut product, mut square) = (0.0, 0.0);
        for (t, px) in seen {
            product += (t - middle) * (px.ln() - mean);
            square += (t - middle) * (t - middle);
        }
        let rate = -product / square;
        (rate > 0.0 && rate.is_finite()).then_some(Self {
            log: mean + rate * middle,
            rate,
        })
    }

    fn px_at(&self, t_s: f64) -> f64 {
        (self.log - self.rate * t_s).exp()
    }
}

/// The table's first line.
pub(super) fn heading() -> String {
    format!(
        "{:<32} {:>7}  {:>11}  {:>12}  {:>12}  {:<28} {}",
        "recording",
        "windows",
        "tones found",
        "worst hz/tol",
        "worst ampl.",
        "false peaks",
        "verdict"
    )
}

impl Score {
    /// Scores the reports on a recording.
    pub(super) fn of(reports: &[Report], truth: &Truth) -> Self {
        let longest = reports
            .iter()
            .map(|report| report.window_s)
            .fold(0.0, f32::max);
        let mut score = Self::default();
        for report in reports
            .iter()
            .filter(|report| report.window_s >= WHOLE * longest)
        {
            score.add(report, truth);
        }
        score.judge_amplitudes(truth);
        score
    }

    /// An amplitude is right where every window has it. What was struck dies away: then the first window has it, and the
    /// others keep to one exponential through all of them.
    fn judge_amplitudes(&mut self, truth: &Truth) {
        let sizes = std::mem::take(&mut self.sizes);
        for (k, tone) in truth.tones.iter().enumerate() {
            let Some(px) = tone.amplitude_px else {
                continue;
            };
            let of_tone = sizes.iter().filter(|size| size.tone == k);
            let seen: Vec<(f64, f64)> = of_tone.map(|size| (size.t_s, size.px)).collect();
            let decay = Decay::through(&seen);
            let away = |(t_s, found): &(f64, f64)| match &decay {
                Some(decay) => {
                    let first = decay.px_at(seen[0].0) / px - 1.0;
                    let along = found / decay.px_at(*t_s) - 1.0;
                    first.abs().max(along.abs())
                }
                None => (found / px - 1.0).abs(),
            };
            for off in seen.iter().map(away) {
                self.worst_amplitude = Some(self.worst_amplitude.unwrap_or(0.0).max(off));
                self.found -= usize::from(off > tone.amplitude_tolerance);
            }
        }
    }

    fn add(&mut self, report: &Report, truth: &Truth) {
        self.windows += 1;
        let mut left: Vec<&Peak> = report.peaks.iter().collect();
        for (k, tone) in truth.tones.iter().enumerate() {
            self.tones += 1;
            let Some(place) = nearest(&left, tone) else {
                continue;
            };
            let peak = left.remove(place);
            let off_hz = (f64::from(peak.hz) - tone.hz).abs() / tone.hz_tolerance;
            self.worst_hz = self.worst_hz.max(off_hz);
            self.sizes.push(Size {
                tone: k,
                t_s: report.time_ms as f64 * 1e-3,
                px: peak.amplitude_px.into(),
            });
            self.found += 1;
        }
        let largest = report
            .peaks
            .iter()
            .map(|peak| peak.amplitude_px)
            .fold(0.0, f32::max);
        let least = truth.nothing_else_above as f32 * largest;
        for peak in left {
            if peak.ambiguous || peak.amplitude_px <= least || truth.is_harmonic(peak.hz.into()) {
                continue;
            }
            self.false_peaks += 1;
            if self
                .largest_false
                .is_none_or(|(_, px)| px < peak.amplitude_px)
            {
                self.largest_false = Some((peak.hz, peak.amplitude_px));
            }
        }
    }

    /// Everything is as it should be.
    pub(super) fn is_right(&self) -> bool {
        self.found == self.tones && self.false_peaks == 0
    }

    /// The recording's line in the table.
    pub(super) fn line(&self, name: &str) -> String {
        let amplitude = self
            .worst_amplitude
            .map_or("-".to_owned(), |off| format!("{:.1} %", 100.0 * off));
        let hz = if self.found > 0 {
            format!("{:.2}", self.worst_hz)
        } else {
            "-".to_owned()
        };
        let false_peaks = match self.largest_false {
            None => "0".to_owned(),
            Some((hz, px)) => format!("{}, largest {hz:.2} Hz {px:.3} px", self.false_peaks),
        };
        let verdict = if self.is_right() { "right" } else { "WRONG" };
        format!(
            "{name:<32} {:>7}  {:>11}  {hz:>12}  {amplitude:>12}  {false_peaks:<28} {verdict}",
            self.windows,
            format!("{} of {}", self.found, self.tones),
        )
    }
}

/// The largest of the peaks that may be this tone: within its tolerance and three of the peak's own sd.
fn nearest(peaks: &[&Peak], tone: &Tone) -> Option<usize> {
    let near = |peak: &Peak| {
        (f64::from(peak.hz) - tone.hz).abs() <= tone.hz_tolerance + 3.0 * f64::from(peak.hz_sd)
    };
    (0..peaks.len())
        .filter(|&k| near(peaks[k]))
        .max_by(|&a, &b| peaks[a].amplitude_px.total_cmp(&peaks[b].amplitude_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(window_s: f32, peaks: &[(f32, f32, bool)]) -> Report {
        let example = rowtone_report::example(None);
        let like = example.peaks[0];
        let peak = |&(hz, amplitude_px, ambiguous): &(f32, f32, bool)| Peak {
            hz,
            amplitude_px,
            ambiguous,
            ..like
        };
        Report {
            window_s,
            peaks: peaks.iter().map(peak).collect(),
            ..example
        }
    }

    fn truth() -> Truth {
        serde_json::from_str(
            r#"{"clip":"a.mp4","tones":[{"hz":32.0,"hz_tolerance":0.1,"amplitude_px":1.0,"amplitude_tolerance":0.05}],
                "harmonics_allowed":true,"nothing_else_above":0.1}"#,
        )
        .unwrap()
    }

    #[test]
    fn right_in_every_window() {
        let reports = [
            report(
                1.0,
                &[
                    (32.01, 1.02, false),
                    (64.0, 0.5, false),
                    (218.0, 0.4, true),
                    (7.0, 0.05, false),
                ],
            ),
            report(1.0, &[(31.98, 0.99, false)]),
            // An odd end.
            report(0.3, &[(40.0, 1.0, false)]),
        ];
        let score = Score::of(&reports, &truth());
        assert!(score.is_right(), "{score:?}");
        assert_eq!((score.windows, score.tones, score.found), (2, 2, 2));
        assert!(
            (score.worst_hz - 0.2).abs() < 1e-3
                && (score.worst_amplitude.unwrap() - 0.02).abs() < 1e-3
        );
        assert!(score.line("a").ends_with("right"));
    }

    #[test]
    fn what_was_struck_dies_away_evenly_from_its_amplitude_on() {
        let windows = |amplitudes: [f32; 4]| {
            let report = |(k, px): (usize, f32)| Report {
                time_ms: 1000 + 500 * k as u64,
                ..report(1.0, &[(32.0, px, false)])
            };
            let reports: Vec<Report> = amplitudes.into_iter().enumerate().map(report).collect();
            Score::of(&reports, &truth())
        };
        let dies = windows([1.02, 0.9, 0.81, 0.73]);
        assert!(dies.is_right(), "{dies:?}");
        let too_small = windows([0.7, 0.63, 0.57, 0.51]);
        assert_eq!((too_small.tones, too_small.found), (4, 0));
        // A window of it is wrong, and so is one that rises.
        assert!(!windows([1.0, 0.9, 0.5, 0.73]).is_right());
        assert_eq!(windows([1.0, 1.1, 1.2, 1.3]).found, 1);
    }

    #[test]
    fn a_missing_tone_a_wrong_amplitude_and_a_false_peak_are_wrong() {
        for (peaks, found, false_peaks) in [
            (&[(33.0_f32, 1.0_f32, false)] as &[_], 0, 1),
            (&[(32.0, 0.9, false)], 0, 0),
            (&[(32.0, 1.0, false), (218.0, 0.3, false)], 1, 1),
            (&[], 0, 0),
        ] {
            let score = Score::of(&[report(1.0, peaks)], &truth());
            assert!(!score.is_right());
            assert_eq!(
                (score.found, score.false_peaks),
                (found, false_peaks),
                "{peaks:?}"
            );
        }
    }
}
