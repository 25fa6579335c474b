//! The output thread: reports out, commands in, on a port that may go away and come back.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use rowtone::link::Link;
use rowtone::link::settings::Settings;
use rowtone::link::settings::store::Keep;
use rowtone::report::Report;
use serialport::SerialPort;

use crate::backoff::Backoff;
use crate::config::OutputConfig;
use crate::journal::log;
use crate::shared::Shared;
use crate::system;

/// How long a loop waits for a report before it looks at the line again.
const STEP: Duration = Duration::from_millis(5);
/// After the end, how long the line may take for what is left.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// The port that is no port: reports as lines for people, on standard output.
pub const TEXT: &str = "text";

/// Where bytes go to and come from.
enum Port {
    Serial(Box<dyn SerialPort>),
    Stdout(io::Stdout),
}

impl Port {
    fn open(config: &OutputConfig) -> io::Result<Self> {
        if config.port == "-" {
            return Ok(Self::Stdout(io::stdout()));
        }
        let port = serialport::new(&config.port, config.baud)
            .timeout(STEP)
            .exclusive(false)
            .open()?;
        Ok(Self::Serial(port))
    }

    /// What has come; nothing where nothing has.
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let Self::Serial(port) = self else {
            return Ok(0);
        };
        let waiting = port.bytes_to_read()? as usize;
        match to.get_mut(..waiting.min(to.len())) {
            Some(to) if !to.is_empty() => port.read(to),
            _ => Ok(0),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self {
            Self::Serial(port) => port.write(bytes),
            // Nobody may read the pipe just now: that must not keep the program from ending.
            Self::Stdout(out) if !system::is_writable(out, STEP) => Ok(0),
            Self::Stdout(out) => {
                let bytes = bytes.get(..system::PIPE_ROOM).unwrap_or(bytes);
                out.write_all(bytes)
                    .and_then(|()| out.flush())
                    .map(|()| bytes.len())
            }
        };
        match written {
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            other => other,
        }
    }
}

/// One line, until the program ends.
pub struct Uart<'a, K> {
    /// Where it is.
    pub config: OutputConfig,
    /// The core's end of it.
    pub link: Link<'a>,
    /// Where settings are kept.
    pub store: K,
}

impl<K: Keep> Uart<'_, K> {
    /// Serves the line until no more reports come and all is said.
    pub fn run(mut self, reports: &Receiver<Report>, shared: &Shared) {
        let mut port: Option<Port> = None;
        let mut backoff = Backoff::new(Duration::from_millis(500), Duration::from_secs(10));
        let mut ended: Option<Instant> = None;
        let mut told = false;
        let for_people = self.config.port == TEXT;
        loop {
            shared.pulses.output.beat(shared.started);
            self.grant(shared);
            match reports.recv_timeout(STEP) {
                Ok(report) => {
                    if for_people && let Err(e) = print(&report) {
                        return self.end(&e, shared);
                    }
                    self.link.push(report);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    ended.get_or_insert_with(Instant::now);
                }
            }
            if port.is_none() && !for_people && backoff.is_due() {
                match Port::open(&self.config) {
                    Ok(open) => {
                        port = Some(open);
                        backoff.reset();
                        told = false;
                        self.link.announce(now_us(shared));
                    }
                    Err(e) if !told => {
                        let port = &self.config.port;
                        log(&format!("{port}: cannot be opened: {e}; trying again"));
                        told = true;
                        backoff.failed();
                    }
                    Err(_) => {
                        backoff.failed();
                    }
                }
            }
            let said = match port.as_mut().map(|port| self.serve(port, shared)) {
                Some(Ok(idle)) => idle,
                Some(Err(e)) => {
                    if self.config.port == "-" {
                        return self.end(&e, shared);
                    }
                    let name = &self.config.port;
                    log(&format!("{name}: went away ({e}); trying again"));
                    port = None;
                    backoff.failed();
                    false
                }
                None => for_people,
            };
            if ended.is_some_and(|at| said || at.elapsed() > LAST_WORDS) {
                if let Some(Port::Serial(port)) = &mut port {
                    // Until the last byte has left, at most as long as a line takes at this speed.
                    let end = Instant::now() + LAST_WORDS;
                    while port.bytes_to_write().is_ok_and(|n| n > 0) && Instant::now() < end {
                        std::thread::sleep(STEP);
                    }
                }
                shared.pulses.output.rest();
                return;
            }
        }
    }

    /// Nobody reads any more: there is nothing to measure for.
    fn end(&self, why: &io::Error, shared: &Shared) {
        shared.stop.store(true, Ordering::Relaxed);
        shared.pulses.output.rest();
        log(&format!("standard output: {why}"));
    }

    /// Uses and keeps the settings that the page asks for, and answers it.
    fn grant(&mut self, shared: &Shared) {
        let wish = shared.wish.try_lock().ok().and_then(|mut wish| wish.take());
        let Some(wish) = wish else { return };
        if let Some((width, height)) = shared.picture() {
            self.link.set_picture(width, height);
        }
        let changed = self.link.change(wish.settings);
        if changed.is_ok() {
            self.pass_on(shared);
            if let Err(e) = self.link.save(&mut self.store) {
                log(&format!(
                    "settings of the page hold until the next start: {e}"
                ));
            }
        }
        // The page may have waited long enough.
        let _ = wish.answer.try_send(changed.map_err(|e| e.to_string()));
    }

    /// Takes what came, sends what is to send; whether all is said.
    fn serve(&mut self, port: &mut Port, shared: &Shared) -> io::Result<bool> {
        let mut bytes = [0; 256];
        let count = port.read(&mut bytes)?;
        if let Some((width, height)) = shared.picture() {
            self.link.set_picture(width, height);
        }
        for &byte in bytes.get(..count).unwrap_or_default() {
            self.link.receive(byte, now_us(shared), &mut self.store);
        }
        if count > 0 {
            self.pass_on(shared);
        }
        loop {
            let waiting = self.link.poll(now_us(shared), &mut self.store);
            if waiting.is_empty() {
                return Ok(true);
            }
            let taken = port.write(waiting)?;
            if taken == 0 {
                return Ok(false);
            }
            self.link.sent(taken);
        }
    }

    /// Tells the measuring side when something that it uses was changed.
    fn pass_on(&self, shared: &Shared) {
        let new = *self.link.console().settings();
        let mut current = shared
            .settings
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let measured = |s: Settings| Settings {
            wire: new.wire,
            unit: new.unit,
            lock: new.lock,
            ..s
        };
        if measured(*current) != new {
            *current = new;
            shared.changes.fetch_add(1, Ordering::Release);
        }
    }
}

/// A report for people. Where the reader is slow it is left out, for nothing is to wait for him.
fn print(report: &Report) -> io::Result<()> {
    let mut out = io::stdout();
    if !system::is_writable(&out, STEP) {
        return Ok(());
    }
    writeln!(out, "{}", rowtone_report::text::report(report))
}

/// Time since the program began, µs.
fn now_us(shared: &Shared) -> u64 {
    shared.started.elapsed().as_micros() as u64
}
