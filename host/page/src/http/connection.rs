//! One socket with deadlines: requests in, answers out.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::reply::{Reply, first_lines};
use super::request::{Head, RequestError, parse};

/// A request must be there, head and body, so long after its first byte; an idle connection ends.
const PATIENCE: Duration = Duration::from_secs(5);
/// An answer must be taken so long after its first byte, and a second more for each [`SLOWEST`] bytes.
const TAKING: Duration = Duration::from_secs(5);
/// The slowest reader that is served, bytes a second.
const SLOWEST: u64 = 256 << 10;
/// Bytes that are written at once.
const PIECE: usize = 64 << 10;

/// Why a connection has no further request.
#[derive(Debug)]
pub enum Broken {
    /// The other end has closed it, fell silent, or does not take what is sent.
    Gone,
    /// What it sent is no request; it is to be told so.
    Refused(RequestError),
}

impl From<io::Error> for Broken {
    fn from(_: io::Error) -> Self {
        Self::Gone
    }
}

/// See the [module](self).
#[derive(Debug)]
pub struct Connection {
    stream: TcpStream,
    /// Received, and not yet part of a request.
    bytes: Vec<u8>,
}

impl Connection {
    /// A connection that has said nothing yet.
    pub fn new(stream: TcpStream) -> Self {
        // Answers are written whole, so waiting for more to send gains nothing.
        let _ = stream.set_nodelay(true);
        Self {
            stream,
            bytes: Vec::new(),
        }
    }

    /// The next request and its body.
    ///
    /// # Errors
    /// [`Broken`] when none comes.
    pub fn request(&mut self) -> Result<(Head, Vec<u8>), Broken> {
        let deadline = Instant::now() + PATIENCE;
        let (head, length) = loop {
            match parse(&self.bytes).map_err(Broken::Refused)? {
                Some(found) => break found,
                None => self.receive(deadline)?,
            }
        };
        let end = length + head.content_length;
        while self.bytes.len() < end {
            self.receive(deadline)?;
        }
        let rest = self.bytes.split_off(end);
        let mut request = std::mem::replace(&mut self.bytes, rest);
        Ok((head, request.split_off(length)))
    }

    fn receive(&mut self, deadline: Instant) -> Result<(), Broken> {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(Broken::Gone);
        }
        self.stream.set_read_timeout(Some(left))?;
        let mut buffer = [0; 4096];
        match self.stream.read(&mut buffer) {
            Ok(0) => Err(Broken::Gone),
            Ok(count) => {
                self.bytes.extend(buffer.get(..count).unwrap_or_default());
                Ok(())
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => Ok(()),
            Err(e) => Err(e.into()),
        }
    }

    /// Sends an answer; of one to `HEAD` the head alone.
    ///
    /// # Errors
    /// [`Broken::Gone`] when the other end does not take it in time.
    pub fn send(&mut self, reply: &Reply, keep_alive: bool, head_only: bool) -> Result<(), Broken> {
        let mut bytes = reply.head(keep_alive).into_bytes();
        if !head_only {
            bytes.extend(&reply.body);
        }
        self.write(&bytes)
    }

    /// Begins an answer of events (`text/event-stream`), which ends with the connection.
    ///
    /// # Errors
    /// [`Broken::Gone`] when the other end does not take it in time.
    pub fn begin_events(&mut self) -> Result<(), Broken> {
        let head = first_lines(200, "text/event-stream", false);
        // A proxy that collects would hold events back.
        self.write(format!("{head}X-Accel-Buffering: no\r\n\r\n").as_bytes())
    }

    /// Writes bytes within the time that they may take.
    ///
    /// # Errors
    /// [`Broken::Gone`] when the other end does not take them in time.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Broken> {
        let more = Duration::from_secs(bytes.len() as u64 / SLOWEST);
        let deadline = Instant::now() + TAKING + more;
        for piece in bytes.chunks(PIECE) {
            let mut piece = piece;
            while !piece.is_empty() {
                let left = deadline.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(Broken::Gone);
                }
                self.stream.set_write_timeout(Some(left))?;
                match self.stream.write(piece) {
                    Ok(0) => return Err(Broken::Gone),
                    Ok(count) => piece = piece.get(count..).unwrap_or_default(),
                    Err(e) if e.kind() == ErrorKind::Interrupted => {}
                    Err(e) => return Err(e.into()),
                }
            }
        }
        Ok(())
    }

    /// Says why there is no answer, and ends in order: what was sent and not read would reset the connection and take the
    /// words with it.
    pub fn refuse(mut self, reply: &Reply) {
        if self.send(reply, false, false).is_err() {
            return;
        }
        let _ = self.stream.shutdown(std::net::Shutdown::Write);
        let _ = self
            .stream
            .set_read_timeout(Some(Duration::from_millis(50)));
        let mut buffer = [0; 4096];
        for _ in 0..16 {
            if !matches!(self.stream.read(&mut buffer), Ok(1..)) {
                break;
            }
        }
    }
}
