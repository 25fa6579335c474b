//! The option that names the rules of alarms.

use std::path::PathBuf;

use crate::failure::Failure;
use rowtone::report::Report;
use rowtone_report::alarms::{Book, Said};

/// Which alarms are judged.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct AlarmArgs {
    /// Judges each report by the alarms of this file (docs/alarms.md): adds their state, and what has changed
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) alarms: Option<PathBuf>,
}

impl AlarmArgs {
    /// The rules, before anything has been seen.
    ///
    /// # Errors
    /// [`Failure::Input`] for a file that cannot be read or used.
    pub(crate) fn book(&self) -> Result<Option<Book>, Failure> {
        let book = self.alarms.as_deref().map(Book::read).transpose();
        book.map_err(|e| Failure::input(e.to_string()))
    }
}

/// What the alarms say of the next report, where there are some.
pub(crate) fn judge(book: &mut Option<Book>, report: &Report) -> Option<Said> {
    Some(book.as_mut()?.window(report))
}

/// A report's JSON object with what the alarms say of it, where they do.
pub(crate) fn added(said: Option<&Said>, object: String) -> String {
    match said {
        Some(said) => said.added_to(object),
        None => object,
    }
}
