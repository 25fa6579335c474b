//! `rowtone compare`: every method on the same simulated clips, one table.

use std::io::{self, Write};
use std::path::PathBuf;

use rowtone::camera::Timing;

use crate::failure::Failure;
use host_sim::{Config, Scene, Tone};
use rowtone_lab::methods::core::Core;
use rowtone_lab::methods::study::{Score, record, score};
use rowtone_lab::methods::summary::{self, Summary};
use rowtone_lab::methods::{self, Method};

/// Options of `rowtone compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Columns: noise of a row over its own Cramér–Rao bound, after the tone's gain is fitted (median over
the seeds; least to largest); error of the amplitude (median; the worst); error of the frequency,
searched within 5 Hz; the largest peak at ±1 to ±3 times the frame rate from the tone, over the
tone (median); wall time of a line on one thread (least).

Example:
  rowtone compare --scene photo --seeds 3 --plot compare.svg")]
pub struct Args {
    /// What the camera looks at; may be given several times [default: all]
    #[arg(long, value_enum)]
    pub scene: Vec<Look>,
    /// The tone, Hz
    #[arg(long, value_name = "F", default_value_t = 83.0)]
    pub hz: f64,
    /// Its amplitude, zero to peak, px
    #[arg(long, value_name = "A", default_value_t = 0.4)]
    pub amplitude_px: f64,
    /// Columns and rows
    #[arg(long, value_name = "W,H", default_value = "128,240", value_parser = size)]
    pub size: (u32, u32),
    /// Frames, at 60 a second
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub frames: u32,
    /// Recordings of each scene
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// The first recording's seed: same seed, same clips
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Draws noise over bound (.svg or .png)
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
}

/// Scenes to compare on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Look {
    /// Random specks.
    Speckle,
    /// Detail at every size, and sky.
    Photo,
    /// One bright bar.
    Bar,
}

impl Look {
    const ALL: [Self; 3] = [Self::Speckle, Self::Photo, Self::Bar];

    fn name(self) -> &'static str {
        match self {
            Self::Speckle => "speckle",
            Self::Photo => "photograph",
            Self::Bar => "bar",
        }
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once(',')
        .and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
    parsed
        .filter(|(w, h)| (48..=2048).contains(w) && (16..=2048).contains(h))
        .ok_or_else(|| "want W,H: 48 to 2048 columns, 16 to 2048 rows".to_owned())
}

/// Runs all methods and prints the table (Markdown).
///
/// # Errors
/// [`Failure::Usage`] for a clip that cannot be simulated.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.plot {
        rowtone_plot::check_ending(path)?;
    }
    let looks = if args.scene.is_empty() {
        &Look::ALL[..]
    } else {
        &args.scene
    };
    let mut scenes = Vec::new();
    for look in looks {
        // By method, then by seed.
        let mut all: Vec<Vec<Score>> = Vec::new();
        for seed in args.seed..args.seed.saturating_add(args.seeds) {
            eprintln!("rowtone: {}, seed {seed}", look.name());
            for (i, score) in scores(args, *look, seed)?.into_iter().enumerate() {
                match all.get_mut(i) {
                    Some(scores) => scores.push(score),
                    None => all.push(vec![score]),
                }
            }
        }
        let summaries = all.iter().filter_map(|s| Summary::of(s)).collect();
        scenes.push((look.name().to_owned(), summaries));
    }
    if let Some(path) = &args.plot {
        rowtone_plot::write(path, &summary::figure(&scenes))?;
    }
    let title = format!(
        "{}x{}, {} frames at 60 fps, {} Hz, {} px, seeds {} to {}\n\n",
        args.size.0,
        args.size.1,
        args.frames,
        args.hz,
        args.amplitude_px,
        args.seed,
        args.seed.saturating_add(args.seeds - 1)
    );
    io::stdout()
        .write_all((title + &summary::markdown(&scenes)).as_bytes())
        .map_err(|e| Failure::writing("standard output", &e))
}

/// Every method on one clip.
fn scores(args: &Args, look: Look, seed: u64) -> Result<Vec<Score>, Failure> {
    let mut config = Config {
        seed,
        frames: args.frames,
        ..Config::default()
    };
    (config.sensor.cols, config.sensor.rows) = args.size;
    // The read-out fills most of the frame, as on real sensors.
    let line_time_ps = (0.72e12 / config.sensor.fps / f64::from(args.size.1)) as u32;
    config.sensor.line_time_ps = line_time_ps.min(config.sensor.line_time_ps);
    config.scene = match look {
        Look::Speckle => Scene::Speckle { grain_px: 2.0 },
        Look::Photo => Scene::Photo { sky: 0.2 },
        Look::Bar => Scene::Bar {
            width_px: f64::from(args.size.0) / 4.0,
        },
    };
    config.motion.tones.push(Tone {
        hz: args.hz,
        amplitude_px: args.amplitude_px,
        // Another one for each seed.
        phase_rad: 0.3 + 2.4 * (seed - args.seed) as f64,
    });
    let (bits, fps) = (config.sensor.bits, config.sensor.fps);
    let timing = Timing::new(
        config.sensor.line_time_ps,
        config.sensor.exposure_ns,
        args.size.1 as u16,
    )
    .map_err(|e| Failure::usage(e.to_string()))?;
    let recording = record(config).map_err(|e| Failure::usage(e.to_string()))?;
    let core = Core {
        timing,
        frame_ns: (1e9 / fps).round() as i64,
        bits,
    };
    let mut all: Vec<Box<dyn Method>> = vec![Box::new(core)];
    all.extend(methods::all());
    Ok(all
        .iter()
        .map(|method| score(method.as_ref(), &recording, args.hz))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("128, 240"), Ok((128, 240)));
        assert!(size("128").is_err() && size("1,1").is_err() && size("128,99999").is_err());
    }

    /// The whole command's work on one small clip: every method has its line, ours is at the bound, and the tone
    /// is found by all that are known to find it.
    #[test]
    fn every_method_has_a_score() {
        let args = Args {
            scene: Vec::new(),
            hz: 83.0,
            amplitude_px: 0.4,
            size: (64, 64),
            frames: 8,
            seeds: 1,
            seed: 1,
            plot: None,
        };
        let scores = scores(&args, Look::Speckle, 1).unwrap();
        let names: Vec<&str> = scores.iter().map(|s| s.method).collect();
        assert_eq!(names.len(), 15, "{names:?}");
        for name in [
            "rowtone",
            "Visual Microphone",
            "subset correlation",
            "template tracking (NCC)",
            "Lucas-Kanade",
            "Horn-Schunck",
        ] {
            let score = scores.iter().find(|s| s.method == name).unwrap();
            assert!(score.hz_error.is_some_and(|e| e.abs() < 0.5), "{score:?}");
        }
        // A reference of eight frames has noise of its own.
        assert!(scores[0].noise_over_bound < 1.5, "{:?}", scores[0]);
    }
}
