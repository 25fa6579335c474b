//! A picture whose tiles move in their own way, beyond half the frame rate.

extern crate std;

use std::vec;
use std::vec::Vec;

use super::*;
use crate::camera::{Line, Pixels, Timing};

const WIDTH: usize = 72;
const HEIGHT: usize = 56;
const TILE: u16 = 16;
const FPS: f64 = 60.0;
const LINE_S: f64 = 100e-6;
const EXPOSURE_S: f64 = 200e-6;

/// Grey values of a texture that is known between its pixels too.
fn grey(x: f64, y: f64) -> f64 {
    let waves: [(f64, f64, f64); 6] = [
        (0.9, 0.2, 0.3),
        (-0.4, 0.8, 1.1),
        (0.6, -0.7, 2.0),
        (1.2, 0.5, 0.2),
        (0.3, 1.1, 0.9),
        (0.15, 0.1, 1.7),
    ];
    let sum: f64 = waves
        .iter()
        .map(|(kx, ky, p)| (kx * x + ky * y + p).sin())
        .sum();
    120.0 + 14.0 * sum
}

/// Memory of a texture, as a desktop has it.
struct Memory {
    right: Vec<i8>,
    down: Vec<i8>,
    rest: Vec<[f32; 2]>,
    brightness: Vec<f32>,
    tiles: Vec<TileTexture>,
}

impl Memory {
    fn new(grid: &Grid) -> Self {
        Self {
            right: vec![0; grid.covered()],
            down: vec![0; grid.covered()],
            rest: vec![[0.0; 2]; grid.segments()],
            brightness: vec![0.0; grid.covered_rows()],
            tiles: vec![TileTexture::default(); grid.tiles()],
        }
    }

    fn lend(&mut self) -> TextureStorage<'_> {
        TextureStorage {
            right: &mut self.right,
            down: &mut self.down,
            rest: &mut self.rest,
            brightness: &mut self.brightness,
            tiles: &mut self.tiles,
        }
    }
}

fn grid() -> Grid {
    Grid::new(WIDTH as u16, HEIGHT as u16, TILE).expect("some tiles")
}

fn timing() -> Timing {
    Timing::new(
        (LINE_S * 1e12) as u32,
        (EXPOSURE_S * 1e9) as u32,
        HEIGHT as u16,
    )
    .expect("rows")
}

fn still() -> Vec<f32> {
    let all = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    all.map(|(x, y)| grey(x as f64, y as f64) as f32).collect()
}

/// Runs `frames` frames of 12-bit pixels through sums at `hz`; `motion` is where the picture is at a place and time, px, and
/// `light` how bright a frame is.
fn run(
    sums: &mut TileSums<'_>,
    frames: u32,
    motion: impl Fn(f64, f64, f64) -> [f64; 2],
    light: impl Fn(u32) -> f64,
) {
    for frame in 0..frames {
        let start_ns = (f64::from(frame) * 1e9 / FPS) as i64;
        for y in 0..HEIGHT {
            let start_ns = start_ns + timing().start_ns(y as u16);
            let middle_s = start_ns as f64 * 1e-9 + EXPOSURE_S / 2.0;
            let pixels: Vec<u16> = (0..WIDTH)
                .map(|x| {
                    let (x, y) = (x as f64, y as f64);
                    let [u, v] = motion(x, y, middle_s);
                    (16.0 * light(frame) * grey(x - u, y - v)).round() as u16
                })
                .collect();
            let line = Line {
                frame,
                row: y as u16,
                start_ns,
                pixels: Pixels::U16(&pixels),
            };
            sums.push(&line, light(frame) as f32);
        }
    }
}

/// Sums of one tone of `hz`; what each tile did comes back, and the lines summed and rejected.
fn measured(
    hz: f64,
    motion: impl Fn(f64, f64, f64) -> [f64; 2],
    light: impl Fn(u32) -> f64,
) -> (Vec<[[f32; 2]; 2]>, u32, u32) {
    let grid = grid();
    let mut memory = Memory::new(&grid);
    // The pixels are 16 times those of `still`.
    let mean: Vec<f32> = still().iter().map(|grey| 16.0 * grey).collect();
    let texture = Texture::build(grid, &mean, 0.0, memory.lend()).expect("a texture");
    let mut sums = vec![ToneSums::default(); grid.tiles()];
    let mut products = vec![[0.0; 2]; grid.columns()];
    let storage = SumsStorage {
        sums: &mut sums,
        products: &mut products,
    };
    let mut sums = TileSums::new(&texture, timing(), &[hz], 0, storage).expect("sums");
    let frames = 60;
    run(&mut sums, frames, motion, light);
    let tiles = (0..grid.tiles()).map(|tile| sums.single(tile, 0, frames).expect("texture"));
    (tiles.collect(), sums.lines(), sums.rejected())
}

/// Middle of a tile's known pixels.
fn middle(tile: usize) -> [f64; 2] {
    let (column, row) = (tile % grid().columns(), tile / grid().columns());
    let middle = |at: usize, all: usize| {
        let from = (at * 16).max(Texture::EDGE_PX);
        let to = (at * 16 + 16).min(all - Texture::EDGE_PX);
        (from + to - 1) as f64 / 2.0
    };
    [middle(column, WIDTH), middle(row, HEIGHT)]
}

#[test]
fn every_tile_tells_its_own_motion_far_above_half_the_frame_rate() {
    for hz in [17.0, 131.0, 1017.0] {
        let turn = |t: f64| core::f64::consts::TAU * hz * t;
        // Along x a travelling wave, along y a seesaw.
        let (tiles, lines, rejected) = measured(
            hz,
            |x, _, t| {
                [
                    0.05 * (turn(t) - 0.005 * x).cos(),
                    0.0008 * (x - 36.0) * turn(t).sin(),
                ]
            },
            |_| 1.0,
        );
        assert_eq!((lines, rejected), (60 * 48, 0));
        for (tile, [x, y]) in tiles.iter().enumerate() {
            let [at, _] = middle(tile);
            let phase = -0.005 * at;
            let truth = [
                [0.05 * phase.cos(), 0.05 * phase.sin()],
                [0.0, -0.0008 * (at - 36.0)],
            ];
            for (found, truth) in [x, y].into_iter().zip(truth) {
                for (found, truth) in found.iter().zip(truth) {
                    let error = f64::from(*found) - truth;
                    assert!(error.abs() < 0.0015, "{hz} Hz, tile {tile}: {x:?}, {y:?}");
                }
            }
        }
    }
}

#[test]
fn light_that_flickers_is_no_motion() {
    let hz = 131.0;
    let flicker =
        |frame: u32| 1.0 + 0.3 * (core::f64::consts::TAU * 11.0 * f64::from(frame) / FPS).sin();
    let (tiles, ..) = measured(hz, |_, _, _| [0.0, 0.0], flicker);
    for (tile, motion) in tiles.iter().enumerate() {
        let most = motion.iter().flatten().fold(0.0f32, |a, b| a.max(b.abs()));
        assert!(most < 1e-3, "tile {tile}: {motion:?}");
    }
}

#[test]
fn a_dark_frame_is_rejected_and_what_is_out_of_place_does_no_harm() {
    let dark = |frame: u32| if frame == 3 { 0.05 } else { 1.0 };
    let (_, lines, rejected) = measured(131.0, |_, _, _| [0.0, 0.0], dark);
    assert_eq!((lines, rejected), (59 * 48, 48));
    let grid = grid();
    let mut memory = Memory::new(&grid);
    let texture = Texture::build(grid, &still(), 0.0, memory.lend()).expect("a texture");
    let mut sums = vec![ToneSums::default(); grid.tiles()];
    let mut products = vec![[0.0; 2]; grid.columns()];
    let storage = SumsStorage {
        sums: &mut sums,
        products: &mut products,
    };
    let mut sums = TileSums::new(&texture, timing(), &[1.0], 0, storage).expect("sums");
    for (row, width) in [(0, 3), (0, 0), (60_000, WIDTH), (55, WIDTH), (1, WIDTH)] {
        let line = Line {
            frame: 0,
            row,
            start_ns: i64::MAX,
            pixels: Pixels::U8(&[100; WIDTH][..width]),
        };
        sums.push(&line, 1.0);
    }
    assert_eq!((sums.lines(), sums.rejected()), (1, 2));
    assert_eq!(sums.single(grid.tiles(), 0, 1), None);
}

#[test]
fn light_is_the_mean_over_rows() {
    let grid = grid();
    let mut memory = Memory::new(&grid);
    let texture = Texture::build(grid, &still(), 0.0, memory.lend()).expect("a texture");
    let rows: Vec<Vec<u16>> = still()
        .chunks(WIDTH)
        .map(|row| row.iter().map(|grey| (2.5 * grey).round() as u16).collect())
        .collect();
    let pixels = || rows.iter().map(|row| Pixels::U16(row));
    let light = texture.light(3, pixels().skip(3).take(20)).expect("rows");
    assert!((light - 2.5).abs() < 1e-3, "{light}");
    assert_eq!(texture.light(48, pixels().skip(48)), None);
    assert_eq!(texture.light(0, [Pixels::U8(&[1, 2])].into_iter()), None);
}

#[test]
fn a_plain_picture_and_one_of_stripes_tell_nothing_of_what_they_cannot() {
    let grid = grid();
    let mut memory = Memory::new(&grid);
    let plain = vec![100.0; WIDTH * HEIGHT];
    let texture = Texture::build(grid, &plain, 0.01, memory.lend()).expect("a texture");
    assert!(
        texture
            .tiles()
            .iter()
            .all(|tile| tile.solve([1.0, 1.0]).is_none())
    );
    let stripes: Vec<f32> = (0..WIDTH * HEIGHT)
        .map(|at| 100.0 + 40.0 * ((at % WIDTH) as f32 * 0.7).sin())
        .collect();
    let texture = Texture::build(grid, &stripes, 0.0, memory.lend()).expect("a texture");
    for tile in texture.tiles() {
        assert!(
            tile.response[0][0] > 1e3 && tile.response[1][1] < 1.0,
            "{tile:?}"
        );
        assert_eq!(tile.solve([1.0, 1.0]), None);
    }
}

#[test]
fn buffers_of_another_size_and_too_many_tones_are_refused() {
    assert_eq!(Grid::new(100, 100, 3), Err(GridError::Tile(3)));
    let error = Grid::new(100, 15, 16).expect_err("too low");
    assert!(std::format!("{error}").contains("100x15"));
    let grid = grid();
    let mut memory = Memory::new(&grid);
    memory.down.pop();
    let error = Texture::build(grid, &still(), 0.0, memory.lend()).expect_err("too short");
    assert_eq!((error.buffer, error.have + 1), ("down", error.need));
    memory.down.push(0);
    let texture = Texture::build(grid, &still(), 0.0, memory.lend()).expect("a texture");
    let mut sums = vec![ToneSums::default(); grid.tiles() * 25];
    let mut products = vec![[0.0; 2]; grid.columns()];
    let mut refuse = |tones: usize, columns: usize| {
        let storage = SumsStorage {
            sums: &mut sums,
            products: &mut products[..columns],
        };
        TileSums::new(&texture, timing(), &[1.0; 25][..tones], 0, storage).expect_err("refused")
    };
    assert_eq!(refuse(25, 4), SumsError::Tones(25));
    assert!(matches!(refuse(24, 4), SumsError::Sums { .. }));
    sums.truncate(grid.tiles());
    let storage = SumsStorage {
        sums: &mut sums,
        products: &mut products[..1],
    };
    let error = TileSums::new(&texture, timing(), &[1.0], 0, storage).expect_err("refused");
    assert_eq!(error, SumsError::Products { have: 1, need: 4 });
}
