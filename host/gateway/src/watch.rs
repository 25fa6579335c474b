//! Which boards speak: a board that falls silent, is unplugged, or is back.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::config::Board;

/// What is known of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// It reports.
    Online,
    /// Its line is there, but no report has come for a while.
    Silent,
    /// Its line is not there.
    Unplugged,
}

impl State {
    /// The word on the wire.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Online => "online",
            Self::Silent => "silent",
            Self::Unplugged => "unplugged",
        }
    }
}

/// A board's state, and since when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Standing {
    pub(super) state: State,
    /// When it came to that, ms since 1970.
    pub(super) since_unix_ms: u64,
    /// What the operating system said of its line, or for how long it was silent.
    pub(super) why: Option<String>,
}

/// One board.
#[derive(Debug)]
struct Watched {
    /// It is silent when no report comes for so long.
    patience: Duration,
    /// The last report, or when its line was opened.
    heard_at: Instant,
    line: bool,
    standing: Option<Standing>,
}

/// All boards.
#[derive(Debug)]
pub(super) struct Watch(BTreeMap<String, Watched>);

impl Watch {
    pub(super) fn new(boards: &[Board], now: Instant) -> Self {
        let watched = |board: &Board| Watched {
            patience: Duration::from_secs(board.silent_s.into()),
            heard_at: now,
            line: true,
            standing: None,
        };
        let each = boards.iter().map(|b| (b.name.clone(), watched(b)));
        Self(each.collect())
    }

    /// A report has come. Whether that is a change.
    pub(super) fn heard(&mut self, board: &str, now: Instant, unix_ms: u64) -> bool {
        let Some(watched) = self.0.get_mut(board) else {
            return false;
        };
        watched.heard_at = now;
        // What was in its buffer when the cable went is no sign of life.
        watched.line && watched.becomes(State::Online, unix_ms, None)
    }

    /// The line has come (`None`) or gone. Whether that is a change: a line alone says nothing of its board.
    pub(super) fn line(
        &mut self,
        board: &str,
        gone: Option<&str>,
        now: Instant,
        unix_ms: u64,
    ) -> bool {
        let Some(watched) = self.0.get_mut(board) else {
            return false;
        };
        watched.line = gone.is_none();
        watched.heard_at = now;
        gone.is_some_and(|why| watched.becomes(State::Unplugged, unix_ms, Some(why.to_owned())))
    }

    /// The boards that have fallen silent.
    pub(super) fn silent(&mut self, now: Instant, unix_ms: u64) -> Vec<String> {
        let mut fallen = Vec::new();
        for (board, watched) in &mut self.0 {
            let silent = now.saturating_duration_since(watched.heard_at) >= watched.patience;
            if silent && watched.line {
                let why = format!("no report for {} s", watched.patience.as_secs());
                if watched.becomes(State::Silent, unix_ms, Some(why)) {
                    fallen.push(board.clone());
                }
            }
        }
        fallen
    }

    /// The boards of which something is known.
    pub(super) fn known(&self) -> impl Iterator<Item = (&str, &Standing)> {
        let each = self.0.iter();
        each.filter_map(|(board, watched)| Some((board.as_str(), watched.standing.as_ref()?)))
    }

    /// What is known of one.
    pub(super) fn of(&self, board: &str) -> Option<&Standing> {
        self.0.get(board)?.standing.as_ref()
    }
}

impl Watched {
    /// Whether the state was another one before.
    fn becomes(&mut self, state: State, since_unix_ms: u64, why: Option<String>) -> bool {
        if self.standing.as_ref().is_some_and(|s| s.state == state) {
            return false;
        }
        self.standing = Some(Standing {
            state,
            since_unix_ms,
            why,
        });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_told_once() {
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        let board = |name: &str, silent_s| Board {
            name: name.to_owned(),
            port: "/dev/ttyUSB0".parse().unwrap(),
            silent_s,
            zone_limits: None,
            alarms: None,
        };
        let mut watch = Watch::new(&[board("a", 10), board("b", 60)], start);
        assert_eq!(watch.known().count(), 0);
        assert!(watch.heard("a", at(1), 1000) && !watch.heard("a", at(2), 2000));
        assert!(watch.silent(at(11), 11_000).is_empty());
        assert_eq!(watch.silent(at(12), 12_000), ["a"]);
        assert!(watch.silent(at(13), 13_000).is_empty());
        let of = |watch: &Watch| watch.of("a").map(|s| (s.state, s.since_unix_ms));
        assert_eq!(of(&watch), Some((State::Silent, 12_000)));
        assert!(watch.line("a", Some("no such device"), at(14), 14_000));
        assert!(!watch.heard("a", at(14), 14_000), "from its buffer");
        // A line without a board on it is silent after a while.
        assert!(!watch.line("a", None, at(20), 20_000));
        assert_eq!(of(&watch), Some((State::Unplugged, 14_000)));
        assert_eq!(watch.silent(at(30), 30_000), ["a"]);
        assert!(watch.heard("a", at(31), 31_000));
        assert_eq!(of(&watch), Some((State::Online, 31_000)));
        // One that has never spoken.
        assert_eq!(watch.silent(at(60), 60_000), ["a", "b"]);
        assert!(!watch.heard("c", at(61), 61_000));
    }
}
