//! Operating deflection shapes: amplitude and phase of each tone in every tile of the picture.
//!
//! [`measure`] reads a recording three times: once to find its tones, as `rowtone analyze` does ([`tones`]); once for its
//! mean picture, against which everything is measured (`mean`); and once for the sums of the tiles
//! ([`rowtone::shape`]), kept in some blocks of time (`blocks`). All tones, and what wanders slowly, are then fitted together
//! in each tile; the blocks tell the frequencies better than a window does, and the noise beside each tone (`fit`).

mod blocks;
mod correct;
mod error;
mod fit;
mod mean;
mod pass;
mod readings;
pub mod tones;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use num_complex::Complex64;
use rowtone::shape::Grid;
use serde::Serialize;

use rowtone_clip::{CameraOptions, Feed, Rect};

pub use self::error::{Alike, Hidden, RecordingError, ShapesError};

use self::mean::Mean;
use self::readings::Readings;
use self::tones::{Findings, Found, Tones};

/// What is wanted of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Frequencies, Hz; none for those that are found.
    pub hz: Vec<f64>,
    /// Side of a tile, px.
    pub tile_px: u16,
    /// Window in which tones are looked for, s.
    pub window_s: f64,
    /// Most tones where none are given.
    pub most: usize,
    /// The tones that are there, the largest first, where they are known already: they are not looked for then.
    pub known: Option<Vec<Found>>,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            hz: Vec::new(),
            tile_px: 16,
            window_s: 1.0,
            most: 8,
            known: None,
        }
    }
}

/// The shape of one tone. Lists hold one entry a tile, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Frequency, Hz.
    pub hz: f64,
    /// Amplitude along x, px: the motion is Re X·e^(2πift), exposure undone, phase against the largest tile. `None` outside the
    /// part and where the texture cannot tell.
    pub x: Vec<Option<Complex64>>,
    /// The same along y, downwards.
    pub y: Vec<Option<Complex64>>,
    /// Standard deviation of a real or imaginary part of `x`, px.
    pub x_sd: Vec<Option<f64>>,
    /// The same of `y`.
    pub y_sd: Vec<Option<f64>>,
    /// The tile surely moves: by chance one in a thousand pictures has a tile that says so and stands still.
    pub moves: Vec<bool>,
}

impl Shape {
    /// Standard deviation of a tile's real or imaginary parts, the root mean square of the axes that are known, px.
    pub fn sd(&self, tile: usize) -> Option<f64> {
        let known = |sd: &[Option<f64>]| sd.get(tile).copied().flatten();
        match (known(&self.x_sd), known(&self.y_sd)) {
            (Some(x), Some(y)) => Some((0.5 * (x * x + y * y)).sqrt()),
            (x, y) => x.or(y),
        }
    }

    /// The larger semi-axis of a tile's orbit, px; 0 where nothing is known.
    pub fn amplitude_px(&self, tile: usize) -> f64 {
        let known =
            |all: &[Option<Complex64>]| all.get(tile).copied().flatten().unwrap_or_default();
        semi_major(known(&self.x), known(&self.y))
    }
}

/// The larger semi-axis of the orbit Re (x, y)·e^(iωt).
pub fn semi_major(x: Complex64, y: Complex64) -> f64 {
    let sum = x.norm_sqr() + y.norm_sqr();
    let squares = (x * x + y * y).norm();
    (0.5 * (sum + squares)).sqrt()
}

/// The shapes of a recording.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// Frame rate, Hz.
    pub fps: f64,
    /// How the turned picture is cut.
    pub grid: Grid,
    /// One shape a tone: in the order asked for, or the largest first.
    pub shapes: Vec<Shape>,
    /// The mean picture, grey values row by row.
    pub mean: Vec<f32>,
    /// Bits of a pixel.
    pub bits: u8,
    /// The part that was measured.
    pub part: Rect,
    /// Frames used.
    pub frames: u32,
    /// What the user should know, a line each.
    pub notes: Vec<String>,
}

/// A shape as programs read it: lists hold one entry a tile, row by row, `None` where nothing is known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// Frequency, Hz.
    pub hz: f64,
    /// Side of a tile, px.
    pub tile: usize,
    /// Tiles side by side.
    pub cols: usize,
    /// Tiles one above the other.
    pub rows: usize,
    /// Real and imaginary part of X along x, px: the motion is Re X·e^(2πift), phase against the largest tile.
    pub x: Vec<Option<[f64; 2]>>,
    /// The same along y, downwards.
    pub y: Vec<Option<[f64; 2]>>,
    /// Standard deviation of a real or imaginary part, the root mean square of both axes, px.
    pub sd: Vec<Option<f64>>,
    /// The same of `x`.
    pub x_sd: Vec<Option<f64>>,
    /// The same of `y`.
    pub y_sd: Vec<Option<f64>>,
    /// Tiles that surely move.
    pub moves: Vec<bool>,
    /// µm a px, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub um_per_px: Option<f64>,
}

impl Shapes {
    /// All shapes as programs read them, px to a ten-millionth.
    pub fn objects(&self, um_per_px: Option<f64>) -> Vec<Object> {
        let digits = |px: f64| (px * 1e7).round() / 1e7;
        let pairs = |all: &[Option<Complex64>]| {
            let pair = |v: &Option<Complex64>| v.map(|v| [digits(v.re), digits(v.im)]);
            all.iter().map(pair).collect()
        };
        let rounded = |all: &[Option<f64>]| all.iter().map(|v| v.map(digits)).collect();
        let object = |shape: &Shape| Object {
            hz: shape.hz,
            tile: self.grid.tile_px(),
            cols: self.grid.columns(),
            rows: self.grid.rows(),
            x: pairs(&shape.x),
            y: pairs(&shape.y),
            sd: (0..shape.moves.len())
                .map(|tile| shape.sd(tile).map(digits))
                .collect(),
            x_sd: rounded(&shape.x_sd),
            y_sd: rounded(&shape.y_sd),
            moves: shape.moves.clone(),
            um_per_px,
        };
        self.shapes.iter().map(object).collect()
    }
}

/// Measures the shapes of a recording. Once `stop` is set no more of it is read than has been: the shapes are those of its
/// first frames, and a note says so. `step` is called for every frame that is read, three times for each, with how many
/// there will be where that is known.
///
/// # Errors
/// [`ShapesError`] for frequencies that cannot be told, for standard input, which cannot be read again, and where nothing
/// vibrates or nothing can be measured.
pub fn measure(
    options: &CameraOptions,
    wanted: &Wanted,
    stop: &Arc<AtomicBool>,
    step: impl FnMut(Option<u64>),
) -> Result<Shapes, ShapesError> {
    if options.is_pipe() {
        return Err(ShapesError::Pipe);
    }
    measure_until(|| Ok(Feed::open(options)?), wanted, stop, step)
}

/// As [`measure`], of a recording that `open` opens anew for each reading.
///
/// # Errors
/// As [`measure`].
pub fn measure_from(
    open: impl Fn() -> Result<Feed, ShapesError>,
    wanted: &Wanted,
    step: impl FnMut(Option<u64>),
) -> Result<Shapes, ShapesError> {
    measure_until(open, wanted, &Arc::default(), step)
}

fn measure_until(
    open: impl Fn() -> Result<Feed, ShapesError>,
    wanted: &Wanted,
    stop: &Arc<AtomicBool>,
    step: impl FnMut(Option<u64>),
) -> Result<Shapes, ShapesError> {
    let feed = open()?;
    let (name, camera) = (feed.name.clone(), feed.camera.clone());
    let (width, height) = camera.size;
    let grid = Grid::new(width as u16, height as u16, wanted.tile_px).map_err(ShapesError::Grid)?;
    let looked_for = wanted.known.is_none();
    let mut readings = Readings::new(stop, feed.frames, 2 + u64::from(looked_for), step);
    let found = match &wanted.known {
        Some(tones) => Findings::known(tones.clone(), feed.notes),
        None => {
            let feed = readings.begin(feed);
            let found = tones::find(feed, wanted, &mut || readings.frame())?;
            readings.end();
            found
        }
    };
    let mean = Mean::read(&mut readings.begin(open()?), &mut readings)?;
    readings.end();
    let mut tones = Tones::choose(&name, wanted, found, &camera, mean.seconds())?;
    tones.notes.extend(readings.note(mean.seconds()));
    // Not more than the mean picture was made of is read again, and all of that, whatever comes: little time.
    let mut run = |hz: &[f64]| pass::run(&mut open()?, &mean, grid, hz, &mut || readings.frame());
    let mut sums = run(&tones.hz())?;
    // A frequency that was far off is set right and read again.
    if let Some(better) = fit::refined(&sums, &tones, &camera) {
        tones.set(&better);
        if fit::is_far(&sums, &tones) {
            sums = run(&tones.hz())?;
            if let Some(better) = fit::refined(&sums, &tones, &camera) {
                tones.set(&better);
            }
        }
    }
    let shapes = fit::shapes(&name, &sums, &tones, &camera)?;
    Ok(Shapes {
        fps: camera.fps,
        grid,
        shapes,
        bits: camera.bits,
        part: camera.part.unwrap_or(Rect::whole(width, height)),
        frames: sums.blocks.frames(),
        notes: tones.notes,
        mean: mean.pixels,
    })
}
