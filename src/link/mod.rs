//! A board's end of the serial line, whole: reports out, commands in, on the wire that is set.
//!
//! Three calls, none of which waits: [`Link::receive`] takes each byte that came, [`Link::poll`]
//! says which bytes to send, [`Link::sent`] how many of them the line took. Measuring hands over
//! each report with [`Link::push`] and never waits for the line: a slow or stuck one drops the
//! oldest report and counts it ([`crate::link::outbox`]).

use heapless::{Deque, Vec};

pub mod modbus;
pub mod outbox;
pub mod settings;

use crate::report::Report;
use crate::wire::modbus::{FrameReader, State};
use crate::wire::{Format, Message, binary, text};
use outbox::Outbox;
use settings::command::LineReader;
use settings::store::{Keep, SaveError};
use settings::{Console, Settings, SettingsError};

/// Most answers that can wait for the line. A command that comes while so many wait is refused.
pub(crate) const MAX_ANSWERS: usize = 2;

/// How late the echo of a Modbus response may come behind it, µs: adapters hold bytes back for some
/// milliseconds.
const ECHO_US: u64 = 20_000;

/// One serial line.
///
/// ```
/// use rowtone::link::{Link, outbox::Outbox};
/// use rowtone::link::settings::{Board, Console, Limits, Settings, store::{Nowhere, Started}};
/// use rowtone::wire::SettingsOrigin;
///
/// let board = Board {
///     version: [0, 1, 0],
///     limits: Limits { width: 320, height: 240, min_width: 16, max_window_s: 10.0 },
///     defaults: Settings::default(),
/// };
/// let started = Started { session: 1, settings: None, origin: SettingsOrigin::Defaults };
/// let mut slots = [const { None }; 8];
/// let mut link = Link::new(Console::new(board, started)?, Outbox::new(&mut slots), 115_200);
/// for &byte in b"get window\n" {
///     link.receive(byte, 0, &mut Nowhere);
/// }
/// let line = link.poll(0, &mut Nowhere);
/// assert!(line.starts_with(b"$RTACK,window=1*"));
/// let all = line.len();
/// link.sent(all);
/// assert!(link.poll(0, &mut Nowhere).is_empty());
/// # Ok::<(), rowtone::link::settings::SettingsError>(())
/// ```
#[derive(Debug)]
pub struct Link<'a> {
    console: Console,
    outbox: Outbox<'a>,
    lines: LineReader,
    frames: FrameReader,
    answers: Deque<Message, MAX_ANSWERS>,
    /// The last Modbus response, until it has come back, and by when it does on a bus that echoes, µs.
    echo: Vec<u8, { crate::wire::modbus::MAX_FRAME }>,
    echo_by_us: u64,
    /// What is being sent, and how much of it the line has taken.
    buffer: Vec<u8, { text::MAX_LINE }>,
    taken: usize,
}

impl<'a> Link<'a> {
    /// A line of this speed, baud (Modbus tells frames apart by it).
    pub fn new(console: Console, outbox: Outbox<'a>, baud: u32) -> Self {
        Self {
            console,
            outbox,
            lines: LineReader::new(),
            frames: FrameReader::new(baud),
            answers: Deque::new(),
            echo: Vec::new(),
            echo_by_us: 0,
            buffer: Vec::new(),
            taken: 0,
        }
    }

    /// The settings in use, and what else the line can change.
    pub fn console(&self) -> &Console {
        &self.console
    }

    /// Changes all settings at once from another side than the line: the device's own page.
    ///
    /// # Errors
    /// As [`Console::replace`].
    pub fn change(&mut self, settings: Settings) -> Result<(), SettingsError> {
        self.console.replace(settings)
    }

    /// Keeps the settings in use, as `save` over the line does.
    ///
    /// # Errors
    /// As the store's.
    pub fn save(&mut self, store: &mut impl Keep) -> Result<(), SaveError> {
        self.console.save(store)
    }

    /// As [`Console::set_picture`].
    pub fn set_picture(&mut self, width: u16, height: u16) {
        self.console.set_picture(width, height);
    }

    /// The reports kept.
    pub fn outbox(&self) -> &Outbox<'a> {
        &self.outbox
    }

    /// Takes a report of the measuring side. It gets the next number.
    pub fn push(&mut self, report: Report) {
        self.outbox.push(report);
        if self.is_modbus() {
            self.outbox.pass_over();
        }
    }

    /// Says the status unasked, as a board does at its start.
    pub fn announce(&mut self, now_us: u64) {
        let status = self.console.status(now_us / 1000, &self.outbox);
        // Where no room is left, answers to commands are waiting, and they tell more.
        let _ = self.answers.push_back(Message::Status(status));
    }

    /// Takes a byte from the line that came at `now_us` since the board's start.
    pub fn receive(&mut self, byte: u8, now_us: u64, store: &mut impl Keep) {
        if self.is_modbus() {
            self.frames.push(byte, now_us);
            return;
        }
        let Some(line) = self.lines.push(byte) else {
            return;
        };
        let answer = match line {
            _ if self.answers.is_full() => return self.console.count_refused(),
            Ok(line) => self
                .console
                .carry_out(line, now_us / 1000, &mut self.outbox, store),
            Err(error) => self.console.refuse(&error),
        };
        // There is room, as was seen above.
        let _ = self.answers.push_back(answer);
    }

    /// The bytes to send now; none where there is nothing to say. Call [`Link::sent`] with what
    /// the line took of them.
    pub fn poll(&mut self, now_us: u64, store: &mut impl Keep) -> &[u8] {
        if self.taken >= self.buffer.len() {
            self.taken = 0;
            self.buffer.clear();
            self.load(now_us, store);
        }
        self.buffer.get(self.taken..).unwrap_or_default()
    }

    /// The line has taken so many of the bytes that [`Link::poll`] gave.
    pub fn sent(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_add(bytes).min(self.buffer.len());
    }

    /// Puts the next thing to say into the buffer.
    fn load(&mut self, now_us: u64, store: &mut impl Keep) {
        // An answer goes out on the wire that is set now, the one to `set wire` included.
        let wire = self.console.settings().wire;
        if self.is_modbus() {
            self.answers.clear(); // there is no place for them on this wire
            return self.answer_frame(now_us, store);
        }
        if let Some(answer) = self.answers.pop_front() {
            return write(wire, &answer, &mut self.buffer);
        }
        let session = self.console.session();
        if let Some(report) = self.outbox.take() {
            let report = report.clone();
            write(wire, &Message::Report { session, report }, &mut self.buffer);
        }
    }

    fn is_modbus(&self) -> bool {
        // Settings with a wire that is left out do not pass their check.
        cfg!(feature = "modbus") && self.console.settings().wire == Format::Modbus
    }

    fn answer_frame(&mut self, now_us: u64, store: &mut impl Keep) {
        let Some(frame) = self.frames.frame(now_us) else {
            return;
        };
        // What this end has said itself is no request. The response to a write of one register looks
        // like one, though, and a client may say it again, if not so soon.
        let is_response = !self.echo.is_empty() && frame == self.echo.as_slice();
        let is_write = frame.get(1) == Some(&6);
        if is_response && (!is_write || self.frames.began_us() <= self.echo_by_us) {
            self.echo.clear();
            return self.frames.clear();
        }
        let status = self.console.status(now_us / 1000, &self.outbox);
        let state = State {
            status: &status,
            report: self.outbox.newest(),
        };
        let mut response = Vec::new();
        modbus::answer(frame, &state, &mut self.console, store, &mut response);
        self.frames.clear();
        let takes_us = self.frames.duration_us(response.len());
        self.echo_by_us = now_us.saturating_add(takes_us).saturating_add(ECHO_US);
        self.echo.clone_from(&response);
        // A frame is shorter than a line.
        let _ = self.buffer.extend_from_slice(&response);
    }
}

/// Encodes a message; one that cannot be said leaves the buffer empty.
fn write(wire: Format, message: &Message, buffer: &mut Vec<u8, { text::MAX_LINE }>) {
    if buffer.resize_default(text::MAX_LINE).is_err() {
        return;
    }
    let used = match wire {
        Format::Text => text::encode_to_slice(message, buffer).map(<[u8]>::len),
        Format::Binary if cfg!(feature = "binary") => {
            binary::encode_to_slice(message, buffer).map(<[u8]>::len)
        }
        // No messages on these wires.
        Format::Binary | Format::Modbus => Ok(0),
    };
    buffer.truncate(used.unwrap_or(0));
}
