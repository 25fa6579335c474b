//! Lines become displacements: learning the reference, following it, and knowing when it is lost.
//!
//! A [`Tracker`] is pushed every line of every frame. It first *learns*: the first frame is the first
//! reference, and each later line is aligned by its own estimate before it is averaged in, so that motion
//! does not blur the reference (the thesis's Algorithm 1, as a running mean). A second round over as many
//! frames refines it: only then is the motion's range known, and with it the margin and the level of the
//! band. Then it *tracks*: one inner product a line.

use crate::{
    band::Level,
    camera::{Line, Pixels, Timing},
    kernel::Kernel,
    noise::{NoiseMeter, PixelNoise},
    pixel::Pixel,
    reference::{Build, Parts, Recipe, RowTable},
    timeline::Displacement,
};
use core::{fmt, ops::Range};

/// How a tracker is to work. Plain data, checked by [`Tracker::new`].
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
    /// Frames in each of the two rounds of learning, at least 1.
    pub learn_frames: u16,
    /// How coarse the band is; `None` chooses by the information that the picture holds.
    pub level: Option<Level>,
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
            learn_frames: 30,
            level: None,
            kernel: Kernel::detect(),
        }
    }
}

/// Memory of a tracker, lent by the caller: 3·width + 24 bytes a row, and 5 bytes a column.
#[derive(Debug)]
pub struct Storage<'a> {
    /// width × rows: the coefficients of the inner products.
    pub coefficients: &'a mut [i8],
    /// rows: what the line path needs besides.
    pub tables: &'a mut [RowTable],
    /// width × rows: the reference picture, in counts.
    pub mean: &'a mut [u16],
    /// rows: what learning needs.
    pub learning: &'a mut [RowLearning],
    /// width: weight of each column, 0 = unused … 255. As given it is kept: a caller can mask columns.
    pub mask: &'a mut [u8],
    /// 2 × width: scratch.
    pub scratch: &'a mut [f32],
}

/// What learning keeps of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowLearning {
    /// Mean shift of the aligned frames, px.
    shift_px: f32,
    /// Frames averaged in this round.
    frames: u16,
}

/// What a line came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Its shift.
    Measured(Displacement),
    /// The reference is still being learned.
    Learning,
    /// The row has too little texture.
    NoTexture,
    /// The line does not look like its reference: something passes through the picture.
    Disturbed,
    /// The line has another width, or a row that is not there.
    Misfit,
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

/// Which round a tracker is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The first reference: anchored to the first frame.
    Rough,
    /// The reference at the middle of the motion.
    Refining,
    /// Measuring.
    Tracking,
}

/// See the [module](self).
#[derive(Debug)]
pub struct Tracker<'a> {
    config: Config,
    storage: Storage<'a>,
    recipe: Recipe,
    stage: Stage,
    frame: Option<u32>,
    frames_in_stage: u16,
    /// Brightness of the last line against its reference.
    gain: f32,
    prediction: Prediction,
    meter: NoiseMeter,
    /// Largest shift met in this round, px.
    range_px: f32,
}

/// Where the next line is expected: the information-weighted mean of the last rows.
#[derive(Clone, Copy, Debug, Default)]
struct Prediction {
    weighted_px: f32,
    information: f32,
}

impl Prediction {
    #[inline]
    fn shift_px(&self) -> f32 {
        if self.information > 0.0 {
            self.weighted_px / self.information
        } else {
            0.0
        }
    }

    #[inline]
    fn add(&mut self, shift_px: f32, information: f32) {
        self.weighted_px = self.weighted_px * 0.75 + shift_px * information;
        self.information = self.information * 0.75 + information;
    }
}

/// Beyond this the polynomial is left for the next whole shift, px.
const NEAR_PX: f32 = 0.7;

impl<'a> Tracker<'a> {
    /// A tracker that has learned nothing yet. `storage.mask` is kept as given; the other buffers are
    /// overwritten.
    ///
    /// # Errors
    /// [`ConfigError`] names the field that is out of range, or the buffer that is too short.
    pub fn new(config: Config, storage: Storage<'a>) -> Result<Self, ConfigError> {
        let pixels = usize::from(config.width) * usize::from(config.rows);
        let (width, rows) = (usize::from(config.width), usize::from(config.rows));
        match config {
            c if !(16..=8192).contains(&c.width) => return Err(ConfigError::Width(c.width)),
            c if c.rows == 0 || c.rows > c.timing.rows() => return Err(ConfigError::Rows(c.rows)),
            c if !(8..=16).contains(&c.bits) => return Err(ConfigError::Bits(c.bits)),
            c if !(1..=2).contains(&c.stride) => return Err(ConfigError::Stride(c.stride)),
            c if c.learn_frames == 0 => return Err(ConfigError::LearnFrames),
            _ => {}
        }
        for (name, has, needs) in [
            ("coefficients", storage.coefficients.len(), pixels),
            ("tables", storage.tables.len(), rows),
            ("mean", storage.mean.len(), pixels),
            ("learning", storage.learning.len(), rows),
            ("mask", storage.mask.len(), width),
            ("scratch", storage.scratch.len(), 2 * width),
        ] {
            if has < needs {
                return Err(ConfigError::Buffer { name, has, needs });
            }
        }
        let values = f32::from(1u16.checked_shl(u32::from(config.bits) - 1).unwrap_or(0)) * 2.0;
        let mut tracker = Self {
            config,
            storage,
            recipe: Recipe {
                level: config.level.unwrap_or(Level::Medium),
                stride: usize::from(config.stride),
                margin_px: 0,
                // Until it is measured: 1 % of the range.
                noise: PixelNoise {
                    dark: (values / 128.0) * (values / 128.0),
                    per_value: 0.0,
                },
                counts_per_value: 32768.0 / values,
                saturation: values * (254.0 / 256.0),
                kernel: config.kernel,
            },
            stage: Stage::Rough,
            frame: None,
            frames_in_stage: 0,
            gain: 1.0,
            prediction: Prediction::default(),
            meter: NoiseMeter::default(),
            range_px: 0.0,
        };
        tracker.relearn();
        Ok(tracker)
    }

    /// Forgets the reference and learns it anew from the next line on.
    pub fn relearn(&mut self) {
        self.stage = Stage::Rough;
        self.frame = None;
        self.frames_in_stage = 0;
        self.range_px = 0.0;
        self.prediction = Prediction::default();
        self.recipe.margin_px = usize::from(self.config.width / 8).min(32);
        self.storage.learning.fill(RowLearning::default());
        self.storage.tables.fill(RowTable::default());
        self.storage.coefficients.fill(0);
    }

    /// Which round it is in.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Noise of one pixel, as measured while learning.
    pub fn pixel_noise(&self) -> PixelNoise {
        self.recipe.noise
    }

    /// The band's level in use.
    pub fn level(&self) -> Level {
        self.recipe.level
    }

    /// The rows' tables, one a row.
    pub fn tables(&self) -> &[RowTable] {
        self.storage.tables
    }

    /// Ends the present round of learning now, with the frames that were seen: for a recording that is
    /// shorter than the configured rounds.
    pub fn end_round(&mut self) {
        match self.stage {
            Stage::Rough => {
                self.finish_rough();
                self.stage = Stage::Refining;
            }
            Stage::Refining => {
                self.finish_refining();
                self.stage = Stage::Tracking;
            }
            Stage::Tracking => {}
        }
        self.frames_in_stage = 0;
        self.frame = None;
    }

    /// Takes one line.
    #[inline]
    pub fn push(&mut self, line: &Line<'_>) -> Outcome {
        match line.pixels {
            Pixels::U8(p) => self.push_pixels(line, p),
            Pixels::U16(p) => self.push_pixels(line, p),
        }
    }

    #[inline]
    fn push_pixels<P: Pixel>(&mut self, line: &Line<'_>, pixels: &[P]) -> Outcome {
        let row = usize::from(line.row);
        if line.row >= self.config.rows || pixels.len() != usize::from(self.config.width) {
            return Outcome::Misfit;
        }
        if self.frame != Some(line.frame) {
            self.next_frame(line.frame);
        }
        if self.stage != Stage::Tracking {
            self.learn(row, pixels);
            return Outcome::Learning;
        }
        let Some((shift_px, information_per_px2)) = self.estimate(row, pixels) else {
            return Outcome::NoTexture;
        };
        Outcome::Measured(Displacement {
            frame: line.frame,
            row: line.row,
            time_ns: line
                .start_ns
                .saturating_add(i64::from(self.config.timing.exposure_ns() / 2)),
            shift_px,
            information_per_px2,
        })
    }

    fn next_frame(&mut self, frame: u32) {
        if self.stage != Stage::Tracking
            && self.frame.is_some()
            && self.frames_in_stage >= self.config.learn_frames
        {
            self.end_round();
        }
        self.frames_in_stage = self.frames_in_stage.saturating_add(1);
        self.frame = Some(frame);
    }

    /// Shift of a line and its information, or `None` where the row has no texture.
    #[inline]
    fn estimate<P: Pixel>(&mut self, row: usize, pixels: &[P]) -> Option<(f32, f32)> {
        let width = pixels.len();
        let table = *self.storage.tables.get(row)?;
        let information = table.information_per_px2();
        if information == 0.0 {
            return None;
        }
        let coefficients = self.storage.coefficients.get(row * width..)?.get(..width)?;
        let whole = libm::roundf(self.prediction.shift_px()) as i32;
        let stride = i32::from(self.config.stride);
        let mut whole = whole - whole % stride;
        let mut shift_px = 0.0;
        for _ in 0..4 {
            let overlap = Overlap::new(width, whole)?;
            let sums = P::sums(
                self.config.kernel,
                pixels.get(overlap.line)?,
                coefficients.get(overlap.reference)?,
            );
            // The brightness of what both see.
            let unseen = self
                .storage
                .mean
                .get(row * width..)?
                .get(overlap.unseen)?
                .iter()
                .map(|&c| u64::from(c))
                .sum::<u64>();
            let seen = table.pixel_sum() - unseen as f32 / self.recipe.counts_per_value;
            self.gain = sums.pixels as f32 / seen.max(1.0);
            let near = table.shift_px(sums.product as f32, self.gain.max(1e-3));
            shift_px = whole as f32 + near;
            if near.abs() <= NEAR_PX * stride as f32 {
                break;
            }
            let step = libm::roundf(near.clamp(-2.0, 2.0) / stride as f32) as i32 * stride;
            let limit = width as i32 / 2;
            let next = (whole + step).clamp(-limit, limit);
            if next == whole {
                break;
            }
            whole = next;
        }
        if !shift_px.is_finite() {
            return None;
        }
        self.prediction.add(shift_px, information);
        Some((shift_px, information))
    }

    fn learn<P: Pixel>(&mut self, row: usize, pixels: &[P]) {
        let width = pixels.len();
        let first = self.frames_in_stage <= 1 && self.stage == Stage::Rough;
        let estimate = if first {
            None
        } else {
            self.estimate(row, pixels)
        };
        // A row without texture moves like its neighbours.
        let shift_px = if first {
            0.0
        } else {
            estimate.map_or(self.prediction.shift_px(), |e| {
                if e.1 > 25.0 {
                    e.0
                } else {
                    self.prediction.shift_px()
                }
            })
        };
        self.range_px = self.range_px.max(self.prediction.shift_px().abs());
        let gain = self.gain;
        let (Some(mean), Some(learning)) = (
            self.storage.mean.get_mut(row * width..(row + 1) * width),
            self.storage.learning.get_mut(row),
        ) else {
            return;
        };
        if estimate.is_some() && self.stage == Stage::Refining && learning.frames > 2 {
            self.meter.add_line(
                mean,
                pixels,
                shift_px - learning.shift_px,
                gain,
                &self.recipe,
                f32::from(learning.frames),
            );
        }
        let centre = if self.stage == Stage::Refining {
            learning.shift_px
        } else {
            0.0
        };
        learning.frames = learning.frames.saturating_add(1);
        let weight = 1.0 / f32::from(learning.frames);
        if self.stage == Stage::Rough {
            learning.shift_px += (shift_px - learning.shift_px) * weight;
        }
        crate::align::average_in(
            mean,
            pixels,
            shift_px - centre,
            weight / if gain > 0.1 { gain } else { 1.0 },
            weight,
            &self.recipe,
        );
        if self.stage == Stage::Rough && learning.frames.is_power_of_two() {
            self.build(row);
        }
    }

    fn build(&mut self, row: usize) {
        let width = usize::from(self.config.width);
        let span = row * width..(row + 1) * width;
        let s = &mut self.storage;
        let (Some(mean), Some(coefficients), Some(table), Some(learning)) = (
            s.mean.get(span.clone()),
            s.coefficients.get_mut(span),
            s.tables.get_mut(row),
            s.learning.get(row),
        ) else {
            return;
        };
        let frames = f32::from(learning.frames.max(1));
        *table = Build::new(&self.recipe, frames).all(&mut Parts {
            mean,
            mask: s.mask,
            scratch: s.scratch,
            coefficients,
        });
    }

    fn build_all(&mut self) {
        for row in 0..usize::from(self.config.rows) {
            self.build(row);
        }
    }

    fn finish_rough(&mut self) {
        for l in self.storage.learning.iter_mut() {
            l.frames = 0;
        }
        self.range_px = 0.0;
    }

    fn finish_refining(&mut self) {
        if let Some(noise) = self.meter.noise(self.recipe.saturation) {
            self.recipe.noise = noise;
        }
        // Small motion stays within the polynomial and never leaves the picture's edge behind.
        self.recipe.margin_px = if self.range_px < 0.6 {
            0
        } else {
            (self.range_px * 1.25) as usize + 2
        };
        self.build_all();
        self.prediction = Prediction::default();
    }
}

/// Which pixels of a line meet which of its reference when it is read `whole` pixels to the right:
/// p\[x + whole\] meets r\[x\].
struct Overlap {
    line: Range<usize>,
    reference: Range<usize>,
    /// The part of the reference that the line does not show.
    unseen: Range<usize>,
}

impl Overlap {
    #[inline]
    fn new(width: usize, whole: i32) -> Option<Self> {
        let by = whole.unsigned_abs() as usize;
        let rest = width.checked_sub(by)?;
        let (ahead, behind) = (by..width, 0..rest);
        Some(if whole >= 0 {
            Self {
                line: ahead,
                reference: behind,
                unseen: rest..width,
            }
        } else {
            Self {
                line: behind,
                reference: ahead,
                unseen: 0..by,
            }
        })
    }
}
