//! How a tracker is to work.

use crate::{
    camera::Timing,
    kernel::Kernel,
    reference::{BufferTooShort, Storage, band::Level},
};
use core::fmt;

/// Along which axes motion is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// Along the rows alone. What moves along the columns leaks in where edges lean.
    #[default]
    X,
    /// Along rows and columns ([`Vertical`](crate::timeline::Vertical)). Takes the memory of
    /// [`Storage::vertical`] and about half as long again; pictures of ten rows and more, as two rows of each colour at either
    /// end are not measured.
    Xy,
}

/// How a tracker is to work. Plain data, checked by [`Tracker::new`](super::Tracker::new).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// When rows are exposed.
    pub timing: Timing,
    /// Pixels in a line, 16 to 8192.
    pub width: u16,
    /// Rows, 1 to [`Timing::rows`].
    pub rows: u16,
    /// Bits of a pixel, 8 to 16.
    pub bits: u8,
    /// Pixels from one to the next of the same colour: 1 for luma, 2 for raw Bayer.
    pub stride: u8,
    /// Along which axes it measures.
    pub axes: Axes,
    /// Frames in each of the two rounds of learning, at least 1.
    pub learn_frames: u16,
    /// How coarse the band is; `None` chooses by the information that the picture holds.
    pub level: Option<Level>,
    /// How far a lost picture is searched for, px either way; at most a third of the width counts.
    pub search_px: u16,
    /// Columns of coefficients that are built again in one line time: what a line may cost besides its own
    /// measurement. `u16::MAX`: as much as it likes. With fewer, all that a line may need while measuring (not
    /// while learning) is bounded: a row's
    /// reference grows over many lines, a lost picture is searched for at one place a line, and a line that
    /// would need more is called occluded. And the light is told by every second column
    /// ([`Kernel::with_half_the_light`]).
    pub columns_per_line: u16,
    /// Which implementation of the inner product.
    pub kernel: Kernel,
}

impl Config {
    /// 8-bit luma of this width, all rows of the timing, everything else as it suits most cameras.
    pub fn new(timing: Timing, width: u16) -> Self {
        Self {
            timing,
            width,
            rows: timing.rows(),
            bits: 8,
            stride: 1,
            axes: Axes::X,
            learn_frames: 30,
            level: None,
            search_px: 48,
            columns_per_line: u16::MAX,
            kernel: Kernel::detect(),
        }
    }
}

/// Why a [`Config`] or [`Storage`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigError {
    /// Width in pixels, outside 16 to 8192.
    Width(u16),
    /// Rows: 0, or more than the timing's.
    Rows(u16),
    /// Bits of a pixel, outside 8 to 16.
    Bits(u8),
    /// Neither 1 nor 2.
    Stride(u8),
    /// Learning needs a frame.
    LearnFrames,
    /// A buffer of this name has `has` elements and needs `needs`.
    Buffer {
        /// Field of [`Storage`].
        name: &'static str,
        /// Its length.
        has: usize,
        /// The length that is needed.
        needs: usize,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Width(w) => write!(f, "a line of {w} px: 16 to 8192 px can be measured"),
            Self::Rows(r) => write!(f, "{r} rows: at least 1, at most the camera's"),
            Self::Bits(b) => write!(f, "{b} bits a pixel: 8 to 16 can be read"),
            Self::Stride(s) => write!(f, "stride {s}: 1 for luma, 2 for raw Bayer"),
            Self::LearnFrames => f.write_str("learn_frames is 0: at least 1 frame is needed"),
            Self::Buffer { name, has, needs } => {
                write!(f, "buffer `{name}` has {has} elements and needs {needs}")
            }
        }
    }
}

impl core::error::Error for ConfigError {}

impl Config {
    /// Pixel values: 2 to the power of `bits`.
    pub(super) fn values(&self) -> f32 {
        f32::from(1u16 << (self.bits - 1)) * 2.0
    }

    /// Pixel value from which on a pixel is saturated.
    pub(super) fn saturation(&self) -> f32 {
        self.values() * (254.0 / 256.0)
    }

    /// Checks the configuration and cuts the buffers to the sizes that it needs.
    pub(super) fn check<'a>(&self, storage: Storage<'a>) -> Result<Storage<'a>, ConfigError> {
        if !(16..=8192).contains(&self.width) {
            return Err(ConfigError::Width(self.width));
        }
        if self.rows == 0 || self.rows > self.timing.rows() {
            return Err(ConfigError::Rows(self.rows));
        }
        if !(8..=16).contains(&self.bits) {
            return Err(ConfigError::Bits(self.bits));
        }
        if !(1..=2).contains(&self.stride) {
            return Err(ConfigError::Stride(self.stride));
        }
        if self.learn_frames == 0 {
            return Err(ConfigError::LearnFrames);
        }
        let (width, rows) = (usize::from(self.width), usize::from(self.rows));
        let cut = storage.cut(width, rows, self.axes == Axes::Xy);
        cut.map_err(|BufferTooShort { name, has, needs }| ConfigError::Buffer { name, has, needs })
    }
}
