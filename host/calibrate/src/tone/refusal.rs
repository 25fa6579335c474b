//! Why a motion gives no line time, in one line each.

use crate::Refusal;
use std::fmt;

/// A turn known no better than this, periods, does not say that there is none.
const COARSE: f64 = 0.01;

/// Why the motion gives no line time.
#[derive(Clone, Debug, PartialEq)]
pub enum NoTone {
    /// The frequency is not a positive number.
    Hz {
        /// What was given, Hz.
        hz: f64,
    },
    /// Too short a video.
    TooFewFrames {
        /// Its frames.
        frames: usize,
        /// How many are needed.
        least: usize,
    },
    /// Frame times are not known.
    NoTimes,
    /// No pixel changes to its neighbours.
    NoTexture,
    /// No tone stands out.
    NothingSteady,
    /// All rows move at the same moment.
    AtOnce {
        /// The strongest tone, Hz.
        hz: f64,
        /// Its turn over the picture, periods.
        turns: f64,
        /// Standard deviation of that.
        sd: f64,
    },
    /// There is no tone of the frequency that was given.
    NotThere {
        /// That, Hz.
        hz: f64,
        /// Those that there are, below half the frame rate, Hz.
        seen_hz: Vec<f64>,
    },
    /// No read-out that fits into a frame explains the turn.
    NoReading {
        /// The tone, Hz.
        hz: f64,
    },
    /// Several line times explain the motion.
    Ambiguous {
        /// Frequency of the tone, Hz, and line time, s.
        readings: Vec<(f64, f64)>,
    },
    /// What the stripes of a light would be refused for as well.
    Other(Refusal),
}

impl fmt::Display for NoTone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hz { hz } => {
                write!(
                    f,
                    "a tone of {hz} Hz: give its frequency in Hz, greater than 0"
                )
            }
            Self::TooFewFrames { frames, least } => write!(
                f,
                "{frames} frames: a vibration needs a video of at least {least}"
            ),
            Self::NoTimes => f.write_str(
                "a vibration needs a video whose frame rate is known: give --fps or --pts",
            ),
            Self::NoTexture => f.write_str(
                "too little texture to see motion: film a part with contrast, such as a label",
            ),
            Self::NothingSteady => f.write_str(
                "no steady tone stands out in the motion: film a machine that runs steadily, \
                 longer, or give the part that moves with --roi",
            ),
            Self::AtOnce { hz, turns, sd } if *sd > COARSE => write!(
                f,
                "the motion at {hz:.2} Hz turns by {turns:+.3} ± {sd:.3} periods from the first row to \
                 the last, too little for that: film a larger or a faster one, longer, or give the part \
                 that vibrates with --roi"
            ),
            Self::AtOnce { hz, turns, sd } => write!(
                f,
                "all rows move at once at {hz:.2} Hz ({turns:+.4} ± {sd:.4} periods from the first \
                 to the last): this camera has a global shutter, or the tone is too slow; film a \
                 faster one, or give the part that vibrates with --roi"
            ),
            Self::NotThere { hz, seen_hz } => {
                write!(f, "no steady motion at {hz} Hz")?;
                if !seen_hz.is_empty() {
                    f.write_str("; there is some at")?;
                }
                for (i, hz) in seen_hz.iter().enumerate() {
                    write!(f, "{} {hz:.2}", if i > 0 { "," } else { "" })?;
                }
                if seen_hz.is_empty() {
                    return Ok(());
                }
                f.write_str(" Hz, or at a multiple of the frame rate more or less")
            }
            Self::NoReading { hz } => write!(
                f,
                "the rows of a motion at {hz:.2} Hz turn by more or less than any read-out that \
                 fits into a frame makes them: check --fps, or give the part that vibrates with --roi"
            ),
            Self::Ambiguous { readings } => {
                f.write_str("several line times explain the motion:")?;
                for (i, (hz, line_time_s)) in readings.iter().take(6).enumerate() {
                    let comma = if i > 0 { "," } else { "" };
                    write!(
                        f,
                        "{comma} {:.3} µs if the tone is at {hz:.1} Hz",
                        1e6 * line_time_s
                    )?;
                }
                f.write_str("; say which with --about-hz")
            }
            Self::Other(refusal) => refusal.fmt(f),
        }
    }
}

impl std::error::Error for NoTone {}
