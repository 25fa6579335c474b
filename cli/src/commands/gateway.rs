//! `rowtone gateway`: the reports of many boards to an MQTT broker.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::failure::Failure;
use rowtone_gateway::{Config, GatewayError, Totals, run as run_gateway};

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
    /// Only check the configuration, the files and devices it names, and say whether it is right
    #[arg(long)]
    check: bool,
    /// Stop after this time and say what was counted
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
}

/// Runs until it is stopped by a signal. Being killed costs nothing either: whatever the broker has not
/// acknowledged lies on disk.
///
/// # Errors
/// [`Failure::Input`] when the configuration is wrong or the spool cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = Config::read(&args.config).map_err(refused)?;
    if args.check {
        rowtone_gateway::check(&config, &args.config).map_err(refused)?;
        let boards = config.boards.len();
        let plural = if boards == 1 { "" } else { "s" };
        println!("{}: right, {boards} board{plural}", args.config.display());
        return Ok(());
    }
    if let Some(why) = rowtone_gateway::open_secret(&config, &args.config) {
        eprintln!("rowtone: {why}");
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
    } = run_gateway(&config, seconds, &stopped_by_signal()).map_err(refused)?;
    println!(
        "heard {heard}, acknowledged {acknowledged}, lost on the lines {lost}, bad frames {bad}, \
         dropped from the spool {dropped}, waiting {waiting}"
    );
    Ok(())
}

fn refused(error: GatewayError) -> Failure {
    Failure::input(error.to_string())
}

/// Set once the program is asked to end.
fn stopped_by_signal() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        // Where it cannot be caught it ends the program at once, as a kill does.
        let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
    }
    stop
}
