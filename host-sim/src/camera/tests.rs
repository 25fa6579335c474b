//! The camera against physics: where rows stand, what they integrate, what disturbs them.

use rowtone::camera::Pixels as LinePixels;

use super::*;
use crate::{Led, Rect, Scene, Step, Tone};

fn small() -> Config {
    let mut config = Config {
        frames: 4,
        ..Config::default()
    };
    config.sensor.cols = 96;
    config.sensor.rows = 40;
    config
}

fn tone(hz: f64, amplitude_px: f64) -> Tone {
    Tone {
        hz,
        amplitude_px,
        phase_rad: 0.3,
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_in_any_order_and_another_does_not() {
    let mut config = small();
    config.motion.tones.push(tone(49.2, 0.4));
    let camera = Camera::new(config.clone()).expect("good");
    let forward: Vec<Frame> = camera.frames().collect();
    let again = Camera::new(config.clone()).expect("good");
    let mut backward: Vec<Frame> = again
        .slots()
        .iter()
        .rev()
        .map(|&s| again.frame(s))
        .collect();
    backward.reverse();
    assert_eq!(forward, backward);
    config.seed = 2;
    let other = Camera::new(config).expect("good");
    assert_ne!(forward[0].pixels, other.frame(other.slots()[0]).pixels);
}

/// The bytes themselves, so that a change of any step shows: the recordings in the repository's
/// tables depend on them.
#[test]
fn the_bytes_stay_what_they_are() {
    let camera = Camera::new(small()).expect("good");
    let PixelBuffer::U8(p) = camera.frame(camera.slots()[3]).pixels else {
        panic!("8 bits")
    };
    let hash = p.iter().fold(0xcbf2_9ce4_8422_2325u64, |h, &b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    });
    assert_eq!(hash, BYTES_OF_THE_DEFAULT, "{hash:#x}");
}

/// FNV-1a of the fourth frame of [`small`].
const BYTES_OF_THE_DEFAULT: u64 = 0x91ed_7778_75a6_5838;

/// Displacement of a noise-free row against the scene at rest, by Gauss–Newton on the texture.
fn measured(camera: &Camera, row: &[f32], y: usize) -> f64 {
    let cols = 0..row.len();
    let mut d = 0.0;
    for _ in 0..30 {
        let at = camera.texture().row(y, cols.clone(), d);
        let ahead = camera.texture().row(y, cols.clone(), d + 1e-3);
        let (mut num, mut den) = (0.0, 0.0);
        for ((r, a), b) in row.iter().zip(&at).zip(&ahead) {
            let slope = f64::from(b - a) / 1e-3;
            num += slope * f64::from(r - a);
            den += slope * slope;
        }
        d += num / den;
    }
    d
}

#[test]
fn rows_stand_where_the_truth_says() {
    for exposure_ns in [0, 900_000] {
        let mut config = small();
        config.sensor.exposure_ns = exposure_ns;
        config.motion.tones = vec![tone(49.2, 0.4), tone(296.7, 0.05)];
        config.shake.tones = vec![tone(13.0, 0.2)];
        let camera = Camera::new(config).expect("good");
        for slot in camera.arriving() {
            for row in [0u32, 17, 39] {
                let truth = camera.row_truth(slot, row);
                let pixels = camera.noise_free_row(slot, row);
                let d = measured(&camera, &pixels, row as usize);
                assert!(
                    (d - truth.displacement_px - truth.shake_px).abs() < 1e-3,
                    "row {row}: {d} {truth:?}"
                );
                let t_s = slot.start_ns as f64 * 1e-9 + f64::from(row) * 40e-6;
                if exposure_ns == 0 {
                    assert!((truth.displacement_px - camera.displacement_px(t_s)).abs() < 1e-9);
                }
            }
        }
    }
}

#[test]
fn each_row_integrates_its_own_interval() {
    // A step in the middle of row 20's exposure: rows before see nothing, rows after all of it.
    let mut config = small();
    config.sensor.exposure_ns = 100_000;
    config.motion.steps = vec![Step {
        t_s: 20.0 * 40e-6 + 50e-6,
        value: 1.0,
    }];
    let camera = Camera::new(config).expect("good");
    let at = |row| camera.row_truth(camera.slots()[0], row).displacement_px;
    for (row, want) in [(18, 0.0), (19, 0.1), (20, 0.5), (21, 0.9), (22, 1.0)] {
        assert!((at(row) - want).abs() < 1e-6, "{row}: {}", at(row));
    }
}

#[test]
fn fast_motion_within_an_exposure_is_the_average_of_many_instants() {
    let mut config = small();
    config.sensor.exposure_ns = 8_000_000;
    config.motion.tones = vec![tone(40.0, 12.0)];
    let camera = Camera::new(config.clone()).expect("good");
    let slot = camera.slots()[1];
    let blurred = camera.noise_free_row(slot, 5);
    let n = 4000;
    let mut mean = vec![0.0f64; 96];
    for k in 0..n {
        let t =
            slot.start_ns as f64 * 1e-9 + 5.0 * 40e-6 + 8e-3 * (f64::from(k) + 0.5) / f64::from(n);
        let row = camera.texture().row(5, 0..96, config.motion.at(t));
        mean.iter_mut()
            .zip(row)
            .for_each(|(m, r)| *m += f64::from(r) / f64::from(n));
    }
    for (b, m) in blurred.iter().zip(mean) {
        assert!((f64::from(*b) - m).abs() < 1e-5, "{b} {m}");
    }
}

#[test]
fn only_the_vibrating_part_moves_and_the_background_only_shakes() {
    let mut config = small();
    config.motion.drift_px_per_s = 200.0;
    config.shake.steps = vec![Step {
        t_s: -1.0,
        value: 0.5,
    }];
    config.vibrating = Some(Rect {
        x: 30,
        y: 10,
        w: 40,
        h: 20,
    });
    config.background_cols = 35;
    let camera = Camera::new(config).expect("good");
    let slot = camera.slots()[2];
    for (row, moving) in [(5usize, 0..0usize), (15, 35..70), (30, 0..0)] {
        let got = camera.noise_free_row(slot, row as u32);
        let shaken = camera.texture().row(row, 0..96, 0.5);
        for x in 0..96 {
            assert_eq!(
                (got[x] - shaken[x]).abs() < 1e-5,
                !moving.contains(&x),
                "row {row} column {x}"
            );
        }
    }
}

#[test]
fn disturbances_do_what_they_say() {
    let mut config = small();
    let d = &mut config.disturbances;
    (d.dead_cols, d.saturated_rows, d.black_rows) = (vec![7], vec![3], vec![4]);
    d.scene_change_s = Some(0.02);
    d.gain_steps = vec![Step {
        t_s: 0.01,
        value: 0.5,
    }];
    d.hand = Some(Hand {
        start_s: 0.04,
        duration_s: 1.0,
        width_px: 4000.0,
        level: 0.1,
    });
    let camera = Camera::new(config).expect("good");
    let frames: Vec<Vec<u8>> = camera
        .frames()
        .map(|f| match f.pixels {
            PixelBuffer::U8(p) => p,
            PixelBuffer::U16(_) => panic!("8 bits"),
        })
        .collect();
    let row = |f: usize, y: usize| &frames[f][y * 96..][..96];
    let mean = |f: usize, y: usize| row(f, y).iter().map(|&v| f64::from(v)).sum::<f64>() / 96.0;
    assert!(
        row(0, 3)
            .iter()
            .enumerate()
            .all(|(x, &v)| v == if x == 7 { 0 } else { 255 })
    );
    assert!(row(0, 4).iter().all(|&v| v < 4));
    assert!((0..40).all(|y| row(0, y)[7] == 0));
    assert!((mean(1, 10) / mean(0, 10) - 0.5).abs() < 0.02);
    let differs = |a: usize, b: usize| {
        row(a, 20)
            .iter()
            .zip(row(b, 20))
            .filter(|(a, b)| a.abs_diff(**b) > 25)
            .count()
    };
    assert!(differs(1, 2) > 30 && differs(1, 1) == 0);
    // The hand comes in from the left and hides what lies there.
    let t = (camera.slots()[3].start_ns as f64 * 1e-9 - 0.04) * 4096.0;
    assert!(
        t > 40.0
            && row(3, 20)[2..20]
                .iter()
                .enumerate()
                .all(|(k, &v)| k == 5 || v.abs_diff(13) < 8)
    );
}

#[test]
fn read_from_the_bottom_the_last_row_comes_first() {
    let mut config = small();
    config.sensor.bottom_up = true;
    config.sensor.bits = 10;
    let camera = Camera::new(config).expect("good");
    let frame = camera.frames().next().expect("four frames");
    assert_eq!(frame.line(39).expect("last").start_ns, 0);
    assert_eq!(frame.line(0).expect("first").start_ns, 39 * 40_000);
    assert_eq!(frame.line(40), None);
    let LinePixels::U16(p) = frame.line(0).expect("first").pixels else {
        panic!("10 bits")
    };
    assert!(p.iter().all(|&v| v < 1024) && p.iter().any(|&v| v > 600));
    assert_eq!(camera.row_truth(camera.slots()[0], 39).middle_ns, 250_000);
}

/// Mean of each row of a frame of a plain wall, DN.
fn row_means(camera: &Camera, frame: usize) -> Vec<f64> {
    let slot = camera.slots()[frame];
    let mean = |row| {
        camera
            .noise_free_row(slot, row)
            .iter()
            .map(|&v| f64::from(v))
            .sum::<f64>()
            / 96.0
    };
    (0..camera.config().sensor.rows).map(mean).collect()
}

/// A flashing light writes a square wave down the rows: its period in rows is the calibration's whole
/// principle, and the edges are as wide as the exposure.
#[test]
fn a_flashing_light_writes_stripes_that_keep_time_over_frames_and_in_both_directions() {
    for bottom_up in [false, true] {
        let mut config = small();
        config.scene = Scene::Plain;
        config.sensor.rows = 300;
        config.sensor.bottom_up = bottom_up;
        config.sensor.exposure_ns = 100_000;
        config.light.led = Some(Led {
            hz: 1000.0,
            duty: 0.5,
            phase: 0.0,
            off_level: 0.0,
            missing: 0.0,
        });
        let camera = Camera::new(config).expect("good");
        for frame in [0usize, 1, 3] {
            let means = row_means(&camera, frame);
            let white = means.iter().fold(0.0f64, |a, &b| a.max(b));
            let start_us = camera.slots()[frame].start_ns as f64 * 1e-3;
            for (row, mean) in means.iter().enumerate() {
                let order = if bottom_up { 299 - row } else { row };
                let from = start_us + order as f64 * 40.0;
                // Microseconds of light within [from, from + 100].
                let lit: f64 = (0..=40)
                    .map(|k| f64::from(k) * 1000.0 + (from / 1000.0).floor() * 1000.0 - 1000.0)
                    .map(|on| ((on + 500.0).min(from + 100.0) - on.max(from)).max(0.0))
                    .sum();
                assert!(
                    (mean / white - lit / 100.0).abs() < 1e-4,
                    "row {row}: {} {}",
                    mean / white,
                    lit / 100.0
                );
            }
        }
    }
}

#[test]
fn uneven_light_shows_in_the_picture() {
    let mut config = small();
    config.scene = Scene::Plain;
    config.light.gradient = [0.5, 0.2];
    let camera = Camera::new(config).expect("good");
    let slot = camera.slots()[0];
    let (top, bottom) = (
        camera.noise_free_row(slot, 0),
        camera.noise_free_row(slot, 39),
    );
    assert!((top[95] / top[0] - 1.15 / 0.65).abs() < 1e-3);
    assert!((bottom[0] / top[0] - 0.85 / 0.65).abs() < 1e-3);
}
