//! A real mosquitto on loopback, and a client of it.

use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rumqttc::{Client, Event, MqttOptions, Packet, QoS};

/// A mosquitto that ends with the test.
pub(crate) struct Broker {
    config: PathBuf,
    pub(crate) port: u16,
    child: Option<Child>,
}

impl Broker {
    /// `None` where there is no mosquitto.
    pub(crate) fn start(dir: &Path, more: &str) -> Option<Self> {
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
        eprintln!("left out: there is no mosquitto; apt-get install mosquitto");
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

/// The messages on a topic, heard by a client with a lasting session that subscribes anew whenever it
/// is back: a broker that was killed may have forgotten it.
pub(crate) fn subscribe(port: u16, topic: &'static str) -> (Client, Receiver<(String, Vec<u8>)>) {
    let (to, heard) = channel();
    let mut options = MqttOptions::new("receiver", "127.0.0.1", port);
    options
        .set_clean_session(false)
        .set_keep_alive(Duration::from_secs(5));
    let (client, mut connection) = Client::new(options, 10);
    let (ready_to, ready) = channel();
    let of_thread = client.clone();
    std::thread::spawn(move || {
        for event in connection.iter() {
            match event {
                Ok(Event::Incoming(Packet::ConnAck(_))) => {
                    of_thread.try_subscribe(topic, QoS::AtLeastOnce).unwrap();
                }
                Ok(Event::Incoming(Packet::SubAck(_))) => drop(ready_to.send(())),
                Ok(Event::Incoming(Packet::Publish(message))) => {
                    if to.send((message.topic, message.payload.to_vec())).is_err() {
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
    (client, heard)
}
