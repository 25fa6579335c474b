extern crate std;
use super::*;
use crate::camera::Timing;
use std::vec::Vec;

fn group() -> Group {
    Group::new(Timing::new(10_000_000, 0, 8).unwrap(), 4).unwrap()
}

fn row(frame: u32, row: u16, shift_px: f32, information_per_px2: f32) -> Displacement {
    Displacement {
        frame,
        row,
        time_ns: i64::from(frame) * 1_000_000 + i64::from(row) * 10_000,
        shift_px,
        information_per_px2,
        vertical: None,
    }
}

#[test]
fn weights_shift_and_time_by_information() {
    let mut binner = Binner::new(group());
    for (y, w) in [(0, 1.0), (1, 1.0), (2, 1.0), (3, 5.0)] {
        assert_eq!(binner.push(row(0, y, f32::from(y), w)), None);
    }
    let sample = binner.finish().unwrap();
    assert_eq!(sample.shift_px, 18.0 / 8.0);
    assert_eq!(sample.time_ns, 22_500);
    assert_eq!(sample.information_per_px2, 8.0);
}

/// Rows of a light that changes by `change` a row (of the factor that undoes it), 0.1 ms apart and exposed for 2 ms:
/// 3.33 ms·change late.
fn late_ns(change: f32, rows: core::ops::Range<u16>) -> Vec<i64> {
    let timing = Timing::new(100_000_000, 2_000_000, 8).unwrap();
    let mut binner = Binner::new(Group::new(timing, 4).unwrap());
    let mut samples = Vec::new();
    for frame in 0..2u32 {
        for y in rows.clone() {
            let begin = Begin {
                middle_ns: i64::from(y) * 100_000,
                curvature: Curvature::default(),
                to_reference: 1.0 - change * f32::from(y),
                anchor_px: 0.25,
            };
            let row = RowShift {
                frame,
                row: y,
                shift_px: 0.5,
                information_per_px2: 1.0,
            };
            let mut done = None;
            binner.push_row(row, || begin, &mut done);
            samples.extend(done);
        }
    }
    samples.extend(binner.finish());
    assert!(samples.iter().all(|s| s.shift_px == 0.75));
    let middle_ns = |s: &Sample| i64::from(s.slot) * 400_000 + 150_000;
    samples.iter().map(|s| s.time_ns - middle_ns(s)).collect()
}

#[test]
fn a_light_that_grows_makes_rows_late_and_a_jump_does_not() {
    let late = late_ns(0.01, 0..8);
    // Group by group 33.3 µs over the factor, 1 to 0.96; the frame's last is as late as the one before.
    assert_eq!(late.len(), 4);
    assert!(
        late.iter().all(|ns| (33_000..36_000).contains(ns)),
        "{late:?}"
    );
    assert!(
        late_ns(-0.01, 0..8)
            .iter()
            .all(|ns| (-34_000..-31_000).contains(ns))
    );
    // Less than noise may feign, and more than a lamp does.
    for change in [0.0002, 0.06, -0.08] {
        assert_eq!(late_ns(change, 0..8), [0; 4], "{change}");
    }
}

#[test]
fn the_spread_is_that_of_the_rows_that_know_something() {
    let mut binner = Binner::new(group());
    for y in 0..4 {
        binner.push(row(0, y, 0.0, 2.0));
    }
    let even = binner.push(row(0, 4, 0.0, 3.0)).unwrap().spread;
    assert_eq!(even, group().even_spread());
    for (y, w) in [(5, 1e-9), (6, 1e-9), (7, 1.0)] {
        binner.push(row(0, y, 0.0, w));
    }
    // 3/4 of the weight at 0, 1/4 three lines of 10 µs later: variance 27/16, third moment 81/32 lines.
    let uneven = binner.finish().unwrap().spread;
    assert!((uneven.variance_ns2 / (27.0 / 16.0 * 1e8) - 1.0).abs() < 1e-5);
    assert!((uneven.third_ns3 / (81.0 / 32.0 * 1e12) - 1.0).abs() < 1e-5);
}

#[test]
fn a_thin_group_gives_none() {
    let mut binner = Binner::new(group());
    for y in 0..4 {
        let information = if y == 1 { 1.0 } else { 0.0 };
        assert_eq!(binner.push(row(0, y, 1.0, information)), None);
    }
    assert_eq!(binner.push(row(0, 4, 1.0, 1.0)), None);
    assert_eq!(binner.thin_groups(), 1);
}

#[test]
fn rows_left_out_and_rows_twice_do_not_move_the_others() {
    let mut binner = Binner::new(group());
    for y in [1, 3, 3, 2] {
        assert_eq!(binner.push(row(5, y, f32::from(y), 1.0)), None);
    }
    let sample = binner.push(row(5, 5, 0.0, 1.0)).unwrap();
    assert_eq!(
        (sample.shift_px, sample.time_ns, sample.information_per_px2),
        (2.0, 5_020_000, 2.0)
    );
    assert_eq!(sample.spread.variance_ns2, 1e8);
    // A row that is exposed later than its place says.
    let mut late = row(5, 6, 0.0, 1.0);
    late.time_ns += 4000;
    binner.push(late);
    assert_eq!(binner.finish().unwrap().time_ns, 5_057_000);
}

#[test]
fn times_are_rounded_to_the_nearest_whatever_their_size() {
    for ns in [0.0, 0.4, 0.6, 12_345.5, 9.9e8, 1e9, 1.5e12, 8.6e13] {
        for ns in [ns, -ns] {
            assert_eq!(rounded_ns(ns), libm::roundf(ns) as i64, "{ns}");
        }
    }
    assert_eq!(rounded_ns(f32::NAN), 0);
}

#[test]
fn lost_frames_are_counted_by_number() {
    let mut binner = Binner::new(group());
    for frame in [u32::MAX, 0, 3, 4] {
        binner.push(row(frame, 0, 0.0, 1.0));
    }
    assert_eq!(binner.lost_frames(), 2);
}

#[test]
fn nonsense_gives_nothing_and_breaks_nothing() {
    let mut binner = Binner::new(group());
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -1.0,
        0.0,
        f32::MAX,
    ];
    for (i, shift) in odd.into_iter().enumerate() {
        for information in odd {
            let mut d = row(i as u32, 65_535, shift, information);
            d.time_ns = if i % 2 == 0 { i64::MIN } else { i64::MAX };
            assert_eq!(binner.push(d), None);
            d.row = 1;
            let _ = binner.push(d);
        }
    }
    let _ = binner.finish();
}
