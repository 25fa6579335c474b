//! `rowtone analyze` and `rowtone displacement` from the outside: what goes in, what comes out.

mod common;

use std::io::Read;
use std::process::{Command, Stdio};

use common::{
    CAMERA, assert_failure, assert_the_tone, command, config, file, on_clip, piped, reports, texts,
    y4m,
};

#[test]
fn a_clip_gives_its_tone_once_a_window() {
    let clip = file("tone.y4m", &y4m(config(90)));
    let output = on_clip("analyze", &clip, &["--format", "json"]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stderr, "");
    let reports = reports(&stdout);
    assert_eq!(reports.len(), 2, "{stdout}");
    reports.iter().for_each(assert_the_tone);
    for (key, value) in [
        ("seq", 0.0),
        ("t_s", 1.0),
        ("window_s", 1.0),
        ("lost_frames", 0.0),
    ] {
        let got = reports[0][key].as_f64().unwrap();
        assert!((got - value).abs() < 0.02, "{key} is {got}");
    }
}

#[test]
fn a_summary_closes_with_the_whole_recording() {
    let clip = file("summary.y4m", &y4m(config(150)));
    let output = on_clip("analyze", &clip, &["--format", "json", "--summary"]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let objects = reports(&stdout);
    let (last, windows) = objects.split_last().expect("a line");
    assert!(
        windows.len() >= 3 && windows.iter().all(|w| w.get("summary").is_none()),
        "{stdout}"
    );
    assert_eq!(last["summary"], true);
    assert_eq!(last["windows"], windows.len());
    let tone = &last["peaks"][0];
    assert_eq!(tone["windows"], windows.len());
    let (hz, sd) = (
        tone["hz"].as_f64().unwrap(),
        tone["hz_sd"].as_f64().unwrap(),
    );
    // Fixed seeds; five standard deviations.
    assert!((hz - common::HZ).abs() < 5.0 * sd, "{tone}");
    let first = windows[0]["peaks"][0]["hz_sd"].as_f64().unwrap();
    assert!(
        sd < first,
        "the whole knows no less than its first window: {tone}"
    );
    let text = texts(&on_clip("analyze", &clip, &["--summary"])).0;
    let whole = text
        .split("The whole recording: ")
        .nth(1)
        .expect("a summary");
    assert!(
        whole.contains("133.3") && whole.contains("in all "),
        "{text}"
    );
    let wire = on_clip("analyze", &clip, &["--summary", "--format", "wire"]);
    assert_failure(&wire, 2, &["--summary"]);
}

#[test]
fn standard_input_and_deep_pixels_are_read_as_well() {
    let mut deep = config(60);
    deep.sensor.bits = 10;
    let args = ["analyze", "-", "--format", "json"];
    let output = piped(args.iter().chain(&CAMERA), &y4m(deep));
    assert_the_tone(&reports(&texts(&output).0)[0]);
}

#[test]
fn six_frames_have_the_displacements_of_six_frames() {
    let clip = file("six.y4m", &y4m(config(6)));
    let output = on_clip("displacement", &clip, &["--rows-per-sample", "1"]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let mut lines = stdout.lines();
    assert_eq!(lines.next(), Some("t_s,row,x_px,x_sd_px,y_px,y_sd_px"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 6 * 120);
    assert!(rows.iter().filter(|row| !row[2].is_empty()).count() > 600);
    // Row 3 of frame 2: 2/60 s, three line times, half an exposure.
    let t_s: f64 = rows[2 * 120 + 3][0].parse().unwrap();
    assert!((t_s - (2.0 / 60.0 + 300e-6 + 250e-6)).abs() < 1e-8, "{t_s}");
    assert_eq!(rows[2 * 120 + 3][1], "3");
}

#[test]
fn a_global_shutter_gives_one_sample_a_frame() {
    let clip = file("global.y4m", &y4m(config(20)));
    let path = clip.to_str().unwrap();
    let args = ["displacement", path, "--global-shutter", "--rotate", "90"];
    let (stdout, _) = texts(&command(args).output().unwrap());
    assert_eq!(stdout.lines().count(), 1 + 20);
}

#[test]
fn wav_and_npy_hold_the_same_motion() {
    let clip = file("formats.y4m", &y4m(config(12)));
    let output = on_clip("displacement", &clip, &["--format", "npy"]);
    assert!(output.stdout.starts_with(b"\x93NUMPY"));
    let wav = clip.with_file_name("formats.wav");
    let output = on_clip("displacement", &clip, &["-o", wav.to_str().unwrap()]);
    assert!(output.status.success());
    let reader = hound::WavReader::open(&wav).unwrap();
    // One row every 100 µs.
    assert_eq!(reader.spec().sample_rate, 10_000);
    assert!(reader.duration() > 1_900, "{}", reader.duration());
}

#[test]
fn a_scale_adds_micrometres_and_a_picture_is_drawn() {
    let clip = file("picture.y4m", &y4m(config(60)));
    let svg = clip.with_extension("svg");
    let png = clip.with_extension("png");
    let output = on_clip(
        "analyze",
        &clip,
        &[
            "--um-per-px",
            "20",
            "--format",
            "json",
            "--plot",
            svg.to_str().unwrap(),
        ],
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let um = reports(&stdout)[0]["peaks"][0]["amplitude_um"]
        .as_f64()
        .unwrap();
    assert!((um - 2.0).abs() < 0.1, "{um}");
    assert!(std::fs::read_to_string(svg).unwrap().contains("133.3"));
    let output = on_clip("analyze", &clip, &["--plot", png.to_str().unwrap()]);
    assert!(output.status.success());
    assert!(std::fs::read(png).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn the_cameras_own_motion_is_subtracted() {
    let mut shaking = config(60);
    shaking.sensor.cols = 160;
    shaking.background_cols = 64;
    shaking.shake.tones.push(host_sim::Tone {
        hz: 31.2,
        amplitude_px: 0.3,
        phase_rad: 0.0,
    });
    let clip = file("shaking.y4m", &y4m(shaking));
    let output = on_clip(
        "analyze",
        &clip,
        &[
            "--background",
            "0,0,60,120",
            "--roi",
            "68,0,92,120",
            "--format",
            "json",
        ],
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let report = &reports(&stdout)[0];
    let peaks = report["peaks"].as_array().unwrap();
    let shake = peaks
        .iter()
        .filter(|p| (p["hz"].as_f64().unwrap() - 31.2).abs() < 1.0);
    for peak in shake {
        assert!(peak["amplitude_px"].as_f64().unwrap() < 0.006, "{report}");
    }
    assert!(
        (peaks[0]["hz"].as_f64().unwrap() - common::HZ).abs() < 0.1,
        "{report}"
    );
    assert!((peaks[0]["amplitude_px"].as_f64().unwrap() / common::PX - 1.0).abs() < 0.05);
}

#[test]
fn something_of_known_length_gives_the_scale() {
    let clip = file("known.y4m", &y4m(config(60)));
    // Fifty pixels.
    let known = ["--known", "0,0,30,40=5mm", "--format", "json"];
    let peak = &reports(&texts(&on_clip("analyze", &clip, &known)).0)[0]["peaks"][0];
    let of = |key: &str| peak[key].as_f64().unwrap();
    assert!(
        (of("amplitude_um") / of("amplitude_px") - 100.0).abs() < 0.1,
        "{peak}"
    );
    let twice = ["--known", "0,0,30,40=5mm", "--um-per-px", "100"];
    assert_failure(
        &on_clip("analyze", &clip, &twice),
        2,
        &["--known", "--um-per-px"],
    );
    let unknown = ["--known", "0,0,30,40=5"];
    assert_failure(&on_clip("analyze", &clip, &unknown), 2, &["35mm"]);
}

#[test]
fn wire_sentences_are_what_monitor_reads() {
    let clip = file("wire.y4m", &y4m(config(60)));
    let output = on_clip("analyze", &clip, &["--format", "wire"]);
    assert!(output.stdout.starts_with(b"$RTRPT,"));
    assert!(output.stdout.ends_with(b"\r\n"));
    let heard = piped(["monitor", "-", "--format", "json"], &output.stdout);
    assert_the_tone(&reports(&texts(&heard).0)[0]);
}

#[test]
fn a_closed_output_is_no_error() {
    let clip = file("closed.y4m", &y4m(config(90)));
    let path = clip.to_str().unwrap();
    for args in [["analyze", path], ["displacement", path]] {
        let mut child = command(args.iter().chain(&CAMERA))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut stderr = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut stderr)
            .unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0), "{stderr}");
        assert_eq!(stderr, "");
    }
}

#[test]
fn an_h264_file_is_read_through_ffmpeg() {
    let clip = file("h264.y4m", &y4m(config(60)));
    let mp4 = clip.with_extension("mp4");
    let encode = Command::new("ffmpeg")
        .args(["-v", "error", "-y", "-i"])
        .arg(&clip)
        .args(["-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv420p"])
        .arg(&mp4)
        .status();
    if !encode.is_ok_and(|status| status.success()) {
        eprintln!("there is no ffmpeg with H.264 here: not tested");
        return;
    }
    let mut ffmpeg = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(&mp4)
        .args(["-f", "yuv4mpegpipe", "-"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let output = command(["analyze", "-", "--format", "json"].iter().chain(&CAMERA))
        .stdin(ffmpeg.stdout.take().unwrap())
        .output()
        .unwrap();
    ffmpeg.wait().unwrap();
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let peak = &reports(&stdout)[0]["peaks"][0];
    assert!(
        (peak["hz"].as_f64().unwrap() - common::HZ).abs() < 0.1,
        "{stdout}"
    );
}

#[test]
fn a_picture_without_texture_is_refused_with_a_reason() {
    let mut plain = config(20);
    plain.scene = host_sim::Scene::Plain;
    let clip = file("plain.y4m", &y4m(plain));
    assert_failure(&on_clip("analyze", &clip, &[]), 1, &["texture"]);
}

#[test]
fn a_calibration_file_stands_for_line_time_and_exposure() {
    let text = "rows = 120\nline_time_s = 1e-4\nexposure_s = 5e-4\nrolling = \"up\"\n";
    let toml = file("camera.toml", text.as_bytes());
    let mut upward = config(60);
    upward.sensor.bottom_up = true;
    let clip = file("upward.y4m", &y4m(upward));
    let [clip, toml] = [&clip, &toml].map(|path| path.to_str().unwrap());
    let args = ["analyze", clip, "--calibration", toml, "--format", "json"];
    let output = command(args).output().unwrap();
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert_the_tone(&reports(&stdout)[0]);
    let output = command(["analyze", clip, "--calibration", "no/such.toml"])
        .output()
        .unwrap();
    assert_failure(&output, 1, &["no/such.toml"]);
}
