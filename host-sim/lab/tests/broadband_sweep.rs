//! A few windows of `rowtone sweep broadband`, kept as they are.
//!
//! A changed digit is a changed estimator: look at it with the full table, then keep the new one.

use rowtone_lab::spectrum_scenes::broadband::{Kind, head, row, scores};

#[test]
fn the_small_table_is_as_it_was() {
    let mut table = head() + "\n";
    for kind in Kind::ALL {
        for (measure, score) in scores(kind, 3, 4, 1).iter().enumerate() {
            table += &(row(kind, measure, score) + "\n");
        }
    }
    assert_eq!(table, include_str!("broadband_sweep.txt"), "now:\n{table}");
}
