//! The gateway against a real mosquitto on loopback, its boards on pseudo-terminals.
//!
//! Left out, and said so, where there is no mosquitto (Debian: `apt-get install mosquitto`).
//! The load, 200 boards: `cargo test --release -p host-sim --test gateway -- --ignored --nocapture`
#![cfg(unix)]

use std::collections::BTreeMap;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rowtone::report::{Peak, Report, Warnings};
use rowtone::wire::{Message, text};
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use serialport::{SerialPort, TTYPort};

/// A mosquitto that remembers over a restart, and ends with the test.
struct Broker {
    config: PathBuf,
    port: u16,
    child: Option<Child>,
}

impl Broker {
    /// `None` where there is no mosquitto.
    fn start(dir: &Path, more: &str) -> Option<Self> {
        let port = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
        let config = dir.join("mosquitto.conf");
        let text = format!(
            "listener {port} 127.0.0.1\npersistence true\npersistence_location {}/\n\
             max_queued_messages 0\nmax_inflight_messages 0\nuser root\n{more}\n",
            dir.display()
        );
        std::fs::write(&config, text).unwrap();
        let mut broker = Self {
            config,
            port,
            child: None,
        };
        broker.go().then_some(broker)
    }

    fn go(&mut self) -> bool {
        // Debian keeps it where only root looks.
        for program in ["mosquitto", "/usr/sbin/mosquitto"] {
            let child = Command::new(program)
                .args(["-c".as_ref(), self.config.as_os_str()])
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn();
            let Ok(child) = child else { continue };
            self.child = Some(child);
            let start = Instant::now();
            while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
                assert!(start.elapsed().as_secs() < 20, "mosquitto does not answer");
                std::thread::sleep(Duration::from_millis(20));
            }
            return true;
        }
        eprintln!("left out: there is no mosquitto; apt-get install mosquitto");
        false
    }

    fn stop(&mut self) {
        let Some(mut child) = self.child.take() else {
            return;
        };
        // Asked politely it keeps the sessions of its clients.
        let _ = Command::new("kill").arg(child.id().to_string()).status();
        let _ = child.wait();
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.stop();
    }
}

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

/// The board's ends of so many pseudo-terminals, the hosts' (to be kept open), and a configuration.
fn boards(count: usize, dir: &Path, broker: &str) -> (Vec<TTYPort>, Vec<TTYPort>, PathBuf) {
    let mut config = format!(
        "[broker]\nhost = \"127.0.0.1\"\nclient_id = \"test\"\n{broker}\n\
         [payload]\nformat = \"json\"\ntopic = \"plant\"\n[spool]\ndir = \"{}/spool\"\n",
        dir.display()
    );
    let (mut masters, mut slaves) = (vec![], vec![]);
    for number in 0..count {
        let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let port = slave.name().unwrap();
        config += &format!("[[board]]\nname = \"b{number}\"\nport = \"{port}\"\n");
        masters.push(master);
        slaves.push(slave);
    }
    let path = dir.join("gateway.toml");
    std::fs::write(&path, config).unwrap();
    (masters, slaves, path)
}

fn line(seq: u32) -> Vec<u8> {
    let peak = |hz| Peak {
        hz,
        hz_sd: 0.0004,
        amplitude_px: 0.4,
        amplitude_px_sd: 0.0002,
        snr_db: 61.2,
        ambiguous: false,
        track: 1,
        harmonic: None,
    };
    let report = Report {
        seq,
        time_ms: 500 * u64::from(seq),
        window_s: 1.0,
        fps: 60.0,
        lines: 18_000,
        lost_frames: 0,
        noise_px: 0.0131,
        peaks: [peak(49.2), peak(98.4), peak(147.6)].into_iter().collect(),
        warnings: Warnings(0),
        um_per_px: None,
        velocity_mm_s_rms: None,
    };
    let mut buffer = [0; text::MAX_LINE];
    let message = Message::Report { session: 1, report };
    text::encode_to_slice(&message, &mut buffer)
        .unwrap()
        .to_vec()
}

/// What a receiver with a lasting session gets: board and number of each report.
fn subscribe(port: u16) -> Receiver<(String, u64)> {
    let (to, heard) = channel();
    let mut options = MqttOptions::new("receiver", "127.0.0.1", port);
    options
        .set_clean_session(false)
        .set_keep_alive(Duration::from_secs(5));
    let (client, mut connection) = Client::new(options, 10);
    client
        .subscribe("plant/+/report", QoS::AtLeastOnce)
        .unwrap();
    let (ready_to, ready) = channel();
    std::thread::spawn(move || {
        let _client = client;
        for event in connection.iter() {
            match event {
                Ok(Event::Incoming(Packet::SubAck(_))) => drop(ready_to.send(())),
                Ok(Event::Incoming(Packet::Publish(message))) => {
                    let object: serde_json::Value =
                        serde_json::from_slice(&message.payload).unwrap();
                    let board = object["board"].as_str().unwrap().to_owned();
                    if to.send((board, object["seq"].as_u64().unwrap())).is_err() {
                        return;
                    }
                }
                Ok(_) => {}
                Err(_) => std::thread::sleep(Duration::from_millis(100)),
            }
        }
    });
    ready
        .recv_timeout(Duration::from_secs(20))
        .expect("a subscription");
    heard
}

/// Takes reports until every board has `count` different ones; then their numbers in the order in
/// which each first came, by board, and how many came again.
fn collect(
    heard: &Receiver<(String, u64)>,
    boards: usize,
    count: usize,
) -> (BTreeMap<String, Vec<u64>>, u32) {
    let (mut numbers, mut again) = (BTreeMap::<String, Vec<u64>>::new(), 0);
    let end = Instant::now() + Duration::from_secs(60);
    while numbers.len() < boards || numbers.values().any(|numbers| numbers.len() < count) {
        let left = end.saturating_duration_since(Instant::now());
        let Ok((board, seq)) = heard.recv_timeout(left) else {
            let counts: Vec<usize> = numbers.values().map(Vec::len).collect();
            panic!("not all came: {counts:?} of {count}");
        };
        let of_board = numbers.entry(board).or_default();
        if of_board.contains(&seq) {
            again += 1;
        } else {
            of_board.push(seq);
        }
    }
    (numbers, again)
}

fn run(config: &Path, more: &[&str]) -> Gateway {
    let mut command = rowtone(&["gateway", "--config"]);
    Gateway(
        command
            .arg(config)
            .args(more)
            .stderr(Stdio::null())
            .spawn()
            .unwrap(),
    )
}

/// The broker goes and comes back, and so does the gateway: every report arrives, in order.
#[test]
fn nothing_is_lost_while_the_broker_or_the_gateway_is_away() {
    let dir = dir("away");
    let Some(mut broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let heard = subscribe(broker.port);
    let (mut ports, _slaves, config) = boards(3, &dir, &format!("port = {}", broker.port));
    let mut gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_millis(500));
    let mut say = |numbers: std::ops::Range<u32>| {
        for seq in numbers {
            for port in &mut ports {
                port.write_all(&line(seq)).unwrap();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    say(0..20);
    broker.stop();
    say(20..40);
    // Killed while the broker is away: what it heard lies on disk.
    std::thread::sleep(Duration::from_millis(500));
    drop(gateway);
    gateway = run(&config, &[]);
    say(40..60);
    assert!(broker.go());
    say(60..80);
    let (numbers, again) = collect(&heard, 3, 80);
    for (board, numbers) in &numbers {
        assert!(numbers.iter().copied().eq(0..80), "{board}: {numbers:?}");
    }
    println!("80 reports of 3 boards, {again} came again");
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

/// TLS with an authority of one's own, user and password; a wrong password gets nowhere.
#[test]
fn tls_user_and_password() {
    let dir = dir("tls");
    let made = Command::new("openssl")
        .current_dir(&dir)
        .args("req -x509 -newkey rsa:2048 -nodes -keyout key.pem -out cert.pem -days 2 -subj /CN=test -addext".split(' '))
        .arg("subjectAltName=IP:127.0.0.1")
        .args(["-addext", "basicConstraints=critical,CA:FALSE"])
        .output();
    let hashed = Command::new("mosquitto_passwd")
        .current_dir(&dir)
        .args(["-b", "-c", "users", "hall", "secret"])
        .output();
    if !made.is_ok_and(|made| made.status.success()) || !hashed.is_ok_and(|h| h.status.success()) {
        eprintln!("left out: openssl or mosquitto_passwd is not there");
        return;
    }
    let place = dir.display();
    let more = format!(
        "certfile {place}/cert.pem\nkeyfile {place}/key.pem\nallow_anonymous false\npassword_file {place}/users"
    );
    let Some(broker) = Broker::start(&dir, &more) else {
        return;
    };
    for (password, right) in [("secret", true), ("wrong", false)] {
        let settings = format!(
            "port = {}\nuser = \"hall\"\npassword = \"{password}\"\ntls_ca = \"{place}/cert.pem\"",
            broker.port
        );
        let (mut ports, _slaves, config) = boards(1, &dir, &settings);
        let mut command = rowtone(&["gateway", "--seconds", "4", "--config"]);
        let child = command
            .arg(&config)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_secs(1));
        ports[0].write_all(&line(0)).unwrap();
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            said.contains("heard 1, acknowledged 1,"),
            right,
            "{said}{errors}"
        );
        assert!(right || errors.contains("away"), "{errors}");
    }
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// 200 boards at 2 reports a second each.
#[test]
#[ignore = "a load of half a minute"]
fn two_hundred_boards() {
    const BOARDS: usize = 200;
    const REPORTS: u32 = 40;
    let dir = dir("load");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let heard = subscribe(broker.port);
    let (mut ports, _slaves, config) = boards(BOARDS, &dir, &format!("port = {}", broker.port));
    let gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_secs(2));
    let cpu_before = cpu_s(gateway.0.id());
    let start = Instant::now();
    let talk = std::thread::spawn(move || {
        for seq in 0..REPORTS {
            let line = line(seq);
            for (number, port) in ports.iter_mut().enumerate() {
                port.write_all(&line).unwrap();
                // Spread over the half second, as boards are.
                let at = Duration::from_micros(
                    500_000 * (u64::from(seq) * BOARDS as u64 + number as u64) / BOARDS as u64,
                );
                std::thread::sleep(at.saturating_sub(start.elapsed()));
            }
        }
        ports
    });
    let (numbers, again) = collect(&heard, BOARDS, REPORTS as usize);
    let seconds = start.elapsed().as_secs_f64();
    let cpu = cpu_s(gateway.0.id()) - cpu_before;
    let status =
        std::fs::read_to_string(format!("/proc/{}/status", gateway.0.id())).unwrap_or_default();
    let memory = status
        .lines()
        .find(|line| line.starts_with("VmHWM"))
        .unwrap_or("VmHWM: unknown");
    println!(
        "{BOARDS} boards, {} reports in {seconds:.1} s, {again} came again, CPU {:.1} % of one core, {}",
        BOARDS * REPORTS as usize,
        100.0 * cpu / seconds,
        memory.split_whitespace().collect::<Vec<_>>().join(" ")
    );
    assert!(
        numbers
            .values()
            .all(|numbers| numbers.iter().copied().eq(0..u64::from(REPORTS)))
    );
    let _ports = talk.join().unwrap();
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

/// Processor time of a process so far, s (100 ticks a second on every usual Linux).
fn cpu_s(pid: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap_or("").split(' ').collect();
    let ticks = |at: usize| {
        fields
            .get(at)
            .and_then(|field| field.parse::<f64>().ok())
            .unwrap_or(0.0)
    };
    (ticks(11) + ticks(12)) / 100.0
}
