//! `rowtone verify`: the program scored on recordings whose truth is known.

mod recipe;
mod score;
mod truth;

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use rowtone::report::Report;
use rowtone::tracker::Axes;
use rowtone_clip::{CameraOptions, Feed};
use rowtone_measure::analysis::{Analysis, Event, Plan, Settings};
use rowtone_measure::tracking::Shifts;

use self::score::Score;
use self::truth::Truth;
use crate::output::Out;

/// Options of `rowtone verify`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Each FILE.json in the folder describes one recording:\n\n  \
    {\"clip\": \"fork.mp4\", \"fps\": 250, \"line_time_us\": 8.14, \"exposure_us\": 2000,\n   \
    \"roi\": [290, 70, 50, 340],\n   \
    \"tones\": [{\"hz\": 31.97, \"hz_tolerance\": 0.02,\n              \
    \"amplitude_px\": 1.5, \"amplitude_tolerance\": 0.05}],\n   \
    \"harmonics_allowed\": true, \"nothing_else_above\": 0.03}\n\n\
    \"global_shutter\": true stands in place of the line time; fps, roi (or \"auto\",\n\
    \"full\") and the amplitudes may be left out; tolerances of amplitudes and\n\
    nothing_else_above are shares (of the amplitude; of the largest tone).\n\n\
    A recording is right if every window has every tone, and nothing else above\n\
    that share that is not marked as ambiguous. Of a tone that dies away evenly,\n\
    amplitude_px is that of the first window. Exit status 1 if any is not right.\n\n\
    Examples:\n  rowtone verify recordings\n  rowtone verify --recipe recordings"
)]
pub struct Args {
    /// The folder [with --recipe: here]
    #[arg(required_unless_present = "recipe")]
    folder: Option<PathBuf>,
    /// Says how to make a recording with known tones, and writes the sound for it, tones.wav, into the folder
    #[arg(long)]
    recipe: bool,
}

/// Scores every recording of the folder.
///
/// # Errors
/// [`Failure::Input`] for a folder without descriptions, and where a recording is not right.
pub fn run(args: &Args) -> Result<(), Failure> {
    let folder = args.folder.as_deref().unwrap_or(Path::new("."));
    if args.recipe {
        return recipe::give(folder);
    }
    let stop = crate::stop::on_signals();
    let descriptions = descriptions(folder)?;
    let mut out = Out::default();
    out.line(&score::heading())?;
    let mut wrong = 0;
    for path in &descriptions {
        if stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(Failure::input(
                "interrupted: the recordings after this were not scored",
            ));
        }
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let score = Truth::read(path).and_then(|truth| {
            let reports = measure(folder, &truth)?;
            Ok(Score::of(&reports, &truth))
        });
        match score {
            Ok(score) => {
                wrong += usize::from(!score.is_right());
                out.line(&score.line(&name))?;
            }
            Err(Failure::OutputClosed) => return Err(Failure::OutputClosed),
            Err(failure) => {
                wrong += 1;
                out.line(&format!("{name:<32} {failure}"))?;
            }
        }
    }
    match wrong {
        0 => Ok(()),
        _ => Err(Failure::input(format!(
            "{}: {wrong} of {} recordings are not right",
            folder.display(),
            descriptions.len()
        ))),
    }
}

/// The descriptions in a folder, in the order of their names.
fn descriptions(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed =
        |e: std::io::Error| Failure::input(format!("{}: cannot be read: {e}", folder.display()));
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|ending| ending == "json") {
            found.push(path);
        }
    }
    if found.is_empty() {
        return Err(Failure::input(format!(
            "{}: no .json in it that describes a recording (rowtone verify --help says what it holds)",
            folder.display()
        )));
    }
    found.sort();
    Ok(found)
}

/// The reports on a recording. One in which nothing could be measured has none.
fn measure(folder: &Path, truth: &Truth) -> Result<Vec<Report>, Failure> {
    let clip = folder.join(&truth.clip);
    let options = CameraOptions {
        fps: truth.fps,
        line_time_us: truth.line_time_us,
        global_shutter: truth.global_shutter,
        exposure_us: truth.exposure_us,
        roi: truth.roi()?,
        axes: Axes::Xy,
        ..CameraOptions::of(&clip.display().to_string())
    };
    let feed = Feed::open(&options)?;
    let plan = Plan::new(&feed.camera, &Settings::default())?;
    let shifts = Shifts::start(feed, Some(plan.groups()))?;
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let mut reports = Vec::new();
    // Notes would stand between the lines of the table.
    analysis.run(|event| {
        if let Event::Report(report, _) = event {
            reports.push(report.clone());
        }
        Ok::<(), Failure>(())
    })?;
    Ok(reports)
}
