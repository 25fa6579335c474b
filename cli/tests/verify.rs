//! `rowtone verify`: what is right is told as right, what is not as wrong, and the status says which.

mod common;

use std::path::{Path, PathBuf};

use common::{HZ, PX, command, config, file, texts, y4m};

/// A folder of one test with one clip in it.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    file(&format!("{name}/clip.y4m"), &y4m(config(120)));
    folder
}

fn describe(folder: &Path, name: &str, tone: &str, more: &str) {
    let text = format!(
        r#"{{"clip": "clip.y4m", "line_time_us": 100, "exposure_us": 500, "tones": [{tone}]{more}}}"#
    );
    std::fs::write(folder.join(name), text).expect("a description");
}

fn tone(hz: f64, px: f64) -> String {
    format!(
        r#"{{"hz": {hz}, "hz_tolerance": 0.05, "amplitude_px": {px}, "amplitude_tolerance": 0.05}}"#
    )
}

#[test]
fn a_recording_that_is_right_and_some_that_are_not() {
    let folder = folder("verified");
    describe(&folder, "right.json", &tone(HZ, PX), r#", "roi": "full""#);
    let run = || {
        let output = command(["verify", folder.to_str().unwrap()])
            .output()
            .unwrap();
        let (stdout, stderr) = texts(&output);
        (output.status.code(), stdout, stderr)
    };
    let (status, stdout, stderr) = run();
    assert_eq!(status, Some(0), "{stdout}{stderr}");
    let line = stdout.lines().nth(1).unwrap();
    assert!(
        line.starts_with("right ") && line.ends_with("right"),
        "{stdout}"
    );

    describe(&folder, "other-tone.json", &tone(HZ + 10.0, PX), "");
    describe(&folder, "too-large.json", &tone(HZ, 2.0 * PX), "");
    describe(&folder, "no-tone.json", "", "");
    std::fs::write(folder.join("broken.json"), "{\"clip\": 3}").unwrap();
    let (status, stdout, stderr) = run();
    assert_eq!(status, Some(1), "{stdout}");
    assert!(
        stderr.contains("4 of 5 recordings are not right"),
        "{stderr}"
    );
    let verdict = |name: &str| {
        let line = stdout.lines().find(|line| line.starts_with(name)).unwrap();
        line.rsplit(' ').next().unwrap().to_owned()
    };
    assert_eq!(verdict("right "), "right");
    for name in ["other-tone", "too-large", "no-tone"] {
        assert_eq!(verdict(name), "WRONG", "{stdout}");
    }
    assert!(stdout.contains("broken.json: invalid type"), "{stdout}");
}

#[test]
fn a_folder_without_descriptions_is_refused() {
    let folder = folder("not-described");
    let output = command(["verify", folder.to_str().unwrap()])
        .output()
        .unwrap();
    common::assert_failure(&output, 1, &["no .json", "rowtone verify --help"]);
    let output = command(["verify", "no/such/folder"]).output().unwrap();
    common::assert_failure(&output, 1, &["no/such/folder"]);
}

#[test]
fn a_recipe_writes_the_sound_that_is_to_be_filmed() {
    let folder = folder("recipe");
    let output = command(["verify", "--recipe", folder.to_str().unwrap()])
        .output()
        .unwrap();
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert!(stdout.contains("83.3, 131.7, 211.9 Hz"), "{stdout}");
    let sound = std::fs::read(folder.join("tones.wav")).unwrap();
    assert!(sound.starts_with(b"RIFF") && sound.len() > 1_000_000);
    let output = command(["verify", "--recipe", "no/such/folder"])
        .output()
        .unwrap();
    common::assert_failure(&output, 1, &["tones.wav"]);
    let output = command(["verify"]).output().unwrap();
    common::assert_failure(&output, 2, &["FOLDER"]);
}
