//! `rowtone gateway`: the reports of many boards to an MQTT broker.

use std::path::PathBuf;
use std::time::Duration;

use rowtone_failure::Failure;
use rowtone_gateway::{Config, Totals, run as run_gateway};

/// Options of `rowtone gateway`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "docs/gateway.md explains every key of the configuration.\n\nExample:\n  \
    rowtone gateway --config gateway.toml"
)]
pub struct Args {
    /// What to read and where to send it, as TOML
    #[arg(long, value_name = "FILE.toml")]
    config: PathBuf,
    /// Only read the configuration and say whether it is right
    #[arg(long)]
    check: bool,
    /// Stop after this time and say what was counted
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
}

/// Runs until it is killed, which costs nothing: whatever the broker has not acknowledged lies on
/// disk.
///
/// # Errors
/// [`Failure::Input`] when the configuration is wrong or the spool cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = Config::read(&args.config)?;
    if args.check {
        println!(
            "{}: right, {} boards",
            args.config.display(),
            config.boards.len()
        );
        return Ok(());
    }
    let seconds = args.seconds.map(Duration::try_from_secs_f64).transpose();
    let seconds = seconds.map_err(|_| Failure::usage("--seconds: give a time from 0 on"))?;
    let Totals {
        heard,
        acknowledged,
        lost,
        bad,
        dropped,
        waiting,
    } = run_gateway(&config, seconds)?;
    println!(
        "heard {heard}, acknowledged {acknowledged}, lost on the lines {lost}, bad frames {bad}, \
         dropped from the spool {dropped}, waiting {waiting}"
    );
    Ok(())
}
