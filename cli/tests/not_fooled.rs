//! What must not fool the line engine, from the outside: recordings in which something else changes than the
//! surface's place. How precisely each is measured, `rowtone sweep lines` says.

mod common;

use common::{HZ, PX, assert_the_tone, command, config, file, on_clip, reports, texts};
use host_sim::{
    Camera, Config, Flicker, Hand, Mode, PixelBuffer, Rect, Scene, Shape, Step, Tone, Wave, y4m,
};
use serde_json::Value;

/// The reports on a recording.
fn analyzed(name: &str, config: Config, more: &[&str]) -> Vec<Value> {
    let clip = file(&format!("fooled-{name}.y4m"), &common::y4m(config));
    let args = [&["--format", "json"], more].concat();
    let output = on_clip("analyze", &clip, &args);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    reports(&stdout)
}

fn has_warning(report: &Value, warning: &str) -> bool {
    let warnings = report["warnings"].as_array().expect("warnings");
    warnings.iter().any(|w| w == warning)
}

/// Amplitude of the peak within 1 Hz, px; 0 where there is none.
fn amplitude_px(report: &Value, hz: f64) -> f64 {
    let peaks = report["peaks"].as_array().expect("peaks");
    let near = |p: &&Value| (p["hz"].as_f64().expect("Hz") - hz).abs() < 1.0;
    let peak = peaks.iter().find(near);
    peak.map_or(0.0, |p| p["amplitude_px"].as_f64().expect("px"))
}

#[test]
fn a_flickering_lamp_is_no_vibration() {
    for hz in [100.0, 120.0] {
        let mut lamp = config(60);
        lamp.light.flicker = Some(Flicker {
            depth: 0.3,
            hz,
            phase_rad: 1.0,
        });
        let reports = analyzed(&format!("flicker-{hz}"), lamp, &[]);
        assert_eq!(reports.len(), 1);
        assert_the_tone(&reports[0]);
    }
}

/// Pixels that a lamp's bright moments drive beyond white do not follow the light, and are no motion. (Along the columns,
/// 0.002 to 0.006 px at 100 Hz plus multiples of the frame rate were told of such still scenes, as sure.)
#[test]
fn pixels_that_flicker_beyond_white_are_no_vibration() {
    for seed in [1, 5] {
        let mut lamp = config(90);
        (lamp.sensor.cols, lamp.sensor.rows) = (192, 144);
        lamp.seed = seed;
        lamp.motion.tones.clear();
        lamp.light.flicker = Some(Flicker {
            depth: 0.2,
            hz: 100.0,
            phase_rad: 0.0,
        });
        for report in analyzed(&format!("beyond-white-{seed}"), lamp, &[]) {
            let peaks = report["peaks"].as_array().expect("peaks");
            assert!(peaks.is_empty(), "seed {seed}: {report}");
        }
    }
}

/// No two pixels of a sensor answer alike. What they differ by does not move with the picture, but looks like texture: on a
/// surface of little contrast 0.2 px read 0.179 (x) and 0.175 px (y) with gains that differ by 1 %, 0.134 and 0.126 px with 2 %.
#[test]
fn unequal_pixels_do_not_hold_the_picture_back() {
    for (prnu, axis) in [(0.01, 0), (0.02, 0), (0.02, 1)] {
        let mut uneven = config(120);
        (uneven.sensor.cols, uneven.sensor.rows) = (192, 144);
        uneven.defects.prnu = prnu;
        (uneven.optics.dark, uneven.optics.bright) = (0.4, 0.7);
        uneven.motion.tones.clear();
        let mut px = [0.0; 2];
        px[axis] = 0.2;
        uneven.modes.push(Mode {
            wave: Wave::Tone { hz: HZ },
            x: Shape::even(px[0]),
            y: Shape::even(px[1]),
            x_phase_rad: 0.3,
            y_phase_rad: 0.3,
            part: None,
        });
        let report = &analyzed(&format!("uneven-{prnu}-{axis}"), uneven, &[])[0];
        let told = amplitude_px(report, HZ);
        // Four standard deviations of its noise are 0.0024 px.
        assert!((told - 0.2).abs() < 0.005, "{prnu} {axis}: {report}");
    }
}

/// Rows of an even wall in the middle of a picture: under a lamp the light below them is another than above.
#[test]
fn rows_without_texture_under_a_flickering_lamp_mislead_none_below() {
    for phase in 10..16u8 {
        let mut lamp = config(77);
        (lamp.sensor.cols, lamp.sensor.rows) = (256, 240);
        lamp.sensor.fps = 38.46;
        lamp.seed = u64::from(phase);
        (lamp.sensor.full_well_e, lamp.sensor.read_noise_e) = (4000.0, 60.0);
        lamp.optics.bright = 0.7;
        lamp.light.flicker = Some(Flicker {
            depth: 0.3,
            hz: 100.3,
            phase_rad: 0.8 * f64::from(phase),
        });
        let mut wall = lamp.clone();
        wall.scene = Scene::Plain;
        let row = lamp.sensor.cols as usize;
        let flat = 80 * row..120 * row;
        let (lamp, wall) = (Camera::new(lamp), Camera::new(wall));
        let (lamp, wall) = (lamp.expect("a camera"), wall.expect("a camera"));
        let mut clip = Vec::new();
        y4m::write_header(&mut clip, &lamp.config().sensor).expect("to memory");
        for (mut frame, wall) in lamp.frames().zip(wall.frames()) {
            if let (PixelBuffer::U8(pixels), PixelBuffer::U8(wall)) =
                (&mut frame.pixels, &wall.pixels)
            {
                pixels[flat.clone()].copy_from_slice(&wall[flat.clone()]);
            }
            y4m::write_frame(&mut clip, &frame).expect("to memory");
        }
        let clip = file(&format!("fooled-wall-{phase}.y4m"), &clip);
        let output = on_clip("analyze", &clip, &["--format", "json"]);
        for report in reports(&texts(&output).0) {
            assert_the_tone(&report);
            // 0.0293 to 0.0327 px in the rows below the wall alone.
            assert!(report["noise_px"].as_f64().expect("px") < 0.035, "{report}");
        }
    }
}

#[test]
fn steps_of_gain_are_no_motion() {
    let mut stepping = config(60);
    stepping.optics.bright = 0.7;
    stepping.disturbances.gain_steps = [(0.3, 0.7), (0.6, 1.3)]
        .map(|(t_s, value)| Step { t_s, value })
        .to_vec();
    assert_the_tone(&analyzed("gain", stepping, &[])[0]);
}

#[test]
fn steps_of_exposure_leave_the_tone_what_it_is() {
    let mut stepping = config(60);
    stepping.optics.bright = 0.7;
    stepping.disturbances.exposure_steps = [(0.3, 0.7), (0.6, 1.3)]
        .map(|(t_s, value)| Step { t_s, value })
        .to_vec();
    let report = &analyzed("exposure", stepping, &[])[0];
    assert!(
        (amplitude_px(report, HZ) / PX - 1.0).abs() < 0.03,
        "{report}"
    );
    // The middle of an exposure that is 30 % of 0.5 ms longer comes 75 µs later, and nobody told: phase
    // steps of 0.06 rad, side tones of up to 3 %.
    for peak in report["peaks"].as_array().expect("peaks").iter().skip(1) {
        assert!(
            peak["amplitude_px"].as_f64().expect("px") < 0.04 * PX,
            "{report}"
        );
    }
}

#[test]
fn a_slow_creep_is_followed_and_no_tone() {
    let mut creeping = config(120);
    creeping.motion.drift_px_per_s = 0.5;
    let reports = analyzed("creep", creeping, &[]);
    // A window of a second every half a second.
    assert_eq!(reports.len(), 3);
    reports.iter().for_each(assert_the_tone);
}

#[test]
fn columns_and_rows_that_see_nothing_get_no_weight() {
    let mut blind = config(60);
    blind.scene = Scene::Photo { sky: 0.3 };
    blind.disturbances.dead_cols = vec![40, 70, 71];
    blind.disturbances.saturated_rows = (80..90).collect();
    blind.disturbances.black_rows = (100..110).collect();
    assert_the_tone(&analyzed("blind", blind, &[])[0]);
}

#[test]
fn a_hand_is_flagged_and_forgotten_within_a_second() {
    let mut waving = config(180);
    waving.disturbances.hand = Some(Hand {
        start_s: 1.2,
        duration_s: 0.4,
        width_px: 50.0,
        level: 0.4,
    });
    let reports = analyzed("hand", waving, &["--roi", "full"]);
    assert_eq!(reports.len(), 5);
    let flagged: Vec<bool> = reports.iter().map(|r| has_warning(r, "occluded")).collect();
    // Told with every window that saw it, the fourth of them its last tenth of a second.
    assert_eq!(flagged, [false, true, true, true, false]);
    assert!(reports.iter().all(|r| !has_warning(r, "relearned")));
    assert_the_tone(&reports[0]);
    assert_the_tone(&reports[4]);
    let during = amplitude_px(&reports[2], HZ);
    assert!((during / PX - 1.0).abs() < 0.05, "{during}");
}

#[test]
fn a_changed_scene_is_learned_anew_and_told() {
    let mut changing = config(300);
    changing.disturbances.scene_change_s = Some(0.9);
    let reports = analyzed("scene", changing, &["--roi", "full"]);
    assert!(
        reports.iter().any(|r| has_warning(r, "relearned")),
        "{reports:?}"
    );
    let last = reports.last().expect("reports");
    assert!(!has_warning(last, "relearned"), "{last}");
    assert_the_tone(last);
}

/// A machine of 183.4 Hz before a wall, from a tripod that shakes by six times as much at 31.2 Hz.
#[test]
fn a_shaking_tripod_is_told_from_the_machine() {
    let mut shaking = Config::default();
    shaking.sensor.cols = 160;
    shaking.sensor.rows = 240;
    shaking.sensor.line_time_ps = 55_000_000;
    shaking.frames = 60;
    shaking.background_cols = 48;
    let tone = |hz, amplitude_px, phase_rad| Tone {
        hz,
        amplitude_px,
        phase_rad,
    };
    shaking.motion.tones.push(tone(183.4, 0.05, 0.4));
    shaking.shake.tones.push(tone(31.2, 0.3, 0.0));
    let clip = file("fooled-tripod.y4m", &common::y4m(shaking));
    let path = clip.to_str().expect("a plain path");
    let analyzed = |more: &[&str]| {
        let plain = [
            "analyze",
            path,
            "--line-time-us",
            "55",
            "--exposure-us",
            "500",
        ];
        let output = command([&plain, more, &["--format", "json"]].concat()).output();
        let (stdout, stderr) = texts(&output.expect("it runs"));
        reports(&stdout).into_iter().next().expect(&stderr)
    };
    let both = analyzed(&[]);
    assert!(
        (amplitude_px(&both, 31.2) / 0.3 - 1.0).abs() < 0.03,
        "{both}"
    );
    assert!(amplitude_px(&both, 183.4) > 0.0, "{both}");
    let machine = analyzed(&["--background", "0,0,48,240"]);
    assert!(
        (amplitude_px(&machine, 183.4) / 0.05 - 1.0).abs() < 0.03,
        "{machine}"
    );
    assert!(amplitude_px(&machine, 31.2) < 0.02 * 0.3, "{machine}");
}

/// Half of the columns vibrate by 0.02 px, of which a row of a strip sees nothing.
#[test]
fn a_part_that_vibrates_by_less_than_a_row_can_tell_is_found() {
    let mut config = Config {
        frames: 60,
        vibrating: Some(Rect {
            x: 64,
            y: 0,
            w: 64,
            h: 300,
        }),
        ..Config::default()
    };
    config.motion.tones.push(Tone {
        hz: 83.2,
        amplitude_px: 0.02,
        phase_rad: 0.4,
    });
    let clip = file("fooled-part.y4m", &common::y4m(config));
    let path = clip.to_str().expect("a plain path");
    let analyzed = |roi: &str| {
        let camera = ["--line-time-us", "40", "--exposure-us", "500"];
        let args = [
            &["analyze", path, "--format", "json", "--roi", roi],
            &camera[..],
        ];
        let output = command(args.concat()).output().expect("it runs");
        let (stdout, stderr) = texts(&output);
        (reports(&stdout).remove(0), stderr)
    };
    let (full, told) = analyzed("full");
    assert!(amplitude_px(&full, 83.2) < 0.6 * 0.02 && told.is_empty());
    let (auto, told) = analyzed("auto");
    assert!(told.contains("--roi auto measures 64,0,64,300"), "{told}");
    let share = amplitude_px(&auto, 83.2) / 0.02;
    assert!((share - 1.0).abs() < 0.05, "{share}");
}

/// The rows at the horizon know too little to find a swift picture again; nothing passes through it.
#[test]
fn a_sky_over_a_swift_picture_is_no_disturbance() {
    let mut config = Config {
        frames: 60,
        scene: Scene::Photo { sky: 0.1 },
        ..Config::default()
    };
    config.sensor.cols = 256;
    config.sensor.line_time_ps = 33_670_000;
    config.sensor.exposure_ns = 200_000;
    config.motion.tones.push(Tone {
        hz: 203.7,
        amplitude_px: 4.0,
        phase_rad: 0.4,
    });
    let clip = file("fooled-sky.y4m", &common::y4m(config));
    let path = clip.to_str().expect("a plain path");
    let camera = ["--line-time-us", "33.67", "--exposure-us", "200"];
    for axes in ["x", "xy"] {
        let args = [
            &["analyze", path, "--format", "json", "--axes", axes],
            &camera[..],
        ];
        let output = command(args.concat()).output().expect("it runs");
        let report = reports(&texts(&output).0).remove(0);
        // Along both axes some rows are still rejected as occluded: a known fault (docs/results.md).
        assert!(
            axes == "xy" || !has_warning(&report, "occluded"),
            "{report}"
        );
        assert!(
            (amplitude_px(&report, 203.7) / 4.0 - 1.0).abs() < 0.01,
            "{axes}: {report}"
        );
    }
}
