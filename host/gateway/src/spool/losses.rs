//! Reports that are lost, counted by why and of which board, and said when it happens.

use std::collections::BTreeMap;
use std::fmt;
use std::time::{Duration, Instant};

/// The same loss is said once and then at most this often, with what has come together.
const QUIET: Duration = Duration::from_secs(10);

/// Why reports are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Why {
    /// The spool has reached its limit.
    NoRoom,
    /// The disk is full.
    DiskFull,
    /// The disk takes nothing, and neither does the memory any more.
    NotKept,
    /// They were harmed on disk.
    Harmed,
    /// They cannot be published.
    SetAside,
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoRoom => "dropped, the oldest: the spool has reached spool.max_mb",
            Self::DiskFull => "dropped, the oldest: the disk is full",
            Self::NotKept => "dropped: the disk takes none, and memory holds no more",
            Self::Harmed => "harmed on disk and left out",
            Self::SetAside => "set aside: they cannot be published",
        })
    }
}

#[derive(Debug, Default)]
struct Tally {
    all: u64,
    unsaid: u64,
    said: Option<Instant>,
}

/// What was lost so far.
#[derive(Debug, Default)]
pub(super) struct Losses(BTreeMap<(String, Why), Tally>);

impl Losses {
    pub(super) fn add(&mut self, board: &str, why: Why, count: u64) {
        if count > 0 {
            let tally = self.0.entry((board.to_owned(), why)).or_default();
            tally.all += count;
            tally.unsaid += count;
        }
    }

    /// Reports lost, for whatever reason.
    pub(super) fn count(&self) -> u64 {
        self.0.values().map(|tally| tally.all).sum()
    }

    /// What to say now.
    pub(super) fn say(&mut self, now: Instant, to: &mut Vec<String>) {
        for ((board, why), tally) in &mut self.0 {
            let quiet = tally.said.is_some_and(|at| now.duration_since(at) < QUIET);
            if tally.unsaid == 0 || quiet {
                continue;
            }
            let (unsaid, all) = (tally.unsaid, tally.all);
            let sum = if all == unsaid {
                String::new()
            } else {
                format!(" ({all} so far)")
            };
            let reports = if unsaid == 1 { "report" } else { "reports" };
            to.push(format!("{board}: {unsaid} {reports} {why}{sum}"));
            tally.unsaid = 0;
            tally.said = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_said_at_once_and_then_together() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mut losses = Losses::default();
        let say = |losses: &mut Losses, s| {
            let mut said = vec![];
            losses.say(at(s), &mut said);
            said
        };
        losses.add("a", Why::NoRoom, 3);
        losses.add("a", Why::Harmed, 0);
        assert_eq!(
            say(&mut losses, 0),
            ["a: 3 reports dropped, the oldest: the spool has reached spool.max_mb"]
        );
        losses.add("a", Why::NoRoom, 2);
        losses.add("b", Why::Harmed, 1);
        assert_eq!(
            say(&mut losses, 5),
            ["b: 1 report harmed on disk and left out"]
        );
        let all = say(&mut losses, 10);
        assert_eq!(all.len(), 1);
        assert!(all[0].starts_with("a: 2 reports") && all[0].ends_with("(5 so far)"));
        assert_eq!((say(&mut losses, 99).len(), losses.count()), (0, 6));
    }
}
