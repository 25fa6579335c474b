//! What is true in a recording, as JSON beside it.

use serde::Serialize;

use super::camera::Camera;
use super::config::Config;
use super::crlb::{self, CrlbStats};
use super::field::Mode;
use super::motion::Tone;

/// The truth about a recording. The first fields are the ones a reader wants; `config` is all.
#[derive(Clone, Debug, Serialize)]
pub struct Truth {
    /// Frames a second, Hz.
    pub fps: f64,
    /// Time from one row to the next, µs.
    pub line_time_us: f64,
    /// Exposure of a row, µs.
    pub exposure_us: f64,
    /// Rows.
    pub rows: u32,
    /// Columns.
    pub cols: u32,
    /// Bits of a pixel.
    pub bits: u8,
    /// Columns at the left that do not move with the object.
    pub background_cols: u32,
    /// Frames that arrived.
    pub frames: u32,
    /// Numbers of the frames that were lost.
    pub lost_frames: Vec<u32>,
    /// From the first row's start to the end of the last frame, s.
    pub seconds: f64,
    /// Time between the last row of a frame and the first of the next, as a share.
    pub blank_share: f64,
    /// The object's tones, amplitudes before the exposure averages them.
    pub tones: Vec<Tone>,
    /// What moves differently from place to place; amplitudes before the exposure averages them.
    pub modes: Vec<Mode>,
    /// The camera's own tones.
    pub camera_shake: Vec<Tone>,
    /// Median over the rows of the Cramér–Rao bound of one row's displacement, px; absent when no
    /// row has texture.
    pub crlb_px_median: Option<f64>,
    /// More about the bound.
    pub crlb: Option<CrlbStats>,
    /// The same median where both axes are unknown, along x and along y, px; absent where less than
    /// half of the rows know an axis.
    pub crlb_px_median_of_both: [Option<f64>; 2],
    /// Depth of the lamp's flicker, 0 when steady.
    pub flicker: f64,
    /// Frequency of the flicker, Hz, 0 when steady.
    pub flicker_hz: f64,
    /// The file of frame times, when one was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pts: Option<String>,
    /// Everything.
    pub config: Config,
}

impl Truth {
    /// Of this camera.
    pub fn new(camera: &Camera) -> Self {
        let config = camera.config();
        let s = &config.sensor;
        let bounds = crlb::stats(&crlb::row_bounds_px(camera));
        let slots = camera.slots();
        let (first, last) = (slots.first(), slots.last());
        let span = last.map_or(0, |l| l.start_ns) - first.map_or(0, |f| f.start_ns);
        let frames = camera.arriving().count() as u32;
        Self {
            fps: s.fps,
            line_time_us: f64::from(s.line_time_ps) * 1e-6,
            exposure_us: f64::from(s.exposure_ns) * 1e-3,
            rows: s.rows,
            cols: s.cols,
            bits: s.bits,
            background_cols: config.background_cols,
            frames,
            lost_frames: slots.iter().filter(|s| s.lost).map(|s| s.number).collect(),
            seconds: span as f64 * 1e-9 + s.readout_s() + f64::from(s.exposure_ns) * 1e-9,
            blank_share: 1.0 - s.readout_s() * s.fps,
            tones: config.motion.tones.clone(),
            modes: config.modes.clone(),
            camera_shake: config.shake.tones.clone(),
            crlb_px_median: bounds.map(|b| b.median_px),
            crlb: bounds,
            crlb_px_median_of_both: crlb::medians_of_both_px(camera),
            flicker: config.light.flicker.map_or(0.0, |f| f.depth),
            flicker_hz: config.light.flicker.map_or(0.0, |f| f.hz),
            pts: None,
            config: config.clone(),
        }
    }
}
