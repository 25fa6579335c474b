//! `rowtone trend`: what a Raspberry Pi has kept of its machine, as CSV.

use std::path::PathBuf;

use crate::failure::Failure;
use crate::output::Out;
use rowtone_trend::{CSV_HEADING, Tier, read};

/// Options of `rowtone trend`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A line a record, the oldest first; the velocity of a minute or an hour is the root of the mean square of its windows.
Also while rowtone-rpi writes there.

Example:
  rowtone trend /var/lib/rowtone-rpi/trend --of hours")]
pub struct Args {
    /// The folder that `service.trend` names
    folder: PathBuf,
    /// Every window of the last hour, a minute each of the last month, or an hour each of five years
    #[arg(long, value_name = "windows|minutes|hours", default_value = "minutes", value_parser = tier)]
    of: Tier,
}

fn tier(text: &str) -> Result<Tier, String> {
    let found = Tier::ALL.into_iter().find(|tier| tier.name() == text);
    found.ok_or_else(|| "want windows, minutes or hours".to_owned())
}

/// Writes the records to standard output.
///
/// # Errors
/// [`Failure`] of a folder that cannot be read, or when nobody reads standard output any more.
pub fn run(args: &Args) -> Result<(), Failure> {
    let records = read(&args.folder, args.of);
    let named = |e| Failure::input(format!("{}: {e}", args.folder.display()));
    let mut out = Out::default();
    let records = records.map_err(named)?;
    out.line(CSV_HEADING)?;
    records
        .iter()
        .try_for_each(|record| out.line(&record.csv()))
}
