//! `rowtone simulate` from the outside: what it writes and how it refuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A directory of this test's own, removed at its end.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("rowtone-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary directory");
        Self(path)
    }

    fn simulate(&self, options: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_rowtone"))
            .current_dir(&self.0)
            .arg("simulate")
            .args(options.split_whitespace())
            .output()
            .expect("the command runs")
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("text")
    }

    fn truth(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).expect("JSON")
    }

    fn has(&self, name: &str) -> bool {
        Path::exists(&self.0.join(name))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_clip_and_its_truth_agree_and_the_seed_decides() {
    let place = Place::new("clip");
    let options = "--size 64x48 --frames 7 --tone 49.2:0.4:0.3 --shake 31.2:0.3 --background-cols 16 --flicker 0.25:100";
    let done = place.simulate(&format!("{options} --seed 5 -o a.y4m --truth a.json"));
    assert!(
        done.status.success() && done.stdout.is_empty() && done.stderr.is_empty(),
        "{done:?}"
    );
    let clip = place.read("a.y4m");
    let header = b"YUV4MPEG2 W64 H48 F60:1 Ip A1:1 Cmono\nFRAME\n";
    assert!(clip.starts_with(header));
    assert_eq!(clip.len(), header.len() - 6 + 7 * (6 + 64 * 48));
    let truth = place.truth("a.json");
    assert_eq!(truth["tones"][0]["hz"], 49.2);
    assert_eq!(truth["tones"][0]["amplitude_px"], 0.4);
    assert_eq!(truth["camera_shake"][0]["hz"], 31.2);
    assert_eq!(truth["line_time_us"], 40.0);
    assert_eq!(truth["exposure_us"], 500.0);
    assert_eq!(truth["flicker"], 0.25);
    assert_eq!(truth["flicker_hz"], 100.0);
    assert_eq!(truth["rows"], 48);
    assert_eq!(truth["cols"], 64);
    assert_eq!(truth["background_cols"], 16);
    let bound = truth["crlb_px_median"].as_f64().expect("a bound");
    assert!((0.005..0.1).contains(&bound), "{bound}");
    assert!(!place.has("a.pts") && truth.get("pts").is_none());

    let again = place.simulate(&format!("{options} --seed 5 -o -"));
    assert!(again.stdout == clip, "the same seed gives the same bytes");
    let other = place.simulate(&format!("{options} --seed 6 -o -"));
    assert!(other.stdout.len() == clip.len() && other.stdout != clip);
}

#[test]
fn lost_and_late_frames_come_with_their_times() {
    let place = Place::new("lost");
    let done = place
        .simulate("--size 32x8 --frames 20 --lose 3,7-9 --jitter-us 30 -o b.y4m --truth b.json");
    assert!(done.status.success(), "{done:?}");
    let times: Vec<f64> = place
        .text("b.pts")
        .lines()
        .skip(1)
        .map(|l| l.parse().expect("ms"))
        .collect();
    assert_eq!(times.len(), 16);
    let seen: Vec<f64> = times.iter().map(|ms| (ms * 0.06).round()).collect();
    assert!(seen.windows(2).all(|w| w[1] > w[0]) && !seen.contains(&3.0) && seen.contains(&10.0));
    assert!(
        times
            .iter()
            .zip(&seen)
            .any(|(t, n)| (t - n / 0.06).abs() > 0.005)
    );
    let truth = place.truth("b.json");
    assert_eq!(truth["lost_frames"], serde_json::json!([3, 7, 8, 9]));
    assert_eq!(truth["pts"], "b.pts");
    assert_eq!(truth["frames"], 16);
    assert_eq!(
        place.read("b.y4m").len(),
        "YUV4MPEG2 W32 H8 F60:1 Ip A1:1 Cmono\n".len() + 16 * (6 + 256)
    );
}

#[test]
fn deep_pixels_are_little_endian_words() {
    let place = Place::new("deep");
    let done = place.simulate("--size 32x8 --frames 1 --bits 10 --scene plain -o -");
    let start = "YUV4MPEG2 W32 H8 F60:1 Ip A1:1 Cmono10\nFRAME\n".len();
    let words = done.stdout[start..]
        .chunks(2)
        .map(|b| u16::from_le_bytes([b[0], b[1]]));
    let mean = words.map(f64::from).sum::<f64>() / 256.0;
    assert!((650.0..720.0).contains(&mean), "{mean}"); // (0.05 + 0.9 · 0.7) of 1023
}

#[test]
fn what_cannot_be_is_refused_in_one_line_with_the_right_status() {
    let place = Place::new("refused");
    for (options, status, says) in [
        ("-o x.y4m --fps 1000", 2, "lower the frame rate"),
        ("-o x.y4m --tone 50", 2, "want HZ:PX"),
        (
            "-o x.y4m --vibrating 0,0,999,5",
            2,
            "0,0,999,5 lies outside the picture of 128x300",
        ),
        ("-o x.y4m --bits 9", 2, "8, 10, 12 or 16"),
        ("-o x.y4m --preset imx999", 2, "ov5647"),
        ("-o x.y4m --frames 0", 2, "at least 1"),
        ("-o x.y4m --scene nothing.png", 1, "nothing.png"),
        ("-o x.y4m --wav nothing.wav", 1, "nothing.wav"),
        ("-o no/such/place.y4m", 1, "no/such/place.y4m"),
    ] {
        let done = place.simulate(options);
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(status), "{options}: {said}");
        assert!(
            said.contains(says) && said.lines().count() == 1,
            "{options}: {said}"
        );
        assert!(!place.has("x.y4m"), "{options} left a file");
    }
}

#[test]
fn a_picture_and_a_sound_become_a_clip() {
    let place = Place::new("files");
    let grey: Vec<u8> = (0..60)
        .flat_map(|y| (0..80).map(move |x| ((x * 37 + y * 11) % 256) as u8))
        .collect();
    let file = std::fs::File::create(place.0.join("wall.png")).expect("a picture");
    let mut encoder = png::Encoder::new(file, 80, 60);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().expect("room");
    writer.write_image_data(&grey).expect("room");
    writer.finish().expect("room");
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 8000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(place.0.join("hum.wav"), spec).expect("a sound");
    for k in 0..8000 {
        let v = (f64::from(k) * 0.05).sin() * 20_000.0;
        wav.write_sample(v as i16)
            .and_then(|()| wav.write_sample(0i16))
            .expect("room");
    }
    wav.finalize().expect("room");
    let done = place.simulate("--size 64x48 --frames 3 --scene wall.png --wav hum.wav --wav-px 0.3 -o c.y4m --truth c.json");
    assert!(done.status.success(), "{done:?}");
    let truth = place.truth("c.json");
    assert_eq!(truth["config"]["motion"]["sound"]["amplitude_px"], 0.3);
    assert_eq!(truth["config"]["scene"]["kind"], "picture");
}

/// Of a calibration all that was measured is taken, and options go before it.
#[test]
fn a_calibration_gives_the_camera() {
    let place = Place::new("calibrated");
    let toml = "rows = 64\nline_time_s = 3.367e-5\nframe_period_s = 0.02\nexposure_s = 2e-4\nrolling = \"up\"\n";
    std::fs::write(place.0.join("c.toml"), toml).unwrap();
    let of = |options: &str| {
        let done = place.simulate(&format!(
            "--calibration c.toml {options} -o c.y4m --truth c.json"
        ));
        assert!(done.status.success(), "{done:?}");
        let truth = place.truth("c.json");
        ["line_time_us", "exposure_us", "fps", "rows"].map(|key| truth[key].as_f64())
    };
    let near = |found: [Option<f64>; 4], wanted: [f64; 4]| {
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found.unwrap() - wanted).abs() < 1e-6, "{found:?} {wanted}");
        }
    };
    near(of("--frames 3"), [33.67, 200.0, 50.0, 64.0]);
    near(
        of("--frames 3 --size 32x48 --fps 40 --line-time-us 30 --exposure-us 10"),
        [30.0, 10.0, 40.0, 48.0],
    );
    std::fs::write(place.0.join("c.toml"), "rows = 64\nline_time_s = -1\n").unwrap();
    let done = place.simulate("--calibration c.toml -o c.y4m");
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains("c.toml: line 2: line_time_s"), "{said}");
}
