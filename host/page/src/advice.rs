//! The state in words, and what to do about it.

use std::time::{Duration, Instant};

use rowtone_report::sentence;
use serde::Serialize;

use crate::live::{Live, Phase};
use crate::picture::Aim;

/// A live source is silent when no report came for so many windows, and for so long at the least.
const SILENT_WINDOWS: f32 = 4.0;
const SILENT: Duration = Duration::from_secs(5);
/// More noise of a row than this is worth a word, px.
const MUCH_NOISE_PX: f32 = 0.3;

/// How urgent something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// All is well.
    Good,
    /// Figures are worse than they could be, or not all that they seem.
    Look,
    /// Nothing is measured.
    Bad,
}

/// One thing to know, and to do something about.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Advice {
    /// How urgent it is.
    pub level: Level,
    /// A sentence without a stop.
    pub text: String,
}

fn advice(level: Level, text: impl Into<String>) -> Advice {
    Advice {
        level,
        text: text.into(),
    }
}

/// The state in a few words, and what to do, the most urgent first.
pub fn state(live: &Live, aim: Option<&Aim>, is_live: bool, now: Instant) -> (Advice, Vec<Advice>) {
    let (phase, why) = live.phase();
    let mut todo = Vec::new();
    if let Some(aim) = aim {
        light(aim, &mut todo);
    }
    let last = live.reports.last();
    if let Some(last) = &last {
        let report = &last.report;
        if report.noise_px > MUCH_NOISE_PX {
            let noise = report.noise_px;
            todo.push(advice(
                Level::Look,
                format!("a row is noisy ({noise:.2} px): focus better, more light, or a part with more edges"),
            ));
        }
        let warnings = report.warnings.iter();
        todo.extend(warnings.map(|warning| advice(Level::Look, sentence(warning))));
    }
    todo.sort_by_key(|one| std::cmp::Reverse(one.level));
    let state = match (phase, last) {
        (Phase::Failed, _) => advice(Level::Bad, why),
        (Phase::Ended, Some(_)) => advice(Level::Good, "read to its end"),
        (Phase::Ended, None) => advice(Level::Bad, "nothing could be measured"),
        (_, None) => advice(
            Level::Look,
            "learning the picture: the first report comes after a window",
        ),
        (Phase::Starting | Phase::Measuring, Some(last)) => {
            let age = now.saturating_duration_since(last.came);
            let patience =
                Duration::from_secs_f32((SILENT_WINDOWS * last.report.window_s).clamp(0.0, 3600.0));
            if is_live && age > patience.max(SILENT) {
                advice(
                    Level::Bad,
                    format!(
                        "no report for {} s: is the camera covered or unplugged?",
                        age.as_secs()
                    ),
                )
            } else if last.report.peaks.is_empty() {
                advice(Level::Good, "measuring: no vibration above the noise")
            } else {
                advice(Level::Good, "measuring")
            }
        }
    };
    (state, todo)
}

/// The same words as `rowtone-rpi doctor`'s.
fn light(aim: &Aim, todo: &mut Vec<Advice>) {
    if aim.bright > 10.0 {
        let text = format!(
            "too bright: {:.0} % of the pixels are white; lower the gain or the light",
            aim.bright
        );
        todo.push(advice(Level::Look, text));
    } else if aim.mean < 8.0 {
        let text = format!(
            "too dark: {:.0} % on average; more light, a higher gain, a wider aperture",
            aim.mean
        );
        todo.push(advice(Level::Look, text));
    }
    let blind = aim.rows.iter().filter(|row| row.is_none()).count();
    if !aim.rows.is_empty() && 2 * blind > aim.rows.len() {
        let text = "less than half of the rows have texture: focus better, or choose a part with upright edges";
        todo.push(advice(Level::Look, text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aim() -> Aim {
        Aim {
            focus: 10.0,
            mean: 50.0,
            dark: 0.0,
            bright: 0.0,
            histogram: vec![],
            rows: vec![Some(1.0); 4],
            columns: vec![],
        }
    }

    #[test]
    fn a_camera_that_falls_silent_is_said_to_be_and_a_recording_is_not() {
        let live = Live::default();
        let now = Instant::now();
        assert_eq!(state(&live, None, true, now).0.level, Level::Look);
        let mut report = rowtone_report::example(None);
        report.warnings = Default::default();
        live.report(&report, String::new());
        live.set_phase(Phase::Measuring, "");
        let (said, todo) = state(&live, Some(&aim()), true, now);
        assert_eq!(
            (said.level, said.text.as_str(), todo),
            (Level::Good, "measuring", vec![])
        );
        let later = Instant::now() + Duration::from_secs(20);
        let (said, _) = state(&live, None, true, later);
        assert_eq!(said.level, Level::Bad);
        assert!(said.text.starts_with("no report for "), "{}", said.text);
        assert_eq!(state(&live, None, false, later).0.level, Level::Good);
    }

    #[test]
    fn what_is_wrong_with_the_picture_is_said_with_what_to_do() {
        let live = Live::default();
        let said = |aim: Aim| {
            let (_, todo) = state(&live, Some(&aim), true, Instant::now());
            todo.into_iter()
                .map(|one| one.text)
                .collect::<Vec<_>>()
                .join("; ")
        };
        assert_eq!(said(aim()), "");
        assert!(
            said(Aim {
                bright: 40.0,
                ..aim()
            })
            .contains("lower the gain")
        );
        assert!(said(Aim { mean: 2.0, ..aim() }).contains("more light"));
        let rows = vec![None, None, None, Some(1.0)];
        assert!(said(Aim { rows, ..aim() }).contains("upright edges"));
    }
}
