//! What is said to the broker besides when: topics and payloads of either format.

use std::collections::{BTreeMap, BTreeSet};

use super::config::{Board, Config, Payload};
use super::discovery::{self, Topics};
use super::mqtt::packet::Message;
use super::spool::record::Entry;
use super::watch::Standing;
use super::{payload, sparkplug};
use rowtone_report::zone::ZoneLimits;

/// Older reports are marked as historical (Sparkplug).
const HISTORICAL_MS: u64 = 10_000;

/// Knows what was said on this connection.
#[derive(Debug)]
pub(super) struct Speech {
    payload: Payload,
    client_id: String,
    /// Where the zones of boards' machines begin, by name.
    zone_limits: BTreeMap<String, ZoneLimits>,
    /// Number of the node's birth and death (Sparkplug).
    bd_seq: u64,
    /// Boards whose birth was said (Sparkplug).
    births: BTreeSet<String>,
    /// Number of the last message of the node (Sparkplug).
    seq: u64,
}

impl Speech {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            payload: config.payload.clone(),
            client_id: config.broker.client_id.clone(),
            zone_limits: {
                let each = config.boards.iter();
                each.filter_map(|b| Some((b.name.clone(), b.zone_limits?)))
                    .collect()
            },
            bd_seq: 0,
            births: BTreeSet::new(),
            seq: 0,
        }
    }

    /// A new connection begins: what the broker is to say when the gateway dies. `bd_seq` is what births and deaths of the
    /// node count.
    pub(super) fn begin(&mut self, bd_seq: u64) -> Message {
        self.bd_seq = bd_seq;
        self.births.clear();
        self.goodbye()
    }

    /// What the gateway wants to hear.
    pub(super) fn subscription(&self) -> Option<String> {
        match &self.payload {
            Payload::Json { .. } => None,
            Payload::Sparkplug { group, node } => Some(format!("spBv1.0/{group}/NCMD/{node}")),
        }
    }

    /// The first message of a connection, and what a host gets that asks for births.
    pub(super) fn hello(&mut self, unix_ms: u64) -> Message {
        self.births.clear();
        self.seq = 0;
        match &self.payload {
            Payload::Json { topic, .. } => self.state(topic, "online"),
            Payload::Sparkplug { .. } => {
                let birth = sparkplug::node_birth(self.bd_seq, unix_ms);
                self.node("NBIRTH", birth)
            }
        }
    }

    /// The last one. The will is for a gateway that dies; one that ends says so itself.
    pub(super) fn goodbye(&self) -> Message {
        match &self.payload {
            Payload::Json { topic, .. } => self.state(topic, "offline"),
            Payload::Sparkplug { .. } => self.node("NDEATH", sparkplug::node_death(self.bd_seq)),
        }
    }

    /// A report, after the board's birth where it needs one.
    pub(super) fn report(&mut self, entry: &Entry, unix_ms: u64) -> (Option<Message>, Message) {
        if let Payload::Json { topic, retain, .. } = &self.payload {
            let limits = self.zone_limits.get(&entry.board);
            let said = Message {
                topic: format!("{topic}/{}/report", entry.board),
                payload: payload::json(entry, limits),
                retain: *retain,
            };
            return (None, said);
        }
        let historical = unix_ms.saturating_sub(entry.unix_ms) > HISTORICAL_MS;
        let say = |speech: &mut Self, kind| {
            let payload = sparkplug::board_data(entry, speech.next_seq(), historical);
            speech.board(kind, &entry.board, payload)
        };
        let birth = self.births.insert(entry.board.clone());
        let birth = birth.then(|| say(self, "DBIRTH"));
        (birth, say(self, "DDATA"))
    }

    /// The board's line has gone and all its reports are said.
    pub(super) fn board_gone(&mut self, board: &str, unix_ms: u64) -> Option<Message> {
        // Only Sparkplug has births, and a board that was never born does not die.
        self.births.remove(board).then(|| {
            let payload = sparkplug::board_death(self.next_seq(), unix_ms);
            self.board("DDEATH", board, payload)
        })
    }

    /// Whether a board speaks: an event, and kept by the broker for whoever comes later. Sparkplug has births and deaths for
    /// that.
    pub(super) fn standing(&self, board: &str, standing: &Standing) -> Option<Message> {
        let Payload::Json { topic, .. } = &self.payload else {
            return None;
        };
        Some(Message {
            topic: format!("{topic}/{board}/state"),
            payload: payload::standing(board, standing),
            retain: true,
        })
    }

    /// What Home Assistant is told of a board, where it is to be told.
    pub(super) fn discovery(&self, board: &Board) -> Option<Message> {
        let Payload::Json {
            topic,
            discovery: Some(prefix),
            ..
        } = &self.payload
        else {
            return None;
        };
        let topics = Topics {
            topic,
            client_id: &self.client_id,
        };
        let (topic, payload) = discovery::device(prefix, topics, board);
        Some(Message {
            topic,
            payload: payload.into_bytes(),
            retain: true,
        })
    }

    fn next_seq(&mut self) -> u64 {
        self.seq = (self.seq + 1) % 256;
        self.seq
    }

    fn state(&self, topic: &str, state: &str) -> Message {
        Message {
            topic: format!("{topic}/gateway/{}/state", self.client_id),
            payload: state.as_bytes().to_vec(),
            retain: true,
        }
    }

    fn node(&self, kind: &str, payload: Vec<u8>) -> Message {
        self.sparkplug(kind, "", payload)
    }

    fn board(&self, kind: &str, board: &str, payload: Vec<u8>) -> Message {
        self.sparkplug(kind, &format!("/{board}"), payload)
    }

    fn sparkplug(&self, kind: &str, board: &str, payload: Vec<u8>) -> Message {
        let topic = match &self.payload {
            Payload::Sparkplug { group, node } => format!("spBv1.0/{group}/{kind}/{node}{board}"),
            Payload::Json { topic, .. } => topic.clone(),
        };
        Message {
            topic,
            payload,
            retain: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speech() -> Speech {
        Speech {
            payload: Payload::Sparkplug {
                group: "g".to_owned(),
                node: "n".to_owned(),
            },
            client_id: "c".to_owned(),
            zone_limits: BTreeMap::new(),
            bd_seq: 0,
            births: BTreeSet::new(),
            seq: 0,
        }
    }

    #[test]
    fn a_board_is_born_once_and_dies_once() {
        let mut speech = speech();
        assert_eq!(speech.begin(1).topic, "spBv1.0/g/NDEATH/n");
        assert_eq!(speech.hello(5).topic, "spBv1.0/g/NBIRTH/n");
        let entry = Entry {
            unix_ms: 5,
            board: "b".to_owned(),
            session: 1,
            report: rowtone_report::example(None),
        };
        assert_eq!(speech.board_gone("b", 6), None);
        let (birth, data) = speech.report(&entry, 6);
        assert_eq!(birth.unwrap().topic, "spBv1.0/g/DBIRTH/n/b");
        assert_eq!(data.topic, "spBv1.0/g/DDATA/n/b");
        assert_eq!(speech.report(&entry, 6).0, None);
        assert_eq!(
            speech.board_gone("b", 6).unwrap().topic,
            "spBv1.0/g/DDEATH/n/b"
        );
        assert_eq!(speech.board_gone("b", 6), None);
        assert!(speech.report(&entry, 6).0.is_some(), "born again");
        speech.hello(7);
        assert!(speech.report(&entry, 7).0.is_some(), "asked for births");
    }
}
