//! `rowtone experiments`: the tables of docs/results.md, made anew.

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::restore::{Method, sounds, table};
use crate::{calibrate, methods};

/// Options of `rowtone experiments`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  rowtone experiments --out results --only filling")]
pub struct Args {
    /// Folder to write to; made where it does not exist
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Only this one [default: all]
    #[arg(long, value_enum)]
    pub only: Option<Experiment>,
    /// Columns of the thesis's picture in the tone sweep (it had 1040; the narrower the quicker)
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(64..=1040))]
    pub cols: u32,
    /// Amplitude of the tones, px
    #[arg(long, value_name = "A", default_value_t = 0.5)]
    pub amplitude_px: f64,
    /// Recordings a condition in the calibration study
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
}

/// The experiments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Experiment {
    /// Gaps in speech and music filled, with the sounds as WAV.
    Filling,
    /// The thesis's single tones.
    Tones,
    /// Calibrations of simulated cameras.
    Calibration,
}

/// Runs the experiments and writes a Markdown table each.
///
/// # Errors
/// [`Failure::Usage`] for what cannot be simulated, [`Failure::Input`] where a file cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let place = |path: &Path, e: &std::io::Error| Failure::writing(&path.display().to_string(), e);
    std::fs::create_dir_all(&args.out).map_err(|e| place(&args.out, &e))?;
    let wanted = |e: Experiment| args.only.is_none_or(|only| only == e);
    let write = |name: &str, text: &str| {
        let path = args.out.join(name);
        std::fs::write(&path, text).map_err(|e| place(&path, &e))?;
        println!("{text}");
        Ok(())
    };
    let simulated = |e: crate::sim::SimError| Failure::usage(e.to_string());
    if wanted(Experiment::Filling) {
        write("filling.md", &table::markdown())?;
        filled_sounds(&args.out)?;
    }
    if wanted(Experiment::Calibration) {
        write(
            "calibration.md",
            &calibrate::study::markdown(args.seeds).map_err(simulated)?,
        )?;
    }
    if wanted(Experiment::Tones) {
        write(
            "tones.md",
            &methods::sweep::markdown(args.amplitude_px, args.cols).map_err(simulated)?,
        )?;
    }
    Ok(())
}

/// Both sounds with 30 % missing, as recovered by every method.
fn filled_sounds(out: &Path) -> Result<(), Failure> {
    for (name, sound) in [("speech", sounds::speech()), ("music", sounds::music())] {
        wav(&out.join(format!("{name}.wav")), &sound.samples)?;
        let samples = table::with_gaps(&sound.samples, 0.3);
        for method in Method::ALL {
            wav(
                &out.join(format!("{name}-30-{method}.wav")),
                &table::recover(&samples, method),
            )?;
        }
    }
    Ok(())
}

fn wav(path: &Path, samples: &[f64]) -> Result<(), Failure> {
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: sounds::RATE_HZ as u32,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let write = || -> Result<(), hound::Error> {
        let mut writer = hound::WavWriter::create(path, spec)?;
        for value in samples {
            writer.write_sample((value.clamp(-1.0, 1.0) * 32_000.0) as i16)?;
        }
        writer.finalize()
    };
    write().map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
}
