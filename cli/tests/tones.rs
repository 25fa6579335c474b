//! What the spectrum promises, from the pictures to the JSON: run-ups, multiples of the frame rate, few frames, what the
//! engineer reads. Seeds are fixed; the bounds are five standard deviations or as asked.

mod common;

use common::{command, file, reports, texts, y4m};
use host_sim::{Camera, Chirp, Config, Preset, RateChange, Sound, Tone, y4m as clip};
use rowtone::spectrum::FrameRatePlan;
use rowtone_lab::spectrum_scenes::cameras;

/// A camera of `fps`, 96 x 120 px, exposed for 0.3 ms, the blank time 3.5 %.
fn camera(fps: f64) -> Config {
    let mut config = Config::default();
    config.sensor.cols = 96;
    config.sensor.rows = 120;
    config.sensor.fps = fps;
    config.sensor.line_time_ps = (0.965e12 / fps / 120.0) as u32;
    config.sensor.exposure_ns = 300_000;
    config
}

fn tone(hz: f64, amplitude_px: f64) -> Tone {
    Tone {
        hz,
        amplitude_px,
        phase_rad: 0.3,
    }
}

/// Writes the clip `name` and its times, and gives the reports on it.
fn analyze(name: &str, config: Config, more: &[&str]) -> Vec<serde_json::Value> {
    let sensor = config.sensor.clone();
    let made = Camera::new(config.clone()).expect("a camera");
    let mut times = Vec::new();
    clip::write_times(&mut times, made.arriving()).expect("to memory");
    let times = file(&format!("{name}.pts"), &times);
    let path = file(&format!("{name}.y4m"), &y4m(config));
    let line_us = (f64::from(sensor.line_time_ps) * 1e-6).to_string();
    let exposure_us = (f64::from(sensor.exposure_ns) * 1e-3).to_string();
    let mut run = command(["analyze", "--format", "json", "--roi", "full"]);
    run.arg(&path).arg("--pts").arg(times);
    run.args(["--line-time-us", &line_us, "--exposure-us", &exposure_us]);
    let output = run.args(more).output().expect("the command runs");
    std::fs::remove_file(path).expect("it was written");
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    reports(&stdout)
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().expect("a number")
}

fn peaks(report: &serde_json::Value) -> &Vec<serde_json::Value> {
    report["peaks"].as_array().expect("peaks")
}

fn warns(report: &serde_json::Value, what: &str) -> bool {
    let warnings = report["warnings"].as_array().expect("warnings");
    warnings.iter().any(|w| w == what)
}

/// 100 to 1000 Hz in 10 s at 120 fps: the middle of each window within 2 Hz rms was asked.
#[test]
fn a_run_up_is_one_track_from_the_pictures_on() {
    let mut config = camera(120.0);
    config.frames = 1200;
    config.motion.chirps.push(Chirp {
        from_hz: 100.0,
        to_hz: 1000.0,
        start_s: 0.0,
        duration_s: 10.0,
        amplitude_px: 0.3,
    });
    let reports = analyze("run-up", config, &["--window", "0.2"]);
    assert!(reports.len() >= 98, "{}", reports.len());
    let mut squares = 0.0;
    for report in &reports {
        let middle_s = number(&report["t_s"]) - 0.5 * number(&report["window_s"]);
        let [peak] = &peaks(report)[..] else {
            panic!("{report}");
        };
        assert_eq!(peak["track"], 1, "{report}");
        squares += (number(&peak["hz"]) - 100.0 - 90.0 * middle_s).powi(2);
    }
    let rms = (squares / reports.len() as f64).sqrt();
    assert!(rms < 0.05, "{rms} Hz"); // measured: 0.005
}

/// Someone pushed the tripod: a sway that dies away, 40 % of the time blank. Before, it had three ghosts or more in the first
/// window, at 60 ± 4 Hz and 120 ± 4 Hz, of a tenth of its size and more.
#[test]
fn a_pushed_tripod_has_no_ghosts_from_the_pictures_on() {
    let mut config = camera(60.0);
    config.sensor.line_time_ps = (0.6e12 / 60.0 / 120.0) as u32;
    config.frames = 120;
    config.motion.tones = vec![tone(131.3, 0.05)];
    let sway = |t: f64| (-2.5 * t).exp() * (std::f64::consts::TAU * 4.6 * t).cos();
    config.motion.sound = Some(Sound {
        rate_hz: 4000.0,
        amplitude_px: 0.4,
        samples: (0..8400)
            .map(|i| sway(f64::from(i) / 4000.0) as f32)
            .collect(),
    });
    let reports = analyze("tripod", config, &[]);
    assert!(reports.len() >= 3, "{}", reports.len());
    for report in &reports {
        let fast = |p: &&serde_json::Value| number(&p["hz"]) > 20.0;
        let fast: Vec<_> = peaks(report).iter().filter(fast).collect();
        assert_eq!(fast.len(), 1, "{report}");
        let off = |key: &str, truth: f64, sd: &str| {
            (number(&fast[0][key]) - truth) / number(&fast[0][sd])
        };
        assert!(off("hz", 131.3, "hz_sd").abs() < 5.0, "{report}");
        assert!(
            off("amplitude_px", 0.05, "amplitude_px_sd").abs() < 5.0,
            "{report}"
        );
    }
}

/// A tone at exactly three times the frame rate: hidden at one rate, and said to be possible where the report would read
/// otherwise with it, as the fourth multiple of the running speed; found at two.
#[test]
fn a_tone_at_a_multiple_of_the_frame_rate_shows_at_two_rates() {
    let mut config = camera(60.0);
    config.frames = 60;
    config.motion.tones = vec![tone(180.0, 0.2), tone(45.0, 0.1), tone(90.0, 0.05)];
    let one = analyze("running-speed", config.clone(), &[]);
    assert_eq!(peaks(&one[0]).len(), 2, "{}", one[0]);
    assert!(warns(&one[0], "hidden_near_frame_rate"), "{}", one[0]);
    config.motion.tones = vec![tone(180.0, 0.2), tone(44.4, 0.1)];
    let one = analyze("one-rate", config.clone(), &[]);
    assert_eq!(peaks(&one[0]).len(), 1, "{}", one[0]);
    assert!(!warns(&one[0], "hidden_near_frame_rate"), "{}", one[0]);

    let plan = FrameRatePlan::new(60.0, 1.0, 1000.0).expect("a plan");
    config.rate_changes = (1..6)
        .map(|half| RateChange {
            t_s: 0.5 * f64::from(half),
            fps: f64::from(plan.fps(0.5 * half as f32 + 0.25)),
        })
        .collect();
    config.frames = 174;
    let two = analyze("two-rates", config, &[]);
    assert!(two.len() >= 4, "{}", two.len());
    for report in &two {
        assert_eq!(peaks(report).len(), 2, "{report}");
        let peak = &peaks(report)[0];
        let off =
            |key: &str, truth: f64, sd: &str| (number(&peak[key]) - truth) / number(&peak[sd]);
        assert!(off("hz", 180.0, "hz_sd").abs() < 5.0, "{report}");
        assert!(
            off("amplitude_px", 0.2, "amplitude_px_sd").abs() < 5.0,
            "{report}"
        );
        assert_eq!(peak["ambiguous"], false, "{report}");
        assert!(!warns(report, "hidden_near_frame_rate"), "{report}");
    }
}

/// Exposed for half a period, rows are smeared out in the middle of the motion and sharp at its ends: left alone, that is
/// 0.0022 px, 24 standard deviations.
#[test]
fn a_tone_smeared_out_by_the_exposure_reads_right() {
    let mut config = camera(60.0);
    config.frames = 60;
    config.sensor.cols = 192;
    config.sensor.exposure_ns = 450_000;
    config.sensor.full_well_e = 100_000.0;
    config.motion.tones = vec![tone(1151.0, 0.5)];
    let report = &analyze("smear", config, &["--max-hz", "1500"])[0];
    let [peak] = &peaks(report)[..] else {
        panic!("{report}");
    };
    let off = number(&peak["amplitude_px"]) - 0.5;
    assert!(off.abs() < 0.0015, "{report}");
}

#[test]
fn a_tone_near_a_multiple_is_found_and_ambiguous() {
    let mut config = camera(60.0);
    config.frames = 60;
    config.motion.tones = vec![tone(180.3, 0.2), tone(44.4, 0.1)];
    let report = &analyze("near", config, &[])[0];
    assert_eq!(peaks(report).len(), 2, "{report}");
    for peak in peaks(report) {
        let near = (number(&peak["hz"]) - 180.3).abs() < 5.0 * number(&peak["hz_sd"]);
        assert_eq!(peak["ambiguous"], near, "{report}");
    }
}

/// The thesis's rows, a quarter of its columns, five frames: the hardest of its tones and an easy one. Nothing beside
/// them: with a finer level of the band than is of use, 300 Hz had its third harmonic.
#[test]
fn five_frames_are_enough() {
    for hz in [125.0, 225.0, 250.0, 300.0] {
        let mut config = Config {
            sensor: Preset::Thesis.sensor(),
            frames: 5,
            seed: 40,
            ..Config::default()
        };
        config.sensor.cols = 256;
        config.motion.tones = vec![tone(hz, 0.5)];
        let report = &analyze(&format!("five-{hz}"), config, &[])[0];
        let peak = &peaks(report)[0];
        assert!((number(&peak["hz"]) - hz).abs() < 0.1, "{report}");
        assert_eq!(peaks(report).len(), 1, "{report}");
    }
}

/// A machine at 24.7 turns a second, 40 µm a pixel: speeds, the band's sum, harmonics, zone.
#[test]
fn the_engineer_reads_what_is_true() {
    let mut config = camera(60.0);
    config.frames = 60;
    let truth = [
        (24.7, 0.4),
        (49.4, 0.1),
        (74.1, 0.05),
        (311.3, 0.02),
        (1203.0, 0.02),
    ];
    config.motion.tones = truth.iter().map(|&(hz, px)| tone(hz, px)).collect();
    let options = ["--um-per-px", "40", "--zone-limits", "1.0,1.5,4.5"];
    let report = &analyze("engineer", config, &options)[0];
    assert_eq!(peaks(report).len(), truth.len(), "{report}");
    let mut squares = 0.0;
    for (hz, px) in truth {
        let near = |p: &&serde_json::Value| (number(&p["hz"]) - hz).abs() < 0.5;
        let peak = peaks(report).iter().find(near).expect("found");
        let speed = std::f64::consts::TAU * hz * px * 0.040 / 2.0_f64.sqrt();
        if hz < 1000.0 {
            squares += speed * speed;
        }
        let sd = number(&peak["amplitude_px_sd"]) / px;
        let right = |key: &str, want: f64| {
            let off = number(&peak[key]) / want - 1.0;
            assert!(
                off.abs() < 5.0 * sd + 0.003,
                "{hz} Hz {key}: {off}, sd {sd}"
            );
        };
        right("amplitude_px", px);
        right("amplitude_um", 40.0 * px);
        right("velocity_mm_s_rms", speed);
        let turns = (hz / 24.7).round();
        let harmonic = (turns < 4.0).then_some(turns as u64);
        assert_eq!(peak["harmonic"].as_u64(), harmonic, "{report}");
    }
    let band = number(&report["velocity_mm_s_rms"]) / squares.sqrt() - 1.0;
    assert!(band.abs() < 0.01, "{report}");
    // √(1.756² + …) = 2.3 mm/s is between 1.5 and 4.5.
    assert_eq!(report["zone"], "C", "{report}");
    let broad = &report["broad_band"]["sum"]["velocity_mm_s_rms"];
    assert_eq!(broad["value"], report["velocity_mm_s_rms"], "{report}");
    // Of class 2 zone B is from 1.12 mm/s to 2.8.
    let mut config = camera(60.0);
    config.frames = 60;
    config.motion.tones = truth.iter().map(|&(hz, px)| tone(hz, px)).collect();
    let options = ["--um-per-px", "40", "--machine", "iso10816-1:class2"];
    let report = &analyze("machine", config, &options)[0];
    assert_eq!(report["zone"], "B", "{report}");
}

/// A few of `rowtone sweep cameras`. A window of noise alone reports a peak once in a thousand: with fixed seeds it did not.
#[test]
fn simulated_cameras_give_their_tones_and_no_others() {
    let score = cameras::score(&cameras::Ranges::default(), 5, 6).expect("possible cameras");
    assert_eq!(score.found, score.tones, "{:?}", score.failures);
    assert_eq!(score.false_peaks, 0, "{:?}", score.failures);
    let [hz, amplitude, hz_sd, amplitude_sd] = score.errors();
    // Some twenty tones: an rms is within 30 % of 1.1.
    assert!(hz < 1.5 && amplitude < 1.6, "{hz} {amplitude}");
    assert!(hz_sd < 1.5 && amplitude_sd < 1.6, "{hz_sd} {amplitude_sd}");
}
