//! A real mosquitto on loopback, and a client of it.

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A mosquitto that ends with the test.
pub(crate) struct Broker {
    config: PathBuf,
    pub(crate) port: u16,
    child: Option<Child>,
}

impl Broker {
    /// `None` where there is no mosquitto, or none of its clients.
    pub(crate) fn start(dir: &Path, more: &str) -> Option<Self> {
        if Command::new("mosquitto_sub")
            .arg("--help")
            .output()
            .is_err()
        {
            eprintln!("left out: no mosquitto_sub; apt-get install mosquitto mosquitto-clients");
            return None;
        }
        let port = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
        let config = dir.join("mosquitto.conf");
        let text = format!(
            "listener {port} 127.0.0.1\nmax_queued_messages 0\nmax_inflight_messages 0\nuser root\n{more}\n"
        );
        std::fs::write(&config, text).unwrap();
        let mut broker = Self {
            config,
            port,
            child: None,
        };
        broker.go().then_some(broker)
    }

    /// Starts one that keeps what it has on disk.
    pub(crate) fn lasting(dir: &Path) -> Option<Self> {
        let more = format!(
            "allow_anonymous true\npersistence true\npersistence_location {}/",
            dir.display()
        );
        Self::start(dir, &more)
    }

    pub(crate) fn go(&mut self) -> bool {
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
        eprintln!("left out: no mosquitto; apt-get install mosquitto mosquitto-clients");
        false
    }

    /// Number of its process.
    pub(crate) fn id(&self) -> u32 {
        self.child.as_ref().map_or(0, Child::id)
    }

    /// `kill -9`: it loses what it has only in memory.
    pub(crate) fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    pub(crate) fn stop(&mut self) {
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

/// A `mosquitto_sub` that ends with the test.
pub(crate) struct Listener(Child);

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What a listener hears when it is there.
const READY: &[u8] = b"ready";

/// The messages on a topic, heard by a client with a lasting session that subscribes anew whenever it
/// is back: a broker that was killed may have forgotten it.
pub(crate) fn subscribe(port: u16, topic: &str) -> (Listener, Receiver<(String, Vec<u8>)>) {
    let (to, heard) = channel();
    let address = ["-h", "127.0.0.1", "-p", &port.to_string()].map(str::to_owned);
    let mut child = Command::new("mosquitto_sub")
        .args(&address)
        .args([
            "-i", "receiver", "-c", "-q", "1", "-k", "5", "-F", "%t %x", "-t", topic,
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("apt-get install mosquitto-clients");
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    // Ended where this function is left, whichever way.
    let listener = Listener(child);
    let (ready_to, ready) = channel();
    std::thread::spawn(move || {
        for line in lines.map_while(Result::ok) {
            let (topic, digits) = line.split_once(' ').unwrap();
            let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16);
            let message: Vec<u8> = digits
                .as_bytes()
                .chunks(2)
                .map(|d| byte(d).unwrap())
                .collect();
            if message == READY {
                let _ = ready_to.send(());
            } else if to.send((topic.to_owned(), message)).is_err() {
                return;
            }
        }
    });
    let start = Instant::now();
    loop {
        publish(port, &topic.replace(['+', '#'], "ready"), READY);
        if ready.recv_timeout(Duration::from_millis(200)).is_ok() {
            return (listener, heard);
        }
        assert!(start.elapsed().as_secs() < 20, "no subscription");
    }
}

/// Publishes one message, with `mosquitto_pub`.
pub(crate) fn publish(port: u16, topic: &str, message: &[u8]) {
    publish_with(port, topic, message, &[]);
}

/// The same, with more options.
pub(crate) fn publish_with(port: u16, topic: &str, message: &[u8], more: &[&str]) {
    let mut child = Command::new("mosquitto_pub")
        .args(["-h", "127.0.0.1", "-p", &port.to_string()])
        .args(["-q", "1", "-s", "-t", topic])
        .args(more)
        .stdin(Stdio::piped())
        .spawn()
        .expect("apt-get install mosquitto-clients");
    child.stdin.take().unwrap().write_all(message).unwrap();
    assert!(child.wait().unwrap().success());
}
