//! The alarms of boards' machines: judged as reports come, told as they change.
//!
//! A message on `TOPIC/BOARD/alarm` holds how all rules of a board stand and what has just changed; the broker keeps the
//! last one. What changes while the broker is away waits in memory, and is said in order when it is back.

use std::collections::{BTreeMap, VecDeque};

use super::config::{Board, Config, Payload};
use super::log::say;
use super::mqtt::packet::Message;
use super::spool::record::Entry;
use rowtone_report::alarms::{Book, Said};

/// Most messages that wait for the broker; the oldest go.
const MOST_WAITING: usize = 1000;

/// All boards' alarms.
#[derive(Debug, Default)]
pub(super) struct Alarms {
    /// First part of the topics.
    topic: String,
    books: BTreeMap<String, Book>,
    waiting: VecDeque<Message>,
    /// What was said last of each board, to be said again to a broker that may have forgotten it.
    last: BTreeMap<String, Message>,
}

impl Alarms {
    pub(super) fn new(config: &Config) -> Self {
        let Payload::Json { topic, .. } = &config.payload else {
            return Self::default();
        };
        let each = config.boards.iter();
        Self {
            topic: topic.clone(),
            books: each
                .filter_map(|b: &Board| Some((b.name.clone(), b.alarms.clone()?)))
                .collect(),
            ..Self::default()
        }
    }

    /// What acknowledges alarms; `None` where there are none.
    pub(super) fn subscription(&self) -> Option<String> {
        (!self.books.is_empty()).then(|| format!("{}/+/alarm/acknowledge", self.topic))
    }

    /// Judges a report that has just come.
    pub(super) fn window(&mut self, entry: &Entry) {
        let Some(book) = self.books.get_mut(&entry.board) else {
            return;
        };
        let said = book.window(&entry.report);
        // The first one tells a listener that there are alarms.
        if !said.is_quiet() || !self.last.contains_key(&entry.board) {
            self.tell(&entry.board, &said, entry.unix_ms);
        }
    }

    /// Takes a message that may be an acknowledgement: on `TOPIC/BOARD/alarm/acknowledge` the name of a rule, or nothing
    /// for all. One that the broker has kept is of another time, and is passed over.
    pub(super) fn hear(&mut self, message: &Message, unix_ms: u64) {
        let rest = message
            .topic
            .strip_prefix(&self.topic)
            .and_then(|t| t.strip_prefix('/'));
        let board = rest.and_then(|rest| rest.strip_suffix("/alarm/acknowledge"));
        let Some((board, book)) = board.and_then(|b| Some((b.to_owned(), self.books.get_mut(b)?)))
        else {
            return;
        };
        if message.retain {
            return say(&format!(
                "{board}: a retained acknowledgement is passed over"
            ));
        }
        let name = String::from_utf8_lossy(&message.payload);
        let name = name.trim();
        match book.acknowledge((!name.is_empty()).then_some(name)) {
            Some(said) if !said.is_quiet() => self.tell(&board, &said, unix_ms),
            Some(_) => {}
            None => say(&format!(
                "{board}: no alarm is called {name:.40?}: nothing is acknowledged"
            )),
        }
    }

    fn tell(&mut self, board: &str, said: &Said, unix_ms: u64) {
        said.lines()
            .for_each(|line| say(&format!("{board}: {line}")));
        let own = serde_json::json!({"board": board, "unix_ms": unix_ms});
        let message = Message {
            topic: format!("{}/{board}/alarm", self.topic),
            payload: said.added_to(own.to_string()).into_bytes(),
            retain: true,
        };
        self.last.insert(board.to_owned(), message.clone());
        if self.waiting.len() >= MOST_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(message);
    }

    /// A connection begins: the last state of each board is to be said again, but for those of which something waits.
    pub(super) fn say_again(&mut self) {
        let waits = |m: &Message| self.waiting.iter().any(|waiting| waiting.topic == m.topic);
        let again: Vec<_> = self.last.values().filter(|m| !waits(m)).cloned().collect();
        self.waiting.extend(again);
    }

    /// The next message that waits for the broker.
    pub(super) fn next(&mut self) -> Option<Message> {
        self.waiting.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::report::Report;

    const RULES: &str =
        "[[alarm]]\nname = 'fan'\nquantity = 'velocity'\nwarning = 4.5\ndelay = 1\nlatch = true";

    fn entry(mm_s: f32) -> Entry {
        Entry {
            unix_ms: 7,
            board: "press-3".to_owned(),
            session: 1,
            report: Report {
                um_per_px: Some(10.0),
                velocity_mm_s_rms: Some(mm_s),
                ..Report::EMPTY
            },
        }
    }

    fn alarms() -> Alarms {
        Alarms {
            topic: "plant".to_owned(),
            books: [("press-3".to_owned(), Book::parse(RULES, "f").unwrap())].into(),
            ..Alarms::default()
        }
    }

    fn level(message: &Message) -> String {
        let object: serde_json::Value = serde_json::from_slice(&message.payload).unwrap();
        assert_eq!(
            (&message.topic[..], message.retain),
            ("plant/press-3/alarm", true)
        );
        assert_eq!(object["board"], "press-3");
        object["alarm_level"].as_str().unwrap().to_owned()
    }

    fn all(alarms: &mut Alarms) -> Vec<String> {
        std::iter::from_fn(|| alarms.next())
            .map(|m| level(&m))
            .collect()
    }

    fn acknowledge(alarms: &mut Alarms, board: &str, rule: &str) {
        acknowledge_with(alarms, board, rule, false);
    }

    fn acknowledge_with(alarms: &mut Alarms, board: &str, rule: &str, retain: bool) {
        let message = Message {
            topic: format!("plant/{board}/alarm/acknowledge"),
            payload: rule.as_bytes().to_vec(),
            retain,
        };
        alarms.hear(&message, 9);
    }

    #[test]
    fn changes_are_said_once_and_the_last_again_on_a_new_connection() {
        let mut alarms = alarms();
        for mm_s in [1.0, 1.0, 5.0, 5.0, 1.0] {
            alarms.window(&entry(mm_s));
        }
        assert_eq!(all(&mut alarms), ["normal", "warning"]);
        alarms.say_again();
        assert_eq!(all(&mut alarms), ["warning"]);
        for (board, rule) in [("press-4", ""), ("press-3", "pump"), ("press-3/x", "")] {
            acknowledge(&mut alarms, board, rule);
        }
        acknowledge_with(&mut alarms, "press-3", "fan", true);
        assert_eq!(all(&mut alarms), [""; 0]);
        acknowledge(&mut alarms, "press-3", " fan\n");
        assert_eq!(all(&mut alarms), ["normal"]);
        assert_eq!(alarms.subscription().unwrap(), "plant/+/alarm/acknowledge");
    }

    #[test]
    fn a_broker_that_stays_away_costs_the_oldest_changes_only() {
        let mut alarms = alarms();
        for n in 0..4 * MOST_WAITING {
            alarms.window(&entry(if n % 2 == 0 { 5.0 } else { 1.0 }));
            acknowledge(&mut alarms, "press-3", "");
        }
        alarms.window(&entry(5.0));
        alarms.say_again();
        let said = all(&mut alarms);
        assert_eq!(said.len(), MOST_WAITING);
        assert_eq!(said.last().unwrap(), "warning");
    }
}
