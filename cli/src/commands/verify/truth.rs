//! What is true of a recording, as the file beside it says.

use std::path::Path;

use crate::failure::Failure;
use rowtone_clip::{Rect, Roi};
use serde::Deserialize;

/// A recording and what is true of it.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Truth {
    /// The recording's file, in the same folder.
    pub(super) clip: String,
    pub(super) fps: Option<f64>,
    pub(super) line_time_us: Option<f64>,
    #[serde(default)]
    pub(super) global_shutter: bool,
    pub(super) exposure_us: Option<f64>,
    roi: Option<Part>,
    #[serde(default)]
    pub(super) tones: Vec<Tone>,
    /// Whole multiples of the tones may show too.
    #[serde(default)]
    pub(super) harmonics_allowed: bool,
    /// Share of the largest peak above which nothing else may stand unmarked.
    #[serde(default)]
    pub(super) nothing_else_above: f64,
}

/// A tone that is in the recording.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Tone {
    pub(super) hz: f64,
    pub(super) hz_tolerance: f64,
    pub(super) amplitude_px: Option<f64>,
    /// Share of the amplitude.
    #[serde(default = "usual_share")]
    pub(super) amplitude_tolerance: f64,
}

fn usual_share() -> f64 {
    0.05
}

/// A part of the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum Part {
    Rectangle([usize; 4]),
    Word(String),
}

impl Truth {
    /// Reads a description.
    ///
    /// # Errors
    /// [`Failure::Input`] for one that cannot be read.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let name = path.display();
        let text = std::fs::read_to_string(path)
            .map_err(|e| Failure::input(format!("{name}: cannot be read: {e}")))?;
        serde_json::from_str(&text).map_err(|e| Failure::input(format!("{name}: {e}")))
    }

    /// The part to measure.
    ///
    /// # Errors
    /// [`Failure::Input`] for what is none.
    pub(super) fn roi(&self) -> Result<Roi, Failure> {
        match &self.roi {
            None => Ok(Roi::Auto),
            Some(Part::Word(word)) => word
                .parse()
                .map_err(|e| Failure::input(format!("roi {word:?}: {e}"))),
            Some(Part::Rectangle([x, y, width, height])) => Ok(Roi::Part(Rect {
                x: *x,
                y: *y,
                width: *width,
                height: *height,
            })),
        }
    }

    /// A frequency is a whole multiple of a tone, as near as the tone is known.
    pub(super) fn is_harmonic(&self, hz: f64) -> bool {
        self.harmonics_allowed
            && self.tones.iter().any(|tone| {
                let multiple = (hz / tone.hz).round();
                multiple >= 1.0
                    && (hz - multiple * tone.hz).abs() < 0.5 + multiple * tone.hz_tolerance
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(json: &str) -> Truth {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn a_part_is_a_rectangle_or_a_word() {
        let roi = |roi: &str| truth(&format!(r#"{{"clip":"a.mp4","roi":{roi}}}"#)).roi();
        assert_eq!(
            roi("[1,2,3,4]").unwrap(),
            Roi::Part("1,2,3,4".parse().unwrap())
        );
        assert_eq!(roi("\"full\"").unwrap(), Roi::Full);
        assert_eq!(truth(r#"{"clip":"a.mp4"}"#).roi().unwrap(), Roi::Auto);
        assert!(roi("\"half\"").is_err());
    }

    #[test]
    fn harmonics_are_multiples() {
        let json =
            r#"{"clip":"a","tones":[{"hz":32.0,"hz_tolerance":0.1}],"harmonics_allowed":true}"#;
        assert!(truth(json).is_harmonic(96.2) && truth(json).is_harmonic(32.3));
        assert!(!truth(json).is_harmonic(80.0) && !truth(json).is_harmonic(10.0));
        let json = json.replace("true", "false");
        assert!(!truth(&json).is_harmonic(96.0));
    }
}
