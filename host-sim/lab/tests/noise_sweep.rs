//! What noise and changing tones come to, on fewer windows than `rowtone sweep noise` draws, kept as it is.
//!
//! A changed digit is a changed estimator: look at it with the full table, then keep the new one.

use rowtone_lab::spectrum_scenes::noise::{Outcome, kinds};

#[test]
fn the_small_table_is_as_it_was() {
    let mut table = String::new();
    for kind in kinds() {
        let outcome = Outcome::of(&kind, 11, 3);
        table += &format!(
            "{:<28} {} windows, {} with a false tone, found in {}\n",
            kind.name, outcome.windows, outcome.with_false, outcome.found
        );
    }
    assert_eq!(table, include_str!("noise_sweep.txt"), "now:\n{table}");
}
