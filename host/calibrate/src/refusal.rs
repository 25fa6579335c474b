//! Why there is no calibration, in one line each.

use std::fmt;

/// Why there is no calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The frequency is not a positive number.
    LightHz {
        /// What was given, Hz.
        hz: f64,
    },
    /// The picture is not high enough.
    TooFewRows {
        /// Its rows.
        rows: usize,
    },
    /// No stripes at all.
    NoStripes,
    /// Too few periods of the light in one frame.
    TooFewPeriods {
        /// Periods in a frame.
        periods: f64,
        /// How many are needed.
        least: f64,
    },
    /// Stripes narrower than the rows can show.
    TooFine {
        /// Rows in a period.
        rows_per_stripe: f64,
    },
    /// The stripes drown in noise.
    LowContrast {
        /// Amplitude over mean brightness.
        contrast: f64,
        /// Relative standard deviation that the line time would have.
        relative_sd: f64,
    },
    /// There is something periodic, but most of the picture is something else.
    OtherPattern {
        /// Share of the variance that stripes explain.
        explained: f64,
    },
    /// Many stripes are missing or unlike the others.
    Irregular {
        /// How many.
        left_out: usize,
        /// Of how many.
        stripes: usize,
    },
    /// Every second (or third) stripe differs: the light's frequency is not the stripes'.
    Subharmonic {
        /// Every how many.
        divisor: usize,
        /// By how much, against the stripes' own amplitude.
        share: f64,
    },
    /// Two patterns lie over each other, and either may be the light's.
    TwoPatterns {
        /// Periods of the coarser in a frame.
        periods: f64,
        /// Periods of the finer.
        finer: f64,
    },
    /// The read-out would be longer than the frame period.
    ReadoutTooLong {
        /// Read-out time, s.
        readout_s: f64,
        /// Frame period, s.
        frame_period_s: f64,
    },
    /// A faster light could look the same.
    Aliased {
        /// The highest frequency that could not, Hz.
        below_hz: f64,
    },
    /// The stripes move from frame to frame as the given frequency cannot make them.
    FramePhase {
        /// Seen, periods a frame.
        seen: f64,
        /// Expected, periods a frame.
        expected: f64,
    },
    /// Several frequencies explain an unknown light.
    Ambiguous {
        /// Some of them, Hz.
        candidates_hz: Vec<f64>,
    },
    /// All frames see the stripes in the same few places, before a picture that is not smooth.
    FewPhases,
    /// An unknown light needs several frames with known times.
    NoFrameTimes,
    /// The frames do not keep one phase.
    Incoherent,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LightHz { hz } => write!(f, "a light of {hz} Hz: give its frequency in Hz, greater than 0"),
            Self::TooFewRows { rows } => write!(f, "{rows} rows: at least 16 are needed; use a higher picture or --roi"),
            Self::NoStripes => f.write_str("no stripes found: light the scene with the flashing LED alone, with a short exposure"),
            Self::TooFewPeriods { periods, least } => write!(
                f,
                "{periods:.2} periods of the light in a frame, {least} are needed: use a faster light, or a video instead of one picture"
            ),
            Self::TooFine { rows_per_stripe } => {
                write!(f, "a stripe is only {rows_per_stripe:.1} rows high: use a slower light")
            }
            Self::LowContrast { contrast, relative_sd } => write!(
                f,
                "stripes too weak (contrast {:.2} %, line time only within {:.1} %): shorten the exposure, darken the room",
                100.0 * contrast,
                100.0 * relative_sd
            ),
            Self::OtherPattern { explained } => write!(
                f,
                "stripes explain only {:.0} % of the picture's changes from row to row: take a video, or light a plain surface",
                100.0 * explained
            ),
            Self::Irregular { left_out, stripes } => write!(
                f,
                "{left_out} of {stripes} stripes are unlike the others: the light does not flash steadily, or something moves"
            ),
            Self::Subharmonic { divisor, share } => write!(
                f,
                "stripes repeat only every {divisor} (they differ by {:.0} %): the light flashes unevenly, its true frequency may be 1/{divisor} of the stripes'",
                100.0 * share
            ),
            Self::TwoPatterns { periods, finer } => write!(
                f,
                "two patterns lie over each other, of {periods:.1} and of {finer:.1} stripes a frame: put out other lights, or \
                 give the frame rate (--fps) to tell which is the light's"
            ),
            Self::ReadoutTooLong { readout_s, frame_period_s } => write!(
                f,
                "a read-out of {:.3} ms does not fit into a frame of {:.3} ms: check the light's frequency and --fps",
                1e3 * readout_s,
                1e3 * frame_period_s
            ),
            Self::Aliased { below_hz } => write!(
                f,
                "more than half a period of the light may pass from row to row, so several line times would look the same: use a light below {below_hz:.0} Hz"
            ),
            Self::FramePhase { seen, expected } => write!(
                f,
                "stripes move by {seen:+.3} or {:+.3} periods a frame where the light's frequency and frame rate call for {expected:+.3}: one of the two is wrong",
                -seen
            ),
            Self::Ambiguous { candidates_hz } => {
                f.write_str("several frequencies explain the light:")?;
                for hz in candidates_hz {
                    write!(f, " {hz:.2}")?;
                }
                f.write_str(" Hz...; add --about-hz, or record at two frame rates with --pts")
            }
            Self::FewPhases => f.write_str(
                "the stripes come back to the same few places in every frame and hide in the scene's own texture: record longer, change the light's frequency a little, or light a plain surface",
            ),
            Self::NoFrameTimes => f.write_str("an unknown light needs a video of at least 4 frames and its frame rate"),
            Self::Incoherent => f.write_str("the frames do not keep one phase: lost frames without --pts, or a light that is not steady"),
        }
    }
}

impl std::error::Error for Refusal {}
