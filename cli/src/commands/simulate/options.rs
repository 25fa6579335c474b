//! The options of `rowtone simulate`.

mod config;

use std::path::PathBuf;

use super::forms::{self, Gradient, Span};
use super::modes;
use host_sim::{
    Chirp, FirstFrame, Flicker, Hand, Led, Mode, Preset, RateChange, Rect, Shadow, Step, Tone,
};

const EXAMPLES: &str = "\
Examples:
  rowtone simulate --preset ov5647 --tone 49.2:0.4 --tone 296.7:0.02 \\
      --seconds 2 -o clip.y4m --truth clip.json
  rowtone simulate --scene photo --chirp 100:1000:10:0.5 --seconds 10 \\
      -o - | rowtone analyze - --line-time-us 40
  rowtone simulate --scene plain --led 1000 --blur-px 0 --frames 30 -o led.y4m
  rowtone simulate --size 640x480 --calibration calibration.toml \\
      --tone 49.2:0.4 -o clip.y4m";

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
    /// Line time, exposure, frame rate and rolling direction as `rowtone calibrate -o` measured them, where it could tell
    /// them; the options here go before it
    #[arg(long, value_name = "FILE", conflicts_with = "global_shutter")]
    calibration: Option<PathBuf>,
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
    /// speckle, bar, stripes, edges, photo, plain, or a picture file (PNG or JPEG)
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
    /// By how much the edges lean from upright, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value = "30",
        allow_hyphen_values = true
    )]
    lean: f64,
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
#[command(next_help_heading = "Motion (everything adds up)")]
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
    /// A vibration that differs from place to place, along both axes: frequency, amplitude along the
    /// rows, along the columns, phase of that. Amplitudes are polynomials of c (column, -1 left to
    /// 1 right) and r (row, -1 top to 1 bottom), such as 83.3:0.3r or 97:-0.15r:0.2c (may be repeated)
    #[arg(long, value_name = "HZ:X[:Y[:RAD]][@X,Y,W,H]", value_parser = modes::mode)]
    mode: Vec<Mode>,
    /// A hit that dies away: frequency, start, time to 1/e, amplitudes as of --mode (may be repeated)
    #[arg(long, value_name = "HZ:START:DECAY:X[:Y[:RAD]]", value_parser = modes::hit)]
    hit: Vec<Mode>,
    /// Random vibration of an even spectrum, px rms, places as of --mode (may be repeated)
    #[arg(long, value_name = "LOW:HIGH:X[:Y]", value_parser = modes::random)]
    random: Vec<Mode>,
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
    /// A soft shadow passes over the picture: start, time from edge to edge, width, light taken
    #[arg(long, value_name = "START:S:WIDTH:DEPTH", value_parser = modes::shadow)]
    shadow: Option<Shadow>,
    /// Frames that repeat the frame before them
    #[arg(long, value_name = "N,N-N", value_parser = forms::span, value_delimiter = ',')]
    copies: Vec<Span>,
    /// What the first frame shows: black, dark, stale or random
    #[arg(long, value_name = "WHAT", value_parser = modes::first_frame)]
    first_frame: Option<FirstFrame>,
    /// Pixels at random places that always read white
    #[arg(long, value_name = "N", default_value = "0")]
    hot_pixels: u32,
    /// Specks of dust at random places, and the light that each takes in its middle
    #[arg(long, value_name = "N[:DEPTH]", value_parser = modes::dust)]
    dust: Option<(u32, f64)>,
    /// Unequal response of the pixels, rms, as a share
    #[arg(long, value_name = "SHARE", default_value = "0")]
    prnu: f64,
    /// Fixed pattern of the columns, rms, as a share of white
    #[arg(long, value_name = "SHARE", default_value = "0")]
    column_pattern: f64,
    /// Noise that a row's pixels have in common, rms, as a share of white
    #[arg(long, value_name = "SHARE", default_value = "0")]
    row_noise: f64,
    /// Share of the frame before that a phone's temporal denoiser mixes in
    #[arg(long, value_name = "SHARE", default_value = "0")]
    denoise: f64,
    /// Another scene of the same kind from this time on, s
    #[arg(long, value_name = "S")]
    scene_change: Option<f64>,
}
