//! Lines in, shapes out: a part that bends at two tones, one of them far beyond half the frame rate, and what each tile of
//! the picture does. In buffers that are lent, without a heap in the stage itself.
//!
//! ```text
//! cargo run --release --example shapes
//! ```
//!
//! `shapes 640 480 ROUNDS` sums so many rounds of four frames of that size at four tones and prints how long that takes: for
//! a counter of instructions, which compares two numbers of rounds (boards/rpi/ci/shapes.sh).

use std::f32::consts::TAU;
use std::time::Instant;

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::shape::{Grid, SumsStorage, Texture, TextureStorage, TileSums, TileTexture, ToneSums};

/// Frequencies, Hz, and how far the upper edge moves along x, px; the lower edge moves the other way.
pub(crate) const TONES: [(f64, f32); 2] = [(131.7, 0.2), (1017.0, 0.1)];
const FPS: f64 = 60.0;
const TILE_PX: u16 = 16;
/// Four tones are counted.
const COUNTED_HZ: [f64; 4] = [24.7, 131.7, 411.3, 1017.0];

/// Memory of the stage.
struct Memory {
    right: Vec<i8>,
    down: Vec<i8>,
    rest: Vec<[f32; 2]>,
    brightness: Vec<f32>,
    tiles: Vec<TileTexture>,
    sums: Vec<ToneSums>,
    products: Vec<[f32; 2]>,
}

impl Memory {
    fn new(grid: &Grid, tones: usize) -> Self {
        Self {
            right: vec![0; grid.covered()],
            down: vec![0; grid.covered()],
            rest: vec![[0.0; 2]; grid.segments()],
            brightness: vec![0.0; grid.covered_rows()],
            tiles: vec![TileTexture::default(); grid.tiles()],
            sums: vec![ToneSums::default(); grid.tiles() * tones],
            products: vec![[0.0; 2]; grid.columns()],
        }
    }

    fn lend(&mut self) -> (TextureStorage<'_>, SumsStorage<'_>) {
        let texture = TextureStorage {
            right: &mut self.right,
            down: &mut self.down,
            rest: &mut self.rest,
            brightness: &mut self.brightness,
            tiles: &mut self.tiles,
        };
        let sums = SumsStorage {
            sums: &mut self.sums,
            products: &mut self.products,
        };
        (texture, sums)
    }
}

/// The picture at a place, grey values.
fn grey(x: f32, y: f32) -> f32 {
    let waves = [(0.41, 0.13), (-0.23, 0.37), (0.55, -0.31), (0.11, 0.52)];
    let sum: f32 = waves.iter().map(|(a, b)| (a * x + b * y).sin()).sum();
    120.0 + 24.0 * sum
}

fn still(width: u16, height: u16) -> Vec<f32> {
    let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    rows.map(|(x, y)| grey(x.into(), y.into())).collect()
}

/// Amplitudes along x of the tones, in the first tile of the first row of tiles and of the last, px.
pub(crate) fn edges() -> Result<[[f32; 2]; 2], Box<dyn std::error::Error>> {
    let (width, height) = (96, 128);
    let timing = Timing::new(100_000_000, 100_000, height)?;
    let grid = Grid::new(width, height, TILE_PX)?;
    let mut memory = Memory::new(&grid, TONES.len());
    let (texture, sums) = memory.lend();
    // As long as the motion is small the picture at rest is the mean.
    let texture = Texture::build(grid, &still(width, height), 0.0, texture)?;
    let mut sums = TileSums::new(&texture, timing, &TONES.map(|(hz, _)| hz), 0, sums)?;
    let frames = 120;
    let mut pixels = vec![0; width.into()];
    for frame in 0..frames {
        let start_ns = (f64::from(frame) * 1e9 / FPS) as i64;
        for row in 0..height {
            let start_ns = start_ns + timing.start_ns(row);
            let middle_s = (start_ns + timing.middle_ns(0)) as f64 * 1e-9;
            let lean = 1.0 - 2.0 * f32::from(row) / f32::from(height - 1);
            let moved =
                TONES.map(|(hz, px)| lean * px * ((hz * middle_s).fract() as f32 * TAU).sin());
            let moved_px: f32 = moved.iter().sum();
            for (x, pixel) in pixels.iter_mut().enumerate() {
                *pixel = grey(x as f32 - moved_px, row.into()).round() as u8;
            }
            let line = Line {
                frame,
                row,
                start_ns,
                pixels: Pixels::U8(&pixels),
            };
            sums.push(&line, 1.0);
        }
    }
    let last = grid.tiles() - grid.columns();
    let amplitude = |tile: usize, tone: usize| {
        let [x, _] = sums.single(tile, tone, frames).unwrap_or_default();
        x[0].hypot(x[1])
    };
    Ok([0, last].map(|tile| [amplitude(tile, 0), amplitude(tile, 1)]))
}

/// Sums so many rounds of four frames at four tones; lines, and how long that takes, s.
fn counted(width: u16, height: u16, rounds: u32) -> Result<(u32, f64), Box<dyn std::error::Error>> {
    let timing = Timing::new(20_000_000, 100_000, height)?;
    let grid = Grid::new(width, height, TILE_PX)?;
    let mut memory = Memory::new(&grid, COUNTED_HZ.len());
    let (texture, sums) = memory.lend();
    let picture = still(width, height);
    let texture = Texture::build(grid, &picture, 0.0, texture)?;
    let mut sums = TileSums::new(&texture, timing, &COUNTED_HZ, 0, sums)?;
    let pixels: Vec<u8> = picture.iter().map(|&grey| grey as u8).collect();
    let row_of = |row: u16| &pixels[usize::from(row) * usize::from(width)..][..width.into()];
    let began = Instant::now();
    for frame in 0..rounds * 4 {
        for row in 0..height {
            let own = Pixels::U8(row_of(row));
            // The light of the row itself, as the stage wants it of many.
            let light = texture
                .light(row.into(), core::iter::once(own))
                .unwrap_or(1.0);
            let start_ns = i64::from(frame) * 16_666_667 + timing.start_ns(row);
            let pixels = Pixels::U8(row_of(row));
            sums.push(
                &Line {
                    frame,
                    row,
                    start_ns,
                    pixels,
                },
                light,
            );
        }
    }
    Ok((sums.lines(), began.elapsed().as_secs_f64()))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [width, height, rounds] = words.as_slice() {
        let (lines, s) = counted(width.parse()?, height.parse()?, rounds.parse()?)?;
        println!("{lines} lines in {s:.3} s");
        return Ok(());
    }
    let [upper, lower] = edges()?;
    println!("tone         upper edge   lower edge   simulated at both edges");
    for (k, (hz, px)) in TONES.into_iter().enumerate() {
        println!(
            "{hz:7.1} Hz  {:.4} px    {:.4} px    {:.4} px",
            upper[k],
            lower[k],
            0.88 * px
        );
    }
    Ok(())
}
