//! Many boards on serial lines, one MQTT broker.
//!
//! Each line has a thread (`lines`) that hears its reports and asks for those that are missing.
//! Every report goes to disk ([`spool`]) before it is sent, and leaves it when the broker has
//! acknowledged it (QoS 1) and can be believed (`delivery`), so neither a broker nor a gateway that
//! is killed loses any. One loop (`Gateway`) owns the spool and the connection (`broker`) and takes
//! all that happens as `Input`s; `speech` knows topics and payloads. `docs/gateway.md` is for
//! whoever sets it up.

mod broker;
mod config;
mod delivery;
mod entry;
mod lines;
mod payload;
mod sparkplug;
mod speech;
pub mod spool;

use std::collections::BTreeSet;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rumqttc::{Client, QoS};

use broker::{Address, Note};
pub use config::{Board, Broker, Config, Payload};
use delivery::Delivery;
use entry::Entry;
use lines::Complete;
use rowtone_failure::Failure;
use rowtone_serial::receiver::Counters;
use speech::{Said, Speech};
use spool::{Mark, Spool};

/// How long to wait before the broker is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// How often the spool's cursor is saved.
const SAVE: Duration = Duration::from_millis(500);
/// After a connection was lost, its receivers get this long to be back before reports go out again: a
/// broker that has forgotten them acknowledges all the same.
const GRACE: Duration = Duration::from_secs(3);

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Reports heard.
    pub heard: u64,
    /// Reports that the broker has acknowledged.
    pub acknowledged: u64,
    /// Reports that boards sent, or should have, and that were never heard.
    pub lost: u64,
    /// Damaged sentences and frames.
    pub bad: u64,
    /// Reports dropped from the spool.
    pub dropped: u64,
    /// Bytes in the spool that wait for the broker.
    pub waiting: u64,
}

/// Something happened.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "reports are what comes; the rest is rare"
)]
enum Input {
    /// A report of a board.
    Report(Entry),
    /// A line came or went: index of the board, and why it went.
    Line(usize, Option<String>),
    /// What a line has counted, by index of the board, and up to which session and number none of its
    /// reports is missing.
    Counted(usize, Counters, Option<(u32, u32)>),
    /// On the connection of this number.
    Broker(u64, Note),
}

/// Runs the gateway, for so long or until it is killed.
///
/// # Errors
/// [`Failure::Input`] when a file of the configuration or the spool cannot be used.
pub fn run(config: &Config, limit: Option<Duration>) -> Result<Totals, Failure> {
    let address = Address::new(&config.broker)?;
    let dir = config.spool.dir.clone();
    let in_spool =
        |error: io::Error| Failure::input(format!("spool.dir: {}: {error}", dir.display()));
    let max_bytes = u64::from(config.spool.max_mb) << 20;
    let spool = Spool::open(config.spool.dir.clone(), max_bytes).map_err(in_spool)?;
    let complete = Complete::read(&dir);
    let (to, inputs) = channel();
    for (index, board) in config.boards.iter().enumerate() {
        let complete = complete.of(&board.name);
        lines::listen(index, board, complete, to.clone()).map_err(in_spool)?;
    }
    let mut gateway = Gateway {
        config,
        address,
        to,
        spool,
        complete,
        client: None,
        connection: 0,
        connected: false,
        was_connected: false,
        try_at: Instant::now(),
        send_at: Instant::now(),
        delivery: Delivery::default(),
        speech: Speech::new(config),
        gone: BTreeSet::new(),
        counters: vec![Counters::default(); config.boards.len()],
    };
    gateway.follow(&inputs, limit).map_err(in_spool)?;
    Ok(gateway.totals())
}

/// The loop's state.
struct Gateway<'a> {
    config: &'a Config,
    address: Address,
    to: Sender<Input>,
    spool: Spool,
    complete: Complete,
    client: Option<Client>,
    /// Number of the connection.
    connection: u64,
    connected: bool,
    /// There was a connection before this one.
    was_connected: bool,
    try_at: Instant,
    /// No reports go out before this.
    send_at: Instant,
    delivery: Delivery,
    speech: Speech,
    /// Boards whose line has gone, and of which the broker has not been told.
    gone: BTreeSet<String>,
    counters: Vec<Counters>,
}

impl Gateway<'_> {
    fn follow(&mut self, inputs: &Receiver<Input>, limit: Option<Duration>) -> io::Result<()> {
        let end = limit.map(|limit| Instant::now() + limit);
        let mut save_at = Instant::now() + SAVE;
        loop {
            let now = Instant::now();
            if end.is_some_and(|end| now >= end) {
                self.say_goodbye();
                self.complete.save()?;
                return self.spool.save();
            }
            if let Some(mark) = self.delivery.trusted(now) {
                self.spool.acknowledge(mark);
            }
            if now >= save_at {
                self.complete.save()?;
                self.spool.save()?;
                save_at = now + SAVE;
            }
            if self.client.is_none() && now >= self.try_at {
                self.connect();
            }
            self.send(now)?;
            match inputs.recv_timeout(Duration::from_millis(100)) {
                Ok(input) => {
                    self.take(input)?;
                    // What else is there costs no further round.
                    for input in inputs.try_iter().take(1000) {
                        self.take(input)?;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Not before the gateway itself is gone: it holds a sender.
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    fn take(&mut self, input: Input) -> io::Result<()> {
        match input {
            Input::Report(entry) => self.spool.push(&entry)?,
            Input::Counted(index, counters, complete) => {
                if let Some(slot) = self.counters.get_mut(index) {
                    *slot = counters;
                }
                // Its reports came before it, so they lie in the spool.
                if let (Some(board), Some(complete)) = (self.config.boards.get(index), complete) {
                    self.complete.set(&board.name, complete);
                }
            }
            Input::Line(index, gone) => {
                let Some(board) = self.config.boards.get(index) else {
                    return Ok(());
                };
                match gone {
                    None => {
                        self.gone.remove(&board.name);
                        eprintln!("rowtone: {}: listening on {}", board.name, board.port.path);
                    }
                    Some(why) => {
                        self.gone.insert(board.name.clone());
                        eprintln!("rowtone: {}: waiting for its line ({why})", board.name);
                    }
                }
            }
            Input::Broker(number, note) if number == self.connection => self.note(note),
            // Of a connection that is history.
            Input::Broker(..) => {}
        }
        Ok(())
    }

    fn note(&mut self, note: Note) {
        match note {
            Note::Connected => {
                eprintln!("rowtone: broker {}: connected", self.config.broker.host);
                if std::mem::replace(&mut self.was_connected, true) {
                    self.send_at = Instant::now() + GRACE;
                }
                self.connected = true;
                self.say_hello();
            }
            Note::Sent(pkid) => self.delivery.numbered(pkid),
            Note::Acknowledged(pkid) => self.delivery.acknowledged(pkid, Instant::now()),
            Note::Message(message) => {
                if sparkplug::asks_rebirth(&message) {
                    self.say_hello();
                }
            }
            Note::Lost(why) => {
                let host = &self.config.broker.host;
                if self.connected || self.connection == 1 {
                    eprintln!("rowtone: broker {host}: away ({why}); reports are kept on disk");
                }
                self.client = None;
                self.connected = false;
                self.delivery.lost();
                self.spool.rewind();
                self.try_at = Instant::now() + AGAIN;
            }
        }
    }

    fn connect(&mut self) {
        self.connection += 1;
        let will = self.speech.begin(self.connection);
        let client = self.address.connect(self.connection, will, self.to.clone());
        self.client = Some(client);
    }

    fn say_hello(&mut self) {
        if let (Some(client), Some(topic)) = (&self.client, self.speech.subscription()) {
            let _ = client.try_subscribe(topic, QoS::AtLeastOnce);
        }
        let hello = self.speech.hello(unix_ms());
        self.publish(hello, None);
    }

    /// Ends the connection in peace.
    fn say_goodbye(&mut self) {
        let (Some(client), true) = (&self.client, self.connected) else {
            return;
        };
        let last = self.speech.goodbye();
        let _ = client.try_publish(last.topic, QoS::AtLeastOnce, last.retain, last.payload);
        let _ = client.try_disconnect();
        // Long enough for two packets to leave.
        std::thread::sleep(Duration::from_millis(100));
        if let Some(mark) = self.delivery.trust_all() {
            self.spool.acknowledge(mark);
        }
    }

    /// Sends from the spool while the broker takes it.
    fn send(&mut self, now: Instant) -> io::Result<()> {
        while self.connected && now >= self.send_at && self.delivery.has_room() {
            let Some((mark, entry)) = self.spool.next_entry()? else {
                // All is said that boards without a line had to say.
                for board in std::mem::take(&mut self.gone) {
                    if let Some(death) = self.speech.board_gone(&board, unix_ms()) {
                        self.publish(death, None);
                    }
                }
                break;
            };
            let (birth, data) = self.speech.report(&entry, unix_ms());
            if let Some(birth) = birth {
                self.publish(birth, None);
            }
            self.publish(data, Some(mark));
        }
        Ok(())
    }

    fn publish(&mut self, said: Said, mark: Option<Mark>) {
        let Some(client) = &self.client else { return };
        match client.try_publish(said.topic, QoS::AtLeastOnce, said.retain, said.payload) {
            Ok(()) => self.delivery.sent(mark),
            // Its queue holds more than can be under way, so the connection must be ending; it says
            // so in a moment, and then all is sent again.
            Err(_) => self.connected = false,
        }
    }

    fn totals(&self) -> Totals {
        let sum = |count: fn(&Counters) -> u64| self.counters.iter().map(count).sum();
        Totals {
            heard: sum(|counters| counters.reports),
            acknowledged: self.delivery.count(),
            lost: sum(|counters| counters.lost),
            bad: sum(|counters| counters.bad),
            dropped: self.spool.dropped(),
            waiting: self.spool.waiting(),
        }
    }
}

fn unix_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
    })
}
