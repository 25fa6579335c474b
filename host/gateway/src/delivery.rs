//! Which reports the broker has, as far as it says, and from when on to believe it.
//!
//! A broker acknowledges what it has in memory. When it is killed, what it had neither written to
//! disk nor handed on is gone, acknowledged or not. So an acknowledgement counts only after a
//! while ([`DOUBT`]) on a living connection; when the connection is lost before, the report is sent
//! once more.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::spool::Mark;

/// Messages under way at most.
const IN_FLIGHT: usize = 64;
/// How long a broker may lose what it has acknowledged.
const DOUBT: Duration = Duration::from_secs(10);

/// A message that the broker has not acknowledged.
#[derive(Clone, Copy, Debug)]
struct UnderWay {
    /// Where in the spool it stands, if it is a report.
    mark: Option<Mark>,
    /// Its number; none where nothing was sent, because it cannot be.
    number: Option<u16>,
    since: Instant,
    acknowledged: bool,
}

/// The messages of one connection after the other.
#[derive(Debug, Default)]
pub(super) struct Delivery {
    /// In the order in which they were sent.
    under_way: VecDeque<UnderWay>,
    /// Acknowledged reports that may yet be lost, and since when.
    doubtful: VecDeque<(Instant, Mark)>,
    trusted: u64,
    last_number: u16,
    /// One message at a time, to see which one it is that the broker does not take.
    one_by_one: bool,
}

impl Delivery {
    /// Whether there is room for a report and a birth before it.
    pub(super) fn has_room(&self) -> bool {
        match self.one_by_one {
            true => self.under_way.is_empty(),
            false => self.under_way.len() + 2 <= IN_FLIGHT,
        }
    }

    /// The number for the next message. There are 65 535, and far fewer messages under way.
    pub(super) fn next_number(&mut self) -> u16 {
        loop {
            self.last_number = self.last_number.wrapping_add(1).max(1);
            let number = Some(self.last_number);
            if self.under_way.iter().all(|one| one.number != number) {
                return self.last_number;
            }
        }
    }

    /// A message was handed over under this number; with its mark, if it is a report. Without a
    /// number it cannot be sent, and is done with.
    pub(super) fn sent(&mut self, number: Option<u16>, mark: Option<Mark>, now: Instant) {
        self.under_way.push_back(UnderWay {
            mark,
            number,
            since: now,
            acknowledged: number.is_none(),
        });
        self.settle(now);
    }

    /// The broker acknowledges the message of this number.
    pub(super) fn acknowledged(&mut self, number: u16, now: Instant) {
        let same = |one: &&mut UnderWay| one.number == Some(number) && !one.acknowledged;
        if let Some(one) = self.under_way.iter_mut().find(same) {
            one.acknowledged = true;
            self.one_by_one = false;
        }
        self.settle(now);
    }

    /// Only what is acknowledged without a gap: the order must hold when it is sent again.
    fn settle(&mut self, now: Instant) {
        while self.under_way.front().is_some_and(|one| one.acknowledged) {
            if let Some(mark) = self.under_way.pop_front().and_then(|one| one.mark) {
                self.doubtful.push_back((now, mark));
            }
        }
    }

    /// The next report that the broker can be believed to have.
    pub(super) fn trusted(&mut self, now: Instant) -> Option<Mark> {
        let &(since, mark) = self.doubtful.front()?;
        if now.duration_since(since) < DOUBT {
            return None;
        }
        self.doubtful.pop_front();
        self.trusted += 1;
        Some(mark)
    }

    /// The connection ends in peace: the broker is believed.
    pub(super) fn trust_all(&mut self) -> Vec<Mark> {
        self.trusted += self.doubtful.len() as u64;
        self.doubtful.drain(..).map(|(_, mark)| mark).collect()
    }

    /// How long the oldest message has waited for the broker.
    pub(super) fn oldest(&self, now: Instant) -> Duration {
        let oldest = self.under_way.iter().find(|one| !one.acknowledged);
        oldest.map_or(Duration::ZERO, |one| now.duration_since(one.since))
    }

    /// The connection is lost: what is not trusted is sent again. Gives the first report that was not
    /// acknowledged, if one was under way.
    pub(super) fn lost(&mut self) -> Option<Mark> {
        let first = self.under_way.iter().find(|one| !one.acknowledged);
        let first = first.and_then(|one| one.mark);
        self.under_way.clear();
        self.doubtful.clear();
        first
    }

    /// From now on until something is acknowledged, each message waits for the one before it.
    pub(super) fn one_by_one(&mut self) {
        self.one_by_one = true;
    }

    /// Reports acknowledged, each counted once.
    pub(super) fn count(&self) -> u64 {
        self.trusted + self.doubtful.len() as u64
    }
}

/// Connections that ended over the same report before it is set aside.
const MOST_STRIKES: u32 = 5;

/// The report at which the connection ended the last times.
#[derive(Debug, Default)]
pub(super) struct Suspect {
    of: Option<(usize, u64)>,
    strikes: u32,
}

/// What to do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Nothing.
    Innocent,
    /// Send one message at a time.
    Watch,
    /// The broker does not take it.
    Guilty,
}

impl Suspect {
    /// The broker has closed the connection with this report first in line.
    pub(super) fn lost_at(&mut self, mark: Option<Mark>) -> Verdict {
        let of = mark.map(|mark| (mark.lane, mark.id));
        self.strikes = match of {
            None => 0,
            _ if of == self.of => self.strikes + 1,
            _ => 1,
        };
        self.of = of;
        match self.strikes {
            0 | 1 => Verdict::Innocent,
            2..MOST_STRIKES => Verdict::Watch,
            _ => Verdict::Guilty,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_acknowledgement_is_doubted_for_a_while() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mark = |id| Mark::of(0, id);
        let mut delivery = Delivery::default();
        for id in 1..=4_u16 {
            // The second is a birth, which stands nowhere in the spool.
            let number = delivery.next_number();
            assert_eq!(number, id);
            delivery.sent(Some(number), (id != 2).then(|| mark(u64::from(id))), at(0));
        }
        delivery.acknowledged(3, at(0));
        assert_eq!(delivery.count(), 0, "there is a gap");
        delivery.acknowledged(1, at(1));
        delivery.acknowledged(2, at(2));
        assert_eq!((delivery.count(), delivery.trusted(at(10))), (2, None));
        assert_eq!(delivery.oldest(at(30)), Duration::from_secs(30));
        assert_eq!(delivery.trusted(at(11)), Some(mark(1)));
        assert_eq!(delivery.trusted(at(11)), None);
        assert_eq!(delivery.lost(), Some(mark(4)));
        assert_eq!((delivery.count(), delivery.trusted(at(99))), (1, None));

        delivery.sent(Some(1), Some(mark(3)), at(100));
        // One that cannot be sent keeps its turn.
        delivery.sent(None, Some(mark(4)), at(100));
        assert_eq!(delivery.count(), 1);
        delivery.acknowledged(1, at(100));
        assert_eq!(delivery.trust_all(), [mark(3), mark(4)]);
        assert_eq!(
            (delivery.count(), delivery.oldest(at(200))),
            (3, Duration::ZERO)
        );
    }

    #[test]
    fn numbers_go_round_past_what_is_under_way() {
        let mut delivery = Delivery::default();
        let now = Instant::now();
        delivery.last_number = u16::MAX - 1;
        delivery.sent(Some(1), None, now);
        assert_eq!(delivery.next_number(), u16::MAX);
        assert_eq!(delivery.next_number(), 2);
    }

    #[test]
    fn a_report_that_ends_every_connection_is_found() {
        let mut suspect = Suspect::default();
        let mark = |id| Some(Mark::of(0, id));
        assert_eq!(suspect.lost_at(mark(1)), Verdict::Innocent);
        assert_eq!(suspect.lost_at(mark(2)), Verdict::Innocent);
        assert_eq!(suspect.lost_at(mark(2)), Verdict::Watch);
        assert_eq!(suspect.lost_at(None), Verdict::Innocent);
        let verdicts = [(); 5].map(|()| suspect.lost_at(mark(2)));
        assert_eq!(verdicts[3..], [Verdict::Watch, Verdict::Guilty]);
    }
}
