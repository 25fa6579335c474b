//! Many boards on serial lines, one MQTT broker.
//!
//! Each line has a thread that hears its reports and asks for those that are missing. Every report
//! goes to disk ([`spool`]) before it is sent, and leaves it when the broker has acknowledged it
//! (QoS 1), so neither a broker that is away nor a gateway that is killed loses any. One loop
//! (`Gateway`) owns the spool and the connection (`broker`) and takes all that happens as
//! `Input`s. `docs/gateway.md` is for whoever sets it up.

mod broker;
mod config;
mod payload;
mod sparkplug;
pub mod spool;

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rumqttc::{Client, QoS};

use crate::failure::Failure;
use crate::line;
use crate::receiver::{Counters, Heard, Receiver as Ear};
use broker::{Address, IN_FLIGHT, Note, Will};
pub use config::{Board, Broker, Config, Payload};
use spool::{Entry, Mark, Spool};

/// How long to wait before the broker is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// How often the spool's cursor is saved.
const SAVE: Duration = Duration::from_millis(500);
/// Older reports are marked as historical (Sparkplug).
const HISTORICAL_MS: u64 = 10_000;

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
    /// What a line has counted, by index of the board.
    Counted(usize, Counters),
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
    let (to, inputs) = channel();
    for (index, board) in config.boards.iter().enumerate() {
        listen(index, board, to.clone()).map_err(in_spool)?;
    }
    let mut gateway = Gateway {
        config,
        address,
        to,
        spool,
        client: None,
        connection: 0,
        connected: false,
        try_at: Instant::now(),
        under_way: VecDeque::new(),
        births: BTreeSet::new(),
        seq: 0,
        counters: vec![Counters::default(); config.boards.len()],
        acknowledged: 0,
    };
    gateway.follow(&inputs, limit).map_err(in_spool)?;
    Ok(gateway.totals())
}

/// Starts the thread of one line.
fn listen(index: usize, board: &Board, to: Sender<Input>) -> io::Result<()> {
    let board = board.clone();
    let (commands_to, commands) = channel();
    let work = move || {
        let mut ear = Ear::default();
        let mut counted = Counters::default();
        // The port may come later, so it never fails.
        let _ = line::follow(&board.port, false, &commands, |event| {
            let mut alive = true;
            match event {
                line::Event::Open => alive = to.send(Input::Line(index, None)).is_ok(),
                line::Event::Gone(why) => alive = to.send(Input::Line(index, Some(why))).is_ok(),
                line::Event::End => {}
                line::Event::Bytes(bytes) => ear.hear(&bytes, |heard| {
                    if let Heard::Report {
                        session, report, ..
                    } = heard
                    {
                        let (unix_ms, board) = (unix_ms(), board.name.clone());
                        let entry = Entry {
                            unix_ms,
                            board,
                            session,
                            report,
                        };
                        alive &= to.send(Input::Report(entry)).is_ok();
                    }
                }),
            }
            if let Some(command) = ear.ask(Instant::now()) {
                let _ = commands_to.send(command);
            }
            if ear.counters() != counted {
                counted = ear.counters();
                alive &= to.send(Input::Counted(index, counted)).is_ok();
            }
            alive
        });
    };
    // A line needs little; there may be hundreds.
    let thread = std::thread::Builder::new().stack_size(256 * 1024);
    thread.spawn(work).map(drop)
}

/// A message that the broker has not acknowledged.
#[derive(Clone, Copy, Debug)]
struct UnderWay {
    /// Where in the spool it stands, if it is a report.
    mark: Option<Mark>,
    pkid: Option<u16>,
    acknowledged: bool,
}

/// The loop's state.
struct Gateway<'a> {
    config: &'a Config,
    address: Address,
    to: Sender<Input>,
    spool: Spool,
    client: Option<Client>,
    /// Number of the connection.
    connection: u64,
    connected: bool,
    try_at: Instant,
    /// In the order in which they were sent.
    under_way: VecDeque<UnderWay>,
    /// Boards whose birth was said on this connection (Sparkplug).
    births: BTreeSet<String>,
    /// Number of the next message of the node (Sparkplug).
    seq: u64,
    counters: Vec<Counters>,
    acknowledged: u64,
}

impl Gateway<'_> {
    fn follow(&mut self, inputs: &Receiver<Input>, limit: Option<Duration>) -> io::Result<()> {
        let end = limit.map(|limit| Instant::now() + limit);
        let mut save_at = Instant::now() + SAVE;
        loop {
            let now = Instant::now();
            if end.is_some_and(|end| now >= end) {
                self.say_goodbye();
                return self.spool.save();
            }
            if now >= save_at {
                self.spool.save()?;
                save_at = now + SAVE;
            }
            if self.client.is_none() && now >= self.try_at {
                self.connect();
            }
            self.send()?;
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
            Input::Counted(index, counters) => {
                if let Some(slot) = self.counters.get_mut(index) {
                    *slot = counters;
                }
            }
            Input::Line(index, gone) => {
                let Some(board) = self.config.boards.get(index) else {
                    return Ok(());
                };
                match gone {
                    None => eprintln!("rowtone: {}: listening on {}", board.name, board.port.path),
                    Some(why) => eprintln!("rowtone: {}: waiting for its line ({why})", board.name),
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
                self.connected = true;
                self.say_hello();
            }
            Note::Sent(pkid) => {
                let next = self.under_way.iter_mut().find(|one| one.pkid.is_none());
                if let Some(one) = next {
                    one.pkid = Some(pkid);
                }
            }
            Note::Acknowledged(pkid) => self.acknowledge(pkid),
            Note::Message(message) => {
                if sparkplug::asks_rebirth(&message) {
                    self.births.clear();
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
                self.under_way.clear();
                self.spool.rewind();
                self.try_at = Instant::now() + AGAIN;
            }
        }
    }

    fn acknowledge(&mut self, pkid: u16) {
        let same = |one: &&mut UnderWay| one.pkid == Some(pkid) && !one.acknowledged;
        if let Some(one) = self.under_way.iter_mut().find(same) {
            one.acknowledged = true;
        }
        // The cursor moves on only over what is acknowledged without a gap.
        while self.under_way.front().is_some_and(|one| one.acknowledged) {
            if let Some(mark) = self.under_way.pop_front().and_then(|one| one.mark) {
                self.spool.acknowledge(mark);
                self.acknowledged += 1;
            }
        }
    }

    fn connect(&mut self) {
        self.connection += 1;
        self.births.clear();
        let will = match &self.config.payload {
            Payload::Json { topic } => Will {
                topic: self.state_topic(topic),
                payload: b"offline".to_vec(),
                retain: true,
            },
            Payload::Sparkplug { group, node } => Will {
                topic: format!("spBv1.0/{group}/NDEATH/{node}"),
                payload: sparkplug::node_death(self.connection),
                retain: false,
            },
        };
        let client = self.address.connect(self.connection, will, self.to.clone());
        self.client = Some(client);
    }

    fn state_topic(&self, topic: &str) -> String {
        format!("{topic}/gateway/{}/state", self.config.broker.client_id)
    }

    fn say_hello(&mut self) {
        match &self.config.payload {
            Payload::Json { topic } => {
                self.publish(self.state_topic(topic), b"online".to_vec(), true, None);
            }
            Payload::Sparkplug { group, node } => {
                if let Some(client) = &self.client {
                    let _ = client
                        .try_subscribe(format!("spBv1.0/{group}/NCMD/{node}"), QoS::AtLeastOnce);
                }
                self.seq = 0;
                let birth = sparkplug::node_birth(self.connection, unix_ms());
                self.publish(format!("spBv1.0/{group}/NBIRTH/{node}"), birth, false, None);
            }
        }
    }

    /// The last will is for a gateway that dies; one that ends says so itself.
    fn say_goodbye(&mut self) {
        if let (Payload::Json { topic }, Some(client), true) =
            (&self.config.payload, &self.client, self.connected)
        {
            let _ = client.try_publish(
                self.state_topic(topic),
                QoS::AtLeastOnce,
                true,
                b"offline".to_vec(),
            );
            let _ = client.try_disconnect();
            // Long enough for two packets to leave.
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Sends from the spool while the broker takes it.
    fn send(&mut self) -> io::Result<()> {
        // A birth may go with a report.
        while self.connected && self.under_way.len() + 2 <= IN_FLIGHT {
            let Some((mark, entry)) = self.spool.next_entry()? else {
                break;
            };
            match &self.config.payload {
                Payload::Json { topic } => {
                    let topic = format!("{topic}/{}/report", entry.board);
                    self.publish(topic, payload::json(&entry), false, Some(mark));
                }
                Payload::Sparkplug { group, node } => {
                    let topic = |kind| format!("spBv1.0/{group}/{kind}/{node}/{}", entry.board);
                    let (birth, data) = (topic("DBIRTH"), topic("DDATA"));
                    let historical = unix_ms().saturating_sub(entry.unix_ms) > HISTORICAL_MS;
                    if self.births.insert(entry.board.clone()) {
                        let seq = self.next_seq();
                        self.publish(
                            birth,
                            sparkplug::board_data(&entry, seq, historical),
                            false,
                            None,
                        );
                    }
                    let seq = self.next_seq();
                    self.publish(
                        data,
                        sparkplug::board_data(&entry, seq, historical),
                        false,
                        Some(mark),
                    );
                }
            }
        }
        Ok(())
    }

    fn next_seq(&mut self) -> u64 {
        self.seq = (self.seq + 1) % 256;
        self.seq
    }

    fn publish(&mut self, topic: String, payload: Vec<u8>, retain: bool, mark: Option<Mark>) {
        let Some(client) = &self.client else { return };
        match client.try_publish(topic, QoS::AtLeastOnce, retain, payload) {
            Ok(()) => self.under_way.push_back(UnderWay {
                mark,
                pkid: None,
                acknowledged: false,
            }),
            // Its queue holds more than can be under way, so the connection must be ending; it says
            // so in a moment, and then all is sent again.
            Err(_) => self.connected = false,
        }
    }

    fn totals(&self) -> Totals {
        let sum = |count: fn(&Counters) -> u64| self.counters.iter().map(count).sum();
        Totals {
            heard: sum(|counters| counters.reports),
            acknowledged: self.acknowledged,
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
