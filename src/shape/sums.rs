//! Sums of the tiles' scores with a cosine and a sine of each tone.

use core::fmt;

use heapless::Vec;

use super::{Texture, TileTexture};
use crate::camera::{Line, Pixels, Timing};
use crate::kernel::Kernel;
use crate::math::cos_sin;

/// Most tones at a time.
pub const MAX_TONES: usize = 24;

/// A line whose brightness is not between these shares of the mean picture's is not of this picture.
const LIGHT: core::ops::Range<f32> = 0.3..3.0;

/// What a tone left in a tile, (grey values a px)²·px: Σ s·cos and Σ s·sin of the scores along x, then along y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneSums {
    /// Σ s·cos 2πft and Σ s·sin 2πft along x.
    pub x: [f32; 2],
    /// The same along y.
    pub y: [f32; 2],
}

/// Memory of [`TileSums`], lent by the caller.
#[derive(Debug)]
pub struct SumsStorage<'a> {
    /// One for each tile and tone, the tones of a tile side by side.
    pub sums: &'a mut [ToneSums],
    /// One for each column of tiles: scratch of a line.
    pub products: &'a mut [[f32; 2]],
}

/// Adds up what each tone leaves in each tile.
///
/// Lines may come in any order and with gaps; their number in each row of tiles is counted.
#[derive(Debug)]
pub struct TileSums<'a> {
    texture: &'a Texture<'a>,
    timing: Timing,
    hz: Vec<f64, MAX_TONES>,
    storage: SumsStorage<'a>,
    kernel: Kernel,
    origin_ns: i64,
    lines: u32,
    rejected: u32,
}

impl<'a> TileSums<'a> {
    /// Sums at these frequencies, Hz, at most [`MAX_TONES`]; one of 0 takes up what stands still. `origin_ns`: where phases
    /// are counted from; best is the first frame's start.
    ///
    /// # Errors
    /// [`SumsError`] for more tones, and for buffers of another size than the tiles and tones ask for.
    pub fn new(
        texture: &'a Texture<'a>,
        timing: Timing,
        hz: &[f64],
        origin_ns: i64,
        storage: SumsStorage<'a>,
    ) -> Result<Self, SumsError> {
        let hz: Vec<f64, MAX_TONES> =
            Vec::from_slice(hz).map_err(|_| SumsError::Tones(hz.len()))?;
        let (have, need) = (storage.sums.len(), texture.grid.tiles() * hz.len());
        if have != need {
            return Err(SumsError::Sums { have, need });
        }
        let (have, need) = (storage.products.len(), texture.grid.columns());
        if have != need {
            return Err(SumsError::Products { have, need });
        }
        let mut sums = Self {
            texture,
            timing,
            hz,
            storage,
            kernel: Kernel::detect(),
            origin_ns,
            lines: 0,
            rejected: 0,
        };
        sums.clear();
        Ok(sums)
    }

    /// All sums zero again.
    pub fn clear(&mut self) {
        self.storage.sums.fill(ToneSums::default());
        (self.lines, self.rejected) = (0, 0);
    }

    /// The sums, tile by tile, the tones of a tile side by side.
    pub fn sums(&self) -> &[ToneSums] {
        self.storage.sums
    }

    /// Lines summed since the sums were cleared.
    pub fn lines(&self) -> u32 {
        self.lines
    }

    /// Lines whose light was not this picture's.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }

    /// Takes a line of the whole picture, whose light is so many times the mean picture's: [`Texture::light`] of some hundred
    /// lines around it, since a single line's brightness changes with what moves into it along the columns. A line below the
    /// last row of tiles tells nothing, one that is too short or of another light is rejected.
    pub fn push(&mut self, line: &Line<'_>, light: f32) {
        let row = usize::from(line.row);
        if row >= self.texture.grid.covered_rows() {
            return;
        }
        if !LIGHT.contains(&light) || self.products(row, line.pixels).is_none() {
            self.rejected += 1;
            return;
        }
        self.lines += 1;
        self.scores(row, 1.0 / light);
        let after_ns = line.start_ns.saturating_sub(self.origin_ns);
        let after_ns = after_ns.saturating_add(self.timing.middle_ns(0));
        let mut waves: Vec<(f32, f32), MAX_TONES> = Vec::new();
        for &hz in &self.hz {
            // As long as there are tones there is room for their waves.
            let _ = waves.push(cos_sin(phase(hz, after_ns)));
        }
        self.add(row, &waves);
    }

    /// The inner products of a line with all tiles' coefficients; `None` where it is too short.
    fn products(&mut self, row: usize, pixels: Pixels<'_>) -> Option<()> {
        let grid = &self.texture.grid;
        let (side, width) = (grid.tile_px(), grid.covered_columns());
        let kept = row * width..(row + 1) * width;
        let right = self.texture.right.get(kept.clone())?.chunks_exact(side);
        let down = self.texture.down.get(kept)?.chunks_exact(side);
        let pixels = pixels.part(0, width)?;
        let all = self.storage.products.iter_mut().zip(right.zip(down));
        for (column, (products, (right, down))) in all.enumerate() {
            let own = column * side..(column + 1) * side;
            *products = match pixels {
                Pixels::U8(p) => {
                    let (sums, second) = self.kernel.both_u8(p.get(own)?, right, down);
                    [sums.product as f32, second as f32]
                }
                Pixels::U16(p) => {
                    let p = p.get(own)?;
                    let product = |h| self.kernel.sums_u16(p, h).product as f32;
                    [product(right), product(down)]
                }
                Pixels::Upper(p) => {
                    let mut sums = [0.0f32; 2];
                    let values = p.iter().skip(own.start).map(f32::from);
                    for (p, (&right, &down)) in values.zip(right.iter().zip(down)) {
                        sums[0] += p * f32::from(right);
                        sums[1] += p * f32::from(down);
                    }
                    sums
                }
            };
        }
        Some(())
    }

    /// Products become scores: what the mean picture gives is taken off, and a shift to the right or downwards is positive.
    fn scores(&mut self, row: usize, per_light: f32) {
        let grid = &self.texture.grid;
        let columns = grid.columns();
        let rest = self.texture.rest.iter().skip(row * columns);
        let tiles = self.texture.tiles.iter();
        let tiles = tiles.skip(row / grid.tile_px() * columns);
        let all = self.storage.products.iter_mut().zip(rest.zip(tiles));
        for (products, (rest, tile)) in all {
            for axis in [0, 1] {
                products[axis] = (rest[axis] - products[axis] * per_light) * tile.unit[axis];
            }
        }
    }

    /// Four multiply-adds a tile and tone.
    fn add(&mut self, row: usize, waves: &[(f32, f32)]) {
        let grid = &self.texture.grid;
        let first = row / grid.tile_px() * grid.columns() * waves.len();
        let Some(sums) = self.storage.sums.get_mut(first..) else {
            return;
        };
        let tiles = sums.chunks_exact_mut(waves.len().max(1));
        for (sums, &[x, y]) in tiles.zip(self.storage.products.iter()) {
            for (sum, &(cos, sin)) in sums.iter_mut().zip(waves) {
                sum.x[0] += x * cos;
                sum.x[1] += x * sin;
                sum.y[0] += y * cos;
                sum.y[1] += y * sin;
            }
        }
    }

    /// Amplitudes of the `tone`-th tone in a tile, where it is the only one, over `frames` frames that all came, px: real and
    /// imaginary part of X along x and of Y along y, where the motion is Re X·e^(2πift). The averaging of an exposure is not
    /// undone. `None` where the tile has too little texture to tell both axes.
    pub fn single(&self, tile: usize, tone: usize, frames: u32) -> Option<[[f32; 2]; 2]> {
        let sums = self.storage.sums.get(tile * self.hz.len() + tone)?;
        let texture = self.texture.tiles.get(tile)?;
        let share = 2.0 / frames.max(1) as f32;
        let cos = texture.solve([sums.x[0] * share, sums.y[0] * share])?;
        let sin = texture.solve([sums.x[1] * share, sums.y[1] * share])?;
        Some([[cos[0], -sin[0]], [cos[1], -sin[1]]])
    }
}

impl TileTexture {
    /// The shift, px, that gives these scores; `None` where the edges all lean one way.
    pub fn solve(&self, scores: [f32; 2]) -> Option<[f32; 2]> {
        let [[a, b], [c, d]] = self.response;
        let determinant = a * d - b * c;
        let known = determinant > LEAST_CONDITIONED * 0.25 * (a + d) * (a + d);
        known.then(|| {
            [
                (d * scores[0] - b * scores[1]) / determinant,
                (a * scores[1] - c * scores[0]) / determinant,
            ]
        })
    }
}

/// Where less is known along the edges than about this share of what is known across them, nothing is.
const LEAST_CONDITIONED: f32 = 3e-3;

/// Phase of a tone, in turns of 2³².
fn phase(hz: f64, after_ns: i64) -> u32 {
    let turns = hz * after_ns as f64 * 1e-9;
    ((turns - libm::floor(turns)) * 4_294_967_296.0) as u32
}

/// Why [`TileSums::new`] refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SumsError {
    /// So many tones; [`MAX_TONES`] is the most.
    Tones(usize),
    /// [`SumsStorage::sums`] has another length than tiles times tones.
    Sums {
        /// Its length.
        have: usize,
        /// What it must be.
        need: usize,
    },
    /// [`SumsStorage::products`] has another length than there are columns of tiles.
    Products {
        /// Its length.
        have: usize,
        /// What it must be.
        need: usize,
    },
}

impl fmt::Display for SumsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tones(tones) => write!(f, "{tones} tones: at most {MAX_TONES} at a time"),
            Self::Sums { have, need } => {
                write!(f, "room for {have} sums, and {need} are needed")
            }
            Self::Products { have, need } => {
                write!(f, "room for {have} products, and {need} are needed")
            }
        }
    }
}

impl core::error::Error for SumsError {}
