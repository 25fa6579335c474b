//! The table of figures: one row a kind of scenes.

use std::fmt::Write;

use super::cameras;
use super::scene::Ranges;
use super::score::Score;

/// A row: what is special about its scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind<R = Ranges> {
    /// In words.
    pub name: &'static str,
    /// What is drawn.
    pub ranges: R,
}

/// The kinds of whole recordings; the first is all of it.
pub fn camera_kinds() -> Vec<Kind<cameras::Ranges>> {
    let all = cameras::Ranges::default;
    vec![
        Kind {
            name: "recordings, all",
            ranges: all(),
        },
        Kind {
            name: "blank 40-45 %",
            ranges: cameras::Ranges {
                blank: [0.40, 0.45],
                ..all()
            },
        },
        Kind {
            name: "10-100 times the bound",
            ranges: cameras::Ranges {
                over_bound: [10.0, 100.0],
                ..all()
            },
        },
        Kind {
            name: "noise only",
            ranges: cameras::Ranges {
                tones: [0, 0],
                ..all()
            },
        },
    ]
}

/// The kinds of scenes of the figures; the first is all of it.
pub fn kinds() -> Vec<Kind> {
    let all = Ranges::default;
    let kind = |name, ranges| Kind { name, ranges };
    vec![
        kind("all", all()),
        kind(
            "blank 1-5 %",
            Ranges {
                blank: [0.01, 0.05],
                ..all()
            },
        ),
        kind(
            "blank 40-45 %",
            Ranges {
                blank: [0.40, 0.45],
                ..all()
            },
        ),
        kind(
            "25-40 fps",
            Ranges {
                fps: [25.0, 40.0],
                ..all()
            },
        ),
        kind(
            "150-200 fps",
            Ranges {
                fps: [150.0, 200.0],
                ..all()
            },
        ),
        kind(
            "10-15 times the bound",
            Ranges {
                over_bound: [10.0, 15.0],
                ..all()
            },
        ),
        kind(
            "60-80 dB beside 20-40 dB",
            Ranges {
                over_bound: [10.0, 10_000.0],
                ..all()
            },
        ),
        kind(
            "five tones",
            Ranges {
                tones: [5, 5],
                ..all()
            },
        ),
        kind(
            "noise only",
            Ranges {
                tones: [0, 0],
                ..all()
            },
        ),
    ]
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:<26} {:>6} {:>6} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "scenes", "number", "tones", "found%", "false%", "ghosts", "f/crb", "A/crb", "f/sd", "A/sd"
    )
}

/// A row of the table.
pub fn row(name: &str, score: &Score) -> String {
    let mut line = format!(
        "{:<26} {:>6} {:>6} {:>7.2} {:>7.2} {:>6}",
        name,
        score.scenes,
        score.tones,
        100.0 * score.found_share(),
        100.0 * score.false_share(),
        score.ghosts,
    );
    for error in score.errors() {
        let _ = match score.found {
            0 => write!(line, " {:>6}", "-"),
            _ => write!(line, " {error:>6.3}"),
        };
    }
    line
}
