//! The camera options: the same for every command that reads a video.

use std::path::PathBuf;

use crate::known_length::KnownLength;
use crate::quantity::{Unit, number};
use rowtone::tracker::Axes;
use rowtone_clip::{CameraOptions, FRAME_RATES_HZ, Rect, Roi, Turn};

/// The options that every command has which reads a video: the camera, and which part of its picture.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// A video file (mp4, mov, mkv, avi, ...: read through ffmpeg; or Y4M), or `-` for Y4M on standard input
    #[arg(value_name = "INPUT", help_heading = None)]
    pub input: String,
    /// Frame rate, Hz, whatever the file says: slow motion states the rate it is played at [default: the file's]
    #[arg(long, value_name = "F", value_parser = frame_rate, allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Start of exposure of every frame: timecode format v2, ms [default: the file's times, else frame number / fps]
    #[arg(long, value_name = "FILE")]
    pub pts: Option<PathBuf>,
    /// Time from one row to the next, µs
    #[arg(long, value_name = "T", value_parser = line_time, allow_negative_numbers = true, conflicts_with = "global_shutter")]
    pub line_time_us: Option<f64>,
    /// Takes the line time from a file that `rowtone calibrate` wrote
    #[arg(long, value_name = "FILE", conflicts_with_all = ["line_time_us", "global_shutter"])]
    pub calibration: Option<PathBuf>,
    /// Exposure of a row, µs [default: the calibration's; else not known, and amplitudes are as filmed]
    #[arg(long, value_name = "T", value_parser = exposure, allow_negative_numbers = true)]
    pub exposure_us: Option<f64>,
    /// Part of the picture to use, px; also `full` or `auto` [default: auto]
    #[arg(
        long,
        value_name = "X,Y,W,H",
        hide_default_value = true,
        default_value = "auto"
    )]
    pub roi: Roi,
    /// Part that does not vibrate, px: its motion is the camera's own and is subtracted
    #[arg(long, value_name = "X,Y,W,H")]
    pub background: Option<Rect>,
    /// Turns the given picture clockwise by so many degrees before measuring, so that its rows are the
    /// sensor's: for files whose pixels were turned. The rotation that a phone writes into a file needs
    /// none: it is for players, and the stored rows are the sensor's. --roi and --background are given in
    /// the picture before it is turned
    #[arg(
        long,
        value_name = "0|90|180|270",
        default_value = "0",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub rotate: Turn,
    /// Motion along the rows alone (x), or along rows and columns (xy)
    #[arg(long, value_name = "x|xy", default_value = "xy", value_parser = axes)]
    pub axes: Axes,
    /// All rows are exposed at once (high-speed cameras): one sample a frame
    #[arg(long)]
    pub global_shutter: bool,
    /// Scale: adds µm and mm/s to the output
    #[arg(long, value_name = "S", group = "scale", value_parser = scale, allow_negative_numbers = true)]
    um_per_px: Option<f64>,
    /// Scale by something of known length: two places in the given picture, px, and how far apart they are
    #[arg(
        long,
        value_name = "X1,Y1,X2,Y2=35mm",
        group = "scale",
        allow_hyphen_values = true
    )]
    known: Option<KnownLength>,
}

fn axes(text: &str) -> Result<Axes, String> {
    match text {
        "x" => Ok(Axes::X),
        "xy" => Ok(Axes::Xy),
        _ => Err("want x or xy".to_owned()),
    }
}

/// A frame rate, Hz.
fn frame_rate(text: &str) -> Result<f64, String> {
    number(text, Unit::Hertz, FRAME_RATES_HZ, || {
        let (least, most) = (FRAME_RATES_HZ.start(), FRAME_RATES_HZ.end());
        format!("want a frame rate from {least} to {most} Hz")
    })
}

/// A scale, above 0.
fn scale(text: &str) -> Result<f64, String> {
    positive(text, Unit::Bare)
}

/// A time above 0, µs.
fn line_time(text: &str) -> Result<f64, String> {
    positive(text, Unit::Microseconds)
}

fn positive(text: &str, unit: Unit) -> Result<f64, String> {
    number(text, unit, f64::MIN_POSITIVE.., || {
        "want a number above 0".to_owned()
    })
}

/// A time, at least 0, µs.
fn exposure(text: &str) -> Result<f64, String> {
    number(text, Unit::Microseconds, 0.0.., || {
        "want a number, at least 0".to_owned()
    })
}

impl CameraArgs {
    /// Scale of the picture, µm a pixel, where one was given.
    pub(crate) fn um_per_px(&self) -> Option<f64> {
        self.um_per_px.or(self.known.map(|known| known.um_per_px()))
    }

    /// What they say.
    pub(crate) fn options(&self) -> CameraOptions {
        CameraOptions {
            input: self.input.clone(),
            fps: self.fps,
            pts: self.pts.clone(),
            line_time_us: self.line_time_us,
            calibration: self.calibration.clone(),
            exposure_us: self.exposure_us,
            roi: self.roi,
            background: self.background,
            rotate: self.rotate,
            axes: self.axes,
            global_shutter: self.global_shutter,
            um_per_px: self.um_per_px(),
        }
    }
}
