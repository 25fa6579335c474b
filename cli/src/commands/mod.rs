//! The commands, one file each.
//!
//! A command is a file `commands/<name>.rs` with `#[derive(clap::Args)] pub struct Args` and
//! `pub fn run(args: &Args) -> Result<(), Failure>`, and one variant of `Command`. Results go to
//! standard output; everything else (progress, warnings, the one line of a [`Failure`]) goes to
//! standard error.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::failure::Failure;

pub mod analyze;
pub mod calibrate;
#[cfg(feature = "lab")]
pub mod compare;
pub mod demo;
pub mod displacement;
#[cfg(feature = "lab")]
pub mod experiments;
#[cfg(feature = "gateway")]
pub mod gateway;
#[cfg(any(test, not(all(feature = "gateway", feature = "lab"))))]
mod missing;
pub mod monitor;
pub mod serve;
pub mod shapes;
pub mod simulate;
#[cfg(feature = "lab")]
pub mod sweep;
pub mod trend;
pub mod verify;
pub mod window;

/// Measures vibration with a rolling-shutter camera: every row of a frame is a sample in time.
#[derive(Debug, Parser)]
#[command(name = "rowtone", version)]
#[command(after_help = "Without a command, `rowtone` runs `rowtone demo`.")]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

/// What `rowtone` can do.
#[derive(Debug, Subcommand)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one, for as long as the program runs"
)]
enum Command {
    /// A simulated camera looks at a simulated machine; its peaks appear beside the truth
    Demo(demo::Args),
    /// Says what vibrates, window by window
    Analyze(analyze::Args),
    /// Writes the motion over time as CSV, NPY or WAV
    Displacement(displacement::Args),
    /// What a Raspberry Pi has kept of its machine's last hour, month and years, as CSV
    Trend(trend::Args),
    /// Shows what vibrates where: amplitude and phase of each tone over the picture
    Shapes(shapes::Args),
    /// Decodes what a board sends over a serial port
    Monitor(monitor::Args),
    /// Shows a recording, a live pipe or a board in the browser
    Serve(serve::Args),
    /// Sends the reports of many boards to an MQTT broker
    #[cfg(feature = "gateway")]
    Gateway(gateway::Args),
    /// Sends the reports of many boards to an MQTT broker (needs `--features gateway`)
    #[cfg(not(feature = "gateway"))]
    Gateway(missing::Args),
    /// Writes a simulated clip, with the truth beside it
    Simulate(simulate::Args),
    /// Line time, read-out, blank time and exposure of a camera, from a flashing light
    Calibrate(calibrate::Args),
    /// Scores the program on recordings whose truth is known
    Verify(verify::Args),
    /// Measures the project's own figures anew, from a seed
    #[cfg(feature = "lab")]
    Sweep(sweep::Args),
    /// Runs every method on the same simulated clip and prints one table
    #[cfg(feature = "lab")]
    Compare(compare::Args),
    /// Makes the tables and sounds of docs/results.md anew
    #[cfg(feature = "lab")]
    Experiments(experiments::Args),
    /// Measures the project's own figures anew, from a seed (needs `--features lab`)
    #[cfg(not(feature = "lab"))]
    Sweep(missing::Args),
    /// Runs every method on the same simulated clip and prints one table (needs `--features lab`)
    #[cfg(not(feature = "lab"))]
    Compare(missing::Args),
    /// Makes the tables and sounds of docs/results.md anew (needs `--features lab`)
    #[cfg(not(feature = "lab"))]
    Experiments(missing::Args),
}

fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Demo(args) => demo::run(args),
        Command::Analyze(args) => analyze::run(args),
        Command::Displacement(args) => displacement::run(args),
        Command::Trend(args) => trend::run(args),
        Command::Shapes(args) => shapes::run(args),
        Command::Monitor(args) => monitor::run(args),
        Command::Serve(args) => serve::run(args),
        #[cfg(feature = "gateway")]
        Command::Gateway(args) => gateway::run(args),
        #[cfg(not(feature = "gateway"))]
        Command::Gateway(args) => missing::run(args, "gateway", "gateway"),
        Command::Simulate(args) => simulate::run(args),
        Command::Calibrate(args) => calibrate::run(args),
        Command::Verify(args) => verify::run(args),
        #[cfg(feature = "lab")]
        Command::Sweep(args) => sweep::run(args),
        #[cfg(feature = "lab")]
        Command::Compare(args) => compare::run(args),
        #[cfg(feature = "lab")]
        Command::Experiments(args) => experiments::run(args),
        #[cfg(not(feature = "lab"))]
        Command::Sweep(args) => missing::run(args, "sweep", "lab"),
        #[cfg(not(feature = "lab"))]
        Command::Compare(args) => missing::run(args, "compare", "lab"),
        #[cfg(not(feature = "lab"))]
        Command::Experiments(args) => missing::run(args, "experiments", "lab"),
    }
}

/// The whole program: parses `args` (the program's name first), runs the command, prints the one
/// line of a failure, and says what to exit with.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return answer(&error),
    };
    crate::stop::outlive_large_files();
    let command = cli.command.unwrap_or(Command::Demo(demo::Args::default()));
    match run(&command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => report(&failure),
    }
}

/// Prints why the command stopped.
fn report(failure: &Failure) -> ExitCode {
    if *failure != Failure::OutputClosed {
        eprintln!("rowtone: {failure}");
    }
    ExitCode::from(failure.status())
}

/// What the parser of the command line has to say: help and version on standard output, an error as
/// one line.
fn answer(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // A closed pipe (`rowtone --help | head -1`) is no error.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    report(&Failure::usage(one_line(&error.to_string())))
}

/// clap's message without its usage paragraph: what it says, its tips, and how to go on.
fn one_line(text: &str) -> String {
    let what = text.split("\n\nUsage:").next().unwrap_or(text);
    let what = what.strip_prefix("error: ").unwrap_or(what);
    let what = what
        .split("\n\nFor more information")
        .next()
        .unwrap_or(what);
    let mut parts: Vec<&str> = what.split("tip: ").map(str::trim).collect();
    let hint = recording(what)
        .map(|name| format!("to measure a recording: rowtone analyze {name} --line-time-us T"));
    parts.push(hint.as_deref().unwrap_or("try --help"));
    parts.join("; ")
}

/// The name of the file that stands where a command should.
fn recording(what: &str) -> Option<&str> {
    let name = what
        .strip_prefix("unrecognized subcommand '")?
        .split('\'')
        .next()?;
    (name.contains(['.', '/']) || std::path::Path::new(name).exists()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn a_recording_without_a_command_is_told_which() {
        let text = "error: unrecognized subcommand 'phone.mp4'\n\nUsage: rowtone [COMMAND]\n";
        assert_eq!(
            one_line(text),
            "unrecognized subcommand 'phone.mp4'; \
             to measure a recording: rowtone analyze phone.mp4 --line-time-us T"
        );
    }

    #[test]
    fn a_tip_of_the_parser_is_told_apart_from_what_it_is_about() {
        let text = "error: unrecognized subcommand 'analyse'\n\n  tip: a similar subcommand exists: \
                    'analyze'\n\nUsage: rowtone [COMMAND]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            one_line(text),
            "unrecognized subcommand 'analyse'; a similar subcommand exists: 'analyze'; try --help"
        );
    }
}
