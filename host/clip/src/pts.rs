//! Frame times from a file: timecode format v2, one time in milliseconds a line, as
//! `rpicam-vid --save-pts` and `mkvextract timestamps_v2` write.

use std::fmt;
use std::io;
use std::path::Path;

/// Reads the start of exposure of every frame, ns.
///
/// # Errors
/// [`PtsError`], naming the line, for one that is not a number or not later than the one before, and for
/// a file without any.
pub fn read(path: &Path) -> Result<Vec<i64>, PtsError> {
    let bytes = std::fs::read(path).map_err(PtsError::Read)?;
    let text = String::from_utf8(bytes).map_err(|_| PtsError::NotText)?;
    parse(&text)
}

/// The unit of times that cannot be in milliseconds. They were read as such, ns; the recording is said to
/// have `fps`, Hz. `None` where they may be right: slow motion states another rate than it was filmed at.
///
/// ```
/// let us = rowtone_clip::pts::parse("0\n16667\n33333\n50000\n").unwrap();
/// assert_eq!(rowtone_clip::pts::wrong_unit(&us, Some(60.0)), Some("microseconds"));
/// assert_eq!(rowtone_clip::pts::wrong_unit(&us, Some(0.06)), None);
/// ```
pub fn wrong_unit(times_ns: &[i64], fps: Option<f64>) -> Option<&'static str> {
    let period_s = period_ns(times_ns)? as f64 * 1e-9;
    let Some(fps) = fps else {
        // Slower than this is no camera that watches a machine.
        return match period_s {
            s if s < 0.5 => None,
            s if s < 2000.0 => Some("microseconds"),
            _ => Some("nanoseconds"),
        };
    };
    let longer = period_s * fps;
    let about = |factor: f64| (0.5..2.0).contains(&(longer / factor));
    if about(1e3) {
        return Some("microseconds");
    }
    if about(1e6) {
        return Some("nanoseconds");
    }
    // High-speed cameras' files state a thousandth of their rate too, but not of such rates.
    if about(1e-3) && period_s < 5e-5 {
        return Some("seconds");
    }
    let impossible = period_s > 0.5 && longer > 8.0;
    impossible.then_some(if longer < 3e4 {
        "microseconds"
    } else {
        "nanoseconds"
    })
}

/// Reads the text of such a file.
///
/// ```
/// let times = rowtone_clip::pts::parse("# timecode format v2\n-0.024\n33.341\n").unwrap();
/// assert_eq!(times, [-24_000, 33_341_000]);
/// ```
///
/// # Errors
/// What is wrong, with the number of the line.
pub fn parse(text: &str) -> Result<Vec<i64>, PtsError> {
    let mut times: Vec<i64> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.starts_with('#') {
            if line.contains("format v1") {
                return Err(PtsError::Rates { line: number });
            }
            continue;
        }
        if line.is_empty() {
            continue;
        }
        let milliseconds: f64 = line
            .parse()
            .ok()
            // 126 years either way, so that the time between any two fits as well.
            .filter(|ms: &f64| ms.abs() < 4e12)
            .ok_or_else(|| PtsError::NotATime {
                line: number,
                text: line.to_owned(),
            })?;
        let time = (milliseconds * 1e6).round() as i64;
        if times.last().is_some_and(|&before| time <= before) {
            return Err(PtsError::NotLater {
                line: number,
                text: line.to_owned(),
            });
        }
        times.push(time);
    }
    if times.is_empty() {
        return Err(PtsError::NoTime);
    }
    Ok(times)
}

/// The usual time between frames, ns: the median. `None` for fewer than two times.
pub fn period_ns(times: &[i64]) -> Option<i64> {
    let mut steps: Vec<i64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable(middle).1)
}

/// Why a file of frame times cannot be used.
#[derive(Debug)]
pub enum PtsError {
    /// It cannot be read.
    Read(io::Error),
    /// It is no text.
    NotText,
    /// What a line holds is no time; lines are counted from 1.
    NotATime {
        /// The line's number.
        line: usize,
        /// What it holds.
        text: String,
    },
    /// A time that is not later than the one before it; lines are counted from 1.
    NotLater {
        /// The line's number.
        line: usize,
        /// The time as it stands there, ms.
        text: String,
    },
    /// It has rates, as timecode format v1 does, in place of times; lines are counted from 1.
    Rates {
        /// The line's number.
        line: usize,
    },
    /// There is no time in it.
    NoTime,
    /// Its times are in another unit.
    Unit {
        /// Which unit they seem to be in.
        unit: &'static str,
        /// The time from frame to frame, read as ms.
        period_ms: f64,
        /// The recording's frame rate, Hz.
        fps: Option<f64>,
    },
    /// There are fewer times than frames.
    TooFew {
        /// How many times there are.
        have: u64,
        /// How many frames there are, or how many at the least where more may follow.
        need: u64,
        /// More may follow.
        at_least: bool,
        /// What the recording is called.
        recording: String,
    },
    /// There are more times than frames.
    TooMany {
        /// How many times there are.
        have: u64,
        /// How many frames there are.
        frames: u64,
        /// What the recording is called.
        recording: String,
    },
}

impl fmt::Display for PtsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(error) => write!(f, "cannot be read: {error}"),
            Self::NotText => {
                f.write_str("is no text: --pts wants a file of times, one in milliseconds a line")
            }
            Self::NotATime { line, text } => {
                write!(f, "line {line}: {text:?} is not a time in milliseconds")
            }
            Self::NotLater { line, text } => write!(
                f,
                "line {line}: the time {text} ms is not later than the one before it"
            ),
            Self::Rates { line } => write!(
                f,
                "line {line}: timecode format v1 gives rates, not times: write format v2"
            ),
            Self::NoTime => f.write_str("there is no time in it"),
            Self::Unit {
                unit,
                period_ms,
                fps,
            } => {
                write!(
                    f,
                    "its times look like {unit} ({period_ms} from frame to frame"
                )?;
                if let Some(fps) = fps {
                    let expected_ms = 1e3 / fps;
                    write!(
                        f,
                        ", where a frame at {fps:.3} fps takes {expected_ms:.3} ms"
                    )?;
                }
                f.write_str("): timecode format v2 holds milliseconds")
            }
            Self::TooFew {
                have,
                need,
                at_least,
                recording,
            } => write!(
                f,
                "only {have} times for {}{need} frames of {recording}: every frame needs its own",
                if *at_least { "at least " } else { "" }
            ),
            Self::TooMany {
                have,
                frames,
                recording,
            } => write!(
                f,
                "{have} times for the {frames} frames of {recording}: which frames are missing is \
                 not known, so no time is sure"
            ),
        }
    }
}

impl std::error::Error for PtsError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_line_that_is_wrong() {
        for (text, wrong) in [
            ("# timecode format v2\n0\n10\nten\n", "line 4"),
            ("0\n10\n10\n", "line 3"),
            ("0\n\n-1\n", "line 3"),
            ("0\nNaN\n", "line 2"),
            ("0\ninf\n", "line 2"),
            ("-8e12\n8e12\n", "line 1"),
            ("# timecode format v1\n0\n", "line 1"),
            ("# timecode format v2\n", "no time"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(wrong), "{text:?}: {error}");
        }
    }

    #[test]
    fn times_in_other_units_are_recognised() {
        let times = |scale: f64, fps: f64| -> Vec<i64> {
            (0..100)
                .map(|i| (f64::from(i) * 1e3 / fps * scale * 1e6) as i64)
                .collect()
        };
        for fps in [25.0, 60.0, 240.0, 1000.0] {
            assert_eq!(
                wrong_unit(&times(1e3, fps), Some(fps)),
                Some("microseconds"),
                "{fps}"
            );
            assert_eq!(
                wrong_unit(&times(1e6, fps), Some(fps)),
                Some("nanoseconds"),
                "{fps}"
            );
            assert_eq!(
                wrong_unit(&times(1e-3, fps), Some(fps)),
                Some("seconds"),
                "{fps}"
            );
            // Played at another rate than filmed.
            for said in [25.0, 30.0, 60.0, 240.0] {
                assert_eq!(
                    wrong_unit(&times(1.0, fps), Some(said)),
                    None,
                    "{fps} {said}"
                );
            }
            assert_eq!(wrong_unit(&times(1.0, fps), None), None);
        }
        assert_eq!(wrong_unit(&times(1e3, 60.0), None), Some("microseconds"));
        assert_eq!(
            wrong_unit(&times(1e3, 250.0), Some(25.0)),
            Some("microseconds")
        );
    }

    #[test]
    fn the_usual_period_is_not_fooled_by_a_lost_frame() {
        let times = parse("0\n33\n66\n132\n165\n").unwrap();
        assert_eq!(period_ns(&times), Some(33_000_000));
        assert_eq!(period_ns(&times[..1]), None);
    }
}
