//! Which reports the broker has, as far as it says, and from when on to believe it.
//!
//! A broker acknowledges what it has in memory. When it is killed, what it had neither written to
//! disk nor handed on is gone, acknowledged or not. So an acknowledgement counts only after a
//! while ([`DOUBT`]) on a living connection; when the connection is lost before, the report is sent
//! once more.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::broker::IN_FLIGHT;
use super::spool::Mark;

/// How long a broker may lose what it has acknowledged.
pub(super) const DOUBT: Duration = Duration::from_secs(10);

/// A message that the broker has not acknowledged.
#[derive(Clone, Copy, Debug)]
struct UnderWay {
    /// Where in the spool it stands, if it is a report.
    mark: Option<Mark>,
    pkid: Option<u16>,
    acknowledged: bool,
}

/// The messages of one connection.
#[derive(Debug, Default)]
pub(super) struct Delivery {
    /// In the order in which they were sent.
    under_way: VecDeque<UnderWay>,
    /// Acknowledged reports that may yet be lost, and since when.
    doubtful: VecDeque<(Instant, Mark)>,
    trusted: u64,
}

impl Delivery {
    /// Whether there is room for a report and a birth before it.
    pub(super) fn has_room(&self) -> bool {
        self.under_way.len() + 2 <= IN_FLIGHT
    }

    /// A message was handed over; with its mark, if it is a report.
    pub(super) fn sent(&mut self, mark: Option<Mark>) {
        self.under_way.push_back(UnderWay {
            mark,
            pkid: None,
            acknowledged: false,
        });
    }

    /// The oldest message without a number has this one.
    pub(super) fn numbered(&mut self, pkid: u16) {
        let next = self.under_way.iter_mut().find(|one| one.pkid.is_none());
        if let Some(one) = next {
            one.pkid = Some(pkid);
        }
    }

    /// The broker acknowledges the message of this number.
    pub(super) fn acknowledged(&mut self, pkid: u16, now: Instant) {
        let same = |one: &&mut UnderWay| one.pkid == Some(pkid) && !one.acknowledged;
        if let Some(one) = self.under_way.iter_mut().find(same) {
            one.acknowledged = true;
        }
        // Only what is acknowledged without a gap: the order must hold when it is sent again.
        while self.under_way.front().is_some_and(|one| one.acknowledged) {
            if let Some(mark) = self.under_way.pop_front().and_then(|one| one.mark) {
                self.doubtful.push_back((now, mark));
            }
        }
    }

    /// Up to where the broker can be believed now, if further than the last time.
    pub(super) fn trusted(&mut self, now: Instant) -> Option<Mark> {
        let mut newest = None;
        while let Some(&(since, mark)) = self.doubtful.front()
            && now.duration_since(since) >= DOUBT
        {
            self.doubtful.pop_front();
            self.trusted += 1;
            newest = Some(mark);
        }
        newest
    }

    /// The connection ends in peace: the broker is believed.
    pub(super) fn trust_all(&mut self) -> Option<Mark> {
        self.trusted += self.doubtful.len() as u64;
        self.doubtful.drain(..).next_back().map(|(_, mark)| mark)
    }

    /// The connection is lost: what is not trusted is sent again.
    pub(super) fn lost(&mut self) {
        self.under_way.clear();
        self.doubtful.clear();
    }

    /// Reports acknowledged, each counted once.
    pub(super) fn count(&self) -> u64 {
        self.trusted + self.doubtful.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_acknowledgement_is_doubted_for_a_while() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mark = |offset| Mark { file: 1, offset };
        let mut delivery = Delivery::default();
        for number in 1..=4 {
            // The second is a birth, which stands nowhere in the spool.
            delivery.sent((number != 2).then(|| mark(u64::from(number))));
            delivery.numbered(number);
        }
        delivery.acknowledged(3, at(0));
        assert_eq!(delivery.count(), 0, "there is a gap");
        delivery.acknowledged(1, at(1));
        delivery.acknowledged(2, at(2));
        assert_eq!((delivery.count(), delivery.trusted(at(10))), (2, None));
        assert_eq!(delivery.trusted(at(11)), Some(mark(1)));
        assert_eq!(delivery.trusted(at(11)), None);
        delivery.lost();
        assert_eq!((delivery.count(), delivery.trusted(at(99))), (1, None));

        delivery.sent(Some(mark(3)));
        delivery.numbered(1);
        delivery.acknowledged(1, at(100));
        assert_eq!(delivery.trust_all(), Some(mark(3)));
        assert_eq!((delivery.count(), delivery.trust_all()), (2, None));
    }
}
