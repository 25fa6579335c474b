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
//! | [`model`], [`fit`], `uncertainty` | the least-squares fit, and how sure it is |
//! | [`stripes`] | which fit is believed; `outliers`: failed flashes; `fundamental`: uneven ones; `finer`: two patterns; `bad`: single frames |
//! | [`frames`] | frame period, direction |
//! | [`exposure`], `simplex` | exposure of a row |
//! | [`unknown`] | a light of unknown frequency |
//! | [`vibration`] | a steady machine tone instead of a light, many periods in a frame |
//! | [`tone`] | the same, of less than a period in a frame |
//! | [`plot`] | the stripes and the fit, drawn |
//! | [`mod@file`] | the result as TOML |

mod bad;
pub mod exposure;
pub mod file;
mod finer;
pub mod fit;
pub mod frames;
mod fundamental;
pub mod model;
mod outliers;
pub mod plot;
mod refusal;
pub mod rows;
pub mod search;
mod simplex;
pub mod stripes;
pub mod tone;
mod uncertainty;
pub mod unknown;
pub mod vibration;

pub use file::Calibration;
use file::RollingName;
use frames::{Rolling, Verdict};
pub use refusal::Refusal;
use rows::Recording;
use stripes::Stripes;

/// A camera's own clock is as good as this: crystals keep to 1e-4.
const CAMERA_CLOCK: f64 = 2e-4;

/// What is known of the light (or of the machine tone).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Its frequency, Hz, and the standard deviation of that.
    Known {
        /// Flashes a second.
        hz: f64,
        /// How sure that is, Hz; 0 for a generator.
        hz_sd: f64,
        /// Share of the period that a sharply switched light (an LED) is on: such a one shows the exposure. `None` for
        /// other lights.
        duty: Option<f64>,
    },
    /// Nothing, or about what it is: then frame times of more than one spacing are needed, or the guess must be
    /// nearer than half the frame rate.
    Unknown {
        /// A guess, Hz.
        about_hz: Option<f64>,
    },
}

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
    let (duty, most_harmonics) = match light {
        Light::Known {
            duty: Some(duty), ..
        } => (Some(duty), 90),
        _ => (None, 6),
    };
    if let Light::Known { hz, .. } | Light::Unknown { about_hz: Some(hz) } = light
        && !(hz.is_finite() && hz > 0.0)
    {
        return Err(Refusal::LightHz { hz });
    }
    let stripes = stripes::find(&recording.rows, most_harmonics);
    let (stripes, is_over_another) = of_the_light(recording, light, stripes, most_harmonics)?;
    let fit = &stripes.fit;
    let used_rows = fit.gain.len();
    // A part of the picture tells the line time; read-out and blank time are those of all its rows.
    let rows = recording.picture_rows.unwrap_or(used_rows);
    let times = recording.times_s.as_deref().filter(|t| t.len() > 1);

    let (hz, hz_sd, verdict) = match light {
        Light::Known { hz, hz_sd, .. } => {
            let verdict = times.map_or(Verdict::Undecided, |t| {
                // A frame's stripes tell their number and their phase, by the lever of a straight line.
                let frames = fit.residual.len() as f64;
                let phase_sd = fit.per_row_sd * (frames / 12.0).sqrt() * used_rows as f64;
                frames::judge(&fit.model.phases, t, hz, phase_sd)
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
    let source = Source {
        hz,
        hz_sd,
        verdict,
        is_known: matches!(light, Light::Known { .. }),
        duty,
        is_light: true,
    };
    let (mut calibration, stripes) = conclude(recording, source, stripes)?;
    if is_over_another {
        calibration.warnings.push(
            "a coarser pattern lies over the light's stripes (other lights?) and was taken out: the finer one is the light's"
                .to_owned(),
        );
    }
    Ok((calibration, stripes))
}

/// Of two patterns that lie over each other, the one whose read-out fits into a frame as the light's; and whether it is
/// the finer one.
fn of_the_light(
    recording: &Recording,
    light: Light,
    stripes: Result<Stripes, Refusal>,
    most_harmonics: usize,
) -> Result<(Stripes, bool), Refusal> {
    let Light::Known {
        hz, duty: Some(_), ..
    } = light
    else {
        return stripes.map(|stripes| (stripes, false));
    };
    let all = recording.rows.first().map_or(0, Vec::len);
    let rows = recording.picture_rows.unwrap_or(all) as f64;
    let fits = |per_row: f64| {
        let share = recording
            .frame_period_s()
            .map(|period| per_row * rows / hz / period);
        let can_be = unknown::SHORTEST_READOUT..1.0 + frames::CLOCK_TOLERANCE;
        share.is_none_or(|share| can_be.contains(&share))
    };
    let stripes = match stripes {
        Ok(stripes) => stripes,
        Err(refusal) => {
            // The finer pattern may be too strong for the coarser one to be met.
            let alone = finer::over_a_coarser(&recording.rows)
                .filter(|(coarser, finer)| !fits(*coarser) && fits(*finer))
                .and_then(|(_, finer)| finer::alone(&recording.rows, finer, most_harmonics));
            return alone.map(|stripes| (stripes, true)).ok_or(refusal);
        }
    };
    let Some(finer) = finer::pattern(&stripes.fit) else {
        return Ok((stripes, false));
    };
    match (fits(stripes.fit.model.per_row), fits(finer)) {
        (true, false) => return Ok((stripes, false)),
        (false, true) => {
            if let Some(alone) = finer::alone(&recording.rows, finer, most_harmonics) {
                return Ok((alone, true));
            }
        }
        _ => {}
    }
    Err(Refusal::TwoPatterns {
        periods: stripes.fit.model.per_row * rows,
        finer: finer * rows,
    })
}

/// What was found of the light (or of the machine tone).
struct Source {
    hz: f64,
    hz_sd: f64,
    verdict: Verdict,
    /// Its frequency was given, not found.
    is_known: bool,
    /// As [`Light::Known`]'s.
    duty: Option<f64>,
    is_light: bool,
}

/// The calibration that stripes of a source give, with all that is to be said of it.
fn conclude(
    recording: &Recording,
    source: Source,
    stripes: Stripes,
) -> Result<(Calibration, Stripes), Refusal> {
    let Source {
        hz,
        hz_sd,
        verdict,
        is_known: known,
        duty,
        is_light,
    } = source;
    let mut warnings = Vec::new();
    let fit = &stripes.fit;
    let rows = recording.picture_rows.unwrap_or(fit.gain.len());
    let times = recording.times_s.as_deref().filter(|t| t.len() > 1);
    let nominal_period = recording.frame_period_s();
    let [of_stripes, of_light] = [fit.per_row_sd / fit.model.per_row, hz_sd / hz];
    let relative_sd = of_stripes.hypot(of_light);
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
    }
    if known && times.is_none() {
        warnings.push(match nominal_period {
            Some(_) => "no frame times: the light's frequency is taken on trust".to_owned(),
            None => "no frame rate: the light's frequency is taken on trust, and that less than half its period passes from row to row"
                .to_owned(),
        });
    }

    let mut frame_period = None;
    let mut rolling = None;
    match verdict {
        Verdict::Clear { rolling: direction, scale, scale_sd } => {
            rolling = Some(match direction {
                Rolling::Down => RollingName::Down,
                Rolling::Up => {
                    warnings.push(
                        format!(
                            "the last row is read first; if this camera reads downwards, the {}'s frequency or the frame rate is wrong",
                            if is_light { "light" } else { "tone" }
                        ),
                    );
                    RollingName::Up
                }
            });
            frame_period = nominal_period.map(|p| (p * scale, p * scale_sd));
            if let Some(period) = nominal_period
                && (scale - 1.0).abs() > CAMERA_CLOCK + 3.0 * scale_sd.hypot(of_light)
            {
                warnings.push(format!(
                    "by the light {:.4} frames a second, by the camera {:.4}: if that is exact, the light's frequency is wrong",
                    1.0 / (period * scale),
                    1.0 / period
                ));
            }
        }
        Verdict::Undecided if times.is_some() => warnings.push(
            "rolling direction and blank time are not told, and the light's frequency is taken on trust: fewer than 3 frames, or stripes that stand still, move by half a period a frame, or a frame rate that is not known well enough for so fast a light"
                .to_owned(),
        ),
        Verdict::Undecided => {}
        Verdict::Incoherent => warnings
            .push("frames do not keep one phase (lost frames without --pts?): blank time is not told, and the light's frequency is taken on trust".to_owned()),
        Verdict::Contradiction { seen, expected } => return Err(Refusal::FramePhase { seen, expected }),
    }
    if stripes.left_out.0 > 0 {
        warnings.push(format!(
            "{} of {} stripes were unlike the others and left out",
            stripes.left_out.0, stripes.left_out.1
        ));
    }
    let mut exposure = None;
    if recording.saturated_share > 0.0 {
        warnings.push(format!(
            "{:.0} % of the pixels are saturated: the exposure is not told",
            100.0 * recording.saturated_share
        ));
    } else if let Some(duty) = duty {
        match exposure::ramp(&recording.rows, fit, recording.black).map(|ramp| (ramp.exposure(duty), ramp.sd)) {
            Some((Ok(periods), sd)) => exposure = Some((periods / hz, sd / hz)),
            Some((Err((one, other)), _)) => warnings.push(format!(
                "exposure not told: it may be {:.1} or {:.1} µs, as the light is not on for {:.0} % of its period: give --led-duty",
                1e6 * one / hz,
                1e6 * other / hz,
                100.0 * duty
            )),
            None => warnings.push(
                "exposure not told: the light shows no fully dark and fully bright rows (exposure too long, or other light)"
                    .to_owned(),
            ),
        }
    }
    let gain = rowtone_linear::median(&fit.gain);
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
        frame_period_s_sd: frame_period.map(|p| p.1.hypot(p.0 * of_light)),
        blank_s: frame_period.map(|p| p.0 - readout_s),
        blank_s_sd: frame_period.map(|p| {
            // A known light is off by as much in both; an unknown one's frequency is by the clock that tells the period.
            let by_the_light = if known { p.0 - readout_s } else { readout_s };
            p.1.hypot(readout_s * of_stripes)
                .hypot(by_the_light * of_light)
        }),
        exposure_s: exposure.map(|e| e.0),
        exposure_s_sd: exposure.map(|e| e.1),
        rolling,
        contrast: if is_light {
            gain / rowtone_linear::median(&fit.offset).abs().max(1e-9)
        } else {
            0.0
        },
        warnings,
    };
    Ok((calibration, stripes))
}
