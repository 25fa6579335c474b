//! Bad input: one clear line, the right exit status, and nothing lost that was measured before.

mod common;

use common::{CAMERA, assert_failure, command, config, file, on_clip, piped, reports, texts, y4m};

#[test]
fn files_that_are_no_clip() {
    let missing = std::path::Path::new("no/such/clip.y4m");
    assert_failure(
        &on_clip("analyze", missing, &[]),
        1,
        &["clip.y4m", "opened"],
    );
    let empty = file("empty.y4m", b"");
    assert_failure(&on_clip("analyze", &empty, &[]), 1, &["empty"]);
    let wave = file("wave.y4m", b"RIFF....WAVEfmt ");
    assert_failure(&on_clip("displacement", &wave, &[]), 1, &["not a Y4M"]);
    let no_frame = file("no-frame.y4m", b"YUV4MPEG2 W96 H120 F60:1 Cmono\n");
    assert_failure(&on_clip("analyze", &no_frame, &[]), 1, &["no frame"]);
    let folder = file("in-a-folder", b"");
    assert_failure(
        &on_clip("analyze", folder.parent().unwrap(), &[]),
        1,
        &["folder"],
    );
    let one = file("one.y4m", &y4m(config(1)));
    assert_failure(&on_clip("analyze", &one, &[]), 1, &["only one frame"]);
}

#[test]
fn a_truncated_last_frame_costs_only_itself() {
    let mut bytes = y4m(config(60));
    bytes.truncate(bytes.len() - 1000);
    let clip = file("truncated.y4m", &bytes);
    let output = on_clip("displacement", &clip, &["--rows-per-sample", "120"]);
    assert_failure(&output, 0, &["cut off", "59 before it"]);
    assert_eq!(texts(&output).0.lines().count(), 1 + 59);
    let output = on_clip("analyze", &clip, &["--format", "json"]);
    assert_failure(&output, 0, &["cut off"]);
    common::assert_the_tone(&reports(&texts(&output).0)[0]);
}

#[test]
fn a_header_that_lies() {
    let honest = y4m(config(20));
    let lie = |name: &str, header: &str| {
        let body = honest.iter().position(|&b| b == b'\n').unwrap();
        let bytes = [header.as_bytes(), &honest[body..]].concat();
        on_clip("analyze", &file(name, &bytes), &[])
    };
    let wider = lie("wider.y4m", "YUV4MPEG2 W100 H120 F60:1 Cmono");
    assert_failure(&wider, 1, &["100x120"]);
    let colour = lie("colour.y4m", "YUV4MPEG2 W96 H120 F60:1 C420");
    assert_failure(&colour, 1, &["FRAME"]);
    // Its rows could not even be read out in a frame's time, but it is the header that is wrong.
    let taller = lie("taller.y4m", "YUV4MPEG2 W96 H240 F60:1 Cmono");
    assert_failure(&taller, 1, &["96x240"]);
    let huge = lie("huge.y4m", "YUV4MPEG2 W8000 H6000 F60:1 Cmono");
    assert_failure(&huge, 1, &["not even one frame"]);
    let no_rate = lie("no-rate.y4m", "YUV4MPEG2 W96 H120 F0:0 Cmono");
    assert_failure(&no_rate, 1, &["--fps"]);
    let interlaced = lie("interlaced.y4m", "YUV4MPEG2 W96 H120 F60:1 It Cmono");
    assert_failure(&interlaced, 1, &["interlaced"]);
}

#[test]
fn a_picture_narrower_than_the_band() {
    let frame = [b"FRAME\n".as_slice(), &[90; 8 * 10]].concat();
    let bytes = [
        b"YUV4MPEG2 W8 H10 F60:1 Cmono\n".as_slice(),
        &frame.repeat(5),
    ]
    .concat();
    let clip = file("narrow.y4m", &bytes);
    assert_failure(&on_clip("analyze", &clip, &[]), 1, &["8 px"]);
}

#[test]
fn frame_times_that_cannot_be() {
    let clip = file("timed.y4m", &y4m(config(10)));
    let times = |name: &str, text: &str| {
        let path = file(name, text.as_bytes());
        on_clip("analyze", &clip, &["--pts", path.to_str().unwrap()])
    };
    let few = times("few.pts", "# timecode format v2\n0\n16.7\n33.3\n");
    assert_failure(&few, 1, &["few.pts", "only 3 times", "10 frames"]);
    let unordered = times("unordered.pts", "# timecode format v2\n0\n16.7\n16.6\n");
    assert_failure(&unordered, 1, &["unordered.pts", "line 4"]);
    let words = times("words.pts", "# timecode format v2\n0\nsoon\n");
    assert_failure(&words, 1, &["words.pts", "line 3", "soon"]);
    assert_failure(
        &times("none.pts", "# timecode format v2\n"),
        1,
        &["no time"],
    );
    let missing = on_clip("analyze", &clip, &["--pts", "no/such.pts"]);
    assert_failure(&missing, 1, &["no/such.pts"]);
}

#[test]
fn what_was_measured_before_the_times_end_comes_out() {
    let times: String = (0..60)
        .map(|i| format!("{}\n", f64::from(i) * 1000.0 / 60.0))
        .collect();
    let pts = file("ends.pts", times.as_bytes());
    let args = [
        "analyze",
        "-",
        "--format",
        "json",
        "--pts",
        pts.to_str().unwrap(),
    ];
    // The command stops reading at the frame without a time.
    let output = piped(args.iter().chain(&CAMERA), &y4m(config(80)));
    assert_failure(&output, 1, &["only 60 times", "at least 61"]);
    common::assert_the_tone(&reports(&texts(&output).0)[0]);
}

#[test]
fn what_was_meant_is_told() {
    let wrong = |args: &[&str], words: &[&str]| {
        assert_failure(&command(args).output().unwrap(), 2, words);
    };
    wrong(&["phone.mp4"], &["rowtone analyze phone.mp4"]);
    let analyze = ["analyze", "clip.y4m"];
    wrong(
        &[&analyze[..], &["--line-time-us", "80us"]].concat(),
        &["in µs: 80"],
    );
    let exposure = ["--line-time-us", "80", "--exposure-us", "0.5ms"];
    wrong(&[&analyze[..], &exposure].concat(), &["in µs: 500"]);
    wrong(&[&analyze[..], &["--fps", "60Hz"]].concat(), &["in Hz: 60"]);
    let gap = ["--line-time-us", "80", "--window", "500ms"];
    wrong(&[&analyze[..], &gap].concat(), &["in s: 0.5"]);
    wrong(
        &["calibrate", "led.mp4", "--led-hz", "1kHz"],
        &["in Hz: 1000"],
    );
    wrong(
        &["calibrate", "led.mp4", "--led-hz", "-5"],
        &["--led-hz", "above 0"],
    );
    wrong(&["simulate", "-o", "clip.mp4"], &["is Y4M", "clip.y4m"]);
}

#[test]
fn time_between_windows_is_told() {
    let clip = file("gap.y4m", &y4m(config(90)));
    let sparse = ["--window", "0.5", "--hop", "1"];
    let output = on_clip("analyze", &clip, &sparse);
    assert_failure(&output, 0, &["--hop 1 is longer", "--window 0.5"]);
}

#[test]
fn command_lines_that_are_wrong() {
    let clip = file("options.y4m", &y4m(config(5)));
    let path = clip.to_str().unwrap();
    let bare = command(["analyze", path]).output().unwrap();
    assert_failure(
        &bare,
        2,
        &["--line-time-us", "--calibration", "--global-shutter"],
    );
    for (options, word) in [
        (&["--roi", "90,0,10,10"] as &[_], "not inside"),
        (&["--roi", "1,2,3"], "X,Y,W,H"),
        (&["--background", "0,119,96,2"], "not inside"),
        (&["--background", "0,0,96,120"], "whole picture"),
        (&["--rotate", "45"], "90"),
        (&["--fps", "-60"], "--fps"),
        (&["--fps", "500"], "longer than a frame"),
        (&["--max-peaks", "17"], "--max-peaks"),
        (&["--min-hz", "50", "--max-hz", "20"], "--min-hz"),
        (&["--plot", "picture.gif"], ".svg or .png"),
        (&["--format", "xml"], "xml"),
        (&["--no-such-option"], "--no-such-option"),
        (&["--global-shutter"], "--line-time-us"),
    ] {
        assert_failure(&on_clip("analyze", &clip, options), 2, &[word]);
    }
}

#[test]
fn a_header_s_faults_have_their_own_words() {
    let honest = y4m(config(60));
    let end = honest.iter().position(|&b| b == b'\n').unwrap();
    let with = |name: &str, header: &[u8]| {
        on_clip(
            "analyze",
            &file(name, &[header, &honest[end..]].concat()),
            &["--format", "json"],
        )
    };
    let header = &honest[..end];
    let latin = with("latin.y4m", &[header, b" Xcaf\xe9"].concat());
    common::assert_the_tone(&reports(&texts(&latin).0)[0]);
    let crlf = with("crlf.y4m", &[header, b"\r"].concat());
    assert_failure(&crlf, 1, &["CRLF", "copied as text"]);
    let long = with("long.y4m", &[header, b" X", &[b'x'; 5000]].concat());
    assert_failure(&long, 1, &["longer than 4096 bytes"]);
    let fast = with("fast.y4m", b"YUV4MPEG2 W96 H120 F99999999999:1 Cmono");
    assert_failure(&fast, 1, &["F99999999999:1", "--fps"]);
}

#[test]
fn times_and_exposures_that_cannot_be_right() {
    let clip = file("times.y4m", &y4m(config(60)));
    let times = |name: &str, unit: f64, count: u32| {
        let text: String = (0..count)
            .map(|i| format!("{:.3}\n", f64::from(i) * unit / 60.0))
            .collect();
        let path = file(name, text.as_bytes());
        on_clip("analyze", &clip, &["--pts", path.to_str().unwrap()])
    };
    assert_failure(
        &times("us.pts", 1e6, 60),
        1,
        &["us.pts", "microseconds", "milliseconds"],
    );
    assert_failure(
        &times("ns.pts", 1e9, 60),
        1,
        &["ns.pts", "nanoseconds", "milliseconds"],
    );
    assert_failure(&times("more.pts", 1e3, 65), 1, &["65 times", "60 frames"]);
    assert_failure(
        &times("fewer.pts", 1e3, 50),
        1,
        &["only 50 times", "60 frames"],
    );
    let no_text = on_clip("analyze", &clip, &["--pts", clip.to_str().unwrap()]);
    assert_failure(&no_text, 1, &["--pts", "no text"]);
    let exposed = |us: &str| {
        let args = [
            "analyze",
            clip.to_str().unwrap(),
            "--line-time-us",
            "100",
            "--exposure-us",
            us,
        ];
        command(args).output().unwrap()
    };
    assert_failure(&exposed("20000"), 2, &["exposure", "longer than a frame"]);
    let short = command(["analyze", clip.to_str().unwrap(), "--line-time-us", "0.1"])
        .output()
        .unwrap();
    assert_failure(&short, 2, &["--line-time-us 0.1", "µs"]);
}

/// As many times as frames is asked of a pipe too, where it shows only at the end.
#[test]
fn more_times_than_frames_of_a_pipe() {
    let text: String = (0..65)
        .map(|i| format!("{:.3}\n", f64::from(i) * 1e3 / 60.0))
        .collect();
    let pts = file("more-piped.pts", text.as_bytes());
    let args = [
        "analyze",
        "-",
        "--format",
        "json",
        "--pts",
        pts.to_str().unwrap(),
    ];
    let output = piped(args.iter().chain(&CAMERA), &y4m(config(60)));
    assert_failure(&output, 1, &["65 times", "60 frames"]);
    common::assert_the_tone(&reports(&texts(&output).0)[0]);
}

/// An exposure that nobody gave is warned of in every report for programs, and once for people.
#[test]
fn an_exposure_that_is_not_known_is_told() {
    let clip = file("unexposed.y4m", &y4m(config(120)));
    let run = |more: &[&str]| {
        let args = [
            &["analyze", clip.to_str().unwrap(), "--line-time-us", "100"],
            more,
        ]
        .concat();
        let (stdout, stderr) = texts(&command(args).output().unwrap());
        assert!(stderr.is_empty(), "{stderr}");
        stdout
    };
    for report in reports(&run(&["--format", "json"])) {
        let warnings = report["warnings"].as_array().unwrap();
        assert!(warnings.contains(&"exposure_unknown".into()), "{report}");
    }
    assert_eq!(run(&[]).matches("the exposure is unknown").count(), 1);
    assert!(!run(&["--exposure-us", "0"]).contains("exposure"));
}

#[test]
fn a_part_too_narrow_is_told_with_what_is_enough() {
    let mut soft = config(60);
    soft.sensor.cols = 16;
    soft.optics.blur_px = 3.0;
    let narrow = on_clip("analyze", &file("narrow-part.y4m", &y4m(soft)), &[]);
    assert_failure(&narrow, 1, &["16x120 px is too narrow", "32 px wide"]);
    let grey = [
        b"YUV4MPEG2 W96 H120 F60:1 Cmono\n".as_slice(),
        &[b"FRAME\n".as_slice(), &[90; 96 * 120]].concat().repeat(30),
    ]
    .concat();
    let grey = on_clip("analyze", &file("grey.y4m", &grey), &[]);
    assert_failure(&grey, 1, &["too little texture"]);
}

#[test]
fn help_and_version_are_results() {
    for args in [
        &["--help"] as &[_],
        &["help"],
        &["help", "analyze"],
        &["analyze", "--help"],
        &["--version"],
    ] {
        let output = command(args).output().unwrap();
        let (stdout, stderr) = texts(&output);
        assert!(output.status.success() && stderr.is_empty());
        assert!(stdout.contains("rowtone"), "{stdout}");
    }
}
