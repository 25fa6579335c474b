//! `rowtone sweep`: the project's own figures, measured anew from a seed.

use std::io::Write;

use crate::failure::Failure;
use crate::output::Out;
use host_sim::Scene;
use rowtone_lab::alarm_scenes;
use rowtone_lab::calibrations;
use rowtone_lab::line_scenes::{case, region, slips, table as line_table};
use rowtone_lab::machine_scenes::{case as machine_case, score as machine_score};
use rowtone_lab::shape_scenes::case::{Case, KINDS};
use rowtone_lab::shape_scenes::score as shape_score;
use rowtone_lab::spectrum_scenes::score::Score;
use rowtone_lab::spectrum_scenes::{broadband, cameras, days, few, noise, table};

/// Options of `rowtone sweep`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  rowtone sweep spectrum --scenes 300 --seed 1")]
pub struct Args {
    /// What is measured
    #[command(subcommand)]
    what: What,
}

/// What can be measured.
#[derive(Debug, clap::Subcommand)]
enum What {
    /// Random displacement samples with known tones: what is found, what is not there, errors over their bounds
    Spectrum(Spectrum),
    /// Whole simulated recordings with known tones, from the pictures to the report: the same table
    Cameras(Cameras),
    /// Noise that is not white and tones that are not steady: what is called a tone, and what is found
    Noise(Noise),
    /// Broad-band velocity, displacement, acceleration, crest factor and kurtosis against the truth of each window
    Broadband(Broadband),
    /// The thesis's test: tones of 75 to 325 Hz in a handful of frames at 120 fps, with their bounds
    FewFrames(FewFrames),
    /// Days of samples at 50 000 lines a second through one analyzer: drift, growth, wrapped counters
    Days(Days),
    /// Days of reports of noisy machines through the alarms: what is raised without a cause, how soon a step is found
    Alarms(Alarms),
    /// Simulated cameras calibrated: what is right, refused or wrong, and errors over their stated deviations
    Calibration(Calibration),
    /// Simulated recordings through the line engine: noise over the bound, amplitude, what it invents
    Lines(Lines),
    /// Parts that vibrate in known shapes: how near `rowtone shapes` is to the truth, and to its own deviations
    Shapes(ShapesOptions),
    /// Machines that bend, turn and move in parts: tones, images at f ± k·fps, amplitudes
    Machines(Machines),
    /// Cameras with faults before a rigid tone: what each costs
    Faults(Machines),
    /// What `--roi auto` chooses where all of the picture vibrates, or a part of it
    Region(Region),
    /// How often stripes are read at the wrong stripe where they move by 8 px peak to peak
    Stripes(Stripes),
}

/// Options of `rowtone sweep stripes`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Recordings of 0.4 s whose amplitude is off by more than 1 %, for each distance of the stripes and each frequency.

Example:
  rowtone sweep stripes --recordings 10")]
struct Stripes {
    /// Recordings at each frequency, of different phase
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    recordings: u64,
    /// Which series of recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Options of `rowtone sweep shapes`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
560x320 px in tiles of 16, 60 fps, 48 us a row, 0.2 ms exposed. Columns: modal assurance criterion against the
true shape, both axes together, mean and least over the recordings; measured size over the true one, least and
largest; rms of errors over stated deviations; tiles that stand still, and how many of them are drawn; tiles that
move by more than ten deviations and are not drawn; median deviation of a tile.

Example:
  rowtone sweep shapes --seeds 2 --only travelling")]
struct ShapesOptions {
    /// Recordings of each shape
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// The first recording's number
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of a recording, s
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    seconds: f64,
    /// Only shapes with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Frequencies, Hz
    #[arg(
        long,
        value_name = "F,F",
        value_delimiter = ',',
        default_value = "131.7,1017"
    )]
    hz: Vec<f64>,
    /// Largest amplitudes, px
    #[arg(
        long,
        value_name = "PX,PX",
        value_delimiter = ',',
        default_value = "0.05,0.01"
    )]
    px: Vec<f64>,
    /// A picture like a photograph in place of speckle
    #[arg(long)]
    photo: bool,
}

/// Options of `rowtone sweep machines` and `rowtone sweep faults`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
192x240 px at 60 fps, 48 us a row, 0.2 ms exposed, 2 s each, tones of 40 to 420 Hz. Columns: windows; tones in them,
those found and sure, those found and ambiguous; rms of the frequency's error over its stated deviation; rms and
largest error of the amplitude at its largest row; the largest sure peak at f + k*fps against its tone; windows with
another sure peak; all words of warning.

Example:
  rowtone sweep machines --seeds 3 --only cantilever")]
struct Machines {
    /// Recordings of each kind
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// The first recording's number
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only kinds with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Options of `rowtone sweep region`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Every preset and scene at full size, 30 frames. Columns: share of the width and of the rows that is chosen; share of
the tone's amplitude that would be measured in the whole picture, and in what is chosen; how far the tone stands out
of the noise there, against the whole picture, and how far it could in exactly what vibrates.

Example:
  rowtone sweep region --only 'ov5647 speckle'")]
struct Region {
    /// Only recordings with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Which series of recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Options of `rowtone sweep calibration`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: recordings in which all that was told is right (within 4 stated standard deviations), in which
nothing was told, and in which something was wrong; rms of the line time's relative error and of its stated
deviation; rms of error over stated deviation of each figure that was told, which should be 1, with the range
that so many recordings leave open (95 %); the first reason of each kind.

Example:
  rowtone sweep calibration --seeds 40 --only frame")]
struct Calibration {
    /// Recordings of each condition
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// The first recording's number
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only conditions with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Options of `rowtone sweep lines`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: noise of a row over its Cramér–Rao bound (median over rows); error of the amplitude; largest peak
that is no tone against the largest tone; tones found; what is left of the camera's shake; lines without
texture; lines flagged as disturbed; how often the reference was learned anew.

Example:
  rowtone sweep lines --quick")]
struct Lines {
    /// A part of each picture, and fewer frames
    #[arg(long)]
    quick: bool,
    /// Only recordings with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// As a microcontroller does it: everything beside a line in steps of so many columns
    #[arg(long, value_name = "COLUMNS")]
    in_steps_of: Option<u16>,
    /// Which series of recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Options of `rowtone sweep spectrum`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: tones found; scenes with a peak that is no tone; such peaks a multiple of the frame rate from a tone;
rms error of frequency and amplitude over their Cramér–Rao bounds, and over their stated deviations.

Example:
  rowtone sweep spectrum --scenes 300 --seed 1")]
struct Spectrum {
    /// Scenes of each kind
    #[arg(long, default_value_t = 300)]
    scenes: u64,
    /// Which series of scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Also lists the scenes in which a tone was missed, invented or more than 4 bounds off
    #[arg(long)]
    failures: bool,
}

/// Options of `rowtone sweep broadband`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Random cameras (blank time to 40 %, lost frames, jitter, exposure) that see tones, random vibration or both, along
one axis or two. Columns: windows; those whose stated deviation is 3 % or less; those of which only a limit is told;
those whose truth is above the limit that is told; of the sharp ones mean and rms error; rms of error over
stated deviation of all; the largest error of all windows of a scene together, where all of them are sharp.

Example:
  rowtone sweep broadband --scenes 50 --windows 10")]
struct Broadband {
    /// Scenes of each kind
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..))]
    scenes: u64,
    /// Windows of each scene
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    windows: u32,
    /// Which series of scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Options of `rowtone sweep noise`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Random cameras (25-200 fps, 1-45 % blank time, lost frames, 50 us jitter), 0.015 px a sample. Columns: windows;
those with a sure peak that is no tone; those in which the tone is found, and in which nothing else is; rms and
largest error of its frequency; rms errors of frequency and amplitude over their stated deviations.

Example:
  rowtone sweep noise --windows 200 --only '90-110 Hz'")]
struct Noise {
    /// Windows of each kind
    #[arg(long, default_value_t = 200)]
    windows: u64,
    /// Which series of windows
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only kinds with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Also lists the windows in which a tone was missed or invented
    #[arg(long)]
    failures: bool,
}

/// Options of `rowtone sweep cameras`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Every recording is of another sensor, frame rate, blank time, exposure, picture and noise, and is analysed as
`rowtone analyze` does. Columns as of `rowtone sweep spectrum`; bounds are those of the pictures' own noise.

Example:
  rowtone sweep cameras --scenes 50 --seed 1")]
struct Cameras {
    /// Recordings of each kind
    #[arg(long, default_value_t = 50)]
    scenes: u64,
    /// Which series of recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Also lists the recordings in which a tone was missed, invented or more than 4 bounds off
    #[arg(long)]
    failures: bool,
}

/// Options of `rowtone sweep few-frames`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: frames; amplitude; tone; share of its energy that the rows' unknown offsets leave; Cramér-Rao bound of
its frequency, and with a slow drift unknown as well; largest error; peaks that are no tone.

Example:
  rowtone sweep few-frames --scenes 3")]
struct FewFrames {
    /// Recordings of each tone
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    scenes: u64,
    /// Which series of recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Columns of the picture: the thesis had 1040
    #[arg(long, value_name = "N", default_value_t = 1040, value_parser = clap::value_parser!(u32).range(64..=1040))]
    cols: u32,
}

/// Options of `rowtone sweep days`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: day; windows reported (1 s each, every 5 s); those without the tone; peaks that are no tone; mean and
standard deviation of the frequency's error; mean error of the amplitude; largest error of a report's time;
memory of this process.

Example:
  rowtone sweep days --days 10")]
struct Days {
    /// Days to simulate: each is 1.7 hundred million samples
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    days: u32,
    /// Which series of noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Options of `rowtone sweep alarms`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Reports of a second, every half second, of machines whose velocity scatters; a warning learned at 12 % or three spreads
above the usual, a trip at 20 % or five. Columns: spread of the windows; windows without a cause, and the warnings and
trips in them; steps of 25 % that raise the warning within 10 windows; windows that it takes: mean of these, and most
(200: not found).

Example:
  rowtone sweep alarms --days 10 --steps 1000")]
struct Alarms {
    /// Days without a cause
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    days: u64,
    /// Steps of each machine
    #[arg(long, default_value_t = 1000)]
    steps: u32,
    /// Which series of reports
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs the sweep.
///
/// # Errors
/// [`Failure::OutputClosed`] when nobody reads standard output any more.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Spectrum(options) => spectrum(options),
        What::Cameras(options) => camera_scenes(options),
        What::Noise(options) => noises(options),
        What::Broadband(options) => broad_bands(options),
        What::FewFrames(options) => few_frames(options),
        What::Days(options) => many_days(options),
        What::Alarms(options) => alarms(options),
        What::Calibration(options) => calibration(options),
        What::Lines(options) => lines(options),
        What::Shapes(options) => shapes(options),
        What::Machines(options) => machines(&machine_case::MACHINES, options),
        What::Faults(options) => machines(&machine_case::FAULTS, options),
        What::Region(options) => regions(options),
        What::Stripes(options) => stripes(options),
    }
}

fn alarms(options: &Alarms) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&alarm_scenes::head())?;
    let windows = options.days * alarm_scenes::WINDOWS_A_DAY;
    for kind in alarm_scenes::KINDS {
        let score = alarm_scenes::score(kind, windows, options.steps, options.seed);
        out.line(&alarm_scenes::row(kind, &score))?;
    }
    Ok(())
}

fn calibration(options: &Calibration) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let failed = |error| Failure::writing("standard output", &error);
    writeln!(out, "{}", calibrations::HEAD).map_err(failed)?;
    for condition in calibrations::condition::all() {
        if condition.name.contains(&options.only) {
            let row = calibrations::row(&condition, options.seed, options.seeds)
                .map_err(|error| Failure::usage(error.to_string()))?;
            writeln!(out, "{row}").map_err(failed)?;
        }
    }
    Ok(())
}

fn lines(options: &Lines) -> Result<(), Failure> {
    let (rows, frames) = if options.quick { (32, 12) } else { (96, 40) };
    let mut cases = case::small_motion(options.seed, rows, frames);
    cases.extend(case::hard(options.seed));
    cases.extend(case::long_exposure(options.seed));
    cases.push(case::shaking(options.seed));
    let mut out = std::io::stdout().lock();
    let failed = |error| Failure::writing("standard output", &error);
    writeln!(out, "{}", line_table::head()).map_err(failed)?;
    for mut case in cases {
        if !case.name.contains(&options.only) {
            continue;
        }
        case.columns_per_line = options.in_steps_of;
        writeln!(out, "{}", line_table::row(&case)).map_err(failed)?;
    }
    Ok(())
}

fn regions(options: &Region) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&region::head())?;
    for case in region::cases(options.seed) {
        if case.name.contains(&options.only) {
            out.line(&region::row(&case))?;
        }
    }
    Ok(())
}

fn shapes(options: &ShapesOptions) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&shape_score::head())?;
    let scene = if options.photo {
        Scene::Photo { sky: 0.0 }
    } else {
        Scene::Speckle { grain_px: 2.0 }
    };
    for kind in KINDS {
        if !kind.name().contains(&options.only) {
            continue;
        }
        for &hz in &options.hz {
            for &px in &options.px {
                let seeds = options.seed..options.seed + options.seeds;
                let score = |seed| {
                    let case = Case::new(kind, hz, px, scene.clone(), options.seconds, seed);
                    shape_score::score(&case)
                };
                let scores = seeds.map(score).collect::<Result<Vec<_>, _>>()?;
                out.line(&shape_score::row(kind.name(), hz, px, &scores))?;
            }
        }
    }
    Ok(())
}

fn machines(kinds: &[machine_case::Kind], options: &Machines) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&machine_score::head())?;
    for kind in kinds {
        if !kind.name.contains(&options.only) {
            continue;
        }
        let mut score = machine_score::Score::default();
        for seed in options.seed..options.seed + options.seeds {
            score.add(kind.name, &kind.draw(seed))?;
        }
        out.line(&machine_score::row(kind.name, &score))?;
    }
    Ok(())
}

fn stripes(options: &Stripes) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&slips::head())?;
    for period_px in slips::PERIODS_PX {
        out.line(&slips::row(period_px, options.seed, options.recordings))?;
    }
    Ok(())
}

fn spectrum(options: &Spectrum) -> Result<(), Failure> {
    heading()?;
    for kind in table::kinds() {
        let score = Score::of(&kind.ranges, options.seed, options.scenes);
        row(kind.name, &score, options.failures)?;
    }
    Ok(())
}

fn broad_bands(options: &Broadband) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&broadband::head())?;
    for kind in broadband::Kind::ALL {
        let scores = broadband::scores(kind, options.seed, options.scenes, options.windows);
        for (measure, score) in scores.iter().enumerate() {
            out.line(&broadband::row(kind, measure, score))?;
        }
    }
    Ok(())
}

fn noises(options: &Noise) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&noise::head())?;
    for kind in noise::kinds() {
        if kind.name.contains(&options.only) {
            let outcome = noise::Outcome::of(&kind, options.seed, options.windows);
            out.line(&noise::row(&kind, &outcome))?;
            for failure in outcome.failures.iter().filter(|_| options.failures) {
                out.line(&format!("    {failure}"))?;
            }
        }
    }
    Ok(())
}

fn camera_scenes(options: &Cameras) -> Result<(), Failure> {
    heading()?;
    for kind in table::camera_kinds() {
        let score = cameras::score(&kind.ranges, options.seed, options.scenes)?;
        row(kind.name, &score, options.failures)?;
    }
    Ok(())
}

fn few_frames(options: &FewFrames) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&few::head())?;
    for frames in [5, 6] {
        for px in [0.5, 0.05] {
            for row in few::rows_of(frames, px, options.cols, options.seed, options.scenes)? {
                out.line(&few::line(frames, px, &row))?;
            }
        }
    }
    Ok(())
}

fn many_days(options: &Days) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&days::head())?;
    let (mut number, mut outcome) = (0, Ok(()));
    days::run(options.days, options.seed, |day| {
        number += 1;
        if outcome.is_ok() {
            outcome = out.line(&days::line(number, day));
        }
    });
    outcome
}

fn heading() -> Result<(), Failure> {
    Out::default().line(&table::head())
}

fn row(name: &str, score: &Score, failures: bool) -> Result<(), Failure> {
    let mut out = Out::default();
    out.line(&table::row(name, score))?;
    for failure in score.failures.iter().filter(|_| failures) {
        out.line(&format!("    {failure}"))?;
    }
    Ok(())
}
