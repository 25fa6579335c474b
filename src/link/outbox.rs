//! The last reports, kept so that none is lost unseen.
//!
//! Measuring pushes, the line takes; neither waits for the other. When the line is slow or stuck
//! the oldest unsent report is dropped and counted. Reports stay after they were sent, so that a
//! host that missed some can ask for them again by number. The slots are lent: as many reports
//! are kept as there are slots.

use core::fmt;

use heapless::Deque;

use crate::report::Report;

/// Most ranges of reports that can wait to be sent again.
pub const MAX_RESENDS: usize = 4;

/// Why reports cannot be sent again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResendError {
    /// None of them is kept (any more, or yet).
    NotKept {
        /// Number of the oldest report kept, where there is one.
        oldest: Option<u32>,
        /// Number of the next report to come.
        next: u32,
    },
    /// The range ends before it starts.
    Backwards {
        /// First number asked for.
        from: u32,
        /// Last number asked for.
        to: u32,
    },
    /// [`MAX_RESENDS`] earlier requests are still waiting.
    Busy,
}

impl fmt::Display for ResendError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotKept {
                oldest: Some(oldest),
                next,
            } => {
                write!(
                    f,
                    "not kept: reports {oldest} to before {next} are; ask for those"
                )
            }
            Self::NotKept { oldest: None, next } => {
                write!(f, "not kept: none is yet, the next one is {next}")
            }
            Self::Backwards { from, to } => {
                write!(
                    f,
                    "range {from} to {to} runs backwards; name the lower number first"
                )
            }
            Self::Busy => write!(
                f,
                "busy: {MAX_RESENDS} requests are waiting; ask again later"
            ),
        }
    }
}

impl core::error::Error for ResendError {}

/// The reports of one session, the newest and as many before it as there are slots.
///
/// ```
/// use rowtone::link::outbox::Outbox;
/// # use rowtone::report::Report;
/// # let report = |seq| Report { seq, ..Report::EMPTY };
/// let mut slots = [const { None }; 2];
/// let mut outbox = Outbox::new(&mut slots);
/// for seq in 0..3 {
///     outbox.push(report(seq)); // the line is stuck: 0 makes room for 2
/// }
/// assert_eq!(outbox.dropped(), 1);
/// assert_eq!(outbox.take().map(|r| r.seq), Some(1));
/// assert_eq!(outbox.take().map(|r| r.seq), Some(2));
/// assert_eq!(outbox.take().map(|r| r.seq), None);
/// assert_eq!(outbox.resend(0, 1), Ok((1, 1))); // 0 is gone
/// assert_eq!(outbox.take().map(|r| r.seq), Some(1));
/// ```
#[derive(Debug)]
pub struct Outbox<'a> {
    slots: &'a mut [Option<Report>],
    /// Number of the next report.
    next: u32,
    /// How many of the newest are kept.
    kept: u32,
    /// How many of the newest were never sent.
    unsent: u32,
    dropped: u32,
    /// First and last number of what to send again.
    resends: Deque<(u32, u32), MAX_RESENDS>,
}

impl<'a> Outbox<'a> {
    /// Starts with number 0 and nothing kept. Without any slot every report is dropped.
    pub fn new(slots: &'a mut [Option<Report>]) -> Self {
        Self {
            slots,
            next: 0,
            kept: 0,
            unsent: 0,
            dropped: 0,
            resends: Deque::new(),
        }
    }

    /// Takes the next report. It gets the next number, whatever number it came with.
    pub fn push(&mut self, mut report: Report) {
        report.seq = self.next;
        let capacity = u32::try_from(self.slots.len()).unwrap_or(u32::MAX);
        let lost = if capacity == 0 {
            true
        } else {
            self.kept == capacity && self.unsent == capacity
        };
        if lost {
            self.dropped = self.dropped.saturating_add(1);
        }
        if let Some(slot) = self.slot_of(self.next) {
            *slot = Some(report);
            self.unsent = (self.unsent + 1).min(capacity);
            self.kept = (self.kept + 1).min(capacity);
        }
        self.next = self.next.wrapping_add(1);
    }

    /// The report to send now, and that it is sent: new ones first, in order, then those asked
    /// for again. `None` when there is nothing to send.
    pub fn take(&mut self) -> Option<&Report> {
        let seq = if self.unsent > 0 {
            let seq = self.next.wrapping_sub(self.unsent);
            self.unsent -= 1;
            seq
        } else {
            self.take_resend()?
        };
        self.slot_of(seq)?.as_ref()
    }

    /// Takes nothing as waiting any more, without dropping it: for a line on which reports are read when
    /// the host likes. They are kept, and can be asked for by number.
    pub(crate) fn pass_over(&mut self) {
        self.unsent = 0;
    }

    /// Asks for the reports `from` to `to`, both included, once more. Gives back the first and the
    /// last number that will really be sent: the range less what is no longer kept.
    ///
    /// # Errors
    /// See [`ResendError`].
    pub fn resend(&mut self, from: u32, to: u32) -> Result<(u32, u32), ResendError> {
        if from > to {
            return Err(ResendError::Backwards { from, to });
        }
        let none = ResendError::NotKept {
            oldest: self.oldest(),
            next: self.next,
        };
        let oldest = self.oldest().ok_or(none)?;
        let newest = self.next.wrapping_sub(1);
        let (from, to) = (from.max(oldest), to.min(newest));
        if from > to {
            return Err(none);
        }
        self.resends
            .push_back((from, to))
            .map_err(|_| ResendError::Busy)?;
        Ok((from, to))
    }

    /// The newest report, sent or not.
    pub fn newest(&self) -> Option<&Report> {
        let newest = self.next.wrapping_sub(u32::from(self.kept > 0));
        let index = usize::try_from(newest)
            .ok()?
            .checked_rem(self.slots.len())?;
        self.slots.get(index)?.as_ref().filter(|_| self.kept > 0)
    }

    /// Reports that wait to be sent for the first time.
    pub fn waiting(&self) -> u32 {
        self.unsent
    }

    /// Number that the next report will get.
    pub fn next_seq(&self) -> u32 {
        self.next
    }

    /// Number of the oldest report kept.
    pub fn oldest(&self) -> Option<u32> {
        (self.kept > 0).then(|| self.next.wrapping_sub(self.kept))
    }

    /// Reports dropped before they were sent.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// The next number out of the ranges asked for that is still kept.
    fn take_resend(&mut self) -> Option<u32> {
        loop {
            let (from, to) = self.resends.pop_front()?;
            let from = from.max(self.oldest()?);
            if from > to {
                continue; // all of it was overwritten meanwhile
            }
            if from < to {
                // There is room: one was just taken from the front.
                let _ = self.resends.push_front((from + 1, to));
            }
            return Some(from);
        }
    }

    fn slot_of(&mut self, seq: u32) -> Option<&mut Option<Report>> {
        let index = usize::try_from(seq).ok()?.checked_rem(self.slots.len())?;
        self.slots.get_mut(index)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn report() -> Report {
        Report {
            seq: 77,
            ..Report::EMPTY
        }
    }

    #[derive(Clone, Debug)]
    enum Step {
        Push,
        Take,
        Resend(u32, u32),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            3 => Just(Step::Push),
            3 => Just(Step::Take),
            1 => (0..40_u32, 0..40_u32).prop_map(|(a, b)| Step::Resend(a, b)),
        ]
    }

    proptest! {
        /// Every report is sent once in order or counted as dropped, whatever is asked for again.
        #[test]
        fn none_is_lost_unseen(steps in proptest::collection::vec(step(), 0..200), room in 0..6_usize) {
            let mut slots: Vec<Option<Report>> = (0..room).map(|_| None).collect();
            let mut outbox = Outbox::new(&mut slots);
            let mut new = Vec::new();
            let mut pushed = 0;
            let mut again = 0;
            for step in steps {
                match step {
                    Step::Push => {
                        outbox.push(report());
                        pushed += 1;
                    }
                    Step::Take => {
                        if let Some(taken) = outbox.take() {
                            let seq = taken.seq;
                            if new.last().is_none_or(|&last| seq > last) {
                                new.push(seq);
                            } else {
                                prop_assert!(again > 0);
                                again -= 1;
                            }
                        }
                    }
                    Step::Resend(from, to) => {
                        if let Ok((from, to)) = outbox.resend(from, to) {
                            prop_assert!(outbox.oldest().unwrap() <= from && to < outbox.next_seq());
                            again += to - from + 1;
                        }
                    }
                }
            }
            while outbox.unsent > 0 {
                new.push(outbox.take().unwrap().seq);
            }
            prop_assert_eq!(outbox.next_seq(), pushed);
            prop_assert_eq!(new.len() as u32 + outbox.dropped(), pushed);
        }
    }
}
