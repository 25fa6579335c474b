//! A board at the far end of a pseudo-terminal: the core's own end of a line, and a cable that harms
//! what passes.
#![allow(dead_code, reason = "each test file uses some of it")]

#[path = "../../../tests/wire_common/console.rs"]
mod console;

use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsRawFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use rowtone::link::settings::store::Nowhere;
use rowtone::report::{Peak, Report};
use rowtone::wire::{Format, Message, text};
use rowtone_chance::{Chance, XorShiftStar};
use serialport::{SerialPort, TTYPort};

/// Two ends of a pseudo-terminal: the board's, and the host's with its name.
pub(crate) fn pair() -> (TTYPort, TTYPort, String) {
    let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    // A child that inherited an end would keep the other from ever seeing it go.
    for end in [&master, &slave] {
        let close = FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC);
        fcntl(end.as_raw_fd(), close).expect("a flag of our own");
    }
    let name = slave.name().expect("the slave has a name");
    (master, slave, name)
}

/// A report with three peaks.
pub(crate) fn report(seq: u32) -> Report {
    let peak = |hz, track| Peak {
        hz,
        hz_sd: 0.0004,
        amplitude_px: 0.4,
        amplitude_px_sd: 0.0002,
        snr_db: 61.2,
        ambiguous: false,
        track,
        harmonic: None,
        motion: None,
    };
    Report {
        seq,
        time_ms: 500 * u64::from(seq),
        window_s: 1.0,
        fps: 60.0,
        lines: 18_000,
        noise_px: 0.0131,
        peaks: [peak(49.2, 1), peak(98.4, 2), peak(147.6, 3)]
            .into_iter()
            .collect(),
        ..Report::EMPTY
    }
}

/// The sentence of a report in session 1.
pub(crate) fn line(seq: u32) -> Vec<u8> {
    let mut buffer = [0; text::MAX_LINE];
    let message = Message::Report {
        session: 1,
        report: report(seq),
    };
    text::encode_to_slice(&message, &mut buffer)
        .unwrap()
        .to_vec()
}

/// A board that reports until it is dropped.
pub(crate) struct Board {
    pub(crate) port: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    unplugged: AtomicBool,
    /// Reports made.
    made: AtomicU32,
    /// Frames and commands that the cable harmed.
    harmed: AtomicU32,
}

impl Board {
    /// A report each `period`, on a cable that harms one byte in `1/rate`.
    pub(crate) fn start(wire: Format, period: Duration, rate: f64, seed: u64) -> Self {
        let (master, slave, port) = pair();
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            // The host's end stays there while no host has it open.
            let _slave = slave;
            talk(master, &of_thread, wire, period, rate, seed);
        });
        Self {
            port,
            shared,
            thread: Some(thread),
        }
    }

    /// Nothing of what the board says arrives, until it is plugged in again.
    pub(crate) fn unplug(&self, unplugged: bool) {
        self.shared.unplugged.store(unplugged, Ordering::Relaxed);
    }

    /// Reports made so far.
    pub(crate) fn made(&self) -> u32 {
        self.shared.made.load(Ordering::Relaxed)
    }

    /// How often the cable did harm.
    pub(crate) fn harmed(&self) -> u32 {
        self.shared.harmed.load(Ordering::Relaxed)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn talk(mut port: TTYPort, shared: &Shared, wire: Format, period: Duration, rate: f64, seed: u64) {
    let mut slots = [const { None }; 256];
    let mut link = console::link(&mut slots, wire);
    port.set_timeout(Duration::from_millis(2)).unwrap();
    let start = Instant::now();
    let mut bytes = [0; 512];
    let mut dice = XorShiftStar(seed);
    while !shared.stop.load(Ordering::Relaxed) {
        let now_us = || start.elapsed().as_micros() as u64;
        match port.read(&mut bytes) {
            Ok(n) => {
                for byte in through_cable(&bytes[..n], shared, rate, &mut dice) {
                    link.receive(byte, now_us(), &mut Nowhere);
                }
            }
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(error) => panic!("the board's end: {error}"),
        }
        let made = shared.made.load(Ordering::Relaxed);
        if start.elapsed() >= period * made {
            link.push(report(made));
            shared.made.store(made + 1, Ordering::Relaxed);
        }
        loop {
            let said = link.poll(now_us(), &mut Nowhere);
            if said.is_empty() {
                break;
            }
            let len = said.len();
            let arrives = through_cable(said, shared, rate, &mut dice);
            if !shared.unplugged.load(Ordering::Relaxed) && port.write_all(&arrives).is_err() {
                break; // full: it says the rest of it again
            }
            link.sent(len);
        }
    }
}

/// One byte in `1/rate` has a bit turned, is lost, or comes twice.
fn through_cable(sent: &[u8], shared: &Shared, rate: f64, dice: &mut XorShiftStar) -> Vec<u8> {
    let mut roll = || dice.next() >> 11;
    let mut received = vec![];
    for &byte in sent {
        if (roll() as f64) >= rate * (1_u64 << 53) as f64 {
            received.push(byte);
            continue;
        }
        shared.harmed.fetch_add(1, Ordering::Relaxed);
        match roll() % 3 {
            0 => received.push(byte ^ 1 << (roll() % 8)),
            1 => {}
            _ => received.extend([byte, byte]),
        }
    }
    received
}
