//! The configuration that the options ask for.

use std::path::Path;

use super::{Args, CameraOptions, SceneOptions};
use crate::commands::simulate::forms;
use crate::failure::Failure;
use host_sim::{Config, Defects, Led, Optics, Preset, Scene, Sensor, Sound};
use rowtone_calibrate::file::RollingName;

impl Args {
    /// The configuration asked for, not yet checked.
    ///
    /// # Errors
    /// [`Failure::Usage`] for numbers that no configuration can hold, [`Failure::Input`] when the
    /// sound file cannot be read.
    pub fn config(&self) -> Result<Config, Failure> {
        let sensor = self.camera.sensor()?;
        let frames = match self.frames {
            Some(n) => n,
            None => self.frames_of(self.seconds, &sensor)?,
        };
        let mut config = Config {
            seed: self.seed,
            frames,
            ..Config::default()
        };
        config.scene = self.scene.scene(sensor.cols);
        config.sensor = sensor;
        config.optics = self.scene.optics()?;
        let m = &self.motion;
        config.motion.tones.clone_from(&m.tone);
        config.motion.chirps.clone_from(&m.chirp);
        config.motion.steps.clone_from(&m.step);
        config.motion.drift_px_per_s = m.drift;
        if let Some(path) = &m.wav {
            let sound = Sound::read(path, m.wav_px).map_err(|e| Failure::input(e.to_string()))?;
            config.motion.sound = Some(sound);
        }
        config.shake.tones.clone_from(&m.shake);
        config.modes = [&m.mode, &m.hit, &m.random]
            .into_iter()
            .flatten()
            .cloned()
            .collect();
        for (mode, seed) in config.modes.iter_mut().zip(self.seed..) {
            mode.number(seed);
        }
        config.background_cols = m.background_cols;
        config.vibrating = m.vibrating;
        config.light.flicker = self.light.flicker;
        config.light.led = self.light.led.map(|led| Led {
            missing: self.light.led_missing,
            ..led
        });
        config.light.gradient = self.light.gradient.map_or([0.0; 2], |g| g.0);
        config.light.steps.clone_from(&self.light.light_step);
        config.rate_changes.clone_from(&self.camera.hop);
        self.put_faults(&mut config);
        Ok(config)
    }

    /// Frames that start within `seconds`, at whatever rate.
    fn frames_of(&self, seconds: f64, sensor: &Sensor) -> Result<u32, Failure> {
        let (mut frames, mut from_s, mut fps) = (0.0, 0.0, sensor.fps);
        for hop in self.camera.hop.iter().filter(|h| h.t_s < seconds) {
            frames += ((hop.t_s - from_s) * fps).ceil();
            (from_s, fps) = (hop.t_s, hop.fps);
        }
        frames += ((seconds - from_s) * fps - 1e-9).ceil();
        if (1.0..4e9).contains(&frames) {
            Ok(frames as u32)
        } else {
            Err(Failure::usage(format!(
                "--seconds {seconds} makes {frames} frames; try --help"
            )))
        }
    }

    fn put_faults(&self, config: &mut Config) {
        let f = &self.faults;
        config.faults.lost = forms::all(&f.lose);
        config.faults.lost_probability = f.loss;
        config.faults.jitter_us = f.jitter_us;
        (config.faults.late_probability, config.faults.late_us) = f.late.unwrap_or_default();
        config.faults.copies = forms::all(&f.copies);
        config.faults.first_frame = f.first_frame;
        let (dust_specks, dust_depth) = f.dust.unwrap_or_default();
        config.defects = Defects {
            hot_pixels: f.hot_pixels,
            dust_specks,
            dust_depth,
            prnu: f.prnu,
            column_pattern: f.column_pattern,
            row_noise: f.row_noise,
            denoise: f.denoise,
        };
        let d = &mut config.disturbances;
        d.dead_cols = forms::all(&f.dead_cols);
        d.saturated_rows = forms::all(&f.saturated_rows);
        d.black_rows = forms::all(&f.black_rows);
        d.hand = f.hand;
        d.scene_change_s = f.scene_change;
        d.shadow = f.shadow;
        d.gain_steps.clone_from(&self.light.gain_step);
        d.exposure_steps.clone_from(&self.light.exposure_step);
    }
}

impl CameraOptions {
    fn sensor(&self) -> Result<Sensor, Failure> {
        let mut s = self
            .preset
            .map_or_else(|| Config::default().sensor, Preset::sensor);
        (s.cols, s.rows) = self.size.unwrap_or((s.cols, s.rows));
        let measured = self.calibration.as_deref().map(Calibration::of);
        let measured = measured.transpose()?;
        if let Some(c) = &measured {
            c.put_into(&mut s, self.size.is_some())?;
        }
        s.fps = self.fps.unwrap_or(s.fps);
        if let Some(us) = self.line_time_us {
            s.line_time_ps = whole(us * 1e6, "--line-time-us", us)?;
        }
        if self.global_shutter {
            s.line_time_ps = 0;
        }
        if let Some(us) = self.exposure_us {
            s.exposure_ns = whole(us * 1e3, "--exposure-us", us)?;
        }
        s.bits = self.bits.unwrap_or(s.bits);
        s.full_well_e = self.full_well.unwrap_or(s.full_well_e);
        s.read_noise_e = self.read_noise.unwrap_or(s.read_noise_e);
        s.bottom_up |= self.bottom_up;
        Ok(s)
    }
}

/// A camera's timing as it was measured, and where that stands.
struct Calibration<'a> {
    path: &'a Path,
    found: rowtone_calibrate::Calibration,
}

impl<'a> Calibration<'a> {
    fn of(path: &'a Path) -> Result<Self, Failure> {
        let found = rowtone_calibrate::Calibration::read(path)
            .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        Ok(Self { path, found })
    }

    /// The rows too, unless a `sized` picture was asked for. What was not measured stays as it is.
    fn put_into(&self, sensor: &mut Sensor, sized: bool) -> Result<(), Failure> {
        let timing = self
            .found
            .timing()
            .map_err(|error| Failure::input(format!("{}: {error}", self.path.display())))?;
        sensor.line_time_ps = timing.line_time_ps();
        if !sized {
            sensor.rows = self.found.rows;
        }
        if self.found.exposure_s.is_some() {
            sensor.exposure_ns = timing.exposure_ns();
        }
        if let Some(period_s) = self.found.frame_period_s {
            if !(period_s.is_finite() && period_s > 0.0) {
                return Err(Failure::input(format!(
                    "{}: frame_period_s = {period_s} is impossible: correct it, or give none",
                    self.path.display()
                )));
            }
            sensor.fps = 1.0 / period_s;
        }
        sensor.bottom_up |= self.found.rolling == Some(RollingName::Up);
        Ok(())
    }
}

impl SceneOptions {
    fn scene(&self, cols: u32) -> Scene {
        match self.scene.as_str() {
            "speckle" => Scene::Speckle {
                grain_px: self.grain_px,
            },
            "bar" => Scene::Bar {
                width_px: self.bar_px.unwrap_or(f64::from(cols) / 3.0),
            },
            "stripes" => Scene::Stripes {
                period_px: self.stripe_px,
            },
            "edges" => Scene::Edges {
                lean_deg: self.lean,
            },
            "photo" => Scene::Photo { sky: self.sky },
            "plain" => Scene::Plain,
            file => Scene::Picture { path: file.into() },
        }
    }

    fn optics(&self) -> Result<Optics, Failure> {
        let cutoff = self.blur_cutoff.unwrap_or(0.1);
        if cutoff.is_nan() || cutoff <= 0.0 {
            return Err(Failure::usage(format!(
                "--blur-cutoff is {cutoff}, but must be above 0; try --help"
            )));
        }
        let blur_px = self
            .blur_px
            .unwrap_or_else(|| Optics::blur_for_cutoff(cutoff));
        Ok(Optics {
            blur_px,
            dark: self.dark,
            bright: self.bright,
        })
    }
}

/// `value` as a whole number, or why not.
fn whole(value: f64, option: &str, given: f64) -> Result<u32, Failure> {
    let rounded = value.round();
    if (0.0..=f64::from(u32::MAX)).contains(&rounded) {
        Ok(rounded as u32)
    } else {
        Err(Failure::usage(format!(
            "{option} {given} is out of range; try --help"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: Args,
    }

    fn config(line: &str) -> Result<Config, Failure> {
        let words = format!("x -o - {line}");
        Cli::try_parse_from(words.split_whitespace())
            .map(|c| c.args.config())
            .unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn options_reach_the_configuration() {
        let c = config(
            "--preset imx219-480p --size 320x480 --fps 100 --exposure-us 250.5 --bits 10 --scene stripes --stripe-px 30 \
             --tone 49.2:0.4:1 --tone 10:1 --shake 31:0.3 --background-cols 48 --flicker 0.25:100 --lose 3,7-9 --step 0.5:-2",
        )
        .expect("good");
        assert_eq!(
            (c.sensor.cols, c.sensor.rows, c.sensor.bits),
            (320, 480, 10)
        );
        assert_eq!(
            (c.sensor.exposure_ns, c.sensor.line_time_ps, c.frames),
            (250_500, 9_450_000, 100)
        );
        assert_eq!(c.scene, Scene::Stripes { period_px: 30.0 });
        assert_eq!(
            (
                c.motion.tones.len(),
                c.motion.steps[0].value,
                c.shake.tones[0].hz
            ),
            (2, -2.0, 31.0)
        );
        assert_eq!(c.faults.lost, [3, 7, 8, 9]);
        c.check().expect("possible");
    }

    #[test]
    fn without_options_it_is_the_default_recording() {
        assert_eq!(config("").expect("good"), Config::default());
    }

    #[test]
    fn a_length_counts_frames_of_all_rates() {
        assert_eq!(config("--seconds 2 --hop 1:50").expect("good").frames, 110);
        assert_eq!(config("--frames 7").expect("good").frames, 7);
        assert!(config("--seconds 0").is_err());
    }

    #[test]
    fn impossible_numbers_are_usage_errors() {
        for line in [
            "--line-time-us 9999999",
            "--exposure-us -1",
            "--blur-cutoff 0",
            "--line-time-us nan",
        ] {
            let line = line.replace(" -1", "=-1");
            assert_eq!(config(&line).expect_err("refused").status(), 2, "{line}");
        }
    }
}
