//! A board's end of a serial line for a command that measures: reports out, commands in, on a thread of
//! its own.
//!
//! A slow or stuck port never holds up a live measurement: the oldest report is dropped and counted. A
//! recording is measured faster than any line speaks, so it waits for the port as long as that takes
//! anything. A port that goes away ends the sending, never the measuring. The last reports are kept, and
//! a host that missed some can ask for them again.

use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender as Channel, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::store::{Nowhere, Started};
use rowtone::link::settings::{Board, Console, Limits, Settings, SettingsError};
use rowtone::report::Report;
use rowtone::wire::SettingsOrigin;
use serialport::SerialPort;

use crate::error::SerialError;
use crate::port::{PortName, may_go_on};

/// Reports kept for a line that is slow and a host that missed some.
const KEPT: u32 = 64;
/// A port that takes nothing for this long is stuck.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long a read or write, or the wait for a report, may take.
const STEP: Duration = Duration::from_millis(10);
/// After the last report, how long a host has to ask for what it missed.
const LAST_WORDS: Duration = Duration::from_millis(250);

/// What the two threads share.
#[derive(Debug, Default)]
struct Shared {
    /// Reports handed over and not sent.
    waiting: AtomicU32,
    /// The port takes nothing.
    stuck: AtomicBool,
}

/// Sends reports beside other work.
#[derive(Debug)]
pub struct Sender {
    path: String,
    may_wait: bool,
    reports: Option<Channel<Report>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Ended>>,
    outcome: Option<Ended>,
}

/// How the sending ended.
#[derive(Debug)]
struct Ended {
    /// Reports sent, dropped, and left when it ended.
    sent: u32,
    dropped: u32,
    left: u32,
    error: Option<io::Error>,
}

impl Sender {
    /// Opens the port and starts the thread. With `may_wait`, [`Sender::send`] waits for a port that is
    /// slow. `settings` are those in use, for a host that asks.
    ///
    /// # Errors
    /// [`SerialError`] when the port cannot be opened, or the settings are none.
    pub fn open(
        name: &PortName,
        session: u32,
        settings: &Settings,
        may_wait: bool,
    ) -> Result<Self, SerialError> {
        let console = console(session, settings).map_err(SerialError::Settings)?;
        let mut port = name.open()?;
        // It was opened with a longer one, which is right for readers.
        let _ = port.set_timeout(STEP);
        let (reports, to_send) = channel();
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let baud = name.baud;
        let thread =
            std::thread::spawn(move || serve(port.as_mut(), console, baud, &to_send, &of_thread));
        Ok(Self {
            path: name.path.clone(),
            may_wait,
            reports: Some(reports),
            shared,
            thread: Some(thread),
            outcome: None,
        })
    }

    /// Sends one report. When the port has gone away the report is dropped, and the first time that is
    /// noticed the text to tell the user comes back.
    pub fn send(&mut self, report: &Report) -> Option<String> {
        let reports = self.reports.as_ref()?;
        let is_full = || {
            self.shared.waiting.load(Ordering::Relaxed) >= KEPT
                && !self.shared.stuck.load(Ordering::Relaxed)
        };
        let alive = || self.thread.as_ref().is_some_and(|t| !t.is_finished());
        while self.may_wait && is_full() && alive() {
            std::thread::sleep(Duration::from_millis(2));
        }
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        if alive() && reports.send(report.clone()).is_ok() {
            return None;
        }
        self.end();
        self.complaint().map(|text| {
            format!("{text}; the measuring goes on, this report and later ones are not sent")
        })
    }

    /// Waits until everything is written, for as long as the port takes something. Gives back what to
    /// tell the user, if anything.
    ///
    /// # Errors
    /// [`SerialError::Stopped`] when the port went away, or was stuck with reports left.
    pub fn finish(mut self) -> Result<Option<String>, SerialError> {
        self.end();
        match self.complaint() {
            Some(text) => Err(SerialError::Stopped(text)),
            None => Ok(self.outcome.as_ref().and_then(|ended| {
                (ended.dropped > 0).then(|| {
                    format!(
                        "serial port {}: too slow: {} reports sent, {} dropped",
                        self.path, ended.sent, ended.dropped
                    )
                })
            })),
        }
    }

    fn end(&mut self) {
        self.reports = None;
        if let Some(thread) = self.thread.take() {
            self.outcome = thread.join().ok();
        }
    }

    fn complaint(&self) -> Option<String> {
        let ended = self.outcome.as_ref()?;
        let (path, sent) = (&self.path, ended.sent);
        match &ended.error {
            Some(error) => Some(format!(
                "serial port {path}: went away after {sent} reports ({error})"
            )),
            None if ended.left > 0 => Some(format!(
                "serial port {path}: stuck: {sent} reports sent, {} dropped, {} left",
                ended.dropped, ended.left
            )),
            None => None,
        }
    }
}

/// Settings as near as a board's come to them, and not to be changed.
fn console(session: u32, settings: &Settings) -> Result<Console, SettingsError> {
    let window_s = settings.window_s.max(0.05);
    let scale = settings
        .um_per_px
        .filter(|scale| (0.001..=100_000.0).contains(scale));
    let defaults = Settings {
        window_s,
        hop_s: settings.hop_s.clamp(0.01, window_s),
        um_per_px: scale,
        ..*settings
    };
    let version = [
        env!("CARGO_PKG_VERSION_MAJOR"),
        env!("CARGO_PKG_VERSION_MINOR"),
        env!("CARGO_PKG_VERSION_PATCH"),
    ];
    let board = Board {
        version: version.map(|part| part.parse().unwrap_or(0)),
        limits: Limits {
            width: u16::MAX,
            height: u16::MAX,
            min_width: 1,
            max_window_s: 3600.0,
        },
        defaults,
    };
    let started = Started {
        session,
        settings: None,
        origin: SettingsOrigin::Defaults,
    };
    Ok(Console::new(board, started)?.fixed())
}

/// The thread: until all is sent after the last report, or the port fails.
fn serve(
    port: &mut dyn SerialPort,
    console: Console,
    baud: u32,
    reports: &Receiver<Report>,
    shared: &Shared,
) -> Ended {
    let mut slots: Vec<Option<Report>> = (0..KEPT).map(|_| None).collect();
    let mut link = Link::new(console, Outbox::new(&mut slots), baud);
    let start = Instant::now();
    let mut line = Line {
        moved: start,
        heard: start,
        idle: true,
    };
    let mut more = true;
    loop {
        let wait = if line.idle { STEP } else { Duration::ZERO };
        match reports.recv_timeout(wait) {
            Ok(report) => {
                link.push(report);
                reports.try_iter().for_each(|report| link.push(report));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) if more => {
                more = false;
                line.heard = Instant::now();
            }
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(wait),
        }
        let outcome = line.work(port, &mut link, start);
        let unsent = link.outbox().waiting() + u32::from(!line.idle);
        let stuck = !line.idle && line.moved.elapsed() >= PATIENCE;
        shared.waiting.store(unsent, Ordering::Relaxed);
        shared.stuck.store(stuck, Ordering::Relaxed);
        let done = line.idle && line.heard.elapsed() >= LAST_WORDS;
        if outcome.is_err() || (!more && (done || stuck)) {
            let (made, dropped) = (link.outbox().next_seq(), link.outbox().dropped());
            return Ended {
                sent: made - dropped - unsent.min(made - dropped),
                dropped,
                left: unsent,
                error: outcome.err(),
            };
        }
    }
}

/// How the line is doing.
struct Line {
    /// When the port last took something, or there was nothing to say.
    moved: Instant,
    /// When a command last came.
    heard: Instant,
    /// All is said.
    idle: bool,
}

impl Line {
    /// Takes what came, and sends what the port takes.
    fn work(
        &mut self,
        port: &mut dyn SerialPort,
        link: &mut Link<'_>,
        start: Instant,
    ) -> io::Result<()> {
        let now_us = || start.elapsed().as_micros() as u64;
        let mut bytes = [0; 256];
        let waiting = port.bytes_to_read()? as usize;
        if waiting > 0 {
            let count = port.read(&mut bytes[..waiting.min(256)])?;
            for &byte in &bytes[..count] {
                link.receive(byte, now_us(), &mut Nowhere);
            }
            self.heard = Instant::now();
        }
        loop {
            let said = link.poll(now_us(), &mut Nowhere);
            self.idle = said.is_empty();
            if self.idle {
                self.moved = Instant::now();
                return Ok(());
            }
            match port.write(said) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(taken) => {
                    link.sent(taken);
                    self.moved = Instant::now();
                }
                Err(error) if may_go_on(&error) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }
}
