//! The loop that owns the spool and the connection.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use super::alarms::Alarms;
use super::broker::{Address, Retry};
use super::config::{Config, Payload};
use super::delivery::{Delivery, Suspect, Verdict};
use super::log::say;
use super::mqtt::connection::{Client, Loss, Note};
use super::mqtt::packet::{self, DISCONNECT, Message};
use super::speech::Speech;
use super::spool::births::Births;
use super::spool::{Mark, Spool};
use super::watch::Watch;
use super::{Input, Totals, sparkplug, unix_ms};
use rowtone_serial::receiver::Counters;

/// How often the spool's state is saved.
const SAVE: Duration = Duration::from_millis(500);
/// When the broker was away, its receivers get this long to be back before reports go out again: a
/// broker that has forgotten them acknowledges all the same.
const GRACE: Duration = Duration::from_secs(3);
/// A broker that acknowledges nothing for this long is given up.
const MUTE: Duration = Duration::from_secs(30);
/// Births are said at most this often, however many hosts ask for them.
const REBIRTH: Duration = Duration::from_secs(1);
/// The likely cause of messages that are too long is said at most this often.
const REPEAT: Duration = Duration::from_secs(600);

/// The loop's state.
pub(super) struct Hub<'a> {
    config: &'a Config,
    address: Address,
    to: Sender<Input>,
    spool: Spool,
    client: Option<Client>,
    /// Number of the connection.
    connection: u64,
    /// The broker has accepted it, and it is not lost.
    connected: bool,
    /// There was a connection before this one.
    was_connected: bool,
    retry: Retry,
    try_at: Instant,
    /// No reports go out before this.
    send_at: Instant,
    delivery: Delivery,
    suspect: Suspect,
    /// The report that the broker does not take.
    guilty: Option<(usize, u64)>,
    speech: Speech,
    /// A host has asked for births.
    rebirth: bool,
    rebirth_at: Instant,
    passed_over_at: Option<Instant>,
    /// Boards whose line has gone, and of which the broker has not been told.
    gone: BTreeSet<String>,
    watch: Watch,
    alarms: Alarms,
    births: Births,
    counters: Vec<Counters>,
}

impl<'a> Hub<'a> {
    pub(super) fn new(
        config: &'a Config,
        address: Address,
        spool: Spool,
        to: Sender<Input>,
    ) -> Self {
        let now = Instant::now();
        Self {
            config,
            address,
            to,
            spool,
            client: None,
            connection: 0,
            connected: false,
            was_connected: false,
            retry: Retry::default(),
            try_at: now,
            send_at: now,
            delivery: Delivery::default(),
            suspect: Suspect::default(),
            guilty: None,
            speech: Speech::new(config),
            rebirth: false,
            rebirth_at: now,
            passed_over_at: None,
            gone: BTreeSet::new(),
            watch: Watch::new(&config.boards, now),
            alarms: Alarms::new(config),
            births: Births::read(&config.spool.dir),
            counters: vec![Counters::default(); config.boards.len()],
        }
    }

    /// Goes on until `end` or `stop`.
    pub(super) fn follow(
        &mut self,
        inputs: &Receiver<Input>,
        end: Option<Instant>,
        stop: &AtomicBool,
    ) {
        let mut save_at = Instant::now() + SAVE;
        loop {
            let now = Instant::now();
            if end.is_some_and(|end| now >= end) || stop.load(Ordering::Relaxed) {
                self.say_goodbye();
                self.spool.finish();
                self.say_notices();
                return;
            }
            while let Some(mark) = self.delivery.trusted(now) {
                self.spool.acknowledge(mark);
            }
            if now >= save_at {
                self.spool.save(now);
                save_at = now + SAVE;
            }
            self.say_notices();
            self.hear_silence(now);
            self.keep_connected(now);
            self.send(now);
            match inputs.recv_timeout(Duration::from_millis(100)) {
                Ok(input) => {
                    self.take(input);
                    // What else is there costs no further round.
                    for input in inputs.try_iter().take(1000) {
                        self.take(input);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Not before this is gone itself: it holds a sender.
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn take(&mut self, input: Input) {
        match input {
            Input::Report(entry) => {
                self.spool.push(&entry);
                self.alarms.window(&entry);
                let board = &entry.board;
                if self.watch.heard(board, Instant::now(), unix_ms()) {
                    self.gone.remove(board);
                    self.say_standing(board);
                }
            }
            Input::Counted(index, counters, complete) => {
                if let Some(slot) = self.counters.get_mut(index) {
                    *slot = counters;
                }
                // Its reports came before it, so they lie in the spool.
                if let (Some(board), Some(complete)) = (self.config.boards.get(index), complete) {
                    self.spool.set_complete(&board.name, complete);
                }
            }
            Input::Line(index, gone) => {
                let Some(board) = self.config.boards.get(index) else {
                    return;
                };
                let now = Instant::now();
                if self
                    .watch
                    .line(&board.name, gone.as_deref(), now, unix_ms())
                {
                    self.say_standing(&board.name);
                }
                match gone {
                    None => {
                        self.gone.remove(&board.name);
                        say(&format!("{}: listening on {}", board.name, board.port.path));
                    }
                    Some(why) => {
                        self.gone.insert(board.name.clone());
                        say(&format!("{}: waiting for its line ({why})", board.name));
                    }
                }
            }
            Input::Broker(number, note) if number == self.connection => self.note(note),
            // Of a connection that is history.
            Input::Broker(..) => {}
        }
    }

    fn note(&mut self, note: Note) {
        let now = Instant::now();
        match note {
            Note::Connected => {
                self.say_of_broker("connected");
                let was_away = self.retry.accepted(now);
                if std::mem::replace(&mut self.was_connected, true) || was_away {
                    self.send_at = now + GRACE;
                }
                self.connected = true;
                self.say_hello(now);
            }
            Note::Acknowledged(number) => self.delivery.acknowledged(number, now),
            Note::Message(message) => {
                self.rebirth |= sparkplug::asks_rebirth(&message.payload);
                self.alarms.hear(&message, unix_ms());
            }
            Note::PassedOver(bytes) => {
                let recent = |at| now.duration_since(at) < REPEAT;
                if !self.passed_over_at.is_some_and(recent) {
                    self.passed_over_at = Some(now);
                    self.say_of_broker(&format!(
                        "a command of {bytes} bytes is passed over: no command is as long; the \
                         likely cause: somebody has published it, perhaps retained, to this node"
                    ));
                }
            }
            Note::Lost(loss) => self.lost(&loss, now),
        }
    }

    /// Connects where there is no connection, and ends one on which nothing is acknowledged.
    fn keep_connected(&mut self, now: Instant) {
        if self.connected && self.delivery.oldest(now) >= MUTE {
            let why = format!("it has acknowledged nothing for {} s", MUTE.as_secs());
            let by_broker = false;
            self.lost(&Loss { why, by_broker }, now);
        }
        if self.client.is_some() || now < self.try_at {
            return;
        }
        self.connection += 1;
        let number = match self.config.payload {
            Payload::Sparkplug { .. } => self.births.count_on(),
            Payload::Json { .. } => 0,
        };
        let will = self.speech.begin(number);
        match self.address.connect(self.connection, &will, &self.to) {
            Ok(client) => self.client = Some(client),
            Err(error) => {
                let why = error.to_string();
                let by_broker = false;
                self.lost(&Loss { why, by_broker }, now);
            }
        }
    }

    fn lost(&mut self, loss: &Loss, now: Instant) {
        // What the connection's thread may still say is of no interest.
        self.connection += 1;
        self.client = None;
        self.connected = false;
        let first = self.delivery.lost();
        self.spool.rewind();
        let mut cause = format!(
            "another client has the id {:?}",
            self.config.broker.client_id
        );
        if loss.by_broker {
            match self.suspect.lost_at(first) {
                Verdict::Innocent => {}
                Verdict::Watch => {
                    self.delivery.one_by_one();
                    cause = "it does not take the next report".to_owned();
                }
                Verdict::Guilty => {
                    self.guilty = first.map(|mark| (mark.lane, mark.id));
                    cause = "it does not take the next report, which is set aside".to_owned();
                }
            }
        }
        let (wait, line) = self.retry.lost(loss, &cause, now);
        self.try_at = now + wait;
        if let Some(line) = line {
            self.say_of_broker(&line);
        }
    }

    fn say_hello(&mut self, now: Instant) {
        self.rebirth = false;
        self.rebirth_at = now + REBIRTH;
        let filter = self.speech.subscription().or(self.alarms.subscription());
        if let Some(filter) = filter
            && let (Some(client), Ok(packet)) = (&self.client, packet::subscribe(1, &filter))
        {
            client.send(packet);
        }
        let hello = self.speech.hello(unix_ms());
        self.publish(&hello, None, now);
        for board in &self.config.boards {
            if let Some(device) = self.speech.discovery(board) {
                self.publish(&device, None, now);
            }
        }
        let known = self.watch.known();
        let standings: Vec<_> = known
            .filter_map(|(board, standing)| self.speech.standing(board, standing))
            .collect();
        for standing in standings {
            self.publish(&standing, None, now);
        }
        self.alarms.say_again();
    }

    /// Tells of a board that has changed its state.
    fn say_standing(&mut self, board: &str) {
        let Some(standing) = self.watch.of(board) else {
            return;
        };
        let message = self.speech.standing(board, standing);
        if let (Some(message), true) = (message, self.connected) {
            self.publish(&message, None, Instant::now());
        }
    }

    /// Tells of boards that have fallen silent.
    fn hear_silence(&mut self, now: Instant) {
        for board in self.watch.silent(now, unix_ms()) {
            let why = self.watch.of(&board).and_then(|s| s.why.clone());
            say(&format!("{board}: silent: {}", why.unwrap_or_default()));
            self.say_standing(&board);
            self.gone.insert(board);
        }
    }

    /// Ends the connection in peace.
    fn say_goodbye(&mut self) {
        let (Some(client), true) = (self.client.take(), self.connected) else {
            return;
        };
        let last = self.speech.goodbye();
        if let Ok(packet) = packet::publish(self.delivery.next_number(), &last) {
            client.send(packet);
        }
        client.send(DISCONNECT.to_vec());
        drop(client);
        // Long enough for two packets to leave.
        std::thread::sleep(Duration::from_millis(100));
        for mark in self.delivery.trust_all() {
            self.spool.acknowledge(mark);
        }
    }

    /// Sends from the spool while the broker takes it.
    fn send(&mut self, now: Instant) {
        if self.connected && self.rebirth && now >= self.rebirth_at {
            self.say_hello(now);
        }
        while self.connected && now >= self.send_at && self.delivery.has_room() {
            if let Some(alarm) = self.alarms.next() {
                self.publish(&alarm, None, now);
                continue;
            }
            let Some((mark, record)) = self.spool.next_record(now) else {
                // All is said that boards without a line had to say.
                for board in std::mem::take(&mut self.gone) {
                    if let Some(death) = self.speech.board_gone(&board, unix_ms()) {
                        self.publish(&death, None, now);
                    }
                }
                break;
            };
            if self.guilty == Some((mark.lane, mark.id)) {
                self.guilty = None;
                self.spool.set_aside(&record);
                self.delivery.sent(None, Some(mark), now);
                continue;
            }
            let (birth, data) = self.speech.report(&record.entry, unix_ms());
            if let Some(birth) = birth {
                self.publish(&birth, None, now);
            }
            if !self.publish(&data, Some(mark), now) {
                self.spool.set_aside(&record);
            }
        }
    }

    /// Hands a message over to the connection; whether it can be said at all.
    fn publish(&mut self, message: &Message, mark: Option<Mark>, now: Instant) -> bool {
        let Some(client) = &self.client else {
            return true;
        };
        let number = self.delivery.next_number();
        match packet::publish(number, message) {
            Ok(packet) => {
                client.send(packet);
                self.delivery.sent(Some(number), mark, now);
                true
            }
            Err(why) => {
                self.say_of_broker(&format!("{:.80}: {why}", message.topic));
                self.delivery.sent(None, mark, now);
                false
            }
        }
    }

    fn say_of_broker(&self, what: &str) {
        say(&format!("broker {}: {what}", self.config.broker.host));
    }

    fn say_notices(&mut self) {
        for line in self.spool.take_notices() {
            say(&line);
        }
    }

    pub(super) fn totals(&self) -> Totals {
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
