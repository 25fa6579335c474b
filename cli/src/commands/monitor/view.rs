//! What the live view knows.

use std::time::{Duration, Instant};

use rowtone::report::Report;
use rowtone::wire::Arrival;

use super::history::History;
use super::log::Log;
use super::went_away;
use crate::failure::Failure;
use rowtone_serial::line::Event;
use rowtone_serial::receiver::{Heard, Receiver as Board};

/// A board is silent when nothing has come for so many times as its last two reports were apart, and
/// for so long at the least.
const MISSED: u32 = 3;
const SILENCE: Duration = Duration::from_secs(5);

/// All that is shown.
pub(super) struct View<'a> {
    pub(super) port: &'a str,
    /// Why the line is not there, if it is not.
    pub(super) gone: Option<String>,
    /// Whether to end when the line goes away.
    pub(super) once: bool,
    /// What the board last said that is no report.
    pub(super) said: String,
    pub(super) session: u32,
    pub(super) history: History,
    pub(super) board: Board,
    /// When the newest report came.
    pub(super) heard: Option<Instant>,
    /// When the port was opened.
    pub(super) open: Option<Instant>,
}

/// How long it is since the board was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Age {
    /// As long as is to be expected.
    Fresh(Duration),
    /// Longer.
    Silent(Duration),
}

impl View<'_> {
    /// Takes in what happened on the line.
    ///
    /// # Errors
    /// [`Failure::Input`] where the line went away and that is to end it, or the log cannot be written.
    pub(super) fn take(&mut self, event: Event, mut log: Option<&mut Log>) -> Result<(), Failure> {
        match event {
            Event::Open => {
                self.gone = None;
                self.open = Some(Instant::now());
                self.board.set_line(true);
            }
            Event::Gone(why) if self.once => {
                return Err(went_away(self.port, self.board.counters().reports, &why));
            }
            Event::Gone(why) => {
                self.gone = Some(why);
                self.board.set_line(false);
            }
            Event::End => self.gone = Some("the input has ended".to_owned()),
            Event::Bytes(bytes) => {
                let mut heard = vec![];
                self.board.hear(&bytes, |one| heard.push(one));
                for one in heard {
                    match one {
                        Heard::Report {
                            session,
                            report,
                            arrival,
                        } => {
                            if let Some(log) = log.as_deref_mut() {
                                log.append(session, &report)?;
                            }
                            self.report(session, &report, arrival);
                        }
                        Heard::Status(status) => {
                            // How long it is up would stand still until the next status.
                            let [major, minor, patch] = status.version;
                            self.said = format!(
                                "version {major}.{minor}.{patch}, {} reports dropped",
                                status.dropped_reports
                            );
                        }
                        Heard::Reply(reply) => self.said = reply.text.to_string(),
                    }
                }
            }
        }
        Ok(())
    }

    fn report(&mut self, session: u32, report: &Report, arrival: Arrival) {
        match arrival {
            // One that came late goes into the log, but would upset the order here.
            Arrival::Again => return,
            Arrival::Restarted => self.history.clear(),
            _ => {}
        }
        self.session = session;
        self.heard = Some(Instant::now());
        self.history.push(report);
    }

    /// How long ago the board was heard; none where neither it nor its line ever was.
    pub(super) fn age(&self, now: Instant) -> Option<Age> {
        let mut newest = self.history.reports.iter().map(|report| report.time_ms);
        let apart_ms = match (newest.next(), newest.next()) {
            (Some(last), Some(before)) => last.saturating_sub(before),
            _ => 0,
        };
        // A gap in the reports is not how far apart they are.
        let apart = Duration::from_millis(apart_ms.min(60_000));
        let age = now.saturating_duration_since(self.heard.or(self.open)?);
        Some(match age > (apart * MISSED).max(SILENCE) {
            true => Age::Silent(age),
            false => Age::Fresh(age),
        })
    }
}
