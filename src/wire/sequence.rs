//! Telling lost, repeated and restarted reports apart by their numbers.

/// How a report's number follows those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The first one heard.
    First,
    /// The one expected.
    Next,
    /// Later than expected: the numbers from `from` up to, not including, `to` are missing.
    /// Ask for them again.
    Missed {
        /// First number missing.
        from: u32,
        /// Number of the report that came instead.
        to: u32,
    },
    /// Not later than the newest one: heard before, or sent again on request.
    Again,
    /// The first one of another session: the board has started anew.
    Restarted,
}

/// Follows the numbers of one board's reports.
///
/// ```
/// use rowtone::wire::{Arrival, Sequence};
///
/// let mut sequence = Sequence::default();
/// assert_eq!(sequence.arrive(3, 7), Arrival::First);
/// assert_eq!(sequence.arrive(3, 8), Arrival::Next);
/// assert_eq!(sequence.arrive(3, 11), Arrival::Missed { from: 9, to: 11 });
/// assert_eq!(sequence.arrive(3, 9), Arrival::Again);
/// assert_eq!(sequence.arrive(4, 0), Arrival::Restarted);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    /// Session and number of the newest report.
    newest: Option<(u32, u32)>,
}

impl Sequence {
    /// Goes on where another listener ended, with the session and number of its newest report: what
    /// was said between is missing.
    pub const fn after(session: u32, seq: u32) -> Self {
        Self {
            newest: Some((session, seq)),
        }
    }

    /// Takes a report's session and number.
    pub fn arrive(&mut self, session: u32, seq: u32) -> Arrival {
        let arrival = match self.newest {
            None => Arrival::First,
            Some((of, _)) if of != session => Arrival::Restarted,
            Some((_, newest)) if seq <= newest => return Arrival::Again,
            Some((_, newest)) if seq - newest == 1 => Arrival::Next,
            Some((_, newest)) => Arrival::Missed {
                from: newest + 1, // below seq, so this cannot overflow
                to: seq,
            },
        };
        self.newest = Some((session, seq));
        arrival
    }

    /// Session and number of the newest report, where there was one.
    pub fn newest(&self) -> Option<(u32, u32)> {
        self.newest
    }
}
