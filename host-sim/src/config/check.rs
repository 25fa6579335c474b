//! What a configuration may be.

use super::{Config, Shadow};
use crate::error::{SimError, check};
use crate::motion::check_steps;

impl Config {
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
        self.modes.iter().try_for_each(crate::Mode::check)?;
        self.defects.check()?;
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
        if let Some(s) = d.shadow {
            check_shadow(&s)?;
        }
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
        let vibrating = self.vibrating.map(|r| ("the vibrating part", r));
        let parts = self.modes.iter().filter_map(|mode| mode.part);
        for (field, r) in vibrating
            .into_iter()
            .chain(parts.map(|r| ("a mode's part", r)))
        {
            let fits = |at: u32, len: u32, all: u32| {
                len > 0 && at.checked_add(len).is_some_and(|end| end <= all)
            };
            if !fits(r.x, r.w, cols) || !fits(r.y, r.h, rows) {
                return outside(field, format!("{},{},{},{}", r.x, r.y, r.w, r.h));
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

fn check_shadow(s: &Shadow) -> Result<(), SimError> {
    check(
        s.start_s.is_finite(),
        "the shadow's start (s)",
        s.start_s,
        "a number",
    )?;
    for (field, value) in [
        ("the shadow's duration (s)", s.duration_s),
        ("the shadow's width (px)", s.width_px),
    ] {
        check(value > 0.0 && value < 1e5, field, value, "above 0")?;
    }
    check(
        (0.0..=1.0).contains(&s.depth),
        "the shadow's depth",
        s.depth,
        "0 to 1",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rect;

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
