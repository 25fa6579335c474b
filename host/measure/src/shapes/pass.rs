//! The third reading: every frame through the sums of the tiles.

use rowtone::camera::{Pixels, Timing};
use rowtone::shape::{Grid, SumsStorage, Texture, TextureStorage, TileSums, TileTexture, ToneSums};

use super::blocks::Blocks;
use super::error::ShapesError;
use super::mean::Mean;
use rowtone_clip::{Feed, Rect};

/// Rows whose light is taken together lie within this time of each other, s: mains flicker hardly changes in it. But at least so
/// many to either side: what moves into and out of a single row would be taken for light.
const LIGHT_S: f64 = 1e-3;
const LEAST_LIT: usize = 24;

/// What it found.
#[derive(Clone, Debug)]
pub(super) struct TileBlocks {
    pub(super) grid: Grid,
    pub(super) tiles: Vec<TileTexture>,
    pub(super) blocks: Blocks,
}

/// Sums at these frequencies, Hz.
///
/// # Errors
/// [`ShapesError`] of the input.
pub(super) fn run(
    feed: &mut Feed,
    mean: &Mean,
    grid: Grid,
    hz: &[f64],
    step: &mut dyn FnMut(),
) -> Result<TileBlocks, ShapesError> {
    let (mut right, mut down) = (vec![0; grid.covered()], vec![0; grid.covered()]);
    let mut rest = vec![[0.0; 2]; grid.segments()];
    let mut brightness = vec![0.0; grid.covered_rows()];
    let mut tiles = vec![TileTexture::default(); grid.tiles()];
    let storage = TextureStorage {
        right: &mut right,
        down: &mut down,
        rest: &mut rest,
        brightness: &mut brightness,
        tiles: &mut tiles,
    };
    let variance = mean.variance / mean.used.len() as f64;
    let texture = Texture::build(grid, &mean.pixels, variance as f32, storage)?;
    let mut sums = vec![ToneSums::default(); grid.tiles() * hz.len()];
    let mut products = vec![[0.0; 2]; grid.columns()];
    let storage = SumsStorage {
        sums: &mut sums,
        products: &mut products,
    };
    let timing = feed.camera.timing;
    let origin_ns = mean.span_ns[0];
    let mut sums = TileSums::new(&texture, timing, hz, origin_ns, storage)?;
    let mut blocks = Blocks::new(hz, grid.tiles(), mean.used.len());
    let whole = Rect::whole(grid.width(), grid.height());
    let mut lights = Lights::new(&grid, &timing);
    let mut used = mean.used.iter();
    while let Some(frame) = feed.next_frame()? {
        step();
        // A recording that is stopped while it is read again may be longer than it was.
        let Some(&used) = used.next() else { break };
        if used {
            sums.clear();
            lights.measure(&texture, |row| frame.pixels(&whole, row));
            let lines = frame.lines(&whole, &timing, 0..grid.covered_rows());
            for (line, &light) in lines.zip(&lights.smooth) {
                sums.push(&line, light);
            }
            if sums.rejected() == 0 {
                blocks.add((frame.start_ns - origin_ns) as f64 * 1e-9, sums.sums());
            }
        }
        feed.recycle(frame);
    }
    let tiles = texture.tiles().to_vec();
    Ok(TileBlocks {
        grid,
        tiles,
        blocks,
    })
}

/// Light of a frame's rows, against the mean picture's.
struct Lights {
    /// Rows to either side that are taken together.
    reach: usize,
    own: Vec<f32>,
    smooth: Vec<f32>,
}

impl Lights {
    fn new(grid: &Grid, timing: &Timing) -> Self {
        let rows = match timing.line_time_ps() {
            0 => grid.height(),
            ps => (LIGHT_S * 1e12 / f64::from(ps)) as usize,
        };
        Self {
            reach: rows.max(LEAST_LIT),
            own: vec![0.0; grid.covered_rows()],
            smooth: vec![0.0; grid.covered_rows()],
        }
    }

    fn measure<'a>(&mut self, texture: &Texture<'_>, row: impl Fn(usize) -> Pixels<'a>) {
        for (y, own) in self.own.iter_mut().enumerate() {
            // A row that is not known is of no light, and its frame is left out.
            *own = texture.light(y, std::iter::once(row(y))).unwrap_or(0.0);
        }
        let rows = self.own.len();
        let mut sums = vec![0.0];
        sums.extend(self.own.iter().scan(0.0f64, |sum, &own| {
            *sum += f64::from(own);
            Some(*sum)
        }));
        for (y, smooth) in self.smooth.iter_mut().enumerate() {
            let (from, to) = (y.saturating_sub(self.reach), (y + self.reach + 1).min(rows));
            *smooth = ((sums[to] - sums[from]) / (to - from) as f64) as f32;
        }
    }
}
