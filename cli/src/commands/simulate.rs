//! `rowtone simulate`: a recording of a machine that vibrates as asked, with the truth beside it.

mod forms;
mod modes;
mod options;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

pub use options::Args;

use crate::failure::Failure;
use crate::output::progress::Progress;
use host_sim::{Camera, SimError, Truth, parallel, y4m};
use rowtone_files::WholeFile;

/// Makes the recording.
///
/// # Errors
/// [`Failure::Usage`] when the options contradict each other or ask for an impossible camera,
/// [`Failure::Input`] when a picture or sound cannot be read or an output not be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    check_ending(&args.output)?;
    let camera = Camera::new(args.config()?).map_err(|e| match e {
        SimError::File { .. } => Failure::input(e.to_string()),
        other => Failure::usage(other.to_string()),
    })?;
    let times = times_file(args, &camera);
    if let Some(path) = &times {
        let mut out = create(path)?;
        write_to(
            path,
            y4m::write_times(&mut out, camera.arriving()).and_then(|()| out.finish()),
        )?;
    } else if is_irregular(&camera) {
        eprintln!("rowtone: the frames do not come evenly; add --pts FILE to keep their times");
    }
    if let Some(path) = &args.truth {
        write_truth(path, &camera, times.as_deref())?;
    }
    if args.output == Path::new("-") {
        let mut out = BufWriter::new(io::stdout().lock());
        let name = "standard output";
        write_clip(&mut out, name, &camera)?;
        out.flush().map_err(|e| Failure::writing(name, &e))
    } else {
        let mut out = create(&args.output)?;
        write_clip(&mut out, &args.output.display().to_string(), &camera)?;
        write_to(&args.output, out.finish())
    }
}

/// A clip that is named as another kind of video would be taken for one.
fn check_ending(path: &Path) -> Result<(), Failure> {
    const OTHERS: [&str; 11] = [
        "mp4", "mov", "mkv", "avi", "webm", "mjpeg", "gif", "png", "jpg", "jpeg", "json",
    ];
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !OTHERS
        .iter()
        .any(|other| ending.eq_ignore_ascii_case(other))
    {
        return Ok(());
    }
    let (name, clip) = (path.display(), path.with_extension("y4m"));
    let clip = clip.display();
    Err(Failure::usage(format!(
        "-o {name}: the clip is Y4M: name it {clip} (ffmpeg makes other videos of it)"
    )))
}

/// Where the frame times go: as asked, else beside a clip whose frames do not come evenly.
fn times_file(args: &Args, camera: &Camera) -> Option<PathBuf> {
    let beside = || args.output.with_extension("pts");
    let wanted = is_irregular(camera) && args.output != Path::new("-");
    args.pts.clone().or_else(|| wanted.then(beside))
}

/// Frame number over frame rate does not give the times of the frames in the file.
fn is_irregular(camera: &Camera) -> bool {
    let fps = camera.config().sensor.fps;
    let expected = |k: usize| (k as f64 * 1e9 / fps).round() as i64;
    camera
        .arriving()
        .enumerate()
        .any(|(k, slot)| slot.start_ns.abs_diff(expected(k)) > 1)
}

fn write_truth(path: &Path, camera: &Camera, times: Option<&Path>) -> Result<(), Failure> {
    let mut truth = Truth::new(camera);
    truth.pts = times
        .and_then(Path::file_name)
        .map(|n| n.to_string_lossy().into_owned());
    let mut out = create(path)?;
    let written = serde_json::to_writer_pretty(&mut out, &truth).map_err(io::Error::from);
    write_to(
        path,
        written
            .and_then(|()| writeln!(out))
            .and_then(|()| out.finish()),
    )
}

fn write_clip(out: &mut impl Write, name: &str, camera: &Camera) -> Result<(), Failure> {
    let failed = |e: io::Error| Failure::writing(name, &e);
    let progress = Progress::new(Some(camera.arriving().count() as u64));
    let stop = crate::stop::on_signals();
    y4m::write_header(out, &camera.config().sensor).map_err(failed)?;
    parallel::for_each_frame(camera, parallel::all_threads(), |frame| {
        if stop.load(Ordering::Relaxed) {
            return Err(Failure::input(format!(
                "{name}: interrupted: the clip is not complete"
            )));
        }
        progress.step();
        y4m::write_frame(out, &frame).map_err(failed)
    })
}

fn create(path: &Path) -> Result<WholeFile, Failure> {
    WholeFile::create(path).map_err(|e| Failure::writing(&path.display().to_string(), &e))
}

fn write_to(path: &Path, result: io::Result<()>) -> Result<(), Failure> {
    result.map_err(|e| Failure::writing(&path.display().to_string(), &e))
}
