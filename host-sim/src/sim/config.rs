//! The whole simulated recording as plain data.

use serde::Serialize;

use super::error::{SimError, check};
use super::light::Light;
use super::motion::{Motion, Step, check_steps};
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

/// A part of the picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub w: u32,
    /// Rows.
    pub h: u32,
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
            shake: Motion::default(),
            background_cols: 0,
            vibrating: None,
            light: Light::default(),
            rate_changes: Vec::new(),
            faults: Faults::default(),
            disturbances: Disturbances::default(),
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

    /// Checks every field.
    ///
    /// # Errors
    /// A [`SimError`] that names the first field that is wrong.
    pub fn check(&self) -> Result<(), SimError> {
        self.check_sensor()?;
        check(
            self.frames > 0,
            "the number of frames",
            f64::from(self.frames),
            "at least 1",
        )?;
        let o = &self.optics;
        check(
            (0.0..=100.0).contains(&o.blur_px),
            "the lens blur (px)",
            o.blur_px,
            "0 to 100",
        )?;
        check(
            (0.0..=1.0).contains(&o.bright),
            "the brightest grey level",
            o.bright,
            "0 to 1",
        )?;
        check(
            o.dark >= 0.0 && o.dark <= o.bright,
            "the darkest grey level",
            o.dark,
            "0 to the brightest",
        )?;
        self.scene.check()?;
        self.motion.check()?;
        self.shake.check()?;
        self.light.check()?;
        self.check_places()?;
        let f = &self.faults;
        check(
            (0.0..1.0).contains(&f.lost_probability),
            "the share of lost frames",
            f.lost_probability,
            "0 to below 1",
        )?;
        check(
            (0.0..=1.0).contains(&f.late_probability),
            "the share of late frames",
            f.late_probability,
            "0 to 1",
        )?;
        check(
            (0.0..1e9).contains(&f.jitter_us),
            "the jitter (µs)",
            f.jitter_us,
            "0 or more",
        )?;
        check(
            (0.0..1e9).contains(&f.late_us),
            "the delay of late frames (µs)",
            f.late_us,
            "0 or more",
        )?;
        let d = &self.disturbances;
        for s in d.gain_steps.iter().chain(&d.exposure_steps) {
            check(
                s.value > 0.0 && s.value < 1e3,
                "a gain or exposure step",
                s.value,
                "a factor above 0, below 1000",
            )?;
        }
        check_steps(&d.gain_steps)?;
        check_steps(&d.exposure_steps)?;
        if let Some(h) = d.hand {
            check(
                h.start_s.is_finite(),
                "the hand's start (s)",
                h.start_s,
                "a number",
            )?;
            check(
                h.duration_s > 0.0,
                "the hand's duration (s)",
                h.duration_s,
                "above 0",
            )?;
            check(
                h.width_px > 0.0 && h.width_px < 1e5,
                "the hand's width (px)",
                h.width_px,
                "above 0",
            )?;
            check(
                (0.0..=1.0).contains(&h.level),
                "the hand's grey level",
                h.level,
                "0 to 1",
            )?;
        }
        Ok(())
    }

    fn check_sensor(&self) -> Result<(), SimError> {
        let s = &self.sensor;
        check(
            (8..=16384).contains(&s.cols),
            "the picture's width (px)",
            f64::from(s.cols),
            "8 to 16384",
        )?;
        check(
            (1..=16384).contains(&s.rows),
            "the picture's height (rows)",
            f64::from(s.rows),
            "1 to 16384",
        )?;
        check(
            [8, 10, 12, 16].contains(&s.bits),
            "the bits of a pixel",
            f64::from(s.bits),
            "8, 10, 12 or 16",
        )?;
        check(
            s.full_well_e > 0.0 && s.full_well_e < 1e9,
            "the full well (electrons)",
            s.full_well_e,
            "above 0",
        )?;
        check(
            (0.0..1e6).contains(&s.read_noise_e),
            "the read noise (electrons)",
            s.read_noise_e,
            "0 or more",
        )?;
        let rates = self.rate_changes.iter().map(|r| r.fps);
        for fps in std::iter::once(s.fps).chain(rates) {
            check(
                fps > 0.0 && fps < 1e6,
                "the frame rate (Hz)",
                fps,
                "above 0 and below 1 MHz",
            )?;
            if s.readout_s() > 1.0 / fps {
                return Err(SimError::ReadoutTooLong {
                    readout_ms: s.readout_s() * 1e3,
                    frame_ms: 1e3 / fps,
                });
            }
            let longest = self
                .disturbances
                .exposure_steps
                .iter()
                .map(|e| e.value)
                .fold(1.0, f64::max);
            let exposure_ms = f64::from(s.exposure_ns) * 1e-6 * longest;
            check(
                exposure_ms <= 1e3 / fps,
                "the exposure (ms)",
                exposure_ms,
                "no longer than a frame",
            )?;
        }
        let mut last = 0.0;
        for r in &self.rate_changes {
            check(
                r.t_s > last,
                "a frame-rate change's time (s)",
                r.t_s,
                "above 0 and later than the one before",
            )?;
            last = r.t_s;
        }
        Ok(())
    }

    fn check_places(&self) -> Result<(), SimError> {
        let (cols, rows) = (self.sensor.cols, self.sensor.rows);
        let outside = |field, value: String| {
            Err(SimError::Outside {
                field,
                value,
                cols,
                rows,
            })
        };
        if self.background_cols >= cols {
            return outside("the background columns", self.background_cols.to_string());
        }
        if let Some(r) = self.vibrating {
            let fits = |at: u32, len: u32, all: u32| {
                len > 0 && at.checked_add(len).is_some_and(|end| end <= all)
            };
            if !fits(r.x, r.w, cols) || !fits(r.y, r.h, rows) {
                return outside(
                    "the vibrating part",
                    format!("{},{},{},{}", r.x, r.y, r.w, r.h),
                );
            }
        }
        let d = &self.disturbances;
        if let Some(c) = d.dead_cols.iter().find(|&&c| c >= cols) {
            return outside("the dead column", c.to_string());
        }
        if let Some(r) = d
            .saturated_rows
            .iter()
            .chain(&d.black_rows)
            .find(|&&r| r >= rows)
        {
            return outside("the saturated or black row", r.to_string());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl FnOnce(&mut Config)) -> String {
        let mut config = Config::default();
        change(&mut config);
        config.check().expect_err("must be refused").to_string()
    }

    #[test]
    fn the_default_is_good_and_bad_fields_are_named() {
        Config::default().check().expect("the default");
        assert!(
            refused(|c| c.sensor.fps = 120.0)
                .contains("12.000 ms, longer than a frame of 8.333 ms")
        );
        assert!(refused(|c| c.sensor.bits = 9).contains("bits of a pixel is 9"));
        assert!(refused(|c| c.sensor.exposure_ns = 17_000_000).contains("exposure (ms) is 17"));
        assert!(refused(|c| c.background_cols = 128).contains("background columns 128"));
        assert!(
            refused(|c| c.vibrating = Some(Rect {
                x: 100,
                y: 0,
                w: 29,
                h: 5
            }))
            .contains("100,0,29,5")
        );
        assert!(
            refused(|c| c.vibrating = Some(Rect {
                x: u32::MAX,
                y: 0,
                w: 2,
                h: 5
            }))
            .contains("vibrating")
        );
        assert!(refused(|c| c.optics.blur_px = f64::NAN).contains("NaN"));
        assert!(refused(|c| c.disturbances.dead_cols = vec![128]).contains("dead column 128"));
        assert!(refused(|c| c.frames = 0).contains("frames is 0"));
    }
}
