//! What the reports of a recording are worth.

use std::collections::BTreeSet;

use host_sim::Camera;
use rowtone::report::{Peak, Report};
use rowtone::tracker::Axes;
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings};
use rowtone_measure::tracking::Shifts;

use super::case::{Recording, Truth};
use crate::LabError;
use crate::filmed::Filmed;

/// As near as this to a tone a peak is that tone, Hz: half of what a second can tell apart.
const SAME_HZ: f64 = 0.5;

/// What came of the recordings of one kind.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Windows reported.
    pub windows: u32,
    /// Tones that should be in them.
    pub due: u32,
    /// Of these, those that are there and sure.
    pub sure: u32,
    /// Of these, those that are there and marked `ambiguous`.
    pub ambiguous: u32,
    /// Errors of frequency over their stated deviations.
    hz_over_sd: Vec<f64>,
    /// Errors of amplitude over the true one, where one is known.
    amplitude: Vec<f64>,
    /// The largest sure peak at f ± k·fps of a tone that is none, over that tone.
    pub image: f64,
    /// Windows with a sure peak that is neither a tone nor such an image.
    pub false_windows: u32,
    /// All words of warning.
    warnings: BTreeSet<&'static str>,
}

impl Score {
    /// Films and measures a recording as `rowtone analyze` does.
    ///
    /// # Errors
    /// [`LabError`] where it cannot be simulated or measured.
    pub fn add(&mut self, name: &str, recording: &Recording) -> Result<(), LabError> {
        let simulated = |why| LabError::Recording {
            what: name.to_owned(),
            why,
        };
        let camera = Camera::new(recording.config.clone()).map_err(simulated)?;
        let feed = Filmed::new(&camera, Axes::Xy)?.feed()?;
        let plan = Plan::new(&feed.camera, &Settings::default())?;
        let shifts = Shifts::start(feed, Some(plan.groups()))?;
        let mut memory = plan.memory();
        Analysis::new(shifts, &plan, &mut memory)?.run(|event| {
            if let Event::Report(report, _) = event {
                self.judge(report, &recording.tones, recording.config.sensor.fps);
            }
            Ok::<(), LabError>(())
        })
    }

    fn judge(&mut self, report: &Report, tones: &[Truth], fps: f64) {
        self.windows += 1;
        self.warnings.extend(report.warnings.names());
        let mut invented = false;
        for peak in &report.peaks {
            if tones.iter().any(|tone| tone.is(peak)) || peak.ambiguous {
                continue;
            }
            let (hz, px) = (f64::from(peak.hz), f64::from(peak.amplitude_px));
            match tones.iter().find(|tone| is_image(tone.hz, hz, fps)) {
                Some(tone) => {
                    let own = report.peaks.iter().find(|peak| tone.is(peak));
                    let own_px = own.map_or(0.0, |peak| f64::from(peak.amplitude_px));
                    self.image = self.image.max(px / own_px.max(px));
                }
                None => invented = true,
            }
        }
        self.false_windows += u32::from(invented);
        for tone in tones {
            self.due += 1;
            let Some(peak) = report.peaks.iter().find(|peak| tone.is(peak)) else {
                continue;
            };
            match peak.ambiguous {
                true => self.ambiguous += 1,
                false => self.sure += 1,
            }
            let hz_sd = f64::from(peak.hz_sd).max(1e-9);
            self.hz_over_sd.push((f64::from(peak.hz) - tone.hz) / hz_sd);
            if let Some(px) = tone.px {
                self.amplitude.push(f64::from(peak.amplitude_px) / px - 1.0);
            }
        }
    }
}

impl Truth {
    /// A peak is this tone.
    fn is(&self, peak: &Peak) -> bool {
        (f64::from(peak.hz) - self.hz).abs() < SAME_HZ
    }
}

/// Whether a peak lies at f ± k·fps or at their mirror images, k not 0.
fn is_image(tone_hz: f64, hz: f64, fps: f64) -> bool {
    [hz - tone_hz, hz + tone_hz].into_iter().any(|apart| {
        let apart = apart.rem_euclid(fps);
        apart.min(fps - apart) < SAME_HZ
    })
}

/// What the columns of [`row`] are.
pub fn head() -> String {
    format!(
        "{:<48} {:>7} {:>5} {:>5} {:>6} {:>7} {:>8} {:>8} {:>7} {:>6}  warnings",
        "recording",
        "windows",
        "tones",
        "sure",
        "ambig.",
        "f/sd",
        "A, rms",
        "worst",
        "image",
        "false"
    )
}

/// A line of the table.
pub fn row(name: &str, score: &Score) -> String {
    let rms = |of: &[f64]| (of.iter().map(|v| v * v).sum::<f64>() / of.len().max(1) as f64).sqrt();
    let worst = score
        .amplitude
        .iter()
        .copied()
        .max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let words: Vec<&str> = score.warnings.iter().copied().collect();
    let known = worst.map_or(String::new(), |_| percent(rms(&score.amplitude)));
    format!(
        "{name:<48} {:>7} {:>5} {:>5} {:>6} {:>7.2} {known:>8} {:>8} {:>7} {:>6}  {}",
        score.windows,
        score.due,
        score.sure,
        score.ambiguous,
        rms(&score.hz_over_sd),
        worst.map_or(String::new(), |share| format!("{:+.2} %", 100.0 * share)),
        percent(score.image),
        score.false_windows,
        words.join(" "),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_a_multiple_of_the_frame_rate_away_or_mirrored() {
        assert!(is_image(83.3, 143.3, 60.0));
        assert!(is_image(83.3, 23.3, 60.0));
        assert!(is_image(83.3, 36.7, 60.0), "mirrored");
        assert!(!is_image(83.3, 100.0, 60.0));
    }
}
