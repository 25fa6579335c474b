//! The whole simulated recording as plain data.

mod check;

use serde::Serialize;

use super::defects::Defects;
use super::field::Mode;
use super::light::Light;
use super::motion::{Motion, Step};
use super::rect::Rect;
use super::scene::Scene;

/// The sensor and how it is driven.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensor {
    /// Pixels in a row.
    pub cols: u32,
    /// Rows of a frame.
    pub rows: u32,
    /// Frames a second.
    pub fps: f64,
    /// Time from one row to the next, ps; 0 for a global shutter.
    pub line_time_ps: u32,
    /// Exposure of a row, ns; 0 for an instant.
    pub exposure_ns: u32,
    /// Bits of a pixel: 8, 10, 12 or 16.
    pub bits: u8,
    /// Electrons that make a pixel white (full scale).
    pub full_well_e: f64,
    /// Read noise, electrons (rms).
    pub read_noise_e: f64,
    /// The picture is read from the last row to the first.
    pub bottom_up: bool,
}

impl Sensor {
    /// The whitest value of a pixel, DN.
    pub fn white_dn(&self) -> f64 {
        f64::from((1u32 << self.bits.min(16)) - 1)
    }

    /// Time from the first row read to one line time after the last, s.
    pub fn readout_s(&self) -> f64 {
        f64::from(self.line_time_ps) * 1e-12 * f64::from(self.rows)
    }

    /// Start of exposure of `row` after the frame's start, s.
    pub fn row_start_s(&self, row: u32) -> f64 {
        let order = if self.bottom_up {
            (self.rows - 1).saturating_sub(row)
        } else {
            row
        };
        f64::from(order) * f64::from(self.line_time_ps) * 1e-12
    }
}

/// What the lens and the picture's grey values do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Optics {
    /// Standard deviation of the lens's Gaussian blur, px. The pixels' own area blurs on top of it.
    pub blur_px: f64,
    /// Grey level of the darkest part of the scene under steady light, 0 to 1 of white.
    pub dark: f64,
    /// Grey level of its brightest part, 0 to 1 of white.
    pub bright: f64,
}

impl Optics {
    /// The blur whose transfer function is `exp(-½(f/cutoff)²)`, px; 0.1 cycles/px is like a lens.
    pub fn blur_for_cutoff(cutoff_cycles_per_px: f64) -> f64 {
        1.0 / (std::f64::consts::TAU * cutoff_cycles_per_px)
    }
}

/// From `t_s` on the camera runs at `fps`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateChange {
    /// From when on, s: the first frame that starts at or after it starts the new spacing.
    pub t_s: f64,
    /// Frames a second.
    pub fps: f64,
}

/// What goes wrong with the frames' times.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Faults {
    /// Frames that are lost, by number.
    pub lost: Vec<u32>,
    /// Probability that any other frame is lost.
    pub lost_probability: f64,
    /// Jitter of the frames' starts, µs (rms).
    pub jitter_us: f64,
    /// Probability that a frame comes late.
    pub late_probability: f64,
    /// By how much a late frame is late, µs.
    pub late_us: f64,
    /// Frames, by number, that show the pixels of the frame before them again.
    pub copies: Vec<u32>,
    /// What the first frame shows in place of the scene.
    pub first_frame: Option<FirstFrame>,
}

/// What a camera delivers before it is ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FirstFrame {
    /// Zeros.
    Black,
    /// Read noise without light.
    Dark,
    /// The scene as it once stood, a third of the width away.
    Stale,
    /// Random values.
    Random,
}

/// A soft shadow that passes over the picture; it takes light and moves nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shadow {
    /// When its middle is at the left edge, s.
    pub start_s: f64,
    /// How long its middle takes to the right edge, s.
    pub duration_s: f64,
    /// Standard deviation of its Gaussian profile, px.
    pub width_px: f64,
    /// Light that it takes in its middle, 0 to 1.
    pub depth: f64,
}

/// A hand (dark, soft-edged) that passes through the whole height of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hand {
    /// When it appears at the left edge, s.
    pub start_s: f64,
    /// How long it takes to leave at the right, s.
    pub duration_s: f64,
    /// Its width, px.
    pub width_px: f64,
    /// Its grey level, 0 to 1.
    pub level: f64,
}

/// What disturbs the picture; nothing by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Disturbances {
    /// Columns that always read 0.
    pub dead_cols: Vec<u32>,
    /// Rows so bright that they always read white.
    pub saturated_rows: Vec<u32>,
    /// Rows that no light reaches.
    pub black_rows: Vec<u32>,
    /// A hand passing through.
    pub hand: Option<Hand>,
    /// A shadow passing over.
    pub shadow: Option<Shadow>,
    /// The scene becomes a different one of the same kind, s.
    pub scene_change_s: Option<f64>,
    /// Analogue gain from given times on, as a factor.
    pub gain_steps: Vec<Step>,
    /// Exposure time from given times on, as a factor of the sensor's.
    pub exposure_steps: Vec<Step>,
}

/// Everything that defines a recording. The default is a small speckled machine face, still.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Same seed, same recording.
    pub seed: u64,
    /// The sensor.
    pub sensor: Sensor,
    /// Frames, the lost ones included.
    pub frames: u32,
    /// What the camera looks at.
    pub scene: Scene,
    /// Lens and grey levels.
    pub optics: Optics,
    /// How the object moves.
    pub motion: Motion,
    /// What moves differently from place to place, and along the columns; added to the motion.
    pub modes: Vec<Mode>,
    /// How the whole picture moves because the camera does; added to the object's motion.
    pub shake: Motion,
    /// This many columns at the left do not move with the object.
    pub background_cols: u32,
    /// Only this part moves with the object; the whole picture when absent.
    pub vibrating: Option<Rect>,
    /// The light.
    pub light: Light,
    /// Changes of the frame rate, sorted by time.
    pub rate_changes: Vec<RateChange>,
    /// Lost and late frames.
    pub faults: Faults,
    /// What disturbs the picture.
    pub disturbances: Disturbances,
    /// What is wrong with the sensor.
    pub defects: Defects,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            seed: 1,
            sensor: Sensor {
                cols: 128,
                rows: 300,
                fps: 60.0,
                line_time_ps: 40_000_000,
                exposure_ns: 500_000,
                bits: 8,
                full_well_e: 9600.0,
                read_noise_e: 20.0,
                bottom_up: false,
            },
            frames: 60,
            scene: Scene::Speckle { grain_px: 2.0 },
            optics: Optics {
                blur_px: Optics::blur_for_cutoff(0.1),
                dark: 0.05,
                bright: 0.95,
            },
            motion: Motion::default(),
            modes: Vec::new(),
            shake: Motion::default(),
            background_cols: 0,
            vibrating: None,
            light: Light::default(),
            rate_changes: Vec::new(),
            faults: Faults::default(),
            disturbances: Disturbances::default(),
            defects: Defects::default(),
        }
    }
}

impl Config {
    /// Rows by columns that move with the object at `row`: `None` when none do.
    pub fn moving_cols(&self, row: u32) -> Option<std::ops::Range<u32>> {
        let whole = self.background_cols..self.sensor.cols;
        let part = match self.vibrating {
            Some(r) if (r.y..r.y + r.h).contains(&row) => {
                whole.start.max(r.x)..whole.end.min(r.x + r.w)
            }
            Some(_) => 0..0,
            None => whole,
        };
        (!part.is_empty()).then_some(part)
    }
}
