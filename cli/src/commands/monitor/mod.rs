//! `rowtone monitor`: what a board says, live in the terminal or as plain lines, and into a log.

mod draw;
mod history;
mod log;
mod plain;
mod screen;
mod signals;
mod view;

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::ValueEnum;

use crate::failure::Failure;
use rowtone_serial::line;
use rowtone_serial::port::PortName;

/// Options of `rowtone monitor`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "On a terminal: q, Esc or Ctrl-C leaves. Behind a tone, 2x says that it is twice the running speed, and ? that \
    it may be another frequency (near a multiple of the frame rate, or weak and not seen before). The trend is that of \
    its amplitude over the last reports.\n\nExample:\n  \
    rowtone monitor /dev/ttyUSB0 --log vibration.csv\n  \
    rowtone analyze clip.mp4 --line-time-us 18.9 --format wire \\\n      | rowtone monitor - --live"
)]
pub struct Args {
    /// A serial port, with its speed if it is not 115200; a file, or `-` for standard input
    #[arg(value_name = "PORT[:BAUD]")]
    port: PortName,
    /// Plain lines in this format; without it, a live view where the output is a terminal
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Append every report to this file, one line each: CSV or JSON Lines by its ending
    #[arg(long, value_name = "FILE.csv|.jsonl")]
    log: Option<PathBuf>,
    /// End when the port goes away, instead of waiting until it is back
    #[arg(long)]
    once: bool,
    /// The live view although the input is standard input; keys are read from the terminal
    #[arg(long, conflicts_with = "format")]
    live: bool,
}

/// What `--once` ends with.
fn went_away(port: &str, reports: u64, why: &str) -> Failure {
    Failure::input(format!("{port}: went away after {reports} reports ({why})"))
}

/// Formats of plain lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// Shows what comes until a file or pipe ends, or the user leaves. A port that goes away is waited
/// for.
///
/// # Errors
/// [`Failure::Input`] when the port cannot be opened at the start, when it goes away and `--once` is
/// given, or when the log cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let log = args.log.as_deref().map(log::Log::open).transpose()?;
    let (events, commands) = line::listen(&args.port)?;
    let is_terminal = std::io::stdout().is_terminal();
    if args.live && !is_terminal {
        return Err(Failure::usage("--live: the output is no terminal"));
    }
    let on_terminal = is_terminal && (args.port.path != "-" || args.live);
    match args.format {
        None if on_terminal => screen::run(&args.port.path, args.once, &events, &commands, log),
        format => {
            let format = format.unwrap_or(Format::Text);
            plain::run(&args.port.path, args.once, format, &events, &commands, log)
        }
    }
}
