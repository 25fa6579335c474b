//! The whole recording as one JSON object and as text.

use std::fmt::Write;

use serde::Serialize;

use super::{Persistent, Summary};
use crate::text::{digits, figures};
use crate::zone::ZoneLimits;
use crate::{sentence, velocity_mm_s_rms};

/// Most tones that are told.
const MOST_TOLD: usize = 32;

#[derive(Serialize)]
struct SummaryObject {
    summary: bool,
    windows: u32,
    t_s: f64,
    window_s: f64,
    fps: f64,
    noise_px: f64,
    velocity_mm_s_rms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zone: Option<char>,
    peaks: Vec<ToneObject>,
    warnings: Vec<&'static str>,
}

#[derive(Serialize)]
struct ToneObject {
    hz: f64,
    hz_sd: f64,
    hz_spread: f64,
    amplitude_px: f64,
    amplitude_px_sd: f64,
    amplitude_px_spread: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    amplitude_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_mm_s_rms: Option<f64>,
    x_px: Option<f64>,
    x_px_sd: Option<f64>,
    y_px: Option<f64>,
    y_px_sd: Option<f64>,
    windows: u32,
    ambiguous_windows: u32,
    ambiguous: bool,
    from_s: f64,
    to_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    harmonic: Option<u8>,
}

impl ToneObject {
    fn new(tone: &Persistent, um_per_px: Option<f32>) -> Self {
        let amplitude_um = um_per_px.map(|um| tone.amplitude_px * f64::from(um));
        Self {
            hz: round(tone.hz, 1e-6),
            hz_sd: round(tone.hz_sd, 1e-7),
            hz_spread: round(tone.hz_spread, 1e-7),
            amplitude_px: round(tone.amplitude_px, 1e-7),
            amplitude_px_sd: round(tone.amplitude_px_sd, 1e-8),
            amplitude_px_spread: round(tone.amplitude_px_spread, 1e-8),
            amplitude_um: amplitude_um.map(|um| round(um, 1e-6)),
            velocity_mm_s_rms: amplitude_um.map(|um| round(velocity_mm_s_rms(tone.hz, um), 1e-7)),
            x_px: tone.x_px.map(|(px, _)| round(px, 1e-7)),
            x_px_sd: tone.x_px.map(|(_, sd)| round(sd, 1e-8)),
            y_px: tone.y_px.map(|(px, _)| round(px, 1e-7)),
            y_px_sd: tone.y_px.map(|(_, sd)| round(sd, 1e-8)),
            windows: tone.windows,
            ambiguous_windows: tone.ambiguous_windows,
            ambiguous: tone.doubtful(),
            from_s: round(tone.from_s, 1e-3),
            to_s: round(tone.to_s, 1e-3),
            harmonic: tone.harmonic,
        }
    }
}

/// Digits beyond a unit that no camera reaches only make lines long.
fn round(value: f64, unit: f64) -> f64 {
    // Dividing by a whole number keeps the decimals short.
    let parts = (1.0 / unit).round();
    (value * parts).round() / parts
}

impl Persistent {
    /// Whether at most half of the windows that have it are sure of its frequency.
    pub fn doubtful(&self) -> bool {
        2 * self.ambiguous_windows >= self.windows
    }
}

impl Summary {
    /// The tones, those found in most windows first.
    pub fn tones(&self) -> Vec<Persistent> {
        let mut entries = self.entries.clone();
        entries.sort_by(super::Entry::by_persistence);
        entries.iter().map(super::Entry::persistent).collect()
    }

    /// One JSON object without a line feed: keys as those of a window's report, which `summary` tells it from
    /// (docs/json.md).
    pub fn json(&self, limits: Option<&ZoneLimits>) -> String {
        let (from_s, to_s) = self.span_s.unwrap_or_default();
        let velocity = self.velocity_mm_s_rms();
        let tones = self.tones();
        let object = SummaryObject {
            summary: true,
            windows: self.windows,
            t_s: round(to_s, 1e-3),
            window_s: round(to_s - from_s, 1e-3),
            fps: round(self.mean(self.fps_s), 1e-5),
            noise_px: round(self.mean(self.noise_px2_s).sqrt(), 1e-7),
            velocity_mm_s_rms: velocity.map(|v| round(v, 1e-6)),
            zone: limits.zip(velocity).map(|(limits, v)| limits.zone(v)),
            peaks: tones
                .iter()
                .take(MOST_TOLD)
                .map(|tone| ToneObject::new(tone, self.um_per_px))
                .collect(),
            warnings: self.warnings.names().collect(),
        };
        // Numbers, strings and lists of them always serialise.
        serde_json::to_string(&object).unwrap_or_default()
    }

    /// A heading and one line a tone, without the last line feed.
    pub fn text(&self, limits: Option<&ZoneLimits>) -> String {
        let (from_s, to_s) = self.span_s.unwrap_or_default();
        let windows = match self.windows {
            1 => "1 window".to_owned(),
            n => format!("{n} windows"),
        };
        let mut text = format!(
            "The whole recording: {:.2} s, {windows}, noise {} px a row",
            to_s - from_s,
            digits(self.mean(self.noise_px2_s).sqrt(), 2),
        );
        // Writing to a string cannot fail.
        if let Some(velocity) = self.velocity_mm_s_rms() {
            let _ = write!(text, ", {velocity:.3} mm/s RMS (10-1000 Hz)");
            if let Some(limits) = limits {
                let _ = write!(text, ", zone {}", limits.zone(velocity));
            }
        }
        let tones = self.tones();
        if tones.is_empty() {
            text.push_str("\n            no vibration above the noise");
        }
        for tone in tones.iter().take(MOST_TOLD) {
            let _ = write!(text, "\n{}", self.line(tone));
        }
        if tones.len() > MOST_TOLD {
            let rest = tones.len() - MOST_TOLD;
            let _ = write!(text, "\n            and {rest} rarer ones");
        }
        for sentence in self.warnings.iter().map(sentence) {
            let _ = write!(text, "\n            note: {sentence}");
        }
        text
    }

    fn line(&self, tone: &Persistent) -> String {
        let um = self.um_per_px.map(|um| tone.amplitude_px * f64::from(um));
        let mut line = figures(
            [tone.hz, tone.hz_sd],
            [tone.amplitude_px, tone.amplitude_px_sd],
            um,
        );
        let _ = match (tone.windows, self.windows) {
            (_, 1) => write!(line, "  in the only window"),
            (n, all) if n == all => write!(line, "  in all {all} windows"),
            (n, all) => write!(line, "  in {n} of {all} windows"),
        };
        if tone.windows > 1 {
            let share = 100.0 * tone.amplitude_px_spread / tone.amplitude_px.max(1e-9);
            let spread = digits(tone.hz_spread, 2);
            let _ = write!(line, ", which differ by {spread} Hz, {share:.1} %");
        }
        if tone.windows < self.windows {
            let _ = write!(line, ", {:.2} to {:.2} s", tone.from_s, tone.to_s);
        }
        if let Some(harmonic) = tone.harmonic {
            let _ = write!(line, "  {harmonic}x");
        }
        match tone.ambiguous_windows {
            0 => {}
            n if n == tone.windows => line.push_str("  ambiguous: may be another frequency"),
            n => {
                let _ = write!(line, "  ambiguous in {n}");
            }
        }
        line
    }

    /// Of the windows that have a scale, as root mean square over their time.
    fn velocity_mm_s_rms(&self) -> Option<f64> {
        (self.velocity_s > 0.0).then(|| (self.velocity2_s / self.velocity_s).sqrt())
    }

    fn mean(&self, sum_s: f64) -> f64 {
        if self.total_s > 0.0 {
            sum_s / self.total_s
        } else {
            0.0
        }
    }
}
