//! Errors of the libraries as the one line and the exit status that end a command.

use rowtone_failure::Failure;
use rowtone_plot::PlotError;
use rowtone_serial::SerialError;

/// A picture of `--plot` that cannot be drawn or written.
pub(crate) fn plot(error: PlotError) -> Failure {
    match &error {
        PlotError::Ending(_) => Failure::usage(format!("--plot {error}")),
        PlotError::Write { path, why } => Failure::writing(&path.display().to_string(), why),
        PlotError::Draw { .. } => Failure::input(error.to_string()),
    }
}

/// A serial line that cannot be used.
pub(crate) fn serial(error: SerialError) -> Failure {
    match &error {
        SerialError::Settings(_) => Failure::usage(format!("--serial: {error}")),
        _ => Failure::input(error.to_string()),
    }
}
