//! What comes from one board's line: messages of either wire, what is missing, and what to ask for
//! again.
//!
//! Both decoders look at every byte. Each accepts only what passes its CRC-32, so which wire the
//! board speaks need not be told.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rowtone::report::Report;
use rowtone::wire::{Arrival, Message, Reply, Sequence, Status, binary, text};

/// How long to wait for reports that were asked for again.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often to ask for the same reports: on a line that harms one byte in a thousand, a question and
/// its answer get through three times in four.
const ATTEMPTS: u32 = 8;
/// Most reports to wait for; those missing beyond are lost.
const MOST_MISSING: u32 = 1000;

/// What was counted on a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Reports, each counted once.
    pub reports: u64,
    /// Of these, reports that came only when asked for again.
    pub recovered: u64,
    /// Reports that never came.
    pub lost: u64,
    /// Reports that came once more although they were there.
    pub repeated: u64,
    /// Sentences and frames refused.
    pub bad: u64,
    /// Times the board started anew.
    pub restarts: u64,
}

/// One thing that was heard.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one lives at a time")]
pub enum Heard {
    /// A report that was not there before.
    Report {
        /// Number of the board's session.
        session: u32,
        /// What was measured.
        report: Report,
        /// How it follows those before it; [`Arrival::Again`] for one that was asked for.
        arrival: Arrival,
    },
    /// How the board is doing.
    Status(Status),
    /// The answer to a command.
    Reply(Reply),
}

/// The wire that was last understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wire {
    Text,
    Binary,
}

/// A request that waits for its answer.
#[derive(Clone, Copy, Debug)]
struct Asked {
    at: Instant,
    attempt: u32,
    /// First and last number.
    range: (u32, u32),
    /// The board has said something since.
    heard: bool,
}

/// Listens to one line.
#[derive(Debug, Default)]
pub struct Receiver {
    text: text::Decoder<{ text::MAX_LINE }>,
    binary: binary::Decoder<{ binary::MAX_FRAME }>,
    wire: Option<Wire>,
    sequence: Sequence,
    missing: BTreeSet<u32>,
    asked: Option<Asked>,
    /// There is no line to ask on.
    away: bool,
    counters: Counters,
}

impl Receiver {
    /// Goes on where another listener ended, with the session and number of its newest report.
    pub fn after(session: u32, seq: u32) -> Self {
        Self {
            sequence: Sequence::after(session, seq),
            ..Self::default()
        }
    }

    /// Takes bytes as they came, and gives `to` what they say.
    pub fn hear(&mut self, bytes: &[u8], mut to: impl FnMut(Heard)) {
        for &byte in bytes {
            let text = self.text.push(byte).map(|heard| (Wire::Text, heard.ok()));
            let binary = self.binary.push(byte);
            let binary = binary.map(|heard| (Wire::Binary, heard.ok()));
            for (wire, message) in [text, binary].into_iter().flatten() {
                match message {
                    Some(message) => {
                        self.wire = Some(wire);
                        if let Some(asked) = &mut self.asked {
                            asked.heard = true;
                        }
                        if let Some(heard) = self.sort(message) {
                            to(heard);
                        }
                    }
                    // The other wire's decoder finds nothing but faults, of course.
                    None if self.wire.is_none_or(|known| known == wire) => self.counters.bad += 1,
                    None => {}
                }
            }
        }
    }

    /// Tells whether the line is there. On one that was away all that is missing is asked for anew,
    /// however long that was.
    pub fn set_line(&mut self, is_there: bool) {
        self.away = !is_there;
        self.asked = None;
    }

    /// The command to send now: it asks for the oldest reports that are missing. It is given again
    /// after a while, and after some times in vain the reports count as lost: while the board goes on
    /// speaking, that is. Of one that says nothing the cable may be out, and what is written to it
    /// may come all at once when it is back; it is asked once more, and then when it speaks again.
    pub fn ask(&mut self, now: Instant) -> Option<Vec<u8>> {
        if self.away {
            return None;
        }
        let attempt = match self.asked {
            Some(asked) if now.duration_since(asked.at) < PATIENCE => return None,
            Some(asked) if !asked.heard && asked.attempt > 1 => return None,
            Some(asked) => asked.attempt + 1,
            None => 1,
        };
        let (first, last) = self.first_missing()?;
        if attempt > ATTEMPTS {
            self.give_up(first, last);
            return self.ask(now);
        }
        self.asked = Some(Asked {
            at: now,
            attempt,
            range: (first, last),
            heard: false,
        });
        let mut line = String::new();
        // Writing to a string cannot fail.
        let _ = text::encode_command(&format!("resend {first} {last}"), &mut line);
        Some(line.into_bytes())
    }

    /// Session and number of the last report up to which none is missing: all before were heard, or
    /// given up. [`Receiver::after`] goes on from there.
    pub fn complete(&self) -> Option<(u32, u32)> {
        let (session, newest) = self.sequence.newest()?;
        let first = self.missing.first();
        Some((
            session,
            first.map_or(newest, |first| first.saturating_sub(1)),
        ))
    }

    /// What was counted so far. Reports still missing count as lost until they come.
    pub fn counters(&self) -> Counters {
        Counters {
            lost: self.counters.lost + self.missing.len() as u64,
            ..self.counters
        }
    }

    fn sort(&mut self, message: Message) -> Option<Heard> {
        let (session, report) = match message {
            Message::Report { session, report } => (session, report),
            Message::Status(status) => return Some(Heard::Status(status)),
            Message::Reply(reply) => {
                // The board has said all that it can, so these are gone.
                if let Some(Asked { range, .. }) = self.asked
                    && !reply.ok
                    && reply.text.starts_with("not kept")
                {
                    self.give_up(range.0, range.1);
                }
                return Some(Heard::Reply(reply));
            }
        };
        let arrival = self.sequence.arrive(session, report.seq);
        match arrival {
            Arrival::First | Arrival::Next => {}
            Arrival::Missed { from, to } => {
                let kept = from.max(to.saturating_sub(MOST_MISSING));
                self.counters.lost += u64::from(kept - from);
                self.missing.extend(kept..to);
            }
            Arrival::Again if self.missing.remove(&report.seq) => {
                self.counters.recovered += 1;
                // It answers, so the next range has all its attempts.
                self.asked = None;
            }
            Arrival::Again => {
                self.counters.repeated += 1;
                return None;
            }
            Arrival::Restarted => {
                self.counters.restarts += 1;
                self.counters.lost += self.missing.len() as u64;
                self.missing.clear();
                self.asked = None;
            }
        }
        self.counters.reports += 1;
        Some(Heard::Report {
            session,
            report,
            arrival,
        })
    }

    /// The first run of missing numbers.
    fn first_missing(&self) -> Option<(u32, u32)> {
        let mut numbers = self.missing.iter().copied();
        let first = numbers.next()?;
        let last = numbers
            .zip(first + 1..)
            .take_while(|(number, next)| number == next)
            .last();
        Some((first, last.map_or(first, |(number, _)| number)))
    }

    fn give_up(&mut self, first: u32, last: u32) {
        let before = self.missing.len();
        self.missing
            .retain(|number| !(first..=last).contains(number));
        self.counters.lost += (before - self.missing.len()) as u64;
        self.asked = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(session: u32, seq: u32) -> Vec<u8> {
        let mut report = rowtone_report::example(None);
        report.seq = seq;
        let mut buffer = [0; text::MAX_LINE];
        let message = Message::Report { session, report };
        text::encode_to_slice(&message, &mut buffer)
            .unwrap()
            .to_vec()
    }

    fn reply(ok: bool, text: &str) -> Vec<u8> {
        let text = text.try_into().unwrap();
        let mut buffer = [0; text::MAX_LINE];
        text::encode_to_slice(&Message::Reply(Reply { ok, text }), &mut buffer)
            .unwrap()
            .to_vec()
    }

    fn not_kept() -> Vec<u8> {
        reply(false, "not kept: reports 9 to before 12 are; ask for those")
    }

    fn numbers(receiver: &mut Receiver, bytes: &[u8]) -> Vec<u32> {
        let mut numbers = vec![];
        receiver.hear(bytes, |heard| {
            if let Heard::Report { report, .. } = heard {
                numbers.push(report.seq);
            }
        });
        numbers
    }

    #[test]
    fn what_is_missing_is_asked_for_and_then_given_up() {
        let mut receiver = Receiver::default();
        let now = Instant::now();
        let at = |s| now + Duration::from_secs(s);
        let heard = [line(1, 4), line(1, 5), line(1, 9), line(1, 11)].concat();
        assert_eq!(numbers(&mut receiver, &heard), [4, 5, 9, 11]);
        assert_eq!(receiver.complete(), Some((1, 5)));
        assert_eq!(receiver.counters().lost, 4);
        let asked = String::from_utf8(receiver.ask(at(0)).unwrap()).unwrap();
        assert!(asked.starts_with("$RTCMD,resend 6 8*"), "{asked}");
        assert_eq!(receiver.ask(at(1)), None);

        assert_eq!(
            numbers(&mut receiver, &[line(1, 7), line(1, 7)].concat()),
            [7]
        );
        for attempt in 1..=ATTEMPTS {
            let asked = receiver.ask(at(3 * u64::from(attempt))).unwrap();
            let asked = String::from_utf8(asked).unwrap();
            assert!(asked.contains("resend 6 6*"), "{asked}");
            // It speaks, of other things.
            assert!(numbers(&mut receiver, &reply(true, "unit=1")).is_empty());
        }
        let asked = String::from_utf8(receiver.ask(at(50)).unwrap()).unwrap();
        assert!(asked.contains("resend 8 8*"), "{asked}");
        // The board says that it has 8 no more; 10 is next.
        assert!(numbers(&mut receiver, &not_kept()).is_empty());
        let asked = String::from_utf8(receiver.ask(at(51)).unwrap()).unwrap();
        assert!(asked.contains("resend 10 10*"), "{asked}");
        let counters = Counters {
            reports: 5,
            recovered: 1,
            lost: 3,
            repeated: 1,
            ..Counters::default()
        };
        assert_eq!(receiver.counters(), counters);

        assert_eq!(numbers(&mut receiver, &line(2, 0)), [0]);
        assert_eq!(receiver.complete(), Some((2, 0)));
        assert_eq!(receiver.ask(at(60)), None);
        assert_eq!(
            (receiver.counters().restarts, receiver.counters().lost),
            (1, 3)
        );
    }

    /// However long the cable is out: what is missing is asked for when the board is heard again or the
    /// port is back, with few questions into the silence.
    #[test]
    fn a_cable_that_is_out_costs_no_attempts() {
        let now = Instant::now();
        let at = |s| now + Duration::from_secs(s);
        for port_stays in [true, false] {
            let mut receiver = Receiver::default();
            numbers(&mut receiver, &[line(1, 0), line(1, 4)].concat());
            assert!(receiver.ask(at(0)).is_some());
            if !port_stays {
                receiver.set_line(false);
            }
            let into_silence = (1..600).filter(|&s| receiver.ask(at(s)).is_some()).count();
            assert_eq!(into_silence, usize::from(port_stays));
            assert_eq!(receiver.complete(), Some((1, 0)));
            if port_stays {
                numbers(&mut receiver, &line(1, 5));
            } else {
                receiver.set_line(true);
            }
            let asked = String::from_utf8(receiver.ask(at(600)).unwrap()).unwrap();
            assert!(asked.contains("resend 1 3*"), "{asked}");
            assert_eq!(receiver.ask(at(601)), None);
            let came = numbers(
                &mut receiver,
                &[line(1, 1), line(1, 2), line(1, 3)].concat(),
            );
            assert_eq!((came, receiver.counters().lost), (vec![1, 2, 3], 0));
        }
    }
}
