//! `rowtone shapes`: simulated parts that move in their own way.

mod common;

use std::sync::Arc;
use std::sync::atomic::Ordering;

use common::{assert_failure, command, config, file, on_clip, texts, y4m};
use host_sim::{Config, Mode, Shape, Term, Wave};
use rowtone_clip::CameraOptions;
use rowtone_measure::shapes::{self, Wanted};
use serde_json::Value;

const HZ: f64 = 131.7;

/// Bends by 0.1 px at the upper and lower edge, with a node between; beside it the same along the columns, a quarter of a period
/// later and half as large.
fn bending(hz: f64, frames: u32) -> Config {
    let mut scene = config(frames);
    scene.motion.tones.clear();
    let lean = |px: f64| {
        Shape(vec![Term {
            px,
            columns: 0,
            rows: 1,
        }])
    };
    scene.modes.push(Mode {
        wave: Wave::Tone { hz },
        x: lean(0.1),
        y: lean(0.05),
        x_phase_rad: 0.4,
        y_phase_rad: 0.4 - std::f64::consts::FRAC_PI_2,
        part: None,
    });
    scene
}

fn numbers(list: &Value) -> Vec<Option<[f64; 2]>> {
    let number = |v: &Value| v.as_f64().expect("a number");
    let pair = |v: &Value| v.as_array().map(|v| [number(&v[0]), number(&v[1])]);
    list.as_array().expect("a list").iter().map(pair).collect()
}

#[test]
fn a_bending_part_is_drawn_at_more_than_twice_the_frame_rate() {
    let clip = file("shapes-bending.y4m", &y4m(bending(HZ, 120)));
    let out = clip.with_extension("json");
    let hz = ["--hz", "131.7", "--format", "json", "-o"];
    let output = on_clip(
        "shapes",
        &clip,
        &[&hz[..], &[out.to_str().expect("a path")]].concat(),
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(std::fs::read_to_string(&out).expect("a file"), stdout);
    let list: Value = serde_json::from_str(&stdout).expect("JSON");
    let shape = &list[0];
    assert!(
        (shape["hz"].as_f64().expect("Hz") - HZ).abs() < 0.01,
        "{stderr}"
    );
    let (cols, rows) = (
        shape["cols"].as_u64().expect("a count"),
        shape["rows"].as_u64(),
    );
    assert_eq!((cols, rows, shape["tile"].as_u64()), (6, Some(7), Some(16)));
    let (x, y) = (numbers(&shape["x"]), numbers(&shape["y"]));
    let sd: Vec<Option<f64>> = serde_json::from_value(shape["sd"].clone()).expect("a list");
    assert_eq!([x.len(), y.len(), sd.len()], [42; 3]);
    // The largest tile is real and positive along x; which edge it is at is chance.
    let largest = |tile: &usize| x[*tile].map_or(0.0, |[re, im]| re.hypot(im));
    let top = (0..42)
        .max_by(|a, b| largest(a).total_cmp(&largest(b)))
        .expect("tiles");
    assert!(
        x[top].is_some_and(|[re, im]| re > 0.08 && im.abs() < 1e-6),
        "{:?}",
        x[top]
    );
    let sign = if top < 21 { 1.0 } else { -1.0 };
    let (mut squares, mut count) = (0.0, 0.0);
    for tile in 0..42 {
        let middle = (tile / 6 * 16) as f64 + 7.5;
        let lean = sign * (1.0 - middle / 59.5);
        let (Some([xr, xi]), Some([yr, yi]), Some(sd)) = (x[tile], y[tile], sd[tile]) else {
            panic!("tile {tile} is not known");
        };
        // The phase is that of a noisy tile.
        for error in [xr - 0.1 * lean, xi, yr, yi + 0.05 * lean] {
            assert!(
                error.abs() < 0.012,
                "tile {tile}: {xr} {xi} {yr} {yi}, {lean}"
            );
            squares += error * error / (sd * sd);
            count += 1.0;
        }
    }
    // 168 numbers; the seed is fixed. The noise of the tile that phases are against is in all of them.
    let ratio = f64::sqrt(squares / count);
    assert!(
        (0.8..1.35).contains(&ratio),
        "error over stated deviation {ratio}"
    );
}

#[test]
fn tones_are_found_and_what_stands_still_is_said_to() {
    let clip = file("shapes-found.y4m", &y4m(bending(83.3, 90)));
    let output = on_clip("shapes", &clip, &["--roi", "0,0,96,60"]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    assert!(stdout.trim_start().starts_with("83."), "{stdout}");
    // Of 42 tiles those whose middles are in the part: 6 columns, 4 rows.
    assert!(stdout.contains("of 24 tiles move"), "{stdout}");
    let picture = clip.with_extension("svg");
    let hz = ["--hz", "47", "-o", picture.to_str().expect("a path")];
    let output = on_clip("shapes", &clip, &hz);
    let drawn = std::fs::read_to_string(&picture).expect("a picture");
    assert!(drawn.contains("none of 42 tiles moves") && !drawn.contains("<circle"));
    assert!(
        texts(&output).0.contains("none of 42 tiles moves"),
        "{output:?}"
    );
}

#[test]
fn every_file_is_what_its_ending_says() {
    let clip = file("shapes-files.y4m", &y4m(bending(HZ, 30)));
    let written = |ending: &str| {
        let out = clip.with_extension(ending);
        let more = ["--hz", "131.7", "-o", out.to_str().expect("a path")];
        let output = on_clip("shapes", &clip, &more);
        assert!(output.status.success(), "{output:?}");
        std::fs::read(&out).expect("a file")
    };
    assert!(written("gif").starts_with(b"GIF89a"));
    let npz = written("npz");
    assert!(npz.starts_with(b"PK\x03\x04") && npz.windows(6).any(|w| w == b"hz.npy"));
    let unv = String::from_utf8(written("unv")).expect("text");
    assert!(unv.lines().all(|line| line.len() <= 80 && line.is_ascii()));
    let datasets: Vec<&str> = unv
        .lines()
        .zip(unv.lines().skip(1))
        .filter(|(mark, next)| mark.trim() == "-1" && next.trim() != "-1")
        .map(|(_, kind)| kind.trim())
        .collect();
    assert_eq!(datasets[..3], ["151", "164", "15"]);
    let count = |kind| datasets.iter().filter(|d| **d == kind).count();
    // 6 columns and 7 rows of tiles.
    assert_eq!([count("82"), count("55"), count("58")], [13, 1, 84]);
}

#[test]
fn what_cannot_be_told_is_refused_in_one_line() {
    let clip = file("shapes-refused.y4m", &y4m(bending(HZ, 30)));
    let refused = |more: &[&str], status, words: &[&str]| {
        assert_failure(&on_clip("shapes", &clip, more), status, words);
    };
    refused(
        &["--hz", "131.7,71.7"],
        2,
        &["cannot be told apart", "131.70"],
    );
    refused(&["--hz", "131.7,48.3"], 2, &["cannot be told apart"]);
    refused(&["--hz", "120"], 2, &["multiple of half the frame rate"]);
    refused(&["--hz", "1995"], 2, &["500 µs", "averages"]);
    refused(&["--hz", "131.7", "-o", "shape.xyz"], 2, &["its ending"]);
    refused(&["--hz", "131.7", "--tile", "200"], 2, &["96x120", "200"]);
    let still = file("shapes-still.y4m", &y4m(bending(HZ, 8)));
    assert_failure(
        &on_clip("shapes", &still, &["--hz", "131.7"]),
        1,
        &["frames are too few"],
    );
    let piped = command(["shapes", "-", "--line-time-us", "100"])
        .output()
        .expect("it runs");
    assert_failure(&piped, 2, &["give a file"]);
}

#[test]
fn stopped_in_any_reading_it_measures_what_was_read_and_says_so() {
    let clip = file("shapes-stopped.y4m", &y4m(bending(HZ, 60)));
    let mut options = CameraOptions::of(clip.to_str().expect("a path"));
    (options.line_time_us, options.exposure_us) = (Some(100.0), Some(500.0));
    let wanted = Wanted {
        hz: vec![HZ],
        ..Wanted::default()
    };
    // In the first reading, which may be ahead of what is measured by all there is, and in the second.
    for (after, least, most) in [(12, 12, 60), (60 + 40, 40, 40)] {
        let (stop, mut read) = (Arc::default(), 0);
        let shapes = shapes::measure(&options, &wanted, &stop, |frames| {
            read += 1;
            assert!(frames.is_some_and(|all| all <= 180), "{frames:?} {read}");
            stop.store(read >= after, Ordering::Relaxed);
        });
        let shapes = shapes.expect("shapes");
        let said = shapes.notes.join("\n");
        let note = format!(
            "stopped: shapes of the first {} of 60 frames",
            shapes.frames
        );
        assert_eq!(said.contains(&note), shapes.frames < 60, "{said}");
        assert!((least..=most).contains(&shapes.frames), "{said}");
        let largest = (0..shapes.grid.tiles()).map(|tile| shapes.shapes[0].amplitude_px(tile));
        let largest = largest.fold(0.0, f64::max);
        assert!((largest - 0.1).abs() < 0.03, "{largest}");
    }
    // In the last it is as good as done.
    let (stop, mut read) = (Arc::default(), 0);
    let shapes = shapes::measure(&options, &wanted, &stop, |_| {
        read += 1;
        stop.store(read >= 150, Ordering::Relaxed);
    });
    let shapes = shapes.expect("shapes");
    let said = shapes.notes.join("\n");
    assert!(shapes.frames == 60 && !said.contains("stopped"), "{said}");
}
