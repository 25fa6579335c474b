//! The program itself, on its simulated camera: its exit status, its last report, its memory, what it says.
//!
//! `ROWTONE_PROGRAM` may name another build of it, words before it included: `qemu-aarch64 … rowtone-rpi`.

mod common;

use std::fs;
use std::io::Read;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

use common::{PATIENCE, Program, command, file, start, terminate};
use rowtone::report::Report;
use rowtone::wire::{Message, text};
use serialport::TTYPort;

/// Reports from a port, one by one.
struct Reports<'a> {
    port: &'a mut TTYPort,
    decoder: text::Decoder<{ text::MAX_LINE }>,
    ready: Vec<Report>,
}

impl<'a> Reports<'a> {
    fn new(port: &'a mut TTYPort) -> Self {
        Self {
            port,
            decoder: text::Decoder::new(),
            ready: Vec::new(),
        }
    }

    /// The next one, within so long.
    fn next(&mut self, within: Duration) -> Option<Report> {
        let began = Instant::now();
        let mut bytes = [0; 512];
        while self.ready.is_empty() && began.elapsed() < within {
            let count = self.port.read(&mut bytes).unwrap_or(0);
            for &byte in &bytes[..count] {
                if let Some(message) = self.decoder.push(byte)
                    && let Message::Report { report, .. } = message.expect("every line is intact")
                {
                    self.ready.push(report);
                }
            }
        }
        (!self.ready.is_empty()).then(|| self.ready.remove(0))
    }
}

#[test]
fn sigterm_in_the_middle_of_a_window_sends_what_was_measured_and_exits_with_0() {
    let (mut program, mut ours, _theirs) =
        start("sigterm", "[measure]\nwindow_s = 1.0\nhop_s = 1.0");
    let mut reports = Reports::new(&mut ours);
    let patience = PATIENCE;
    reports.next(patience).expect("a first report");
    let began = Instant::now();
    let second = reports.next(patience).expect("a second report");
    // The simulation takes its time where the machine is busy: wait for two thirds of a window of its own time.
    std::thread::sleep(began.elapsed().mul_f64(0.67));
    let asked = Instant::now();
    terminate(&program);
    let last = reports.next(patience).expect("a last report");
    // The next whole window would have ended 1 s after the second.
    let after_ms = last.time_ms - second.time_ms;
    assert!((400..950).contains(&after_ms), "{after_ms} ms");
    assert_eq!(last.seq, second.seq + 1);
    for hz in [97.3, 211.7] {
        assert!(
            last.peaks.iter().any(|p| (p.hz - hz).abs() < 0.5),
            "{last:?}"
        );
    }
    let status = program.0.wait().unwrap();
    assert!(asked.elapsed() < Duration::from_secs(5));
    assert_eq!(status.code(), Some(0));
    let mut said = String::new();
    let stderr = program.0.stderr.take();
    stderr.unwrap().read_to_string(&mut said).unwrap();
    assert!(said.contains("ended after"), "{said}");
    assert!(reports.next(Duration::from_millis(100)).is_none());
}

/// There is nothing to send yet: it ends all the same, at once and in order.
#[test]
fn sigterm_before_the_first_report_ends_it() {
    let (mut program, mut ours, _theirs) = start("early", "[measure]\nwindow_s = 5.0\nhop_s = 5.0");
    // It has begun when it says something, or nothing within a second.
    let mut reports = Reports::new(&mut ours);
    assert!(reports.next(Duration::from_secs(1)).is_none());
    let asked = Instant::now();
    terminate(&program);
    assert_eq!(program.0.wait().unwrap().code(), Some(0));
    assert!(asked.elapsed() < Duration::from_secs(5));
}

/// Memory of the process that is in use, KiB.
fn resident_kib(program: &Program) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", program.0.id())).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let words = line.unwrap().split_whitespace();
    words.take(2).last().unwrap().parse().unwrap()
}

#[test]
fn memory_does_not_grow_once_reports_flow() {
    let (program, mut ours, _theirs) = start("memory", "[measure]\nwindow_s = 0.2\nhop_s = 0.05");
    let mut reports = Reports::new(&mut ours);
    let mut resident = Vec::new();
    while resident.len() < 50 {
        reports.next(PATIENCE).expect("reports");
        resident.push(resident_kib(&program));
    }
    let (early, late) = (resident[9], resident[49]);
    if std::env::var_os("ROWTONE_PROGRAM").is_some() {
        return eprintln!(
            "not compared: an emulator's own memory would count ({early} and {late} KiB)"
        );
    }
    // Pages of code that are used for the first time count too: a little is allowed.
    assert!(late <= early + 256, "{resident:?}");
    eprintln!("resident after 10 and after 50 reports: {early} and {late} KiB");
}

/// A pipe that nobody reads is no reason not to end.
#[test]
fn sigterm_ends_it_though_nobody_reads() {
    use std::os::fd::AsRawFd;
    let config = file(
        "stalled",
        "[camera]\nmode = \"160x120\"\nlearn_frames = 8\n[measure]\nwindow_s = 0.2\nhop_s = 0.02\n",
    );
    let child = command()
        .args(["--simulate", "--output", "-", "--config"])
        .arg(&config)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut program = Program(child.unwrap());
    let mut pipe = program.0.stdout.take().unwrap();
    // SAFETY: the descriptor is open, and the call takes a number.
    let set = unsafe { libc::fcntl(pipe.as_raw_fd(), libc::F_SETPIPE_SZ, 8192) };
    assert!(set >= 0);
    // Until the pipe is full.
    let began = Instant::now();
    let mut waiting: libc::c_int = 0;
    while waiting < 3500 {
        std::thread::sleep(Duration::from_millis(50));
        // SAFETY: the call writes one int, which lives until its end.
        let asked = unsafe { libc::ioctl(pipe.as_raw_fd(), libc::FIONREAD, &mut waiting) };
        assert!(asked == 0 && began.elapsed() < Duration::from_secs(60));
    }
    let asked = Instant::now();
    terminate(&program);
    assert_eq!(program.0.wait().unwrap().code(), Some(0));
    assert!(asked.elapsed() < Duration::from_secs(5));
    let mut said = String::new();
    pipe.read_to_string(&mut said).unwrap();
    assert!(said.contains("$RTRPT"), "{said}");
}

/// Who read its reports and its messages has gone, as `2>&1 | head -4` has: it ends by itself.
#[test]
fn it_ends_when_its_reader_has_gone() {
    let config = file(
        "gone",
        "[camera]\nmode = \"160x120\"\nlearn_frames = 8\n[measure]\nwindow_s = 0.2\nhop_s = 0.1\n",
    );
    let (mut read, write) = std::io::pipe().unwrap();
    let child = command()
        .args(["--simulate", "--output", "-", "--config"])
        .arg(&config)
        .stdout(write.try_clone().unwrap())
        .stderr(write)
        .spawn();
    let mut program = Program(child.unwrap());
    let (mut said, mut bytes) = (vec![], [0; 512]);
    while !said.windows(6).any(|part| part == b"$RTRPT") {
        let count = read.read(&mut bytes).unwrap();
        assert!(count > 0, "{}", String::from_utf8_lossy(&said));
        said.extend(&bytes[..count]);
    }
    drop(read);
    let gone = Instant::now();
    while program.0.try_wait().unwrap().is_none() {
        assert!(gone.elapsed() < PATIENCE, "it does not end");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn output(arguments: &[&str]) -> Output {
    command().args(arguments).output().unwrap()
}

#[test]
fn doctor_finds_nothing_wrong_with_the_simulation() {
    let done = output(&["doctor", "--simulate", "--mode", "160x120", "--output", "-"]);
    let said = String::from_utf8(done.stdout).unwrap();
    assert_eq!(done.status.code(), Some(0), "{said}");
    for part in [
        "output",
        "camera",
        "line time",
        "frames",
        "light",
        "texture",
    ] {
        assert!(said.contains(&format!("ok    {part}")), "{said}");
    }
}

#[test]
fn a_wrong_configuration_is_named_by_file_line_and_key() {
    let path = file("wrong", "[measure]\n\nhop_s = 7.5\n");
    let path = path.to_str().unwrap();
    let done = output(&["--simulate", "--config", path]);
    assert_eq!(done.status.code(), Some(2));
    let said = String::from_utf8(done.stderr).unwrap();
    let wanted = format!("rowtone-rpi: {path}:3: measure.hop_s is 7.5: give 0.01 to 1\n");
    assert_eq!(said, wanted);
    let path = file(
        "uncalibrated",
        "[camera]\ncalibration = \"/nowhere/cal.toml\"\n",
    );
    let done = output(&["--simulate", "--config", path.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(2), "it is not tried for ever");
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(said.contains("/nowhere/cal.toml: No such file"), "{said}");
    let done = output(&["--simulate", "--config", "/nonexistent.toml"]);
    assert_eq!(done.status.code(), Some(2));
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(
        said.starts_with("rowtone-rpi: /nonexistent.toml: cannot be read"),
        "{said}"
    );
}
