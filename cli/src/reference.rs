//! Phases against another part of the same picture.
//!
//! The recording is measured twice: the reference first, whose tones are kept, then the part itself. Both see the same
//! frames, so that their windows are the same. Two phases are compared in the middle of their window, where an error of
//! the frequency, which turns a phase over the time from the recording's begin, has no part in them.

use std::f64::consts::TAU;

use rowtone::report::{Motion, Peak, Report};
use serde::Serialize;

use crate::failure::Failure;
use rowtone_clip::{CameraOptions, Feed, Rect, Roi};
use rowtone_measure::MeasureError;
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings};
use rowtone_measure::tracking::Shifts;
use rowtone_report::text::digits;

/// The reference's windows.
#[derive(Debug)]
pub(crate) struct Reference(Vec<Window>);

#[derive(Debug)]
struct Window {
    time_ms: u64,
    peaks: Vec<Peak>,
}

/// What a part's tones are against the reference's.
#[derive(Debug, Serialize)]
pub(crate) struct Against {
    reference: Vec<Option<ToneAgainst>>,
}

/// One tone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct ToneAgainst {
    hz: f32,
    axis: &'static str,
    /// The part's phase less the reference's, −π to π rad: above 0 where the part is ahead.
    phase_rad: f64,
    phase_rad_sd: f64,
    /// The part's amplitude over the reference's.
    ratio: f64,
    ratio_sd: f64,
}

impl Reference {
    /// Measures the reference.
    ///
    /// # Errors
    /// [`Failure`] where it cannot be measured, or the recording comes through a pipe and cannot be read twice.
    pub(crate) fn measure(
        options: &CameraOptions,
        part: Rect,
        settings: &Settings,
    ) -> Result<Self, Failure> {
        if options.is_pipe() {
            return Err(Failure::usage(
                "--reference: a pipe cannot be read twice: write it to a file",
            ));
        }
        let options = CameraOptions {
            roi: Roi::Part(part),
            ..options.clone()
        };
        let mut feed = Feed::open(&options)?;
        feed.stop_when(crate::stop::on_signals());
        let plan = Plan::new(&feed.camera, settings)?;
        let shifts = Shifts::start(feed, Some(plan.groups()))?;
        let mut memory = plan.memory();
        let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
        let mut windows = Vec::new();
        analysis.run(|event| {
            if let Event::Report(report, _) = event {
                windows.push(Window {
                    time_ms: report.time_ms,
                    peaks: report.peaks.to_vec(),
                });
            }
            Ok::<(), MeasureError>(())
        })?;
        Ok(Self(windows))
    }

    /// A report's tones against those of the same window, in their order; `None` for a tone that the reference does not
    /// have, or of which one of the two is not sure.
    pub(crate) fn against(&self, report: &Report) -> Against {
        let same = |window: &&Window| window.time_ms.abs_diff(report.time_ms) <= 1;
        let window = self.0.iter().find(same);
        let middle_s = report.time_ms as f64 / 1000.0 - f64::from(report.window_s) / 2.0;
        let resolved_hz = 0.5 / report.window_s;
        let tone = |peak: &Peak| {
            let others = window?.peaks.iter().filter(|other| !other.ambiguous);
            let apart = |other: &&Peak| (other.hz - peak.hz).abs();
            let other = others.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
            let near = apart(&other) <= resolved_hz && !peak.ambiguous;
            near.then(|| compare(peak, other, middle_s)).flatten()
        };
        Against {
            reference: report.peaks.iter().map(tone).collect(),
        }
    }
}

/// Amplitude, its deviation and phase along one axis.
type Along = (f64, f64, f64);

fn along(motion: &Motion, of_y: bool) -> Option<Along> {
    let (px, sd, phase) = match of_y {
        false => (motion.x_px, motion.x_px_sd, Some(motion.phase_rad)),
        true => (motion.y_px, motion.y_px_sd, motion.y_phase_rad),
    };
    Some((px?.into(), sd?.into(), phase?.into()))
}

/// Along the axis on which both together move most in proportion to their noise.
fn compare(peak: &Peak, other: &Peak, middle_s: f64) -> Option<ToneAgainst> {
    let (a, b) = (peak.motion.as_ref()?, other.motion.as_ref()?);
    let both = |of_y| Some((along(a, of_y)?, along(b, of_y)?, of_y));
    let share = |(px, sd, _): Along| sd / px;
    let noise = |&(a, b, _): &(Along, Along, bool)| share(a).hypot(share(b));
    let axes = [both(false), both(true)].into_iter().flatten();
    let (a, b, of_y) = axes.min_by(|a, b| noise(a).total_cmp(&noise(b)))?;
    let noise = noise(&(a, b, of_y));
    let turned = TAU * f64::from(peak.hz) - TAU * f64::from(other.hz);
    let phase = a.2 - b.2 + turned * middle_s;
    // A frequency is told to half a step of its last bit.
    let step_hz = |hz: f32| f64::from(hz) * f64::from(f32::EPSILON) / 12_f64.sqrt();
    let rounding = TAU * middle_s * step_hz(peak.hz).hypot(step_hz(other.hz));
    let ratio = a.0 / b.0;
    let told = noise.is_finite() && ratio.is_finite();
    told.then(|| ToneAgainst {
        hz: other.hz,
        axis: if of_y { "y" } else { "x" },
        phase_rad: phase - TAU * (phase / TAU).round(),
        phase_rad_sd: noise.hypot(rounding),
        ratio,
        ratio_sd: ratio * noise,
    })
}

impl Against {
    /// A line for each tone that the reference has too.
    pub(crate) fn lines(&self) -> impl Iterator<Item = String> {
        self.reference.iter().flatten().map(|tone| {
            let (degrees, sd) = (tone.phase_rad.to_degrees(), tone.phase_rad_sd.to_degrees());
            let way = if degrees < 0.0 { "behind" } else { "ahead of" };
            format!(
                "{:>14.4} Hz  {:.2}° ± {} {way} the reference along {}, {} times as large",
                tone.hz,
                degrees.abs(),
                digits(sd, 2),
                tone.axis,
                digits(tone.ratio, 4),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(hz: f32, x_px: f32, phase_rad: f32) -> Peak {
        let mut peak = rowtone_report::example(None).peaks[0];
        (peak.hz, peak.ambiguous) = (hz, false);
        peak.motion = Some(Motion {
            x_px: Some(x_px),
            x_px_sd: Some(0.001),
            phase_rad,
            ..Motion::STEADY
        });
        peak
    }

    #[test]
    fn an_error_of_the_frequency_has_no_part_in_a_phase() {
        // Both turn alike in the window's middle, at 10 s: 97.3 Hz, of which one says a millihertz more.
        let (hz, off) = (97.3_f64, 0.001_f64);
        let at_start = |hz: f64, in_the_middle: f64| {
            let phase = in_the_middle - TAU * hz * 10.0;
            (phase - TAU * (phase / TAU).round()) as f32
        };
        let (a, b) = (hz as f32, (hz + off) as f32);
        let a = peak(a, 0.3, at_start(a.into(), 1.0));
        let b = peak(b, 0.1, at_start(b.into(), 0.6));
        let told = compare(&a, &b, 10.0).unwrap();
        assert!((told.phase_rad - 0.4).abs() < 1e-4, "{told:?}");
        assert!((told.ratio - 3.0).abs() < 1e-6);
        // 0.001/0.3 and 0.001/0.1
        assert!((told.phase_rad_sd - 0.010_54).abs() < 2e-4, "{told:?}");
        let none = Peak {
            motion: None,
            ..peak(97.3, 0.3, 0.0)
        };
        assert_eq!(compare(&a, &none, 10.0), None);
        assert_eq!(compare(&a, &peak(97.3, 0.0, 0.0), 10.0), None);
    }
}
