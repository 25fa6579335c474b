//! `rowtone shapes`: what vibrates where.

mod json;
mod npz;
mod unv;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use num_complex::Complex64;

use crate::camera_args::CameraArgs;
use crate::failure::Failure;
use crate::output::Out;
use crate::output::progress::Progress;
use rowtone_files::WholeFile;
use rowtone_measure::shapes::{self, Shape, Shapes, Wanted};
use rowtone_plot::{Animation, Panel, Plate};

/// Options of `rowtone shapes`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    rowtone shapes clip.mp4 --line-time-us 18.9 --exposure-us 500 -o shape.png\n  \
    rowtone shapes clip.y4m --line-time-us 18.9 --hz 131.7,1017 --format json\n  \
    rowtone shapes clip.y4m --line-time-us 18.9 --hz 131.7 -o swings.gif\n\n\
    A picture is cut into tiles, and each tile tells its own amplitude and phase, far beyond half the\n\
    frame rate: its rows are exposed one after the other. JSON: a list with one object a tone, whose\n\
    lists x, y and sd hold one entry a tile, row by row, px; motion is Re (re + i*im)*e^(2 pi i f t),\n\
    exposure undone, phase against the largest tile. null: outside --roi, or too little texture.\n\n\
    Files: .png and .svg show all tones side by side; .gif and .y4m a mesh that swings, slowed and\n\
    enlarged; .npz is for NumPy, .unv (UFF 15, 55, 58, 82, 151, 164) for modal analysis.\n\n\
    The recording is read three times, so it must be a file. What --roi leaves to the program (auto)\n\
    is where tones are looked for; tiles cover the whole picture. Two tones whose sum or difference is\n\
    a multiple of the frame rate cannot be told apart, and are refused. Ctrl-C and SIGTERM end the\n\
    reading: the shapes are those of what was read until then; a second one ends the program.")]
pub struct Args {
    #[command(flatten)]
    camera: CameraArgs,
    /// Frequencies, Hz [default: those that `rowtone analyze` finds]
    #[arg(long, value_name = "F,F,...", value_delimiter = ',', value_parser = super::window::hertz)]
    hz: Vec<f64>,
    /// Side of a tile, px
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u16).range(4..=256))]
    tile: u16,
    /// Most tones, where none are given
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u8).range(1..=8))]
    max_peaks: u8,
    /// Format on standard output
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// Writes the shapes to a file, by its ending
    #[arg(short, long, value_name = "FILE.png|.svg|.gif|.y4m|.json|.npz|.unv")]
    output: Option<PathBuf>,
}

/// Formats on standard output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// Files that shapes are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Json,
    Npz,
    Unv,
    Picture,
    Gif,
    Y4m,
}

impl Kind {
    /// By the ending of a file's name.
    fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("json") => Ok(Self::Json),
            Some("npz") => Ok(Self::Npz),
            Some("unv") => Ok(Self::Unv),
            Some("gif") => Ok(Self::Gif),
            Some("y4m") => Ok(Self::Y4m),
            Some("png" | "svg") => Ok(Self::Picture),
            _ => Err(Failure::usage(format!(
                "-o {}: its ending says what is written: .png, .svg, .gif, .y4m, .json, \
                 .npz or .unv",
                path.display()
            ))),
        }
    }
}

/// Measures the shapes and writes them.
///
/// # Errors
/// [`Failure`] as every command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let kind = args.output.as_deref().map(Kind::of).transpose()?;
    if let Some(path) = &args.output {
        Failure::unless_writable(path)?;
    }
    if args.hz.len() > 8 {
        return Err(Failure::usage("--hz: at most 8 frequencies at a time"));
    }
    let wanted = Wanted {
        hz: args.hz.clone(),
        tile_px: args.tile,
        most: args.max_peaks.into(),
        ..Wanted::default()
    };
    let stop = crate::stop::on_signals();
    let progress = Progress::new(None);
    let options = args.camera.options();
    let shapes = shapes::measure(&options, &wanted, &stop, |frames| progress.step_of(frames))?;
    for note in &shapes.notes {
        progress.note(&format!("{}: {note}", options.name()));
    }
    drop(progress);
    if let (Some(kind), Some(path)) = (kind, &args.output) {
        save(kind, path, &shapes, args)?;
    }
    let mut out = Out::default();
    match args.format {
        Format::Json => out.line(json::text(&shapes, args.camera.um_per_px()).trim_end()),
        Format::Text => shapes
            .shapes
            .iter()
            .try_for_each(|shape| out.line(&sentence(shape, &shapes))),
    }
}

fn save(kind: Kind, path: &Path, shapes: &Shapes, args: &Args) -> Result<(), Failure> {
    let um_per_px = args.camera.um_per_px();
    let failed = |why: &dyn std::fmt::Display| {
        Failure::input(format!("{}: cannot be drawn: {why}", path.display()))
    };
    let mut bytes = Vec::new();
    let memory = |e| Failure::writing(&path.display().to_string(), &e);
    match kind {
        Kind::Picture => return Ok(rowtone_plot::write(path, &plate(shapes))?),
        Kind::Json => bytes = json::text(shapes, um_per_px).into_bytes(),
        Kind::Npz => npz::write(&mut bytes, shapes, um_per_px).map_err(memory)?,
        Kind::Unv => {
            let name = args.camera.options().name().to_owned();
            unv::write(&mut bytes, shapes, &name, um_per_px).map_err(memory)?;
        }
        Kind::Gif | Kind::Y4m => {
            let plate = plate(shapes);
            let animation = Animation::new(&plate).map_err(|e| failed(&e))?;
            bytes = match kind {
                Kind::Gif => rowtone_plot::gif(&animation).map_err(|e| failed(&e))?,
                _ => rowtone_plot::y4m(&animation),
            };
        }
    }
    write(path, &bytes)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let written = WholeFile::create(path).and_then(|mut file| {
        file.write_all(bytes)?;
        file.finish()
    });
    written.map_err(|e| Failure::writing(&path.display().to_string(), &e))
}

/// All shapes side by side; tiles that do not surely move are left out.
fn plate(shapes: &Shapes) -> Plate<'_> {
    let panel = |shape: &Shape| {
        let tile = |tile: usize| {
            let pair = |all: &[Option<Complex64>]| {
                let px = all[tile].unwrap_or_default();
                [px.re, px.im]
            };
            shape.moves[tile].then(|| [pair(&shape.x), pair(&shape.y)])
        };
        Panel {
            title: sentence(shape, shapes).trim_start().to_owned(),
            hz: shape.hz,
            tiles: (0..shape.moves.len()).map(tile).collect(),
        }
    };
    Plate {
        picture: &shapes.mean,
        size: (shapes.grid.width(), shapes.grid.height()),
        tile_px: shapes.grid.tile_px(),
        panels: shapes.shapes.iter().map(panel).collect(),
    }
}

/// What a person is told of a shape.
fn sentence(shape: &Shape, shapes: &Shapes) -> String {
    let moving = (0..shape.moves.len()).filter(|&tile| shape.moves[tile]);
    let (known, count) = (
        (0..shape.moves.len())
            .filter(|&tile| shape.sd(tile).is_some())
            .count(),
        moving.clone().count(),
    );
    let amplitude = |tile: &usize| shape.amplitude_px(*tile);
    let largest = moving.max_by(|a, b| amplitude(a).total_cmp(&amplitude(b)));
    let Some(tile) = largest else {
        return format!("{:9.3} Hz  none of {known} tiles moves", shape.hz);
    };
    let (column, row) = (tile % shapes.grid.columns(), tile / shapes.grid.columns());
    let side = shapes.grid.tile_px();
    format!(
        "{:9.3} Hz  {:.4} ± {:.4} px at {},{},{side},{side}; {count} of {known} tiles move",
        shape.hz,
        amplitude(&tile),
        shape.sd(tile).unwrap_or(0.0),
        column * side,
        row * side,
    )
}
