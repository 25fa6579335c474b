//! What is done to a gateway, on purpose or not: it goes on, and says what was lost.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::board::{line, pair};
use crate::broker::{Broker, publish_with, subscribe};
use crate::{
    JSON, assert_all, board_and_number, collect, config, dir, ports, rowtone, run, run_logged,
    wait_for,
};

const SPARKPLUG: &str = "format = \"sparkplug\"\ngroup = \"g\"\nnode = \"n\"";

/// Messages to and from an edge node's own topic.
const COMMANDS: &str = "spBv1.0/g/NCMD/n";

fn signal(process: u32, name: &str) {
    let done = Command::new("kill")
        .args([name, &process.to_string()])
        .status();
    assert!(done.unwrap().success());
}

/// A thousand hosts ask for births at once: they are said a few times, and data after them.
#[test]
fn a_burst_of_rebirths() {
    let dir = dir("rebirths");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "spBv1.0/g/+/n/#");
    let (mut masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {}", broker.port), SPARKPLUG, &names);
    let (_gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "connected", Duration::from_secs(20));
    let name = b"Node Control/Rebirth";
    let metric = [&[0x0a, name.len() as u8], &name[..], &[0x20, 11, 0x70, 1]].concat();
    let command = [&[0x12, metric.len() as u8], &metric[..]].concat();
    publish_with(broker.port, COMMANDS, &command, &["--repeat", "1000"]);
    std::thread::sleep(Duration::from_secs(2));
    masters[0].write_all(&line(1)).unwrap();
    let (mut node_births, mut data) = (0, 0);
    while data == 0 {
        let next = heard.recv_timeout(Duration::from_secs(20));
        let (topic, _) = next.expect("a report after the burst");
        node_births += u32::from(topic.contains("/NBIRTH/"));
        data += u32::from(topic.contains("/DDATA/"));
    }
    assert!((2..30).contains(&node_births), "{node_births}");
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// A command that is too long to read, retained: it is passed over at every connection, and said.
#[test]
fn a_command_that_is_too_long() {
    let dir = dir("poison");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    publish_with(broker.port, COMMANDS, &vec![b'x'; 300_000], &["-r"]);
    let (_client, heard) = subscribe(broker.port, "spBv1.0/g/DDATA/#");
    let (mut masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {}", broker.port), SPARKPLUG, &names);
    let (_gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "is passed over", Duration::from_secs(20));
    for seq in 0..3 {
        masters[0].write_all(&line(seq)).unwrap();
        heard
            .recv_timeout(Duration::from_secs(20))
            .expect("a report");
    }
    let said = std::fs::read_to_string(&log).unwrap();
    assert_eq!(said.matches("connected").count(), 1, "{said}");
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// Two gateways of one id throw each other out: they give each other more and more time, and say why.
#[test]
fn two_clients_of_one_id() {
    let dir = dir("twins");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let twins = ["a", "b"].map(|name| {
        let here = dir.join(name);
        std::fs::create_dir(&here).unwrap();
        let (masters, slaves, names) = ports(1);
        let config = config(&here, &format!("port = {}", broker.port), JSON, &names);
        (run_logged(&config, &[]), masters, slaves)
    });
    let within = Duration::from_secs(60);
    for ((_, log), ..) in &twins {
        wait_for(log, "another client has the id \"test\"", within);
        let said = std::fs::read_to_string(log).unwrap();
        assert!(said.matches("connected").count() < 8, "{said}");
    }
    drop((twins, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

/// A broker that takes everything and acknowledges nothing but the connection.
#[test]
fn a_broker_that_never_acknowledges() {
    let dir = dir("mute");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            std::thread::spawn(move || {
                let mut bytes = [0; 4096];
                let mut said: &[u8] = &[0x20, 2, 0, 0];
                while stream.read(&mut bytes).is_ok_and(|count| count > 0) {
                    // The connection, and from then on each ping: it says nothing but pings.
                    stream.write_all(said).unwrap();
                    said = &[0xd0, 0];
                }
            });
        }
    });
    let (mut masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {port}"), JSON, &names);
    let (_gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "connected", Duration::from_secs(20));
    masters[0].write_all(&line(0)).unwrap();
    wait_for(
        &log,
        "it has acknowledged nothing for 30 s",
        Duration::from_secs(60),
    );
    std::fs::remove_dir_all(dir).unwrap();
}

/// The cable is out for longer than the gateway asks in vain; the board keeps what was missed.
#[test]
fn a_cable_that_is_out_for_long() {
    let dir = dir("unplugged");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let cable = dir.join("cable");
    let plug_in = || {
        let (master, slave, name) = pair();
        let _ = std::fs::remove_file(&cable);
        std::os::unix::fs::symlink(name, &cable).unwrap();
        (master, slave)
    };
    let (mut master, slave) = plug_in();
    let ports = [cable.to_str().unwrap().to_owned()];
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &ports);
    let (_gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "listening", Duration::from_secs(20));
    for seq in [0, 1, 5] {
        master.write_all(&line(seq)).unwrap();
    }
    std::thread::sleep(Duration::from_millis(300));
    drop((master, slave));
    std::fs::remove_file(&cable).unwrap();
    std::thread::sleep(Duration::from_secs(18));
    let (mut master, _slave) = plug_in();
    // All that comes from the gateway within a while, and then the answer to it.
    let (mut asked, start) = (String::new(), Instant::now());
    while start.elapsed() < Duration::from_secs(5) {
        let mut bytes = [0; 256];
        let count = master.read(&mut bytes).unwrap_or(0);
        asked += std::str::from_utf8(&bytes[..count]).unwrap();
    }
    let questions = asked.matches("resend 2 4*").count();
    assert!((1..=2).contains(&questions), "{asked}");
    for seq in [2, 3, 4] {
        master.write_all(&line(seq)).unwrap();
    }
    let (numbers, _) = collect(&heard, 1, 6);
    assert_eq!(numbers["b0"], [0, 1, 5, 2, 3, 4]);
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// Harms the largest file of the spool.
fn harm(spool: &Path, at: usize, flip: u8) {
    let files = std::fs::read_dir(spool).unwrap().map(|file| file.unwrap());
    let largest = files.max_by_key(|file| file.metadata().unwrap().len());
    let path = largest.unwrap().path();
    let mut bytes = std::fs::read(&path).unwrap();
    let at = at % bytes.len();
    bytes[at] ^= flip;
    std::fs::write(path, bytes).unwrap();
}

/// One byte harmed on disk costs one report, which is said.
#[test]
fn a_harmed_spool() {
    let dir = dir("harmed");
    let Some(mut broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (mut masters, _slaves, names) = ports(1);
    let settings = format!("port = {}", broker.port);
    let config = config(&dir, &settings, JSON, &names);
    broker.stop();
    let (gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "listening", Duration::from_secs(20));
    for seq in 0..20 {
        masters[0].write_all(&line(seq)).unwrap();
    }
    std::thread::sleep(Duration::from_millis(700));
    drop(gateway);
    harm(&dir.join("spool"), 1200, 0x40);
    assert!(broker.go());
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (_gateway, log) = run_logged(&config, &[]);
    let (numbers, _) = collect(&heard, 1, 19);
    assert_eq!(numbers["b0"].last(), Some(&19));
    wait_for(&log, "b0: 1 report harmed on disk", Duration::from_secs(20));
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// A second gateway on the same spool is refused, and a signal ends the first in order.
#[test]
fn one_spool_is_for_one_gateway() {
    let dir = dir("shared");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/gateway/test/state");
    let (_masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let (mut gateway, log) = run_logged(&config, &[]);
    wait_for(&log, "connected", Duration::from_secs(20));
    let mut second = rowtone(&["gateway", "--seconds", "1", "--config"]);
    let second = second.arg(&config).output().unwrap();
    assert_eq!(second.status.code(), Some(1));
    let said = String::from_utf8_lossy(&second.stderr).into_owned();
    let process = gateway.0.id();
    assert!(said.contains(&format!("(process {process})")), "{said}");
    signal(process, "-TERM");
    assert!(gateway.0.wait().unwrap().success());
    let state = || String::from_utf8(heard.recv_timeout(Duration::from_secs(20)).unwrap().1);
    assert_eq!(state().unwrap(), "online");
    assert_eq!(state().unwrap(), "offline");
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// A client id that no topic can hold, and a file that is not there.
#[test]
fn what_check_refuses() {
    let dir = dir("check");
    let (_masters, _slaves, names) = ports(1);
    for (broker, why) in [
        ("", None),
        ("tls_ca = \"/nonexistent\"", Some("broker.tls_ca: ")),
    ] {
        let config = config(&dir, broker, JSON, &names);
        let mut command = rowtone(&["gateway", "--check", "--config"]);
        let output = command.arg(&config).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), why.is_none(), "{said}");
        assert!(said.contains(why.unwrap_or_default()), "{said}");
    }
    let config = config(&dir, "", JSON, &names);
    let text = std::fs::read_to_string(&config).unwrap();
    std::fs::write(&config, text.replace("\"test\"", "\"hall#2\"")).unwrap();
    let mut command = rowtone(&["gateway", "--check", "--config"]);
    let output = command.arg(&config).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains(":3: broker.client_id: "), "{said}");
    std::fs::remove_dir_all(dir).unwrap();
}

/// `kill -9` of the gateway, sixty times at any moment, while a board speaks and the broker comes and
/// goes: every report arrives.
#[test]
#[ignore = "takes two minutes"]
fn a_gateway_that_is_killed_sixty_times_loses_nothing() {
    const KILLS: u32 = 60;
    let dir = dir("sixty");
    let Some(mut broker) = Broker::lasting(&dir) else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (mut masters, _slaves, names) = ports(3);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let mut seq = 0;
    for kill in 0..KILLS {
        let (gateway, log) = run_logged(&config, &[]);
        let listening = format!("b2: listening on {}", names[2]);
        let start = Instant::now();
        while std::fs::read_to_string(&log)
            .unwrap()
            .matches(&listening)
            .count()
            <= kill as usize
        {
            assert!(start.elapsed().as_secs() < 30, "it does not listen");
            std::thread::sleep(Duration::from_millis(10));
        }
        if kill % 10 == 4 {
            broker.stop();
        } else if kill % 10 == 8 {
            assert!(broker.go());
        }
        for _ in 0..20 {
            for master in &mut masters {
                master.write_all(&line(seq)).unwrap();
            }
            seq += 1;
            // From half a second to a second and a half in all, each time another.
            std::thread::sleep(Duration::from_millis(u64::from(
                25 + 50 * (kill * 7 % 11) / 11,
            )));
        }
        // What is in the port's buffer is the computer's; it is asked for only of a board that keeps it.
        std::thread::sleep(Duration::from_millis(150));
        drop(gateway);
    }
    let _gateway = run(&config, &[]);
    let again = assert_all(&heard, 3, seq);
    println!("{seq} reports of 3 boards, {KILLS} kills, {again} came again");
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// So few descriptors that not even all boards can be heard: it goes on with those it has.
#[test]
fn too_few_descriptors() {
    let dir = dir("few");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (mut masters, _slaves, names) = ports(20);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let mut command = Command::new("sh");
    command.args([
        "-c",
        "ulimit -n 22; exec \"$0\" gateway --config \"$1\" --seconds 12",
    ]);
    command.arg(env!("CARGO_BIN_EXE_rowtone")).arg(&config);
    let mut gateway = command.stderr(std::process::Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    for seq in 0..20 {
        for master in &mut masters {
            master.write_all(&line(seq)).unwrap();
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(gateway.wait().unwrap().success());
    let came: Vec<(String, u64)> = heard
        .try_iter()
        .map(|(_, m)| board_and_number(&m))
        .collect();
    let boards: BTreeSet<&String> = came.iter().map(|(board, _)| board).collect();
    assert!((4..20).contains(&boards.len()), "{boards:?}");
    for board in boards {
        let count = came.iter().filter(|(of, _)| of == board).count();
        assert!(count >= 20, "{board}: {count}");
    }
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}
