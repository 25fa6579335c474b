//! `rowtone compare`: every method on the same simulated clip, one table.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;

use rowtone::camera::Timing;

use crate::failure::Failure;
use crate::methods::core::Core;
use crate::methods::study::{Score, record, score};
use crate::methods::{self, Method};
use crate::sim::{Config, Scene, Tone};

/// Options of `rowtone compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  rowtone compare --scene photo --plot compare.svg")]
pub struct Args {
    /// What the camera looks at
    #[arg(long, value_enum, default_value_t = Look::Speckle)]
    pub scene: Look,
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
    #[arg(long, value_name = "N", default_value_t = 24)]
    pub frames: u32,
    /// Same seed, same clip
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Draws noise over bound as bars (SVG)
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
    let scores = scores(args)?;
    if let Some(path) = &args.plot {
        std::fs::write(path, bars(&scores))
            .map_err(|e| Failure::writing(&path.display().to_string(), &e))?;
    }
    io::stdout()
        .write_all(table(args, &scores).as_bytes())
        .map_err(|e| Failure::writing("standard output", &e))
}

fn scores(args: &Args) -> Result<Vec<Score>, Failure> {
    let mut config = Config {
        seed: args.seed,
        frames: args.frames,
        ..Config::default()
    };
    (config.sensor.cols, config.sensor.rows) = args.size;
    // The read-out fills most of the frame, as on real sensors.
    let line_time_ps = (0.72e12 / config.sensor.fps / f64::from(args.size.1)) as u32;
    config.sensor.line_time_ps = line_time_ps.min(config.sensor.line_time_ps);
    config.scene = match args.scene {
        Look::Speckle => Scene::Speckle { grain_px: 2.0 },
        Look::Photo => Scene::Photo { sky: 0.2 },
        Look::Bar => Scene::Bar {
            width_px: f64::from(args.size.0) / 4.0,
        },
    };
    config.motion.tones.push(Tone {
        hz: args.hz,
        amplitude_px: args.amplitude_px,
        phase_rad: 0.3,
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
        .map(|method| {
            eprintln!("rowtone: {}", method.name());
            score(method.as_ref(), &recording, args.hz)
        })
        .collect())
}

fn table(args: &Args, scores: &[Score]) -> String {
    let mut text = format!(
        "{:?}, {}x{}, {} frames at 60 fps, {} Hz, {} px, seed {}\n\n\
         | method | noise / bound | amplitude error | frequency error, Hz | largest ghost | µs a line |\n\
         | --- | --: | --: | --: | --: | --: |\n",
        args.scene, args.size.0, args.size.1, args.frames, args.hz, args.amplitude_px, args.seed
    );
    for s in scores {
        let hz = s
            .hz_error
            .map_or("not found".to_owned(), |e| format!("{e:+.4}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.2} | {:+.1} % | {hz} | {:.2} % | {:.1} |",
            s.method,
            s.noise_over_bound,
            100.0 * s.amplitude_error,
            100.0 * s.ghost,
            s.us_per_line
        );
    }
    text
}

/// Noise over bound on a logarithmic scale, 1 to 100.
fn bars(scores: &[Score]) -> String {
    let height = 30 * scores.len() + 60;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 {height}\" font-family=\"sans-serif\" font-size=\"14\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"10\" y=\"24\">Noise of a row over its Cramér–Rao bound (1 is the best possible)</text>\n"
    );
    for (i, s) in scores.iter().enumerate() {
        let y = 44 + 30 * i;
        let length = 230.0 * s.noise_over_bound.clamp(1.0, 100.0).log10() + 4.0;
        let _ = writeln!(
            svg,
            "<text x=\"220\" y=\"{}\" text-anchor=\"end\">{}</text><rect x=\"230\" y=\"{y}\" width=\"{length:.1}\" height=\"20\" fill=\"#58a\"/><text x=\"{:.1}\" y=\"{}\">{:.2}</text>",
            y + 15,
            s.method,
            236.0 + length,
            y + 15,
            s.noise_over_bound
        );
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("128, 240"), Ok((128, 240)));
        assert!(size("128").is_err() && size("1,1").is_err() && size("128,99999").is_err());
    }

    #[test]
    fn the_table_has_a_line_a_method() {
        let score = Score {
            method: "m",
            noise_over_bound: 1.5,
            amplitude_error: -0.01,
            hz_error: None,
            ghost: 0.001,
            us_per_line: 3.0,
        };
        assert!(bars(std::slice::from_ref(&score)).contains("1.50"));
        let args = Args {
            scene: Look::Bar,
            hz: 83.0,
            amplitude_px: 0.4,
            size: (64, 64),
            frames: 8,
            seed: 1,
            plot: None,
        };
        assert!(
            table(&args, &[score]).contains("| m | 1.50 | -1.0 % | not found | 0.10 % | 3.0 |")
        );
    }
}
