//! What the tests of the command share: small simulated clips, and running it.
#![allow(dead_code, reason = "every test file uses some of it, none uses all")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use host_sim::{Camera, Config, Tone, y4m};

/// The tone in every clip.
pub(crate) const HZ: f64 = 133.3;
/// Its amplitude, px.
pub(crate) const PX: f64 = 0.1;
/// Options that describe the clips' camera.
pub(crate) const CAMERA: [&str; 4] = ["--line-time-us", "100", "--exposure-us", "500"];

/// A small camera that looks at a vibrating surface for `frames` frames at 60 fps.
pub(crate) fn config(frames: u32) -> Config {
    let mut config = Config::default();
    config.sensor.cols = 96;
    config.sensor.rows = 120;
    config.sensor.line_time_ps = 100_000_000;
    config.frames = frames;
    config.motion.tones.push(Tone {
        hz: HZ,
        amplitude_px: PX,
        phase_rad: 0.3,
    });
    config
}

/// The clip as Y4M.
pub(crate) fn y4m(config: Config) -> Vec<u8> {
    let camera = Camera::new(config).expect("a camera");
    let mut bytes = Vec::new();
    y4m::write_header(&mut bytes, &camera.config().sensor).expect("to memory");
    for frame in camera.frames() {
        y4m::write_frame(&mut bytes, &frame).expect("to memory");
    }
    bytes
}

/// Writes a file for one test; the name must be its own.
pub(crate) fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).expect("a temporary file");
    path
}

/// The command, about to be run.
pub(crate) fn command<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rowtone"));
    command.args(args).stdin(Stdio::null());
    command
}

/// Runs `rowtone VERB FILE` with the clips' camera options and some more.
pub(crate) fn on_clip(verb: &str, path: &Path, more: &[&str]) -> Output {
    let path = path.to_str().expect("a plain path");
    let args = [verb, path].into_iter().chain(CAMERA);
    command(args.chain(more.iter().copied()))
        .output()
        .expect("the command runs")
}

/// Runs the command with `input` on its standard input, as far as it reads that.
pub(crate) fn piped<S: AsRef<std::ffi::OsStr>>(
    args: impl IntoIterator<Item = S>,
    input: &[u8],
) -> Output {
    let mut child = command(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    std::thread::scope(|scope| {
        // Beside the reading: the command may say more than a pipe holds before it has read all. One
        // that has seen enough stops reading.
        scope.spawn(move || {
            let _ = stdin.write_all(input);
        });
        child.wait_with_output().expect("the command ends")
    })
}

/// Standard output and error as text.
pub(crate) fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    (text(&output.stdout), text(&output.stderr))
}

/// Checks the exit status and that standard error is one line with `words` in it.
pub(crate) fn assert_failure(output: &Output, status: i32, words: &[&str]) {
    let (_, stderr) = texts(output);
    assert_eq!(output.status.code(), Some(status), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.starts_with("rowtone: "), "{stderr}");
    for word in words {
        assert!(stderr.contains(word), "{word:?} is not in {stderr}");
    }
}

/// Reports of `--format json`.
pub(crate) fn reports(stdout: &str) -> Vec<serde_json::Value> {
    stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON object a line"))
        .collect()
}

/// Checks that the report's only peak is the clips' tone.
pub(crate) fn assert_the_tone(report: &serde_json::Value) {
    let peaks = report["peaks"].as_array().expect("peaks");
    assert_eq!(peaks.len(), 1, "{report}");
    let value = |key: &str| peaks[0][key].as_f64().expect("a number");
    assert!((value("hz") - HZ).abs() < 0.1, "{report}");
    assert!((value("amplitude_px") / PX - 1.0).abs() < 0.05, "{report}");
}
