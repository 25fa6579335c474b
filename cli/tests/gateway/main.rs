//! The gateway against a real mosquitto on loopback, its boards on pseudo-terminals.
//!
//! Left out, and said so, where there is no mosquitto (Debian: `apt-get install mosquitto
//! mosquitto-clients`).
//! The load, 200 boards, and ten kills of the broker in a row:
//! `cargo test --release -p rowtone-cli --test gateway -- --ignored --nocapture`
#![cfg(unix)]

mod alarms;
mod attacks;
#[path = "../common/board.rs"]
mod board;
mod broker;
mod delivery;
mod load;
mod payloads;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use serialport::TTYPort;

/// A child that ends with the test.
struct Gateway(Child);

impl Drop for Gateway {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn rowtone(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rowtone"));
    command.args(arguments);
    command
}

fn dir(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("rowtone-gateway-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// The configuration of boards on these ports.
fn config(dir: &Path, broker: &str, payload: &str, ports: &[String]) -> PathBuf {
    let mut config = format!(
        "[broker]\nhost = \"127.0.0.1\"\nclient_id = \"test\"\n{broker}\n\
         [payload]\n{payload}\n[spool]\ndir = \"{}/spool\"\n",
        dir.display()
    );
    for (number, port) in ports.iter().enumerate() {
        config += &format!("[[board]]\nname = \"b{number}\"\nport = \"{port}\"\n");
    }
    let path = dir.join("gateway.toml");
    std::fs::write(&path, config).unwrap();
    path
}

/// Plain JSON.
const JSON: &str = "format = \"json\"\ntopic = \"plant\"";

/// The board's ends of so many pseudo-terminals, the hosts' (to be kept open), and their names.
fn ports(count: usize) -> (Vec<TTYPort>, Vec<TTYPort>, Vec<String>) {
    let (mut masters, mut slaves, mut names) = (vec![], vec![], vec![]);
    for _ in 0..count {
        let (master, slave, name) = board::pair();
        masters.push(master);
        slaves.push(slave);
        names.push(name);
    }
    (masters, slaves, names)
}

fn board_and_number(message: &[u8]) -> (String, u64) {
    let object: serde_json::Value = serde_json::from_slice(message).unwrap();
    let board = object["board"].as_str().unwrap().to_owned();
    (board, object["seq"].as_u64().unwrap())
}

/// Takes reports until every board has `count` different ones; then their numbers in the order in
/// which each first came, by board, and how many came again.
fn collect(
    heard: &Receiver<(String, Vec<u8>)>,
    boards: usize,
    count: usize,
) -> (BTreeMap<String, Vec<u64>>, u32) {
    let (mut numbers, mut again) = (BTreeMap::<String, Vec<u64>>::new(), 0);
    let end = Instant::now() + Duration::from_secs(120);
    while numbers.len() < boards || numbers.values().any(|numbers| numbers.len() < count) {
        let left = end.saturating_duration_since(Instant::now());
        let Ok((_, message)) = heard.recv_timeout(left) else {
            let counts: Vec<usize> = numbers.values().map(Vec::len).collect();
            panic!("not all came: {counts:?} of {count}");
        };
        let (board, seq) = board_and_number(&message);
        let of_board = numbers.entry(board).or_default();
        if of_board.contains(&seq) {
            again += 1;
        } else {
            of_board.push(seq);
        }
    }
    (numbers, again)
}

/// Asserts that every report from 0 to `count` came from each of these boards, in order. How many came
/// again.
fn assert_all(heard: &Receiver<(String, Vec<u8>)>, boards: usize, count: u32) -> u32 {
    let (numbers, again) = collect(heard, boards, count as usize);
    for (board, numbers) in &numbers {
        let expected = 0..u64::from(count);
        assert!(numbers.iter().copied().eq(expected), "{board}: {numbers:?}");
    }
    again
}

fn run(config: &Path, more: &[&str]) -> Gateway {
    run_into(config, more, Stdio::null())
}

fn run_into(config: &Path, more: &[&str], stderr: Stdio) -> Gateway {
    let mut command = rowtone(&["gateway", "--config"]);
    Gateway(
        command
            .arg(config)
            .args(more)
            .stderr(stderr)
            .spawn()
            .unwrap(),
    )
}

/// The same, and where what it says is to be found.
fn run_logged(config: &Path, more: &[&str]) -> (Gateway, PathBuf) {
    let path = config.with_extension("log");
    let log = std::fs::File::options()
        .append(true)
        .create(true)
        .open(&path)
        .unwrap();
    (run_into(config, more, log.into()), path)
}

/// Waits until the log says this.
fn wait_for(log: &Path, what: &str, within: Duration) {
    let start = Instant::now();
    loop {
        let said = std::fs::read_to_string(log).unwrap();
        if said.contains(what) {
            return;
        }
        assert!(start.elapsed() < within, "no {what:?} in\n{said}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
