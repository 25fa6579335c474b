//! Serial ports, with pseudo-terminals in their place.
#![cfg(unix)]

#[path = "common/board.rs"]
mod board;
mod common;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Stdio};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use board::{Board, line};

use common::{
    CAMERA, assert_failure, assert_the_tone, command, config, file, on_clip, reports, texts, y4m,
};
use rowtone::wire::Format;
use rowtone::wire::{Message, text as wire_text};
use serialport::{SerialPort, TTYPort};

/// One test after the other: a child that starts between the making of a pseudo-terminal and its flag
/// would inherit it.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The board's end and the host's of a pseudo-terminal, and the device's name.
fn pair() -> (TTYPort, TTYPort, String) {
    let (mut master, slave, name) = board::pair();
    master.set_timeout(Duration::from_secs(20)).unwrap();
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

/// A live measurement goes on while nobody takes its reports; at the end it says what became of them.
#[test]
fn a_stuck_port_does_not_hold_up_a_live_measurement() {
    let bytes = y4m(config(150));
    let _alone = alone();
    let (_port, mut end, name) = pair();
    // Full to the brim before the first report.
    end.set_timeout(Duration::from_millis(50)).unwrap();
    while end.write(&[b'x'; 1024]).is_ok() {}
    let args = ["analyze", "-", "--format", "json", "--serial", &name];
    let more = ["--window", "0.5", "--hop", "0.01"];
    let mut child = command(args.iter().copied().chain(more).chain(CAMERA))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // Beside the reading: the reports are more than a pipe holds.
    let filming = std::thread::spawn(move || stdin.write_all(&bytes));
    let output = child.wait_with_output().unwrap();
    filming.join().unwrap().unwrap();
    let (stdout, stderr) = texts(&output);
    assert_failure(&output, 1, &[&name, "stuck", "dropped", "left"]);
    let printed = reports(&stdout);
    assert!(printed.len() > 100, "{}", printed.len());
    let words: Vec<&str> = stderr.split_whitespace().collect();
    let number = |before: &str| -> usize {
        let is = |word: &&str| word.trim_end_matches(',') == before;
        words[words.iter().position(is).unwrap() - 1]
            .parse()
            .unwrap()
    };
    let [sent, dropped, left] = ["reports", "dropped", "left"].map(number);
    assert_eq!(sent, 0, "{stderr}");
    assert!(dropped > 0 && left > 0, "{stderr}");
    assert_eq!(dropped + left, printed.len(), "{stderr}");
}

/// A recording waits for a slow line, which answers commands all the while.
#[test]
fn a_slow_line_gets_every_report_and_answers() {
    let clip = file("slow.y4m", &y4m(config(90)));
    let _alone = alone();
    let (mut port, _end, name) = pair();
    let slow = std::thread::spawn(move || {
        let mut decoder = wire_text::Decoder::<{ wire_text::MAX_LINE }>::new();
        let (mut numbers, mut said) = (vec![], vec![]);
        let mut bytes = [0; 64];
        let mut asked = false;
        // 19 kB/s, the speed of 192 kbaud.
        while let Ok(count) = port.read(&mut bytes) {
            for &byte in &bytes[..count] {
                match decoder.push(byte) {
                    Some(Ok(Message::Report { report, .. })) => numbers.push(report.seq),
                    Some(Ok(Message::Reply(reply))) => said.push(reply.text.to_string()),
                    Some(Ok(Message::Status(status))) => said.push(format!("{status:?}")),
                    Some(Err(error)) => panic!("{error}"),
                    None => {}
                }
            }
            if !asked && numbers.len() == 10 {
                let ask = b"resend 2 4\nget window\nset window 2\nstatus\n";
                // Two answers wait at most, so one after the other.
                for line in ask.split_inclusive(|&byte| byte == b'\n') {
                    port.write_all(line).unwrap();
                    std::thread::sleep(Duration::from_millis(60));
                }
                asked = true;
            }
            std::thread::sleep(Duration::from_micros(3300));
            port.set_timeout(Duration::from_secs(1)).unwrap();
        }
        (numbers, said)
    });
    let more = ["--window", "0.5", "--hop", "0.01", "--serial", &name];
    let output = on_clip(
        "analyze",
        &clip,
        &[&["--format", "json"], &more[..]].concat(),
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let printed = reports(&stdout).len() as u32;
    let (mut numbers, said) = slow.join().unwrap();
    assert_eq!(numbers.len() as u32, printed + 3, "2 to 4 came twice");
    numbers.sort_unstable();
    numbers.dedup();
    assert!(numbers.into_iter().eq(0..printed));
    assert!(said.contains(&"resending 2 to 4".to_owned()), "{said:?}");
    assert!(said.contains(&"window=0.5".to_owned()), "{said:?}");
    assert!(
        said.iter()
            .any(|said| said.starts_with("settings: fixed here")),
        "{said:?}"
    );
    assert!(
        said.iter().any(|said| said.contains("refused_commands: 1")),
        "{said:?}"
    );
}

/// `rowtone monitor` on a port, its lines to be read.
fn monitor(port: &str, more: &[&str]) -> (Child, BufReader<ChildStdout>) {
    let mut child = command(["monitor", port].iter().chain(more))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    (child, out)
}

/// Reads lines until the numbers of the reports are complete from the first to `last`.
fn read_up_to(out: &mut BufReader<ChildStdout>, last: u64) -> Vec<u64> {
    let mut numbers = vec![];
    let mut set = BTreeSet::new();
    loop {
        let mut line = String::new();
        assert!(
            out.read_line(&mut line).unwrap() > 0,
            "it ended: {numbers:?}"
        );
        let seq = reports(&line)[0]["seq"].as_u64().unwrap();
        numbers.push(seq);
        set.insert(seq);
        let first = *set.first().unwrap();
        assert!(first < last, "it came late: {numbers:?}");
        if (first..=last).all(|seq| set.contains(&seq)) {
            return numbers;
        }
    }
}

/// On a cable that harms one byte in 3000 both ways, what is missing is asked for and comes.
#[test]
fn monitor_asks_for_what_was_lost() {
    let _alone = alone();
    for (wire, seed) in [(Format::Text, 11), (Format::Binary, 12)] {
        let board = Board::start(wire, Duration::from_millis(10), 1.0 / 3000.0, seed);
        let (mut child, mut out) = monitor(&board.port, &["--format", "json"]);
        let mut numbers = read_up_to(&mut out, 120);
        let in_order = numbers.is_sorted();
        numbers.sort_unstable();
        let came = numbers.len();
        numbers.dedup();
        assert_eq!(came, numbers.len(), "one was shown twice");
        assert!(board.harmed() > 0 && !in_order, "nothing was lost");
        child.kill().unwrap();
        child.wait().unwrap();
    }
}

/// The lines of a log without its heading; the last one may be cut short where it was killed.
fn log_lines(path: &Path) -> (Vec<String>, bool) {
    let text = std::fs::read_to_string(path).unwrap();
    let whole = text.ends_with('\n');
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if path.extension().is_some_and(|ending| ending == "csv") {
        assert!(lines.remove(0).starts_with("received_unix_s,session,seq,"));
    }
    (lines, whole)
}

/// `kill -9`, again and again: the log has every report that was shown, and goes on where it ended.
#[test]
fn a_log_survives_kill_9() {
    let _alone = alone();
    for ending in ["csv", "jsonl"] {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("killed.{ending}"));
        let _ = std::fs::remove_file(&path);
        let log = path.to_str().unwrap();
        let board = Board::start(Format::Text, Duration::from_millis(2), 0.0, 1);
        let mut shown = BTreeSet::new();
        for _ in 0..4 {
            let (mut child, mut out) = monitor(&board.port, &["--format", "json", "--log", log]);
            for _ in 0..50 {
                let mut line = String::new();
                out.read_line(&mut line).unwrap();
                shown.insert(reports(&line)[0]["seq"].as_u64().unwrap());
            }
            child.kill().unwrap();
            child.wait().unwrap();
        }
        let (mut lines, whole) = log_lines(&path);
        if !whole {
            lines.pop();
        }
        let seq = |line: &String| -> u64 {
            match ending {
                "csv" => {
                    let fields: Vec<&str> = line.split(',').collect();
                    assert_eq!(fields.len(), 11 + 3 * 16, "{line}");
                    fields[2].parse().unwrap()
                }
                _ => serde_json::from_str::<serde_json::Value>(line).unwrap()["seq"]
                    .as_u64()
                    .unwrap(),
            }
        };
        let logged: BTreeSet<u64> = lines.iter().map(seq).collect();
        // What is shown was logged before.
        assert!(
            logged.is_superset(&shown),
            "{:?}",
            shown.difference(&logged)
        );
        std::fs::remove_file(path).unwrap();
    }
}

/// The cable is pulled and plugged in again: the port has gone, and comes back under its name. Plain
/// lines, as always where the output is no terminal.
#[test]
fn monitor_goes_on_when_the_cable_is_back() {
    let _alone = alone();
    let name = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tty-rowtone");
    let plug = || {
        let (port, end, device) = pair();
        let _ = std::fs::remove_file(&name);
        std::os::unix::fs::symlink(device, &name).unwrap();
        (port, end)
    };
    let (mut port, end) = plug();
    let (mut child, mut out) = monitor(name.to_str().unwrap(), &[]);
    let mut next = || {
        let mut line = String::new();
        while !line.contains("#") {
            line.clear();
            assert!(out.read_line(&mut line).unwrap() > 0, "it ended");
        }
        line
    };
    port.write_all(&line(5)).unwrap();
    assert!(next().contains("#5: "));
    drop((port, end));
    std::thread::sleep(Duration::from_millis(300));
    let (mut port, _end) = plug();
    // Garbage, and the tail of a sentence, as when a plug goes in.
    port.write_all(b"\0\xff$RT147.6/0.0\r\n").unwrap();
    port.write_all(&line(6)).unwrap();
    assert!(next().contains("#6: "));
    child.kill().unwrap();
    let mut said = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut said)
        .unwrap();
    child.wait().unwrap();
    assert!(said.contains("went away"), "{said}");
    std::fs::remove_file(&name).unwrap();
}
