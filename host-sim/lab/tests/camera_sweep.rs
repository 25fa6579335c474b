//! What whole recordings come to, on a smaller grid than `rowtone sweep cameras` prints, kept as it is.
//!
//! A changed digit is a changed line engine or estimator: look at it with the full table, then keep the new one. The
//! digits are few, so that another machine's rounding does not show.

use rowtone_lab::spectrum_scenes::cameras;
use rowtone_lab::spectrum_scenes::table::camera_kinds;

#[test]
fn the_small_table_is_as_it_was() {
    let mut table = String::new();
    for kind in camera_kinds() {
        let score = cameras::score(&kind.ranges, 11, 5).expect("recordings that can be analysed");
        let [hz, amplitude, ..] = score.errors();
        table += &format!(
            "{:<26} {:>3} of {:>3} tones, {} false, errors {hz:.1} {amplitude:.1} of the bound\n",
            kind.name, score.found, score.tones, score.false_peaks
        );
    }
    assert_eq!(table, include_str!("camera_sweep.txt"), "now:\n{table}");
}
