//! The spectrum's table of figures, on a smaller grid than `rowtone sweep spectrum` prints, kept as it is.
//!
//! A changed digit is a changed estimator: look at it with the full table, then keep the new one. The digits are
//! few, so that another machine's rounding does not show.

use rowtone_lab::spectrum_scenes::score::Score;
use rowtone_lab::spectrum_scenes::table::kinds;

#[test]
fn the_small_table_is_as_it_was() {
    let mut table = String::new();
    for kind in kinds() {
        let score = Score::of(&kind.ranges, 11, 4);
        let [hz, amplitude, ..] = score.errors();
        table += &format!(
            "{:<26} {:>3} of {:>3} tones, {} false, errors {hz:.1} {amplitude:.1} of the bound\n",
            kind.name, score.found, score.tones, score.false_peaks
        );
    }
    assert_eq!(table, include_str!("spectrum_sweep.txt"), "now:\n{table}");
}
