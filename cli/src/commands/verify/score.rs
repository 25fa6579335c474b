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
        score
    }

    fn add(&mut self, report: &Report, truth: &Truth) {
        self.windows += 1;
        let mut left: Vec<&Peak> = report.peaks.iter().collect();
        for tone in &truth.tones {
            self.tones += 1;
            let Some(place) = nearest(&left, tone) else {
                continue;
            };
            let peak = left.remove(place);
            let off_hz = (f64::from(peak.hz) - tone.hz).abs() / tone.hz_tolerance;
            self.worst_hz = self.worst_hz.max(off_hz);
            let mut right = true;
            if let Some(px) = tone.amplitude_px {
                let off = (f64::from(peak.amplitude_px) / px - 1.0).abs();
                self.worst_amplitude = Some(self.worst_amplitude.unwrap_or(0.0).max(off));
                right = off <= tone.amplitude_tolerance;
            }
            self.found += usize::from(right);
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
