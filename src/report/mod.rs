//! What is said about one window of time, in which units.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most peaks one report can hold.
pub const MAX_PEAKS: usize = 16;

/// One tone of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Frequency, Hz.
    pub hz: f32,
    /// Standard deviation of the frequency, Hz.
    pub hz_sd: f32,
    /// Zero-to-peak amplitude of the object's motion, px, the exposure's averaging undone.
    pub amplitude_px: f32,
    /// Standard deviation of the amplitude, px.
    pub amplitude_px_sd: f32,
    /// Power of the tone over the noise left in the whole window: 10·log₁₀(N·A²/(4σ²)), dB.
    pub snr_db: f32,
    /// Too near a multiple of the frame rate to be trusted.
    pub ambiguous: bool,
    /// The same number from window to window while the tone is the same; from 1.
    pub track: u16,
    /// Which harmonic of the running speed, from 1, where one running speed explains it.
    pub harmonic: Option<u8>,
}

/// Something the reader should know about a window. One bit each, see [`Warnings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Warning {
    /// A vibration near a multiple of the frame rate could hide in this window.
    HiddenNearFrameRate = 1 << 0,
    /// Frames were lost.
    LostFrames = 1 << 1,
    /// The window is shorter than asked for.
    ShortWindow = 1 << 2,
    /// Rows were flagged: something passed through the picture.
    Disturbed = 1 << 3,
    /// The scene changed and the reference was learned anew.
    Relearned = 1 << 4,
    /// Less than half of the rows have texture to measure.
    LittleTexture = 1 << 5,
    /// There were more tones than the report holds.
    MoreTones = 1 << 6,
    /// The picture is too dark or saturated in most rows.
    BadLight = 1 << 7,
    /// The first report since the watchdog reset the board.
    WatchdogReset = 1 << 8,
    /// The first report since the board's firmware failed and reset it.
    PanicReset = 1 << 9,
    /// The first report since the board was told to start anew.
    CommandReset = 1 << 10,
}

/// A set of [`Warning`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warnings(pub u16);

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
    /// Velocity over 10–1000 Hz, mm/s RMS (ISO 20816's quantity), where there is a scale.
    pub velocity_mm_s_rms: Option<f32>,
}
