//! The program on its simulated camera, as several tests start it.
//!
//! `ROWTONE_PROGRAM` may name another build of it, words before it included: `qemu-aarch64 … rowtone-rpi`.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program uses its part of this"
)]

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

/// How long to wait for something to come at all: an emulated program on a busy machine takes its time.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// The program, ended when the test fails.
pub struct Program(pub Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program to test.
pub fn command() -> Command {
    let other = std::env::var("ROWTONE_PROGRAM").unwrap_or_default();
    let mut words = other.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or(env!("CARGO_BIN_EXE_rowtone-rpi")));
    command.args(words);
    command
}

/// A configuration file of this test's own.
pub fn file(name: &str, text: &str) -> PathBuf {
    let name = format!("rowtone-rpi-{name}-{}.toml", std::process::id());
    let path = std::env::temp_dir().join(name);
    fs::write(&path, text).unwrap();
    path
}

/// The program with its camera simulated and its line on a pseudo-terminal, of which our end and the other (to be
/// kept, or the terminal hangs up) are given back.
pub fn start(name: &str, sections: &str) -> (Program, TTYPort, TTYPort) {
    let (mut ours, theirs) = TTYPort::pair().unwrap();
    ours.set_timeout(Duration::from_millis(20)).unwrap();
    let page = match sections.contains("[page]") {
        true => "",
        false => "[page]\nlisten = \"off\"\n",
    };
    let config = file(
        name,
        &format!(
            "[camera]\nmode = \"160x120\"\nlearn_frames = 8\nexposure_us = 1\n{sections}\n{page}\
             [service]\nrealtime_priority = 0\nstate = \"/nonexistent/state\"\n"
        ),
    );
    let child = command()
        .args([
            "--simulate",
            "--output",
            &theirs.name().unwrap(),
            "--config",
        ])
        .arg(&config)
        .stderr(Stdio::piped())
        .spawn();
    (Program(child.unwrap()), ours, theirs)
}

/// Asks it to end.
pub fn terminate(program: &Program) {
    let id = program.0.id().to_string();
    let sent = Command::new("kill").args(["-TERM", &id]).status().unwrap();
    assert!(sent.success());
}
