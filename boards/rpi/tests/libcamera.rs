//! The real libcamera, with its virtual pipeline showing pictures of a simulated machine.
//!
//! Runs where `ROWTONE_LIBCAMERA` names a libcamera that `ci/libcamera.sh` has built; ci.sh does both. libcamera
//! allows one camera manager a process at a time, and the pictures are named in one file, so this is one test.
//!
//! `ROWTONE_PROGRAM` may name another build of the program (`qemu-aarch64 … rowtone-rpi`), whose libcamera is
//! then that of `ROWTONE_LIBCAMERA`; what is tested within this process is left out.
#![cfg(feature = "libcamera")]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use jpeg_encoder::{ColorType, Encoder};
use rowtone::report::Report;
use rowtone::wire::{Message, text};
use rowtone_rpi::capture::libcamera::Cameras;
use rowtone_rpi::capture::simulated::{Scene, Tone};
use rowtone_rpi::capture::{CameraError, Source};
use rowtone_rpi::config::Config;
use serialport::SerialPort;

const WIDTH: u16 = 320;
const HEIGHT: u16 = 240;
/// Pictures of the loop that the camera shows, one second of the machine.
const PICTURES: u32 = 50;
/// libcamera's virtual camera shows each so many times.
const SHOWN: u32 = 4;

/// Where the pictures lie, and the file that tells libcamera so.
struct Pictures {
    folder: PathBuf,
    description: PathBuf,
}

impl Pictures {
    fn new(prefix: &Path) -> Self {
        let folder = std::env::temp_dir().join(format!("rowtone-pictures-{}", std::process::id()));
        let description = prefix.join("share/libcamera/pipeline/virtual/virtual.yaml");
        Self {
            folder,
            description,
        }
    }

    /// `draw` gives each picture's luma.
    fn show(&self, mut draw: impl FnMut(u32) -> Vec<u8>) {
        let _ = fs::remove_dir_all(&self.folder);
        fs::create_dir_all(&self.folder).unwrap();
        for picture in 0..PICTURES {
            // Grey as colour: every decoder reads that.
            let rgb: Vec<u8> = draw(picture).iter().flat_map(|&v| [v; 3]).collect();
            let path = self.folder.join(format!("{picture:04}.jpg"));
            let encoder = Encoder::new_file(path, 100).unwrap();
            encoder.encode(&rgb, WIDTH, HEIGHT, ColorType::Rgb).unwrap();
        }
        let text = format!(
            "%YAML 1.1\n---\n\"Virtual0\":\n  supported_formats:\n  - width: {WIDTH}\n    height: {HEIGHT}\n    \
             frame_rates:\n    - 30\n    - 60\n  frames:\n    path: \"{}/\"\n  location: \"CameraLocationFront\"\n  \
             model: \"a simulated machine\"\n",
            self.folder.display()
        );
        fs::write(&self.description, text).unwrap();
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
        let _ = fs::remove_file(&self.description);
    }
}

#[test]
fn a_simulated_machine_through_the_real_libcamera() {
    let Some(prefix) = std::env::var_os("ROWTONE_LIBCAMERA") else {
        eprintln!("skipped: ROWTONE_LIBCAMERA is not set, see boards/rpi/ci.sh");
        return;
    };
    let pictures = Pictures::new(Path::new(&prefix));
    if std::env::var_os("ROWTONE_PROGRAM").is_none() {
        pictures.show(grey);
        bytes_arrive_exact_and_the_camera_comes_back();
        libcamera_is_started_anew(&pictures);
    }
    // From here on in processes of their own.
    let scene = Scene {
        width: WIDTH,
        height: HEIGHT,
        line_time_s: 66e-6,
        frame_period_ns: 20_000_000,
        // Whole numbers of periods in the loop of one second; no images of each other at 50 frames a second.
        tones: vec![Tone { hz: 83.0, px: 0.5 }, Tone { hz: 211.0, px: 0.2 }],
        ..Scene::default()
    };
    let mut luma = Vec::new();
    pictures.show(|picture| {
        scene.draw(
            i64::from(picture) * scene.frame_period_ns,
            picture,
            &mut luma,
        );
        luma.clone()
    });
    the_program_reports_the_right_peaks();
    a_missing_camera_is_said_and_waited_for();
}

/// A grey of its own for each picture.
fn grey(picture: u32) -> Vec<u8> {
    vec![grey_of(picture); usize::from(WIDTH) * usize::from(HEIGHT)]
}

fn grey_of(picture: u32) -> u8 {
    20 + 4 * picture as u8
}

fn bytes_arrive_exact_and_the_camera_comes_back() {
    let mut cameras = Cameras::new().unwrap();
    let config = Config::parse("[camera]\nstream = \"luma\"", "test").unwrap();
    let mut source = cameras.open(&config).unwrap();
    let shape = source.facts().shape;
    assert_eq!((shape.width, shape.height), (WIDTH, HEIGHT));
    let whole_loop = PICTURES * SHOWN;
    watch(source.as_mut(), whole_loop + 40, Duration::ZERO);
    // Held for long: the camera has no free buffer, nothing breaks, and bytes are right again.
    watch(source.as_mut(), 20, Duration::from_millis(50));
    watch(source.as_mut(), 40, Duration::ZERO);
    // Another frame rate can be asked for at any time.
    source.set_frame_period(25_000_000);
    watch(source.as_mut(), 20, Duration::ZERO);
    drop(source);
    // Closed and opened again.
    let mut source = cameras.open(&config).unwrap();
    watch(source.as_mut(), whole_loop, Duration::ZERO);
    drop(source);
    let wrong = Config::parse("[camera]\nid = \"imx477\"", "test").unwrap();
    match cameras.open(&wrong).map(|_| ()) {
        Err(CameraError::Missing { found, .. }) => assert_eq!(found.len(), 1, "{found:?}"),
        other => panic!("{other:?}"),
    }
    assert!(cameras.open(&config).is_ok(), "and it is still there");
}

/// A new manager after the old one has gone finds the camera again, and its frames; as often as one likes.
fn libcamera_is_started_anew(pictures: &Pictures) {
    let config = Config::parse("[camera]\nstream = \"luma\"", "test").unwrap();
    let mut cameras = Cameras::new().unwrap();
    assert!(
        matches!(Cameras::new(), Err(CameraError::Refused(_))),
        "two at once would abort"
    );
    let mut source = cameras.open(&config).unwrap();
    watch(source.as_mut(), 20, Duration::ZERO);
    assert!(
        matches!(cameras.restart(), Err(CameraError::Refused(_))),
        "a camera is open"
    );
    watch(source.as_mut(), 20, Duration::ZERO);
    drop(source);
    for _ in 0..3 {
        cameras.restart().unwrap();
        assert_eq!(cameras.names().len(), 1);
        let mut source = cameras.open(&config).unwrap();
        watch(source.as_mut(), 20, Duration::ZERO);
    }
    // It really looks for cameras from the beginning: one that is not there any more is not found.
    let description = fs::read(&pictures.description).unwrap();
    fs::write(&pictures.description, "%YAML 1.1\n---\n").unwrap();
    cameras.restart().unwrap();
    let found = cameras.names();
    fs::write(&pictures.description, description).unwrap();
    assert!(found.is_empty(), "{found:?}");
    match cameras.open(&config).map(|_| ()) {
        Err(CameraError::Missing { found, .. }) => assert!(found.is_empty(), "{found:?}"),
        other => panic!("{other:?}"),
    }
    drop(cameras);
    assert!(Cameras::new().is_ok(), "the first one has gone");
}

/// Takes frames and checks every byte of each, and that the greys follow each other.
fn watch(source: &mut dyn Source, frames: u32, hold: Duration) {
    let shape = source.facts().shape;
    let mut last = None;
    let mut times = 0;
    for _ in 0..frames {
        let taken = source.next(Duration::from_secs(5), &mut |frame| {
            assert!(frame.intact && frame.start_ns.is_some());
            let luma = &frame.bytes[..shape.stride * usize::from(shape.height)];
            let value = luma[0];
            assert!(
                luma.iter().all(|&byte| byte == value),
                "frame {}",
                frame.sequence
            );
            assert!(
                value >= grey_of(0) && (value - grey_of(0)).is_multiple_of(4),
                "{value}"
            );
            if let Some((sequence, before)) = last {
                assert!(frame.sequence > sequence);
                times += u32::from(before != value);
            }
            last = Some((frame.sequence, value));
            std::thread::sleep(hold);
        });
        taken.unwrap();
    }
    // Each picture is shown four times, so the grey changes every fourth frame.
    assert!(
        times.abs_diff(frames / SHOWN) <= 2,
        "{times} changes in {frames} frames"
    );
}

/// The program, ended when the test fails.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn program(arguments: &[&str], config: &str) -> Program {
    let file = std::env::temp_dir().join(format!("rowtone-rpi-{}.toml", std::process::id()));
    fs::write(&file, config).unwrap();
    let other = std::env::var("ROWTONE_PROGRAM").unwrap_or_default();
    let mut words = other.split_whitespace();
    let child = Command::new(words.next().unwrap_or(env!("CARGO_BIN_EXE_rowtone-rpi")))
        .args(words)
        .arg("--config")
        .arg(&file)
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn();
    Program(child.unwrap())
}

/// Ends the program as systemd does; its exit status, and what it said.
fn terminate(mut program: Program) -> (Option<i32>, String) {
    let id = program.0.id().to_string();
    let sent = Command::new("kill").args(["-TERM", &id]).status().unwrap();
    assert!(sent.success());
    let mut said = String::new();
    let stderr = program.0.stderr.take().unwrap();
    let mut stderr = stderr;
    let _ = stderr.read_to_string(&mut said);
    (program.0.wait().unwrap().code(), said)
}

/// Memory of the process that is in use, KiB.
fn resident_kib(program: &Program) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", program.0.id())).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS:"))
        .unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

fn the_program_reports_the_right_peaks() {
    let (mut ours, theirs) = serialport::TTYPort::pair().unwrap();
    ours.set_timeout(Duration::from_millis(50)).unwrap();
    let port = theirs.name().unwrap();
    let config = "[camera]\nstream = \"luma\"\nexposure_us = 1\nline_time_us = 66.0\n\
                  take_every = 4\nframe_period_us = 20000.0\n\
                  [page]\nlisten = \"off\"\n\
                  [service]\nrealtime_priority = 0\nstate = \"/nonexistent/state\"\n";
    let program = program(&["--output", &port], config);
    let mut heard = Vec::new();
    let mut resident = Vec::new();
    listen(&mut ours, |report| {
        heard.push(report);
        resident.push(resident_kib(&program));
        heard.len() >= 60
    });
    for report in heard.iter().filter(|r| r.window_s > 0.9) {
        for (hz, px) in [(83.0, 0.5), (211.0, 0.2)] {
            let found = report.peaks.iter().any(|p: &rowtone::report::Peak| {
                (p.hz - hz).abs() < 0.2 && (p.amplitude_px - px).abs() < 0.1 * px
            });
            assert!(found, "{hz} Hz in {report:?}");
        }
        let false_peak = report.peaks.iter().find(|p| {
            p.amplitude_px > 0.01 && (p.hz - 83.0).abs() > 1.0 && (p.hz - 211.0).abs() > 1.0
        });
        assert!(false_peak.is_none(), "{false_peak:?}");
        assert_eq!(report.lost_frames, 0);
    }
    eprintln!(
        "resident after 20 and after 60 reports: {} and {} KiB",
        resident[19], resident[59]
    );
    // Without the page, which keeps the last 8 MiB of reports. An emulator's own memory would count.
    let emulated = std::env::var_os("ROWTONE_PROGRAM").is_some();
    assert!(
        emulated || resident[59] < resident[19] + 512,
        "{resident:?}"
    );
    let stop = Instant::now();
    // Somebody must read the line, or the last report finds no room. That it arrives is tests/program.rs' business.
    let ending = std::thread::spawn(move || terminate(program));
    while !ending.is_finished() {
        let _ = ours.read(&mut [0; 4096]);
    }
    let (status, said) = ending.join().unwrap();
    eprintln!("{said}");
    assert_eq!(status, Some(0), "{said}");
    assert!(stop.elapsed() < Duration::from_secs(5));
    assert!(said.contains(" 0 lost"), "{said}");
    assert!(said.contains("-> 320x240"), "the mode and why: {said}");
}

fn a_missing_camera_is_said_and_waited_for() {
    let mut program = program(&["--output", "-", "--camera", "imx477"], "");
    // Until it has waited twice, however long an emulated libcamera takes.
    let mut said = String::new();
    let mut stderr = BufReader::new(program.0.stderr.take().unwrap());
    while !said.contains("next try in 1.0 s") {
        assert!(stderr.read_line(&mut said).unwrap() > 0, "{said}");
    }
    assert!(said.contains("no camera is called \"imx477\""), "{said}");
    program.0.stderr = Some(stderr.into_inner());
    let (status, said) = terminate(program);
    assert_eq!(status, Some(0), "{said}");
}

fn listen(port: &mut impl Read, mut enough: impl FnMut(Report) -> bool) {
    let began = Instant::now();
    let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
    let mut bytes = [0; 512];
    while began.elapsed() < Duration::from_secs(120) {
        let count = port.read(&mut bytes).unwrap_or(0);
        for message in bytes[..count].iter().filter_map(|&b| decoder.push(b)) {
            if let Message::Report { report, .. } = message.expect("every line is intact")
                && enough(report)
            {
                return;
            }
        }
    }
    panic!("too few reports within 120 s");
}
