//! Whether every thread is alive: systemd's watchdog hears of the program only while all of them are.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::journal::log;
use crate::notify::Notifier;

/// How much longer the start may take, each time that is said: a camera may come late, but a program
/// that stands still is started anew.
const START_FOR: Duration = Duration::from_secs(60);

/// When one thread last gave a sign of life, ms since the program began; 0 while none is due.
#[derive(Debug, Default)]
pub struct Pulse(AtomicU64);

impl Pulse {
    /// A sign of life; the next one is due.
    pub fn beat(&self, began: Instant) {
        self.0.store(ms(began), Ordering::Relaxed);
    }

    /// A sign of life is due from now on, unless it was already.
    pub fn expect(&self, began: Instant) {
        let now = ms(began);
        let _ = self
            .0
            .compare_exchange(0, now, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Nothing is due: there is nothing to do, or the thread has ended.
    pub fn rest(&self) {
        self.0.store(0, Ordering::Relaxed);
    }

    fn is_late(&self, now_ms: u64, by: Duration) -> bool {
        let at = self.0.load(Ordering::Relaxed);
        at != 0 && u128::from(now_ms.saturating_sub(at)) > by.as_millis()
    }
}

fn ms(began: Instant) -> u64 {
    began.elapsed().as_millis() as u64 + 1
}

/// The threads besides the one that takes lines.
#[derive(Debug, Default)]
pub struct Pulses {
    /// Serves the line out.
    pub output: Pulse,
    /// Computes windows.
    pub spectrum: Pulse,
    /// Waits for signals.
    pub signals: Pulse,
    /// Takes the page's connections.
    pub page: Pulse,
}

impl Pulses {
    /// The first thread whose sign of life is overdue by so long.
    pub fn late(&self, began: Instant, by: Duration) -> Option<&'static str> {
        let threads = [
            ("output", &self.output),
            ("spectrum", &self.spectrum),
            ("signals", &self.signals),
            ("page", &self.page),
        ];
        let now_ms = ms(began);
        let late = threads
            .into_iter()
            .find(|(_, pulse)| pulse.is_late(now_ms, by));
        late.map(|(name, _)| name)
    }
}

/// Tells systemd now and then that all is alive.
#[derive(Debug)]
pub struct Alive<'a> {
    notifier: &'a Notifier,
    pulses: &'a Pulses,
    /// When the program began.
    began: Instant,
    /// As often as systemd wants to hear it; a thread that is late by as much stands still.
    every: Option<Duration>,
    told: Option<Instant>,
    complained: bool,
}

impl<'a> Alive<'a> {
    /// Tells this one of the threads with these pulses, in a program that began then.
    pub fn new(notifier: &'a Notifier, pulses: &'a Pulses, began: Instant) -> Self {
        Self {
            notifier,
            pulses,
            began,
            every: Notifier::watchdog(),
            told: None,
            complained: false,
        }
    }

    /// To be called often by the thread that takes lines, so that it is alive too.
    pub fn tell(&mut self) {
        let Some(every) = self.every else { return };
        if self.told.is_some_and(|at| at.elapsed() < every) {
            return;
        }
        match self.pulses.late(self.began, every) {
            None => {
                self.notifier.say("WATCHDOG=1");
                self.told = Some(Instant::now());
                self.complained = false;
            }
            Some(thread) if !self.complained => {
                log(&format!(
                    "the {thread} thread stands still; systemd is told no more"
                ));
                self.complained = true;
            }
            Some(_) => {}
        }
    }

    /// The start goes on: systemd gives it some more time.
    pub fn still_starting(&mut self) {
        if self.told.is_none_or(|at| at.elapsed() >= START_FOR / 6) {
            let us = START_FOR.as_micros();
            self.notifier.say(&format!("EXTEND_TIMEOUT_USEC={us}"));
            self.told = Some(Instant::now());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_stands_still_is_found() {
        let by = Duration::from_secs(1);
        let began = Instant::now() - Duration::from_secs(10);
        let pulses = Pulses::default();
        assert_eq!(pulses.late(began, by), None, "nothing is due");
        pulses.output.0.store(9_500, Ordering::Relaxed);
        assert_eq!(pulses.late(began, by), None);
        pulses.spectrum.0.store(8_000, Ordering::Relaxed);
        assert_eq!(pulses.late(began, by), Some("spectrum"));
        pulses.spectrum.expect(began);
        assert_eq!(pulses.late(began, by), Some("spectrum"), "due already");
        pulses.spectrum.rest();
        assert_eq!(pulses.late(began, by), None);
        pulses.spectrum.expect(began);
        assert_eq!(pulses.late(began, by), None, "due from now on");
    }
}
