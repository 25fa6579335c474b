//! What is said about one window of time, in which units.

mod broadband;
mod motion;
mod warnings;

use heapless::Vec;
use serde::{Deserialize, Serialize};

pub use broadband::{BroadBand, FROM_HZ, Figure, Measures, SLOW_FROM_HZ, TO_HZ};
pub use motion::{MAX_SHAPES, Modulation, Motion, PeakShape, SHAPE_ROWS, ShapeRow};
pub use warnings::{Warning, Warnings};

/// Most peaks one report can hold.
pub const MAX_PEAKS: usize = 16;

/// One tone of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Frequency, Hz.
    pub hz: f32,
    /// Standard deviation of the frequency, Hz.
    pub hz_sd: f32,
    /// Zero-to-peak amplitude of the object's motion in its largest direction (the semi-major axis of its orbit), px, at the
    /// row where it is largest, the exposure's averaging undone.
    pub amplitude_px: f32,
    /// Standard deviation of the amplitude, px.
    pub amplitude_px_sd: f32,
    /// Power of the tone over the noise left in the whole window: 10·log₁₀(N·A²/(4σ²)), dB.
    pub snr_db: f32,
    /// Too near a multiple of the frame rate to be trusted, or weak in a short window and not seen before.
    pub ambiguous: bool,
    /// The same number from window to window while the tone is the same; from 1.
    pub track: u16,
    /// Which harmonic of the running speed, from 1, where one running speed explains it.
    pub harmonic: Option<u8>,
    /// What it does along both axes; `None` from wires of version 1, which do not carry it.
    #[serde(skip)]
    pub motion: Option<Motion>,
}

/// One window of time, as a board sends it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Number of the report, from 0; a lost one leaves a gap.
    pub seq: u32,
    /// End of the window, ms since the board (or the recording) started.
    pub time_ms: u64,
    /// Length of the window, s.
    pub window_s: f32,
    /// Frame rate met in the window, Hz.
    pub fps: f32,
    /// Rows measured in the window.
    pub lines: u32,
    /// Frames missing in the window.
    pub lost_frames: u16,
    /// Standard deviation of one row, px.
    pub noise_px: f32,
    /// Tones, the largest amplitude first.
    pub peaks: Vec<Peak, MAX_PEAKS>,
    /// What the reader should know.
    pub warnings: Warnings,
    /// Scale of the picture, µm a pixel, where the user gave one.
    pub um_per_px: Option<f32>,
    /// Velocity over 10–1000 Hz, mm/s RMS (ISO 20816's quantity), both axes as a vector, where there is a scale: of all motion
    /// where [`Report::broad_band`] is known, else of the peaks.
    pub velocity_mm_s_rms: Option<f32>,
    /// What the line time must be if the frame rate is right, µs: where the motion contradicts the time base
    /// ([`Warning::TimingContradiction`]) and exactly one value fits. Wires of version 1 do not carry it.
    #[serde(skip)]
    pub line_time_us_fit: Option<f32>,
    /// What is no tone, against frequency, along the rows: amplitude density from low to high. Wires of version 1 do not carry
    /// it.
    #[serde(skip)]
    pub noise_floor: Vec<FloorPoint, MAX_FLOOR>,
    /// Root mean square of the motion along the rows that is no tone, px: what the samples hold beyond tones and the quietest
    /// part of the floor. 0 where the floor is white. Wires of version 1 do not carry it.
    #[serde(skip)]
    pub other_px_rms: f32,
    /// Broad-band measures; `None` where they were not asked for, a window is too short or its samples
    /// lie too far apart. Wires of version 1 do not carry them.
    #[serde(skip)]
    pub broad_band: Option<BroadBand>,
}

/// Most points of a noise floor.
pub const MAX_FLOOR: usize = 12;

/// Noise of one level over a part of the band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FloorPoint {
    /// The highest frequency of the part, Hz; it begins where the one before it ends.
    pub to_hz: f32,
    /// One-sided amplitude density, px/√Hz.
    pub px_per_sqrt_hz: f32,
}

impl Report {
    /// The report of nothing: no time, no rows, no peaks, no warnings.
    pub const EMPTY: Self = Self {
        seq: 0,
        time_ms: 0,
        window_s: 0.0,
        fps: 0.0,
        lines: 0,
        lost_frames: 0,
        noise_px: 0.0,
        peaks: Vec::new(),
        warnings: Warnings::NONE,
        um_per_px: None,
        velocity_mm_s_rms: None,
        line_time_us_fit: None,
        noise_floor: Vec::new(),
        other_px_rms: 0.0,
        broad_band: None,
    };
}

impl Default for Report {
    fn default() -> Self {
        Self::EMPTY
    }
}
