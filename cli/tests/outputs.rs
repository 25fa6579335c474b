//! What is written appears whole or not at all, is refused before any work where it cannot be written, and
//! holds what was measured when the program is told to stop.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use common::{
    CAMERA, HZ, PX, assert_failure, assert_the_tone, command, config, file, on_clip, reports,
    texts, y4m,
};

/// An empty folder of one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("UTF-8")
        })
        .collect()
}

/// What cannot be written is said before anything is read: the clip need not even exist.
#[test]
fn places_that_cannot_be_written_are_refused_at_once() {
    let none = Path::new("no/such/clip.y4m");
    for (verb, options, status, word) in [
        (
            "analyze",
            &["--plot", "/nodir/x.png"] as &[_],
            1,
            "/nodir/x.png",
        ),
        ("analyze", &["--plot", "x.gif"], 2, "x.gif"),
        (
            "analyze",
            &["--spectrum", "/nodir/s.csv"],
            1,
            "/nodir/s.csv",
        ),
        ("analyze", &["--spectrum", "s.txt"], 2, "ends with .csv"),
        ("displacement", &["-o", "/nodir/x.csv"], 1, "/nodir/x.csv"),
        ("displacement", &["-o", "x.png"], 2, "csv, wav and npy"),
        ("displacement", &["-o", "motion.y4m"], 2, ".y4m"),
    ] {
        assert_failure(&on_clip(verb, none, options), status, &[word]);
    }
    let output = command([
        "calibrate",
        "no/such.y4m",
        "--led-hz",
        "1000",
        "-o",
        "/nodir/c.toml",
    ])
    .output()
    .unwrap();
    assert_failure(&output, 1, &["/nodir/c.toml"]);
    let output = command(["simulate", "-o", "/nodir/clip.y4m"])
        .output()
        .unwrap();
    assert_failure(&output, 1, &["/nodir/clip.y4m"]);
}

/// A row of a CSV whose first number is this; empty fields are not-a-number.
fn row_at(csv: &str, hz: f64) -> Vec<f64> {
    let numbers = |line: &str| -> Vec<f64> {
        let fields = line.split(',');
        fields.map(|f| f.parse().unwrap_or(f64::NAN)).collect()
    };
    let rows = csv.lines().skip(1).map(numbers);
    let nearest = rows.min_by(|a, b| (a[0] - hz).abs().total_cmp(&(b[0] - hz).abs()));
    nearest.expect("a row")
}

/// A tone stands in the spectrum as large as it is, far above the noise, and has no image a frame rate away.
#[test]
fn a_spectrum_is_written_with_its_floor() {
    let folder = folder("spectrum");
    let clip = file("spectrum.y4m", &y4m(config(120)));
    let csv = folder.join("s.csv");
    let to = csv.to_str().unwrap();
    let output = on_clip("analyze", &clip, &["--spectrum", to, "--um-per-px", "50"]);
    let (_, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let text = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(
        text.lines().next(),
        Some("hz,x_px,x_floor_px,y_px,y_floor_px,x_um,x_floor_um,y_um,y_floor_um")
    );
    let tone = row_at(&text, HZ);
    assert!((tone[1] / PX - 1.0).abs() < 0.03, "{tone:?}");
    assert!((tone[5] / tone[1] / 50.0 - 1.0).abs() < 1e-3, "{tone:?}");
    // Noise of some 0.01 px a row, 7000 rows: 0.3 mpx; y is noise alone.
    assert!((1e-5..2e-3).contains(&tone[2]), "{tone:?}");
    assert!(tone[3] < 6.0 * tone[4], "{tone:?}");
    for image in [HZ - 60.0, HZ + 60.0] {
        let there = row_at(&text, image);
        assert!(there[1] < 0.03 * PX, "{there:?}");
    }
    let output = on_clip("analyze", &clip, &["--spectrum", to, "--axes", "x"]);
    assert!(output.status.success());
    let text = std::fs::read_to_string(&csv).unwrap();
    assert!(text.starts_with("hz,x_px,x_floor_px\n"), "{text}");
    assert_eq!(names(&folder), ["s.csv"]);
}

/// A disk that is full in the middle: here a limit to the size of files.
#[cfg(unix)]
#[test]
fn a_file_that_could_not_be_completed_leaves_the_old_one() {
    let folder = folder("whole");
    let clip = file("whole.y4m", &y4m(config(60)));
    let old = folder.join("o.csv");
    std::fs::write(&old, "old").unwrap();
    let limited = |args: &[&str]| {
        Command::new("sh")
            .args([
                "-c",
                "ulimit -f 8; exec \"$0\" \"$@\"",
                env!("CARGO_BIN_EXE_rowtone"),
            ])
            .args(args)
            .stdin(Stdio::null())
            .output()
            .unwrap()
    };
    let rows = [
        &[
            "displacement",
            clip.to_str().unwrap(),
            "--rows-per-sample",
            "1",
        ],
        &CAMERA[..],
    ]
    .concat();
    let output = limited(&[&rows[..], &["-o", old.to_str().unwrap()]].concat());
    assert_failure(&output, 1, &["o.csv", "cannot be written"]);
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "old");
    let new = folder.join("new.y4m");
    let output = limited(&["simulate", "--frames", "30", "-o", new.to_str().unwrap()]);
    assert_failure(&output, 1, &["new.y4m", "cannot be written"]);
    assert_eq!(names(&folder), ["o.csv"]);
}

/// Starts the command on a pipe that stays open.
#[cfg(unix)]
fn live(args: &[&str]) -> Child {
    command(args.iter().chain(&CAMERA))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-s", name, &id])
            .status()
            .unwrap()
            .success()
    );
}

/// A camera whose pipe has gone quiet, and a signal: what was measured comes out.
#[cfg(unix)]
#[test]
fn a_signal_keeps_what_was_measured() {
    use std::io::Write;
    let folder = folder("stopped");
    let clip = y4m(config(115));
    for name in ["INT", "TERM"] {
        let (csv, plot) = (
            folder.join(format!("{name}.csv")),
            folder.join(format!("{name}.svg")),
        );
        let mut analyze = live(&[
            "analyze",
            "-",
            "--format",
            "json",
            "--plot",
            plot.to_str().unwrap(),
        ]);
        let mut displacement = live(&["displacement", "-", "-o", csv.to_str().unwrap()]);
        for child in [&mut analyze, &mut displacement] {
            child.stdin.as_mut().unwrap().write_all(&clip).unwrap();
        }
        // All of it is in the pipe's buffer or taken; some time to measure it.
        std::thread::sleep(std::time::Duration::from_secs(3));
        // The pipes are open for as long as these are.
        let pipes = [analyze.stdin.take(), displacement.stdin.take()];
        signal(&analyze, name);
        signal(&displacement, name);
        let output = analyze.wait_with_output().unwrap();
        let (stdout, stderr) = texts(&output);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let reports = reports(&stdout);
        assert_the_tone(reports.last().unwrap());
        // 115 frames at 60 fps: the last window ends where the frames did.
        assert!(
            reports.last().unwrap()["t_s"].as_f64().unwrap() > 1.9,
            "{stdout}"
        );
        assert!(
            std::fs::read_to_string(&plot)
                .unwrap()
                .ends_with("</svg>\n")
        );
        assert_eq!(
            displacement.wait_with_output().unwrap().status.code(),
            Some(0)
        );
        let rows = std::fs::read_to_string(&csv).unwrap();
        assert!(rows.lines().last().unwrap().starts_with("1.9"), "{rows}");
        drop(pipes);
    }
}

/// A clip that is not complete is none.
#[cfg(unix)]
#[test]
fn a_signal_leaves_no_half_of_a_clip() {
    let folder = folder("half");
    let clip = folder.join("clip.y4m");
    let mut child = command(["simulate", "--seconds", "600", "-o", clip.to_str().unwrap()])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while names(&folder).is_empty() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(200));
    signal(&child, "TERM");
    let output = child.wait_with_output().unwrap();
    assert_failure(&output, 1, &["clip.y4m", "interrupted"]);
    assert!(names(&folder).is_empty(), "{:?}", names(&folder));
}

/// A clip that another program cuts short while it is read ends with a message, not with SIGBUS.
#[cfg(target_os = "linux")]
#[test]
fn a_clip_that_is_cut_short_on_the_way_is_told() {
    let mut large = config(300);
    large.sensor.cols = 640;
    large.sensor.rows = 120;
    let bytes = y4m(large);
    for (k, share) in [0.05, 0.3, 0.6, 0.9].into_iter().enumerate() {
        let clip = file(&format!("cut-{k}.y4m"), &bytes);
        let child = command([
            "displacement",
            clip.to_str().unwrap(),
            "--rows-per-sample",
            "1",
            "-o",
            "/dev/null",
        ])
        .args(CAMERA)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(30 + 60 * k as u64));
        let cut = std::fs::File::options().write(true).open(&clip).unwrap();
        cut.set_len((bytes.len() as f64 * share) as u64).unwrap();
        let output = child.wait_with_output().unwrap();
        let (_, stderr) = texts(&output);
        let code = output.status.code();
        assert!(
            code.is_some(),
            "ended by a signal: {:?} {stderr}",
            output.status
        );
        // It may have read past the cut before, or meet the new end as its end.
        assert!(
            code == Some(0) || stderr.contains("cut"),
            "{code:?} {stderr}"
        );
    }
}

/// No sound is made of what has no length, no time or no end.
#[test]
fn impossible_sounds_are_refused() {
    let clip = file("sound-refused.y4m", &y4m(config(20)));
    let path = clip.to_str().unwrap();
    let wav = folder("sounds").join("x.wav");
    let run = |options: &[&str]| {
        let args = [
            &["displacement", path, "-o", wav.to_str().unwrap()],
            options,
        ]
        .concat();
        command(args).output().unwrap()
    };
    assert_failure(
        &run(&["--global-shutter", "--rows-per-sample", "1"]),
        2,
        &["global shutter", "sound"],
    );
    assert_failure(
        &run(&["--global-shutter", "--fps", "1e-300"]),
        2,
        &["--fps", "frame rate"],
    );
    let times: String = (0..20)
        .map(|i| {
            format!(
                "{}\n",
                f64::from(i) * 16.7 + if i > 9 { 86.4e6 } else { 0.0 }
            )
        })
        .collect();
    let pts = file("a-day.pts", times.as_bytes());
    let camera = [&CAMERA[..], &["--pts", pts.to_str().unwrap()]].concat();
    assert_failure(
        &run(&camera),
        1,
        &["no frame for 86400 s", "cut the recording"],
    );
    assert!(!wav.exists());
}

/// What stands under "Examples" can be pasted: no line is so long that a terminal of 80 columns breaks it.
#[test]
fn examples_can_be_pasted() {
    for verb in [
        "demo",
        "analyze",
        "displacement",
        "simulate",
        "calibrate",
        "monitor",
        "gateway",
        "compare",
        "sweep",
        "experiments",
    ] {
        let (stdout, stderr) = texts(&command([verb, "--help"]).output().unwrap());
        assert!(stderr.is_empty(), "{stderr}");
        let examples = stdout
            .lines()
            .skip_while(|line| !line.starts_with("Example"));
        let mut any = false;
        for line in examples.filter(|line| line.starts_with("  ")) {
            assert!(line.len() <= 80, "{verb}: {line}");
            any |= line.starts_with("  rowtone");
        }
        assert!(any, "{verb} has no example: {stdout}");
    }
}
