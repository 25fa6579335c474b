//! `rowtone experiments`: the tables, figures and sounds of docs/results, made anew.

use std::path::PathBuf;

use crate::failure::Failure;
use rowtone_lab::experiments::{Folder, Scale, chirp, far, highspeed, phone, tones, voices};
use rowtone_lab::sound::{sounds, table};
use rowtone_measure::restore::Method;

/// Options of `rowtone experiments`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes a table (.md), figures (.svg, .png) and sounds (.wav) of each experiment. Everything takes
some ten minutes and 1 GB of memory, --quick about one minute; --sound-cols 1040 half an hour and
3 GB.

Example:
  rowtone experiments --out results --only tones --quick")]
pub struct Args {
    /// Folder to write to; made where it does not exist
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Only this one; may be given several times [default: all]
    #[arg(long, value_enum)]
    pub only: Vec<Experiment>,
    /// Narrow pictures and short sounds
    #[arg(long)]
    pub quick: bool,
    /// Columns of the single tones' pictures; the thesis's camera had 1040
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(48..=1040))]
    pub cols: Option<u32>,
    /// Columns of ramp, music, speech and phone; 1040 take sixteen times as long as 64
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(48..=1040))]
    pub sound_cols: Option<u32>,
    /// Which recordings of ramp, music, speech and phone: their surface and noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Specks of 0.7 px before a lens that passes 0.25 cycles/px, instead of 2 px and 0.1: tones, ramp, music, speech
    #[arg(long)]
    pub sharp: bool,
    /// Amplitude of the single tones, px
    #[arg(long, value_name = "A", default_value_t = 0.5)]
    pub amplitude_px: f64,
    /// A real high-speed recording (Y4M of 8 bits, motion up and down), to be measured too
    #[arg(long, value_name = "FILE")]
    pub real: Option<PathBuf>,
}

/// The experiments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Experiment {
    /// Gaps in speech, music and a ramp filled, with the sounds.
    Filling,
    /// Single tones in six frames.
    Tones,
    /// A ramp from 100 to 1000 Hz.
    Chirp,
    /// Music and speech.
    Voices,
    /// High-speed video.
    Highspeed,
    /// Far shifts: shearlet against steerable pyramid.
    Far,
    /// A phone with 40 % blank time.
    Phone,
}

/// Runs the experiments and writes what came of them.
///
/// # Errors
/// [`Failure::Usage`] for what cannot be simulated, [`Failure::Input`] where a file cannot be read or written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let folder = Folder::new(&args.out)?;
    let wanted = |e: Experiment| args.only.is_empty() || args.only.contains(&e);
    let mut scale = if args.quick {
        Scale::QUICK
    } else {
        Scale::USUAL
    };
    scale.tone_cols = args.cols.unwrap_or(scale.tone_cols);
    scale.sound_cols = args.sound_cols.unwrap_or(scale.sound_cols);
    (scale.seed, scale.sharp) = (args.seed, args.sharp);
    if wanted(Experiment::Filling) {
        folder.table("filling.md", &table::markdown())?;
        filled_sounds(&folder)?;
    }
    if wanted(Experiment::Far) {
        far::run(&folder)?;
    }
    if wanted(Experiment::Highspeed) {
        highspeed::run(&folder, args.real.as_deref())?;
    }
    if wanted(Experiment::Tones) {
        tones::run(&folder, scale, args.amplitude_px)?;
    }
    if wanted(Experiment::Chirp) {
        chirp::run(&folder, scale)?;
    }
    if wanted(Experiment::Voices) {
        voices::run(&folder, scale)?;
    }
    if wanted(Experiment::Phone) {
        phone::run(&folder, scale)?;
    }
    Ok(())
}

/// Both sounds with 30 % missing, as recovered by every method.
fn filled_sounds(folder: &Folder) -> Result<(), Failure> {
    for (name, sound) in [("speech", sounds::speech()), ("music", sounds::music())] {
        let samples = table::with_gaps(&sound.samples, 0.3);
        for method in Method::ALL {
            let recovered = table::recover(&samples, method);
            let file = format!("filling-{name}-30-{method}.wav");
            folder.wav(&file, &recovered, sounds::RATE_HZ)?;
        }
    }
    Ok(())
}
