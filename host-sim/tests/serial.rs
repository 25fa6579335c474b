//! Serial ports, with pseudo-terminals in their place.
#![cfg(unix)]

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::os::fd::AsRawFd;
use std::process::Stdio;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use common::{
    CAMERA, assert_failure, assert_the_tone, command, config, file, on_clip, reports, texts, y4m,
};
use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use serialport::{SerialPort, TTYPort};

/// One test after the other: a child that starts between the making of a pseudo-terminal and its flag
/// would inherit it.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Two ends of a pseudo-terminal: what is written to the device of this name is read from the port.
fn pair() -> (TTYPort, TTYPort, String) {
    let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    // A child that inherited an end would keep the other from ever seeing it go.
    for end in [&master, &slave] {
        let close = FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC);
        fcntl(end.as_raw_fd(), close).expect("a flag of our own");
    }
    master.set_timeout(Duration::from_secs(20)).unwrap();
    let name = slave.name().expect("the slave has a name");
    (master, slave, name)
}

#[test]
fn what_analyze_sends_monitor_shows() {
    let clip = file("serial.y4m", &y4m(config(90)));
    let _alone = alone();
    let (mut board, _board_end, board_name) = pair();
    let (mut host, host_end, host_name) = pair();
    let mut monitor = command(["monitor", &host_name, "--once", "--format", "json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut monitor_out = BufReader::new(monitor.stdout.take().unwrap());

    let serial = format!("{board_name}:921600");
    let output = on_clip("analyze", &clip, &["--format", "json", "--serial", &serial]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let printed = reports(&stdout);
    assert_eq!(printed.len(), 2);

    // The cable between the two ends.
    let mut sent = Vec::new();
    while sent.iter().filter(|&&byte| byte == b'\n').count() < printed.len() {
        let mut bytes = [0; 256];
        let n = board.read(&mut bytes).unwrap();
        sent.extend_from_slice(&bytes[..n]);
    }
    host.write_all(&sent).unwrap();
    for report in &printed {
        let mut line = String::new();
        monitor_out.read_line(&mut line).unwrap();
        let heard = &reports(&line)[0];
        assert_the_tone(heard);
        assert_eq!(heard["seq"], report["seq"]);
    }
    // The cable is pulled: monitor ends.
    drop((host, host_end));
    let mut rest = String::new();
    monitor_out.read_to_string(&mut rest).unwrap();
    assert_eq!(rest, "");
    assert_failure(
        &monitor.wait_with_output().unwrap(),
        1,
        &[&host_name, "after 2 reports"],
    );
}

#[test]
fn a_port_that_is_not_there() {
    let _alone = alone();
    let clip = file("no-port.y4m", &y4m(config(5)));
    let output = on_clip("analyze", &clip, &["--serial", "/dev/no-such-port"]);
    assert_failure(&output, 1, &["/dev/no-such-port", "opened"]);
    let output = command(["monitor", "/dev/no-such-port"]).output().unwrap();
    assert_failure(&output, 1, &["/dev/no-such-port"]);
}

#[test]
fn a_port_that_goes_away_ends_only_the_sending() {
    let bytes = y4m(config(150));
    let _alone = alone();
    let (mut port, end, name) = pair();
    let args = ["analyze", "-", "--format", "json", "--serial", &name];
    let mut child = command(args.iter().copied().chain(CAMERA))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // Enough for the first window, which is sent.
    let (first, rest) = bytes.split_at(bytes.len() / 2);
    stdin.write_all(first).unwrap();
    let mut byte = [0];
    while byte != *b"\n" {
        port.read_exact(&mut byte).unwrap();
    }
    drop((port, end));
    std::thread::sleep(Duration::from_millis(300));
    stdin.write_all(rest).unwrap();
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    let (stdout, stderr) = texts(&output);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains(&name) && stderr.contains("went away after 1 report"),
        "{stderr}"
    );
    let reports = reports(&stdout);
    assert_eq!(reports.len(), 4, "{stdout}");
    reports.iter().for_each(assert_the_tone);
}
