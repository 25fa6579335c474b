//! Video files given directly: the camera's rows, times and values come out of every container and codec
//! as they went in. Needs ffmpeg, which CI installs.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::{
    CAMERA, assert_failure, assert_the_tone, command, config, file, on_clip, reports, texts, y4m,
};

/// A folder of one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Makes a video of a clip; `options` stand before the output's name.
fn encode(clip: &Path, options: &[&str], to: &Path) {
    let output = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error", "-y", "-i"])
        .arg(clip)
        .args(options)
        .arg(to)
        .output()
        .expect("ffmpeg is installed");
    assert!(
        output.status.success(),
        "{}: {}",
        to.display(),
        texts(&output).1
    );
}

const LOSSLESS: [&str; 6] = ["-pix_fmt", "yuv420p", "-c:v", "libx264", "-qp", "0"];

/// All rows of a clip, as the program measures them.
fn displacements(path: &Path, more: &[&str]) -> String {
    let output = on_clip(
        "displacement",
        path,
        &[&["--rows-per-sample", "1", "--roi", "full"], more].concat(),
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{}: {stderr}", path.display());
    stdout
}

/// Lossless codecs change nothing, whatever the container, the rotation it states and the order of the
/// frames in it: what is measured is the same to the last digit, times apart that a container rounds.
#[test]
fn lossless_videos_measure_as_the_clip_they_were_made_of() {
    let folder = folder("lossless");
    // As limited-range video; making that of the simulated grey is the last change to the values.
    let grey = file("lossless/grey.y4m", &y4m(config(40)));
    let clip = folder.join("clip.y4m");
    encode(&grey, &["-pix_fmt", "yuv420p"], &clip);
    let expected = displacements(&clip, &[]);
    for (name, options) in [
        ("plain.mp4", &[&LOSSLESS[..], &["-bf", "0"]].concat()),
        (
            "b-frames.mov",
            &[&LOSSLESS[..], &["-bf", "3", "-g", "12"]].concat(),
        ),
        (
            "intra.avi",
            &["-vf", "extractplanes=y", "-c:v", "ffv1"].to_vec(),
        ),
        (
            "upright.mp4",
            &[&LOSSLESS[..], &["-metadata:s:v:0", "rotate=90"]].concat(),
        ),
    ] {
        let video = folder.join(name);
        encode(&clip, options, &video);
        let found = displacements(&video, &[]);
        let values = |csv: &str| -> Vec<String> {
            csv.lines()
                .map(|line| line.split_once(',').unwrap().1.to_owned())
                .collect()
        };
        assert!(
            values(&found) == values(&expected),
            "{name} measures otherwise"
        );
        let times = |csv: &str| -> Vec<f64> {
            csv.lines()
                .skip(1)
                .map(|line| line.split(',').next().unwrap().parse().unwrap())
                .collect()
        };
        let (found, expected) = (times(&found), times(&expected));
        let late = found[0] - expected[0];
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected - late).abs() < 2e-6,
                "{name}: {found} for {expected}"
            );
        }
    }
}

/// Ten bits stay ten bits: not cut to eight, not stretched to full range.
#[test]
fn deep_pixels_keep_their_values() {
    let folder = folder("deep");
    let mut deep = config(40);
    deep.sensor.bits = 10;
    let clip = file("deep/clip.y4m", &y4m(deep));
    let expected = displacements(&clip, &[]);
    let video = folder.join("deep.mkv");
    encode(&clip, &["-pix_fmt", "gray10le", "-c:v", "ffv1"], &video);
    let values = |csv: &str| -> Vec<String> {
        csv.lines()
            .map(|line| line.split_once(',').unwrap().1.to_owned())
            .collect()
    };
    assert!(values(&displacements(&video, &[])) == values(&expected));
}

/// Matroska rounds to whole milliseconds; the frames came evenly, so nothing is lost and nothing warned of.
#[test]
fn whole_milliseconds_of_an_even_camera_are_no_trouble() {
    let folder = folder("ms");
    let clip = file("ms/clip.y4m", &y4m(config(120)));
    let video = folder.join("clip.mkv");
    encode(&clip, &[&LOSSLESS[..], &["-bf", "0"]].concat(), &video);
    let output = on_clip("analyze", &video, &["--format", "json"]);
    for report in reports(&texts(&output).0) {
        assert_the_tone(&report);
        assert_eq!(report["fps"].as_f64().unwrap().round(), 60.0);
        let warnings = report["warnings"].as_array().unwrap();
        assert!(!warnings.contains(&"coarse_times".into()), "{report}");
    }
}

/// Frames that a phone did not record are missing in the numbers, not in the times.
#[test]
fn lost_frames_of_a_video_are_counted() {
    let folder = folder("lost");
    let clip = file("lost/clip.y4m", &y4m(config(120)));
    let video = folder.join("lost.mp4");
    let without = r"select='not(between(n\,50\,52)+eq(n\,80))'";
    encode(
        &clip,
        &[
            &["-vf", without, "-fps_mode", "passthrough"][..],
            &LOSSLESS[..],
        ]
        .concat(),
        &video,
    );
    let output = on_clip("analyze", &video, &["--format", "json"]);
    let (stdout, stderr) = texts(&output);
    let reports = reports(&stdout);
    assert_eq!(reports[0]["lost_frames"], 3, "{stderr}");
    assert_eq!(reports.last().unwrap()["lost_frames"], 1, "{stdout}");
    reports.iter().for_each(assert_the_tone);
}

/// Slow motion states the rate that it is played at; what is given overrules it, and that is said.
#[test]
fn a_given_rate_overrules_the_file_and_says_so() {
    let folder = folder("slow");
    let clip = file("slow/clip.y4m", &y4m(config(60)));
    let video = folder.join("slow.mp4");
    encode(
        &clip,
        &[&["-vf", "setpts=2*PTS", "-r", "30"][..], &LOSSLESS[..]].concat(),
        &video,
    );
    let output = on_clip("analyze", &video, &["--format", "json", "--fps", "60"]);
    let (stdout, stderr) = texts(&output);
    assert_the_tone(&reports(&stdout)[0]);
    assert!(
        stderr.contains("--fps 60 is used; the file says 30.000 fps"),
        "{stderr}"
    );
}

/// A bare stream holds no times, and ffmpeg would invent some.
#[test]
fn a_bare_stream_needs_a_rate() {
    let folder = folder("bare");
    let clip = file("bare/clip.y4m", &y4m(config(60)));
    let video = folder.join("clip.h264");
    encode(&clip, &LOSSLESS, &video);
    assert_failure(
        &on_clip("analyze", &video, &[]),
        1,
        &["h264", "no frame times", "--fps"],
    );
    let output = on_clip("analyze", &video, &["--format", "json", "--fps", "60"]);
    assert_the_tone(&reports(&texts(&output).0)[0]);
}

#[test]
fn what_ffmpeg_cannot_read_is_told_in_one_line() {
    let folder = folder("broken");
    let nonsense = file(
        "broken/nonsense.mp4",
        b"this is no video at all, whatever its name says",
    );
    assert_failure(
        &on_clip("analyze", &nonsense, &[]),
        1,
        &["nonsense.mp4", "ffmpeg cannot read it"],
    );
    let sound = folder.join("sound.wav");
    let made = Command::new("ffmpeg")
        .args([
            "-nostdin", "-v", "error", "-y", "-f", "lavfi", "-i", "sine", "-t", "0.1",
        ])
        .arg(&sound)
        .status()
        .expect("ffmpeg is installed");
    assert!(made.success());
    assert_failure(
        &on_clip("analyze", &sound, &[]),
        1,
        &["sound.wav", "no video"],
    );
    let clip = file("broken/clip.y4m", &y4m(config(10)));
    let interlaced = folder.join("fields.mp4");
    encode(
        &clip,
        &[
            &["-vf", "setfield=tff", "-flags", "+ilme+ildct"][..],
            &LOSSLESS[..4],
            &["-x264opts", "tff=1"],
        ]
        .concat(),
        &interlaced,
    );
    assert_failure(&on_clip("analyze", &interlaced, &[]), 1, &["interlaced"]);
}

/// Without ffmpeg: what to install, and Y4M works on.
#[test]
fn without_ffmpeg_it_is_said_how_to_get_it() {
    let clip = file("without.y4m", &y4m(config(60)));
    let video = file("without.mp4", b"not even looked at");
    let run = |path: &Path| {
        command(["analyze", path.to_str().unwrap(), "--format", "json"])
            .args(CAMERA)
            .env("PATH", "/nonexistent")
            .output()
            .unwrap()
    };
    assert_failure(&run(&video), 1, &["without.mp4", "apt install ffmpeg"]);
    assert_the_tone(&reports(&texts(&run(&clip)).0)[0]);
}

/// A picture whose size changes on the way is not scaled to fit.
#[test]
fn a_size_that_changes_stops_the_reading() {
    let folder = folder("sizes");
    let clip = file("sizes/clip.y4m", &y4m(config(40)));
    let (large, small, both) = (
        folder.join("a.ts"),
        folder.join("b.ts"),
        folder.join("both.ts"),
    );
    let plain = [
        "-c:v", "libx264", "-pix_fmt", "yuv420p", "-qp", "0", "-bf", "0",
    ];
    encode(&clip, &plain, &large);
    encode(
        &clip,
        &[&["-vf", "scale=64:80"][..], &plain].concat(),
        &small,
    );
    let joined = [
        std::fs::read(&large).unwrap(),
        std::fs::read(&small).unwrap(),
    ]
    .concat();
    std::fs::write(&both, joined).unwrap();
    let output = on_clip("analyze", &both, &["--format", "json"]);
    assert_failure(&output, 1, &["96x120", "64x80", "frame 40"]);
    // What came before is measured all the same.
    assert_the_tone(&reports(&texts(&output).0)[0]);
}

/// ffmpeg ends with us, also when we stop early.
#[cfg(target_os = "linux")]
#[test]
fn ffmpeg_ends_with_us() {
    use std::io::Read;
    let folder = folder("ends");
    let clip = file("ends/clip.y4m", &y4m(config(600)));
    let video = folder.join("a-name-that-no-other-process-has.mp4");
    encode(&clip, &LOSSLESS, &video);
    let running = || {
        std::fs::read_dir("/proc").unwrap().flatten().any(|entry| {
            std::fs::read(entry.path().join("cmdline")).is_ok_and(|line| {
                let line = String::from_utf8_lossy(&line).into_owned();
                line.starts_with("ffmpeg") && line.contains("a-name-that-no-other-process-has")
            })
        })
    };
    let mut child = command([
        "displacement",
        video.to_str().unwrap(),
        "--rows-per-sample",
        "1",
    ])
    .args(CAMERA)
    .stdout(Stdio::piped())
    .spawn()
    .unwrap();
    // Its reader goes away after the first byte, or it is killed before that.
    let mut first = [0];
    let _ = child.stdout.take().unwrap().read(&mut first);
    child.kill().unwrap();
    child.wait().unwrap();
    let gone = (0..100).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        !running()
    });
    assert!(gone, "ffmpeg is still there after five seconds");
}

/// A codec that predicts frames from each other takes small motions away, which its pixels show: also where they
/// come through a pipe. One that loses nothing, or codes each frame by itself, does not.
#[test]
fn what_a_codec_took_is_warned_of() {
    let folder = folder("codec");
    let clip = file("codec/clip.y4m", &y4m(config(60)));
    let warns = |path: &Path| {
        let output = on_clip("analyze", path, &["--format", "json"]);
        let (stdout, stderr) = texts(&output);
        let of_all = reports(&stdout);
        assert!(!of_all.is_empty(), "{stderr}");
        let warned = |report: &serde_json::Value| {
            report["warnings"]
                .as_array()
                .unwrap()
                .contains(&"compressed".into())
        };
        assert!(
            of_all.iter().all(warned) || !of_all.iter().any(warned),
            "{stdout}"
        );
        warned(&of_all[0])
    };
    let lossy = ["-pix_fmt", "yuv420p", "-c:v", "libx264", "-crf", "23"];
    let (small, piped) = (folder.join("small.mp4"), folder.join("piped.y4m"));
    encode(&clip, &lossy, &small);
    encode(&small, &["-pix_fmt", "yuv420p"], &piped);
    assert!(warns(&small) && warns(&piped));
    let (exact, alone) = (folder.join("exact.mp4"), folder.join("alone.avi"));
    encode(&clip, &LOSSLESS, &exact);
    encode(
        &clip,
        &["-pix_fmt", "yuvj420p", "-c:v", "mjpeg", "-q:v", "2"],
        &alone,
    );
    assert!(!warns(&clip) && !warns(&exact) && !warns(&alone));
}

/// `calibrate` reads the same files.
#[test]
fn calibrate_takes_a_video() {
    let folder = folder("lit");
    let clip = folder.join("led.y4m");
    let made = command([
        "simulate",
        "--size",
        "64x120",
        "--line-time-us",
        "100",
        "--exposure-us",
        "200",
    ])
    .args([
        "--scene",
        "plain",
        "--led",
        "1000",
        "--blur-px",
        "0",
        "--frames",
        "30",
        "-o",
    ])
    .arg(&clip)
    .output()
    .unwrap();
    assert!(made.status.success(), "{}", texts(&made).1);
    let video = folder.join("led.mp4");
    encode(&clip, &[&LOSSLESS[..], &["-bf", "2"]].concat(), &video);
    let output = command([
        "calibrate",
        video.to_str().unwrap(),
        "--led-hz",
        "1000",
        "--format",
        "json",
    ])
    .output()
    .unwrap();
    let (stdout, stderr) = texts(&output);
    let found: serde_json::Value =
        serde_json::from_str(&stdout).unwrap_or_else(|_| panic!("{stderr}"));
    assert!(
        (found["line_time_s"].as_f64().unwrap() / 1e-4 - 1.0).abs() < 1e-3,
        "{found}"
    );
}
