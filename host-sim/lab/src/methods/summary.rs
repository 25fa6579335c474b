//! Scores of several recordings in short: a line of the table a method, a dot of the figure.

use std::fmt::Write;

use super::study::Score;
use crate::figure::dots::{Dots, Range};
use rowtone_linear::median;

/// What a method made of several recordings of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The method.
    pub method: &'static str,
    /// Noise over bound: least, median, largest.
    pub noise: Range,
    /// Error of the amplitude, the median and the one farthest from 0; 0.01 is 1 %.
    pub amplitude: [f64; 2],
    /// Error of the frequency where the tone was found, Hz (rms); `None` where it never was.
    pub hz_rms: Option<f64>,
    /// Recordings in which it was not found.
    pub not_found: usize,
    /// Largest ghost over the tone (median).
    pub ghost: f64,
    /// Time of a line, µs (least: other programs only make it longer).
    pub us_per_line: f64,
}

impl Summary {
    /// Of one method's scores; `None` where there is none.
    pub fn of(scores: &[Score]) -> Option<Self> {
        let sorted = |value: fn(&Score) -> f64| {
            let mut values: Vec<f64> = scores.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let noise = sorted(|s| s.noise_over_bound);
        let amplitude = sorted(|s| s.amplitude_error);
        let worst = amplitude
            .iter()
            .copied()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        let found: Vec<f64> = scores.iter().filter_map(|s| s.hz_error).collect();
        let square = found.iter().map(|e| e * e).sum::<f64>() / found.len().max(1) as f64;
        Some(Self {
            method: scores.first()?.method,
            noise: [*noise.first()?, median(&noise), *noise.last()?],
            amplitude: [median(&amplitude), worst],
            hz_rms: (!found.is_empty()).then(|| square.sqrt()),
            not_found: scores.len() - found.len(),
            ghost: median(&sorted(|s| s.ghost)),
            us_per_line: *sorted(|s| s.us_per_line).first()?,
        })
    }
}

/// The table, as Markdown: all methods on each scene.
pub fn markdown(scenes: &[(String, Vec<Summary>)]) -> String {
    let mut text = String::from(
        "| scene | method | noise / bound | (least to largest) | amplitude | (worst) | frequency, Hz rms | ghost | µs a line |\n\
         | --- | --- | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for (scene, summaries) in scenes {
        for s in summaries {
            let hz = match (s.hz_rms, s.not_found) {
                (None, _) => "not found".to_owned(),
                (Some(hz), 0) => format!("{hz:.4}"),
                (Some(hz), n) => format!("{hz:.4}, {n} not found"),
            };
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| {scene} | {} | {} | {} to {} | {:+.1} % | {:+.1} % | {hz} | {:.2} % | {:.1} |",
                s.method,
                digits(s.noise[1]),
                digits(s.noise[0]),
                digits(s.noise[2]),
                100.0 * s.amplitude[0],
                100.0 * s.amplitude[1],
                100.0 * s.ghost,
                s.us_per_line
            );
        }
    }
    text
}

/// Two decimals where they say something.
fn digits(value: f64) -> String {
    if value < 10.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    }
}

/// Noise over bound of every method on every scene.
pub fn figure(scenes: &[(String, Vec<Summary>)]) -> Dots {
    let lines = scenes.first().map(|s| &s.1[..]).unwrap_or_default();
    Dots {
        title: "Noise of a row over its Cramér–Rao bound (1 is the best possible; ends hold what lies beyond)".to_owned(),
        lines: lines.iter().map(|s| s.method.to_owned()).collect(),
        series: scenes
            .iter()
            .map(|(name, all)| (name.clone(), all.iter().map(|s| Some(s.noise)).collect()))
            .collect(),
        decades: (0, 3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(noise: f64, amplitude: f64, hz: Option<f64>) -> Score {
        Score {
            method: "m",
            noise_over_bound: noise,
            amplitude_error: amplitude,
            hz_error: hz,
            ghost: 0.001,
            us_per_line: noise,
        }
    }

    #[test]
    fn scores_in_short() {
        let all = [
            score(3.0, -0.02, Some(0.3)),
            score(1.0, 0.01, None),
            score(20.0, 0.0, Some(-0.4)),
        ];
        let summary = Summary::of(&all).unwrap();
        assert_eq!(summary.noise, [1.0, 3.0, 20.0]);
        assert_eq!(summary.amplitude, [0.0, -0.02]);
        assert_eq!((summary.not_found, summary.us_per_line), (1, 1.0));
        assert!((summary.hz_rms.unwrap() - 0.125_f64.sqrt()).abs() < 1e-12);
        assert_eq!(Summary::of(&[]), None);
        let scenes = [("bar".to_owned(), vec![summary])];
        let text = markdown(&scenes);
        let line = "| bar | m | 3.00 | 1.00 to 20 | +0.0 % | -2.0 % | 0.3536, 1 not found | 0.10 % | 1.0 |";
        assert!(text.contains(line), "{text}");
        assert_eq!(figure(&scenes).lines, ["m"]);
    }
}
