//! The options of `rowtone simulate`, and the configuration they ask for.

use std::path::PathBuf;

use super::forms::{self, Gradient, Span};
use crate::failure::Failure;
use crate::sim::{
    Chirp, Config, Flicker, Hand, Led, Optics, Preset, RateChange, Rect, Scene, Sensor, Sound,
    Step, Tone,
};

const EXAMPLES: &str = "\
Examples:
  rowtone simulate --preset ov5647 --tone 49.2:0.4 --tone 296.7:0.02 --seconds 2 -o clip.y4m --truth clip.json
  rowtone simulate --scene photo --chirp 100:1000:10:0.5 --seconds 10 -o - | rowtone analyze - --line-time-us 40
  rowtone simulate --scene plain --led 1000 --blur-px 0 --frames 30 -o led.y4m";

/// Options of `rowtone simulate`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The clip to write, Y4M; `-` for standard output
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: PathBuf,
    /// Writes what is true in the clip, JSON
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Writes the frames' times (timecode format v2, ms) [default: beside the clip when they are uneven]
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Length, s
    #[arg(long, value_name = "S", default_value = "1", conflicts_with = "frames")]
    seconds: f64,
    /// Length in frames, lost ones included
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Same seed, same clip
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,

    #[command(flatten)]
    camera: CameraOptions,
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    motion: MotionOptions,
    #[command(flatten)]
    light: LightOptions,
    #[command(flatten)]
    faults: FaultOptions,
}

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Camera")]
struct CameraOptions {
    /// Sensor and mode: ov5647, imx219-1080p, imx219-480p, imx477, imx708, hm01b0, thesis; the options
    /// below change it [default: 128x300 at 60 frames a second, 40 µs a line]
    #[arg(long, value_name = "NAME")]
    preset: Option<Preset>,
    /// Picture size, px
    #[arg(long, value_name = "WxH", value_parser = forms::size)]
    size: Option<(u32, u32)>,
    /// Frames a second
    #[arg(long, value_name = "F")]
    fps: Option<f64>,
    /// Time from one row to the next, µs
    #[arg(long, value_name = "T", conflicts_with = "global_shutter")]
    line_time_us: Option<f64>,
    /// All rows are exposed at once
    #[arg(long)]
    global_shutter: bool,
    /// Exposure of a row, µs
    #[arg(long, value_name = "T")]
    exposure_us: Option<f64>,
    /// Bits of a pixel: 8, 10, 12 or 16
    #[arg(long, value_name = "N")]
    bits: Option<u8>,
    /// Electrons that make a pixel white: fewer make more shot noise
    #[arg(long, value_name = "E")]
    full_well: Option<f64>,
    /// Read noise, electrons rms
    #[arg(long, value_name = "E")]
    read_noise: Option<f64>,
    /// The rows are read from the last to the first
    #[arg(long)]
    bottom_up: bool,
    /// Another frame rate from this time on (may be repeated)
    #[arg(long, value_name = "S:FPS", value_parser = forms::rate)]
    hop: Vec<RateChange>,
}

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Scene")]
struct SceneOptions {
    /// speckle, bar, stripes, photo, plain, or a picture file (PNG or JPEG)
    #[arg(long, value_name = "SCENE", default_value = "speckle")]
    scene: String,
    /// Size of the specks (standard deviation), px
    #[arg(long, value_name = "PX", default_value = "2")]
    grain_px: f64,
    /// Width of the bar, px [default: a third of the picture]
    #[arg(long, value_name = "PX")]
    bar_px: Option<f64>,
    /// From one stripe to the next, px
    #[arg(long, value_name = "PX", default_value = "24")]
    stripe_px: f64,
    /// Share of the photo's rows that are sky
    #[arg(long, value_name = "SHARE", default_value = "0.25")]
    sky: f64,
    /// Blur of the lens (standard deviation), px [default: that of --blur-cutoff 0.1]
    #[arg(long, value_name = "PX", conflicts_with = "blur_cutoff")]
    blur_px: Option<f64>,
    /// Blur of the lens as the frequency where it leaves 61 %, cycles/px
    #[arg(long, value_name = "F")]
    blur_cutoff: Option<f64>,
    /// Grey of the darkest part, 0 to 1 of white
    #[arg(long, value_name = "GREY", default_value = "0.05")]
    dark: f64,
    /// Grey of the brightest part, 0 to 1 of white
    #[arg(long, value_name = "GREY", default_value = "0.95")]
    bright: f64,
}

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Motion (sideways; everything adds up)")]
struct MotionOptions {
    /// A vibration: frequency, zero-to-peak amplitude, phase of the sine (may be repeated)
    #[arg(long, value_name = "HZ:PX[:RAD]", value_parser = forms::tone)]
    tone: Vec<Tone>,
    /// A sweep (may be repeated)
    #[arg(long, value_name = "FROM:TO:S:PX[:START]", value_parser = forms::chirp)]
    chirp: Vec<Chirp>,
    /// A position taken at once (may be repeated)
    #[arg(long, value_name = "S:PX", value_parser = forms::step, allow_hyphen_values = true)]
    step: Vec<Step>,
    /// Moves as a WAV file sounds
    #[arg(long, value_name = "FILE")]
    wav: Option<PathBuf>,
    /// Displacement of the sound's full scale, px
    #[arg(long, value_name = "PX", default_value = "0.5", requires = "wav")]
    wav_px: f64,
    /// Slow creep, px/s
    #[arg(
        long,
        value_name = "PX_PER_S",
        default_value = "0",
        allow_hyphen_values = true
    )]
    drift: f64,
    /// The camera's own vibration, which moves the whole picture (may be repeated)
    #[arg(long, value_name = "HZ:PX[:RAD]", value_parser = forms::tone)]
    shake: Vec<Tone>,
    /// Columns at the left that show an unmoving background
    #[arg(long, value_name = "N", default_value = "0")]
    background_cols: u32,
    /// Only this part of the picture vibrates
    #[arg(long, value_name = "X,Y,W,H", value_parser = forms::rect)]
    vibrating: Option<Rect>,
}

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Light")]
struct LightOptions {
    /// A lamp on the mains
    #[arg(long, value_name = "DEPTH:HZ[:RAD]", value_parser = forms::flicker)]
    flicker: Option<Flicker>,
    /// A light that flashes with sharp edges, for calibration
    #[arg(long, value_name = "HZ[:DUTY[:OFF[:PHASE]]]", value_parser = forms::led)]
    led: Option<Led>,
    /// Share of the flashes that fail to come
    #[arg(long, value_name = "SHARE", default_value = "0", requires = "led")]
    led_missing: f64,
    /// Uneven light: how much more at the right than at the left, and at the bottom than at the top,
    /// relative to the middle
    #[arg(long, value_name = "ACROSS[:DOWN]", value_parser = forms::gradient, allow_hyphen_values = true)]
    gradient: Option<Gradient>,
    /// Light from this time on, as a factor (may be repeated)
    #[arg(long, value_name = "S:FACTOR", value_parser = forms::step)]
    light_step: Vec<Step>,
    /// Gain from this time on, as a factor (may be repeated)
    #[arg(long, value_name = "S:FACTOR", value_parser = forms::step)]
    gain_step: Vec<Step>,
    /// Exposure time from this time on, as a factor (may be repeated)
    #[arg(long, value_name = "S:FACTOR", value_parser = forms::step)]
    exposure_step: Vec<Step>,
}

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "What goes wrong")]
struct FaultOptions {
    /// Frames that are lost: numbers or spans, with commas
    #[arg(long, value_name = "N,N-N", value_parser = forms::span, value_delimiter = ',')]
    lose: Vec<Span>,
    /// Share of the frames that are lost at random
    #[arg(long, value_name = "SHARE", default_value = "0")]
    loss: f64,
    /// Jitter of the frames' starts, µs rms
    #[arg(long, value_name = "US", default_value = "0")]
    jitter_us: f64,
    /// Share of the frames that come late, and by how much, µs
    #[arg(long, value_name = "SHARE:US", value_parser = forms::late)]
    late: Option<(f64, f64)>,
    /// Columns that read 0
    #[arg(long, value_name = "N,N-N", value_parser = forms::span, value_delimiter = ',')]
    dead_cols: Vec<Span>,
    /// Rows that read white
    #[arg(long, value_name = "N,N-N", value_parser = forms::span, value_delimiter = ',')]
    saturated_rows: Vec<Span>,
    /// Rows without light
    #[arg(long, value_name = "N,N-N", value_parser = forms::span, value_delimiter = ',')]
    black_rows: Vec<Span>,
    /// A hand passes through the picture
    #[arg(long, value_name = "START:S:WIDTH[:LEVEL]", value_parser = forms::hand)]
    hand: Option<Hand>,
    /// Another scene of the same kind from this time on, s
    #[arg(long, value_name = "S")]
    scene_change: Option<f64>,
}

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
        let d = &mut config.disturbances;
        d.dead_cols = forms::all(&f.dead_cols);
        d.saturated_rows = forms::all(&f.saturated_rows);
        d.black_rows = forms::all(&f.black_rows);
        d.hand = f.hand;
        d.scene_change_s = f.scene_change;
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
        s.bottom_up = self.bottom_up;
        Ok(s)
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
