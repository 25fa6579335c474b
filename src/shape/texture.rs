//! What a tile answers to a shift, learned from a mean picture.

use core::fmt;

use super::Grid;
use super::slopes::{MARGIN, Mean, bend_noise_gain, noise_gain};
use crate::camera::Pixels;
use crate::kernel::MAX_COEFFICIENT;

/// A tile's answer to a shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileTexture {
    /// Grey values a px of one unit of a coefficient, along x and along y; 0 where the tile is plain.
    pub(super) unit: [f32; 2],
    /// M, row by row: the scores along x and y are M·(u, v), (grey values a px)².
    pub response: [[f32; 2]; 2],
    /// Covariance of the two scores of one frame where a pixel's variance is 1 grey value squared: xx, xy, yy.
    pub noise: [f32; 3],
    /// First moments of M about the tile's middle, (grey values)²/px: `moments[i][j]` is what one px of motion along axis j,
    /// a px to the right and a px below the middle, adds to the score along axis i. A motion d that varies over the tile
    /// by its slopes leaves M·d and, for each direction, its moments times the slope of d.
    pub moments: [[[f32; 2]; 2]; 2],
    /// −Σ h·∂³r along the same axis, x and y, grey values squared: over M's diagonal it is the mean square of the texture's
    /// angular wave numbers, (rad/px)², by which a large motion blurs the mean picture.
    pub bend: [f32; 2],
}

/// Memory of a [`Texture`], lent by the caller: 2 bytes a pixel and 8 a row of a tile.
#[derive(Debug)]
pub struct TextureStorage<'a> {
    /// Coefficients along x: [`Grid::covered`].
    pub right: &'a mut [i8],
    /// Coefficients along y: as many.
    pub down: &'a mut [i8],
    /// What the mean picture's rows give: [`Grid::segments`].
    pub rest: &'a mut [[f32; 2]],
    /// Brightness of the mean picture's rows: [`Grid::covered_rows`].
    pub brightness: &'a mut [f32],
    /// The tiles: [`Grid::tiles`].
    pub tiles: &'a mut [TileTexture],
}

/// What all tiles of a picture answer to a shift.
#[derive(Debug)]
pub struct Texture<'a> {
    pub(super) grid: Grid,
    pub(super) right: &'a [i8],
    pub(super) down: &'a [i8],
    pub(super) rest: &'a [[f32; 2]],
    pub(super) brightness: &'a [f32],
    pub(super) tiles: &'a [TileTexture],
}

impl<'a> Texture<'a> {
    /// Pixels at each edge of the picture that tell nothing: the slopes there are not known.
    pub const EDGE_PX: usize = MARGIN;

    /// Learns from a mean picture: grey values row by row, of the grid's width and height. `variance` is that of a pixel of
    /// the mean, grey values squared: a single frame's over the number of frames. What it adds to the slopes' energy is taken
    /// off. Pixels too near the picture's edge to know their slopes are left out.
    ///
    /// # Errors
    /// [`TextureError`] where a length is not the grid's.
    pub fn build(
        grid: Grid,
        mean: &[f32],
        variance: f32,
        storage: TextureStorage<'a>,
    ) -> Result<Self, TextureError> {
        check(&grid, mean, &storage)?;
        let mean = Mean {
            pixels: mean,
            width: grid.width(),
            height: grid.height(),
        };
        let TextureStorage {
            right,
            down,
            rest,
            brightness,
            tiles,
        } = storage;
        for (number, tile) in tiles.iter_mut().enumerate() {
            let place = Place::of(&grid, number);
            *tile = Sums::of(&mean, &place).tile(&mean, &place, variance, [right, down], rest);
        }
        let covered = grid.covered_columns();
        for (row, brightness) in mean
            .pixels
            .chunks_exact(grid.width())
            .zip(brightness.iter_mut())
        {
            *brightness = row.iter().take(covered).sum();
        }
        Ok(Self {
            grid,
            right,
            down,
            rest,
            brightness,
            tiles,
        })
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[TileTexture] {
        self.tiles
    }

    /// Light of rows one below the other, the first of them `first`, against the mean picture's; `None` where there are none.
    /// Of a row below the last tiles nothing is known.
    pub fn light<'b>(&self, first: usize, rows: impl Iterator<Item = Pixels<'b>>) -> Option<f32> {
        let covered = self.grid.covered_columns();
        let (mut own, mut mean) = (0.0, 0.0);
        for (pixels, brightness) in rows.zip(self.brightness.iter().skip(first)) {
            own += sum(pixels.part(0, covered)?);
            mean += brightness;
        }
        (mean > 0.0).then(|| own / mean)
    }

    /// How the picture is cut.
    pub fn grid(&self) -> Grid {
        self.grid
    }
}

fn check(grid: &Grid, mean: &[f32], storage: &TextureStorage<'_>) -> Result<(), TextureError> {
    let lengths = [
        ("mean", mean.len(), grid.width() * grid.height()),
        ("right", storage.right.len(), grid.covered()),
        ("down", storage.down.len(), grid.covered()),
        ("rest", storage.rest.len(), grid.segments()),
        ("brightness", storage.brightness.len(), grid.covered_rows()),
        ("tiles", storage.tiles.len(), grid.tiles()),
    ];
    match lengths.into_iter().find(|(_, have, need)| have != need) {
        None => Ok(()),
        Some((buffer, have, need)) => Err(TextureError { buffer, have, need }),
    }
}

/// Where a tile's pixels, rows and coefficients are.
struct Place {
    x: usize,
    y: usize,
    side: usize,
    column: usize,
    columns: usize,
}

impl Place {
    fn of(grid: &Grid, number: usize) -> Self {
        let (columns, side) = (grid.columns(), grid.tile_px());
        let (row, column) = (number / columns, number % columns);
        Self {
            x: column * side,
            y: row * side,
            side,
            column,
            columns,
        }
    }

    /// Where a pixel is against the tile's middle, px.
    fn beside_middle(&self, x: usize, y: usize) -> [f32; 2] {
        let middle = 0.5 * (self.side as f32 - 1.0);
        [x - self.x, y - self.y].map(|at| at as f32 - middle)
    }

    fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (x, y, side) = (self.x, self.y, self.side);
        (y..y + side).flat_map(move |y| (x..x + side).map(move |x| (x, y)))
    }
}

/// Means over a tile, and what of its slopes 1 and r explain.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: f32,
    grey: f32,
    slope: [f32; 2],
    /// Slope of each slope over r.
    lean: [f32; 2],
}

impl Sums {
    fn of(mean: &Mean<'_>, place: &Place) -> Self {
        let mut sums = Self::default();
        for slopes in place.pixels().filter_map(|(x, y)| mean.at(x, y)) {
            sums.count += 1.0;
            sums.grey += slopes.grey;
            sums.slope = add(sums.slope, slopes.smooth);
        }
        if sums.count == 0.0 {
            return sums;
        }
        sums.grey /= sums.count;
        sums.slope = sums.slope.map(|s| s / sums.count);
        let (mut power, mut along) = (0.0, [0.0; 2]);
        for slopes in place.pixels().filter_map(|(x, y)| mean.at(x, y)) {
            let grey = slopes.grey - sums.grey;
            power += grey * grey;
            along = add(along, slopes.smooth.map(|s| s * grey));
        }
        if power > 0.0 {
            sums.lean = along.map(|a| a / power);
        }
        sums
    }

    /// A pixel's coefficients in grey values a px, freed of 1 and r.
    fn free(&self, grey: f32, smooth: [f32; 2]) -> [f32; 2] {
        core::array::from_fn(|axis| {
            smooth[axis] - self.slope[axis] - self.lean[axis] * (grey - self.grey)
        })
    }

    /// Writes the tile's coefficients and what the mean picture gives with them.
    fn tile(
        &self,
        mean: &Mean<'_>,
        place: &Place,
        variance: f32,
        [right, down]: [&mut [i8]; 2],
        rest: &mut [[f32; 2]],
    ) -> TileTexture {
        let free = |x, y| mean.at(x, y).map(|s| (self.free(s.grey, s.smooth), s));
        let known = place.pixels().filter_map(|(x, y)| free(x, y));
        let largest = known.fold([0.0f32; 2], |most, (h, _)| {
            core::array::from_fn(|axis| most[axis].max(h[axis].abs()))
        });
        let unit = largest.map(|most| most / f32::from(MAX_COEFFICIENT));
        let per_unit = unit.map(|unit| if unit > 0.0 { 1.0 / unit } else { 0.0 });
        let mut tile = TileTexture {
            unit,
            ..TileTexture::default()
        };
        let width = place.columns * place.side;
        for y in place.y..place.y + place.side {
            let mut own = [0.0f32; 2];
            for x in place.x..place.x + place.side {
                let at = y * width + x;
                let (h, slopes) = free(x, y).unwrap_or_default();
                let q = [0, 1].map(|axis| libm::rintf(h[axis] * per_unit[axis]) as i8);
                if let (Some(right), Some(down)) = (right.get_mut(at), down.get_mut(at)) {
                    [*right, *down] = q;
                }
                own = add(own, q.map(|q| f32::from(q) * slopes.grey));
                let h = [0, 1].map(|axis| f32::from(q[axis]) * unit[axis]);
                tile.add(h, slopes.accurate, place.beside_middle(x, y));
                for (sum, (h, bend)) in tile.bend.iter_mut().zip(h.into_iter().zip(mean.bend(x, y)))
                {
                    *sum -= h * bend;
                }
            }
            if let Some(rest) = rest.get_mut(y * place.columns + place.column) {
                *rest = own;
            }
        }
        let noise = noise_gain() * self.count * variance;
        for axis in [0, 1] {
            let own = &mut tile.response[axis][axis];
            *own = (*own - noise).max(0.0);
            tile.bend[axis] -= bend_noise_gain() * self.count * variance;
        }
        tile
    }
}

impl TileTexture {
    /// A pixel's share; `away` is where it is against the tile's middle, px.
    fn add(&mut self, h: [f32; 2], slopes: [f32; 2], away: [f32; 2]) {
        for (row, h) in self.moments.iter_mut().zip(h) {
            for (moment, slope) in row.iter_mut().zip(slopes) {
                *moment = add(*moment, away.map(|away| away * h * slope));
            }
        }
        for (row, h) in self.response.iter_mut().zip(h) {
            *row = add(*row, slopes.map(|s| h * s));
        }
        let [x, y] = h;
        for (sum, product) in self.noise.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += product;
        }
    }
}

/// Sum of a row's pixels.
fn sum(pixels: Pixels<'_>) -> f32 {
    let sum = match pixels {
        Pixels::U8(p) => p.iter().map(|&p| u32::from(p)).sum::<u32>(),
        deep => deep.values().map(u32::from).sum::<u32>(),
    };
    sum as f32
}

fn add(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// A buffer of another length than the [`Grid`] asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureError {
    /// Which.
    pub buffer: &'static str,
    /// Its length.
    pub have: usize,
    /// What it must be.
    pub need: usize,
}

impl fmt::Display for TextureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffer, have, need } = self;
        write!(
            f,
            "the buffer `{buffer}` has {have} entries, and {need} are needed"
        )
    }
}

impl core::error::Error for TextureError {}
