//! `rowtone calibrate` on stripes that something spoils: single frames unlike the others, other light over the LED's.

use rowtone_calibrate::rows::Recording;
use rowtone_calibrate::{Light, Refusal, calibrate};
use rowtone_chance::{Chance, SplitMix};
use std::f64::consts::TAU;

const LINE_TIME_S: f64 = 30e-6;
const ROWS: usize = 480;
const FPS: f64 = 29.97;

fn led(hz: f64) -> Light {
    Light::Known {
        hz,
        hz_sd: 0.0,
        duty: Some(0.5),
    }
}

/// Row means of frames lit by sinusoids of these frequencies, Hz, and amplitudes.
fn lit(frames: usize, lights: &[(f64, f64)]) -> Recording {
    let mut chance = SplitMix(3);
    let rows = (0..frames)
        .map(|n| {
            let row = |y: usize| {
                let t = n as f64 / FPS + y as f64 * LINE_TIME_S;
                let light = lights.iter().map(|(hz, a)| a * (TAU * hz * t + 0.4).sin());
                110.0 + light.sum::<f64>() + 0.3 * chance.normal_between()
            };
            (0..ROWS).map(row).collect()
        })
        .collect();
    let times = (0..frames).map(|n| n as f64 / FPS).collect();
    Recording {
        rows,
        times_s: (frames > 1).then_some(times),
        fps: Some(FPS),
        ..Recording::default()
    }
}

fn is_right(recording: &Recording, hz: f64) {
    let c = calibrate(recording, led(hz)).unwrap();
    let off = c.line_time_s / LINE_TIME_S - 1.0;
    assert!(off.abs() < 1e-3, "{c:?}");
}

/// Black, white, and of another scene: each is left out, in a video and of three pictures, and the rest is right.
#[test]
fn one_bad_frame_is_left_out() {
    let other: Vec<f64> = (0..ROWS)
        .map(|y| 60.0 + 50.0 * (0.021 * y as f64).sin())
        .collect();
    for bad in [vec![2.0; ROWS], vec![255.0; ROWS], other] {
        for frames in [3, 12] {
            let mut recording = lit(frames, &[(1000.0, 60.0)]);
            recording.rows[1] = bad.clone();
            let (kept, count) = recording.without_bad_frames();
            assert_eq!((count, kept.rows.len()), (1, frames - 1));
            is_right(&kept, 1000.0);
        }
    }
}

#[test]
fn good_frames_are_kept() {
    for hz in [120.0, 200.0, 1000.0] {
        let recording = lit(12, &[(hz, 60.0)]);
        assert_eq!(recording.clone().without_bad_frames(), (recording, 0));
    }
}

/// Bands of 120 Hz over 1920 Hz of a dimmed LED: the bands taken for the LED would make the line time 16 times too short.
#[test]
fn the_finer_pattern_can_be_the_lights() {
    is_right(&lit(1, &[(120.0, 60.0), (1920.0, 25.0)]), 1920.0);
    is_right(&lit(1, &[(120.0, 60.0), (1920.0, 10.0)]), 1920.0);
    let nothing_known = Recording {
        fps: None,
        ..lit(1, &[(240.0, 60.0), (1920.0, 10.0)])
    };
    let refusal = calibrate(&nothing_known, led(1920.0)).unwrap_err();
    assert!(matches!(refusal, Refusal::TwoPatterns { .. }), "{refusal}");
}
