//! The table of the line engine's figures.

use super::case::Case;
use super::measure::{Figures, measure};

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:<36} {:>6} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "recording", "n/crb", "ampl.%", "inv.%", "tones", "shake%", "blank%", "dist.%", "anew"
    )
}

/// A row of the table; where a case cannot be measured, why.
pub fn row(case: &Case) -> String {
    match measure(case) {
        Ok(figures) => of(&case.name, &figures),
        Err(error) => format!("{:<36} {error}", case.name),
    }
}

fn of(name: &str, f: &Figures) -> String {
    let percent =
        |share: Option<f64>| share.map_or("-".to_owned(), |v| format!("{:.2}", 100.0 * v));
    let tones = f
        .found
        .map_or("-".to_owned(), |(n, of)| format!("{n}/{of}"));
    format!(
        "{name:<36} {:>6.2} {:>7.2} {:>7} {tones:>6} {:>6} {:>6.1} {:>6.1} {:>6}",
        f.to_bound,
        100.0 * f.amplitude_error,
        percent(f.invented),
        percent(f.shake_left),
        100.0 * f.no_texture,
        100.0 * f.disturbed,
        f.relearned,
    )
}
