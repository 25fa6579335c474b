//! Frames in: from libcamera, or simulated where there is no camera.
//!
//! A [`Source`] lends each frame where the camera wrote it; nothing is copied. When it fails or falls
//! silent it is dropped and opened anew ([`crate::run`]).

pub mod format;
#[cfg(feature = "libcamera")]
pub mod libcamera;
pub mod simulated;
#[cfg(feature = "libcamera")]
mod v4l2;

use std::fmt;
use std::time::Duration;

use rowtone::camera::RawFormat;

/// How a frame lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Bytes from one row to the next.
    pub stride: usize,
    /// Pixels of a row.
    pub format: RawFormat,
    /// Neighbouring pixels are of different colours.
    pub bayer: bool,
}

/// One frame in the camera's memory.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Counted by the camera; a lost one leaves a gap.
    pub sequence: u32,
    /// Start of exposure of the first row, ns on the camera's clock; `None` where the camera does not say.
    pub start_ns: Option<i64>,
    /// All rows.
    pub bytes: &'a [u8],
    /// The camera calls it good.
    pub intact: bool,
}

/// What the camera does, as far as it says.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Its name.
    pub id: String,
    /// How frames lie in memory.
    pub shape: Shape,
    /// From one row to the next, s, and who says so.
    pub line_time: Option<(f64, &'static str)>,
    /// From one frame to the next, ns.
    pub frame_period_ns: Option<i64>,
    /// The shortest frame that this mode allows, s.
    pub shortest_frame_s: Option<f64>,
    /// Why this mode; one line each.
    pub reasons: String,
}

/// Frames, one after the other.
pub trait Source {
    /// What is known about them.
    fn facts(&self) -> &Facts;

    /// Waits for the next frame, at most so long, and lends it.
    ///
    /// # Errors
    /// [`CameraError::Silent`] when none came; it may be tried again.
    fn next(
        &mut self,
        patience: Duration,
        take: &mut dyn FnMut(Frame<'_>),
    ) -> Result<(), CameraError>;

    /// Asks for another frame rate, from one of the next frames on.
    fn set_frame_period(&mut self, period_ns: i64);
}

/// Why there are no frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CameraError {
    /// No camera at all, or none of this name.
    Missing {
        /// Part of the name asked for.
        wanted: Option<String>,
        /// What there is.
        found: Vec<String>,
    },
    /// It cannot be used, now or as it is set up.
    Refused(String),
    /// No frame came for so long.
    Silent(Duration),
    /// It was unplugged, or stopped by itself.
    Gone,
}

impl fmt::Display for CameraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing { found, .. } if found.is_empty() => f.write_str(
                "no camera was found: check the ribbon cable, then `rpicam-hello --list-cameras`",
            ),
            Self::Missing { wanted, found } => write!(
                f,
                "no camera is called {:?}: give camera.id a part of one of {found:?}",
                wanted.as_deref().unwrap_or_default()
            ),
            Self::Refused(why) => write!(f, "the camera cannot be used: {why}"),
            Self::Silent(time) => write!(f, "no frame came for {:.1} s", time.as_secs_f64()),
            Self::Gone => f.write_str("the camera went away"),
        }
    }
}

impl std::error::Error for CameraError {}
