//! Line time, read-out time, blank time and exposure of a camera, from the stripes that a flashing light makes.
//!
//! Contract: [`calibrate`] takes the mean of every row of every frame ([`rows::Recording`]) and what is known of the
//! light ([`Light`]), and returns a [`Calibration`] whose standard deviations can be believed, or a [`Refusal`]
//! that says why there is none. It never returns a figure that it has reason to doubt without saying so in
//! [`Calibration::warnings`].
//!
//! The idea (section 4.5 of the thesis this project starts from): a row is exposed one line time after the row above
//! it, so a light of f hertz makes ν = f·t_line stripes a row. All frames are fitted together with one wave form
//! ([`model`], [`fit`]); the phase of each frame is free, so frame times need not be known for the line time. They
//! then give frame period, blank time and rolling direction ([`frames`]). [`exposure`] reads the ramps.
//!
//! | file | what it does |
//! | --- | --- |
//! | [`rows`] | pictures to row means |
//! | [`search`] | first guess of the stripes |
//! | [`model`], [`fit`] | the least-squares fit and its uncertainty |
//! | [`stripes`] | which fit is believed |
//! | [`frames`] | frame period, direction |
//! | [`exposure`] | exposure of a row |
//! | [`unknown`] | a light of unknown frequency |
//! | [`vibration`] | a steady machine tone instead of a light |
//! | [`plot`] | the stripes and the fit, drawn |
//! | [`mod@file`] | the result as TOML |
//! | [`study`] | calibrations of simulated cameras, with the truth |

use std::fmt;

pub mod exposure;
pub mod file;
pub mod fit;
pub mod frames;
pub mod model;
pub mod plot;
pub mod rows;
pub mod search;
pub mod stripes;
pub mod study;
pub mod unknown;
pub mod vibration;

pub use file::Calibration;
use file::RollingName;
use frames::{Rolling, Verdict};
use rows::Recording;
use stripes::Stripes;

/// What is known of the light (or of the machine tone).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Its frequency, Hz, and the standard deviation of that.
    Known {
        /// Flashes a second.
        hz: f64,
        /// How sure that is, Hz; 0 for a generator.
        hz_sd: f64,
        /// Whether the light is switched sharply (an LED) and so shows the exposure.
        switched: bool,
    },
    /// Nothing, or about what it is: then frame times of more than one spacing are needed, or the guess must be
    /// nearer than half the frame rate.
    Unknown {
        /// A guess, Hz.
        about_hz: Option<f64>,
    },
}

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
            Self::NoFrameTimes => f.write_str("an unknown light needs a video of at least 4 frames and its frame rate"),
            Self::Incoherent => f.write_str("the frames do not keep one phase: lost frames without --pts, or a light that is not steady"),
        }
    }
}

impl std::error::Error for Refusal {}

/// Calibrates a camera from one recording.
///
/// # Errors
/// A [`Refusal`].
pub fn calibrate(recording: &Recording, light: Light) -> Result<Calibration, Refusal> {
    calibrate_with_stripes(recording, light).map(|(calibration, _)| calibration)
}

/// [`calibrate`], and the fit behind it (to be drawn).
///
/// # Errors
/// A [`Refusal`].
pub fn calibrate_with_stripes(
    recording: &Recording,
    light: Light,
) -> Result<(Calibration, Stripes), Refusal> {
    let switched = matches!(light, Light::Known { switched: true, .. });
    if let Light::Known { hz, .. } | Light::Unknown { about_hz: Some(hz) } = light
        && !(hz.is_finite() && hz > 0.0)
    {
        return Err(Refusal::LightHz { hz });
    }
    let stripes = stripes::find(&recording.rows, if switched { 48 } else { 6 })?;
    let mut warnings = Vec::new();
    let fit = &stripes.fit;
    let rows = fit.gain.len();
    let times = recording.times_s.as_deref().filter(|t| t.len() > 1);
    let nominal_period = recording.frame_period_s();

    let (hz, hz_sd, verdict) = match light {
        Light::Known { hz, hz_sd, .. } => {
            let verdict = times.map_or(Verdict::Undecided, |t| {
                frames::judge(&fit.model.phases, t, hz)
            });
            (hz, hz_sd, verdict)
        }
        Light::Unknown { about_hz } => {
            let times = times.ok_or(Refusal::NoFrameTimes)?;
            let found = unknown::solve(
                &fit.model.phases,
                times,
                fit.model.per_row * rows as f64,
                about_hz,
            )?;
            let verdict = Verdict::Clear {
                rolling: found.rolling,
                scale: 1.0,
                scale_sd: 0.0,
            };
            (found.hz, found.hz_sd, verdict)
        }
    };
    let relative_sd = (fit.per_row_sd / fit.model.per_row).hypot(hz_sd / hz);
    let line_time_s = fit.model.per_row / hz;
    let readout_s = line_time_s * rows as f64;

    if let Some(period) = nominal_period {
        if readout_s > period * (1.0 + frames::CLOCK_TOLERANCE) {
            return Err(Refusal::ReadoutTooLong {
                readout_s,
                frame_period_s: period,
            });
        }
        // A row can take no longer than its share of the frame period: could the next alias be meant?
        if hz * period / rows as f64 > 1.0 - fit.model.per_row {
            return Err(Refusal::Aliased {
                below_hz: (1.0 - fit.model.per_row) * rows as f64 / period,
            });
        }
    } else {
        warnings
            .push("one picture, no frame rate: the light's frequency is taken on trust".to_owned());
    }

    let mut frame_period = None;
    let mut rolling = None;
    match verdict {
        Verdict::Clear { rolling: direction, scale, scale_sd } => {
            rolling = Some(match direction {
                Rolling::Down => RollingName::Down,
                Rolling::Up => {
                    warnings.push(
                        "the last row is read first; if this camera reads downwards, the light's frequency or the frame rate is wrong"
                            .to_owned(),
                    );
                    RollingName::Up
                }
            });
            frame_period = nominal_period.map(|p| (p * scale, p * scale_sd.hypot(hz_sd / hz)));
        }
        Verdict::Undecided if times.is_some() => warnings.push(
            "rolling direction and blank time are not told: stripes stand still, move by half a period a frame, or the frame rate is not known well enough for so fast a light"
                .to_owned(),
        ),
        Verdict::Undecided => {}
        Verdict::Incoherent => warnings
            .push("frames do not keep one phase (lost frames without --pts?): blank time is not told".to_owned()),
        Verdict::Contradiction { seen, expected } => return Err(Refusal::FramePhase { seen, expected }),
    }
    if stripes.left_out.0 > 0 {
        warnings.push(format!(
            "{} of {} stripes were unlike the others and left out",
            stripes.left_out.0, stripes.left_out.1
        ));
    }
    let mut ramp = None;
    if recording.saturated_share > 0.0 {
        warnings.push(format!(
            "{:.0} % of the pixels are saturated: the exposure is not told",
            100.0 * recording.saturated_share
        ));
    } else if switched {
        ramp = exposure::ramp(&recording.rows, fit);
        if ramp.is_none() {
            warnings.push(
                "exposure not told: the light shows no fully dark and fully bright rows (exposure too long, or other light)"
                    .to_owned(),
            );
        }
    }
    let gain = crate::linear::median(&fit.gain);
    let calibration = Calibration {
        rows: rows as u32,
        frames: fit.residual.len() as u32,
        light_hz: hz,
        light_hz_sd: hz_sd,
        periods_per_frame: fit.model.per_row * rows as f64,
        periods_per_frame_sd: fit.per_row_sd * rows as f64,
        readout_s,
        readout_s_sd: readout_s * relative_sd,
        line_time_s,
        line_time_s_sd: line_time_s * relative_sd,
        frame_period_s: frame_period.map(|p| p.0),
        frame_period_s_sd: frame_period.map(|p| p.1),
        blank_s: frame_period.map(|p| p.0 - readout_s),
        blank_s_sd: frame_period.map(|p| p.1.hypot(readout_s * relative_sd)),
        exposure_s: ramp.map(|r| r.periods / hz),
        exposure_s_sd: ramp.map(|r| r.sd / hz),
        rolling,
        contrast: gain / crate::linear::median(&fit.offset).abs().max(1e-9),
        warnings,
    };
    Ok((calibration, stripes))
}
