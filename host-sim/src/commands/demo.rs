//! `rowtone demo`: the whole chain on a simulated camera, its peaks beside the truth.

use crate::failure::Failure;

/// Options of `rowtone demo`.
#[derive(Debug, Default, clap::Args)]
#[command(after_help = "Example:\n  rowtone demo")]
pub struct Args {}

/// Runs the demo.
///
/// # Errors
/// [`Failure::OutputClosed`] when nobody reads standard output any more.
pub fn run(_args: &Args) -> Result<(), Failure> {
    Err(Failure::input(
        "demo: the line engine is not in this build yet",
    ))
}
