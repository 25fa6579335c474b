//! Serial ports: where reports go out and come in.
//!
//! A [`PortName`] is what the user writes: a device, and a baud rate if it is not 115200. [`Sender`]
//! writes beside the measuring, on a thread of its own with a short queue; a port that goes away ends
//! the sending, never the measuring. [`open_reader`] also takes a file or standard input, so that a
//! recorded log can be read like a live port.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serialport::SerialPort;

use crate::failure::Failure;

/// What a board uses unless it is told otherwise.
const USUAL_BAUD: u32 = 115_200;
/// Sentences waiting to be written.
const QUEUE: usize = 16;
/// A port that takes nothing for this long is given up.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long one read or write may wait before it is tried again.
const STEP: Duration = Duration::from_millis(100);

/// A serial device and its speed: `PORT` or `PORT:BAUD`.
///
/// ```
/// use host_sim::serial::PortName;
/// let port: PortName = "/dev/ttyUSB0:921600".parse()?;
/// assert_eq!((port.path.as_str(), port.baud), ("/dev/ttyUSB0", 921_600));
/// assert_eq!("COM3".parse::<PortName>()?.baud, 115_200);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortName {
    /// The device.
    pub path: String,
    /// Bits a second.
    pub baud: u32,
}

impl FromStr for PortName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("want PORT or PORT:BAUD".to_owned());
        }
        let whole = || Self {
            path: text.to_owned(),
            baud: USUAL_BAUD,
        };
        match text.rsplit_once(':') {
            // Names under /dev/serial/by-path have colons of their own.
            Some((path, baud))
                if !path.is_empty()
                    && !baud.is_empty()
                    && baud.bytes().all(|b| b.is_ascii_digit())
                    && !Path::new(text).exists() =>
            {
                let baud = baud.parse().ok().filter(|&baud| baud > 0);
                Ok(Self {
                    path: path.to_owned(),
                    baud: baud.ok_or("the baud rate is out of range")?,
                })
            }
            _ => Ok(whole()),
        }
    }
}

impl PortName {
    /// Opens the device: 8 data bits, no parity, 1 stop bit, not locked against others.
    ///
    /// # Errors
    /// [`Failure::Input`] when it cannot be opened.
    pub fn open(&self) -> Result<Box<dyn SerialPort>, Failure> {
        serialport::new(&self.path, self.baud)
            .timeout(STEP)
            .exclusive(false)
            .open()
            .map_err(|error| {
                Failure::input(format!(
                    "serial port {}: cannot be opened: {error}",
                    self.path
                ))
            })
    }
}

/// Writes to a serial port beside other work.
#[derive(Debug)]
pub struct Sender {
    path: String,
    queue: Option<SyncSender<Vec<u8>>>,
    thread: Option<JoinHandle<Ended>>,
    outcome: Option<Ended>,
}

/// How the sending ended: how many were sent, and what went wrong.
#[derive(Debug)]
struct Ended {
    sent: u64,
    error: Option<io::Error>,
}

impl Sender {
    /// Opens the port and starts the writing thread.
    ///
    /// # Errors
    /// [`Failure::Input`] when the port cannot be opened.
    pub fn open(name: &PortName) -> Result<Self, Failure> {
        let port = name.open()?;
        let (queue, sentences) = sync_channel(QUEUE);
        let thread = std::thread::spawn(move || write_all(port, &sentences));
        Ok(Self {
            path: name.path.clone(),
            queue: Some(queue),
            thread: Some(thread),
            outcome: None,
        })
    }

    /// Sends one sentence. When the port has gone away the sentence is dropped, and the first time
    /// that is noticed the text to tell the user comes back.
    pub fn send(&mut self, sentence: &[u8]) -> Option<String> {
        let mut sentence = sentence.to_vec();
        // A recording is measured faster than a serial line speaks: wait for it, but not for a port
        // that is stuck; the writing thread gives that up.
        while let Some(queue) = &self.queue {
            match queue.try_send(sentence) {
                Ok(()) => return None,
                Err(TrySendError::Full(back)) => {
                    sentence = back;
                    std::thread::sleep(Duration::from_millis(2));
                }
                Err(TrySendError::Disconnected(_)) => {
                    self.end();
                    return self.complaint().map(|text| {
                        format!(
                            "{text}; the measuring goes on, this report and later ones are not sent"
                        )
                    });
                }
            }
        }
        None
    }

    /// Waits until everything is written.
    ///
    /// # Errors
    /// [`Failure::Input`] when the port went away before that.
    pub fn finish(mut self) -> Result<(), Failure> {
        self.end();
        self.complaint()
            .map_or(Ok(()), |text| Err(Failure::input(text)))
    }

    fn end(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            self.outcome = thread.join().ok();
        }
    }

    fn complaint(&self) -> Option<String> {
        let Ended { sent, error } = self.outcome.as_ref()?;
        let error = error.as_ref()?;
        Some(format!(
            "serial port {}: went away after {sent} reports ({error})",
            self.path
        ))
    }
}

/// The writing thread: until the queue is closed or the port fails.
fn write_all(mut port: Box<dyn SerialPort>, sentences: &Receiver<Vec<u8>>) -> Ended {
    let mut sent = 0;
    loop {
        let outcome = match sentences.recv_timeout(STEP) {
            Ok(sentence) => write_one(&mut port, &sentence).map(|()| sent += 1),
            // While there is nothing to say, notice a port that has gone.
            Err(RecvTimeoutError::Timeout) => port.bytes_to_write().map(|_| ()).map_err(Into::into),
            Err(RecvTimeoutError::Disconnected) => return Ended { sent, error: None },
        };
        if let Err(error) = outcome {
            let error = Some(error);
            return Ended { sent, error };
        }
    }
}

/// Writes one sentence, however long the port takes, as long as it takes some of it.
fn write_one(port: &mut impl Write, mut rest: &[u8]) -> io::Result<()> {
    let mut last = Instant::now();
    while !rest.is_empty() {
        match port.write(rest) {
            Ok(n) if n > 0 => {
                rest = &rest[n..];
                last = Instant::now();
            }
            Ok(_) => return Err(ErrorKind::WriteZero.into()),
            Err(e) if may_go_on(&e) && last.elapsed() < PATIENCE => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

fn may_go_on(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

/// Something to read bytes from: a port, a file, or `-` for standard input.
///
/// # Errors
/// [`Failure::Input`] when it cannot be opened.
pub fn open_reader(name: &PortName) -> Result<Box<dyn Read>, Failure> {
    if name.path == "-" {
        return Ok(Box::new(io::stdin()));
    }
    let is_file = std::fs::metadata(&name.path).is_ok_and(|meta| meta.is_file() || is_fifo(&meta));
    if is_file {
        let file = File::open(&name.path)
            .map_err(|e| Failure::input(format!("{}: cannot be opened: {e}", name.path)))?;
        return Ok(Box::new(file));
    }
    Ok(Box::new(Patient(name.open()?)))
}

#[cfg(unix)]
fn is_fifo(meta: &std::fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&meta.file_type())
}

#[cfg(not(unix))]
fn is_fifo(_: &std::fs::Metadata) -> bool {
    false
}

/// A port whose reads wait until there is something.
struct Patient(Box<dyn SerialPort>);

impl Read for Patient {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.0.read(buffer) {
                Err(e) if may_go_on(&e) => {}
                done => return done,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_may_have_a_speed_and_colons() {
        let parse = |text: &str| text.parse::<PortName>();
        assert_eq!(parse("/dev/ttyS0").unwrap().baud, 115_200);
        assert_eq!(parse("/dev/ttyS0:9600").unwrap().baud, 9600);
        let by_path = parse("/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0").unwrap();
        assert!(by_path.path.ends_with("port0"));
        assert!(parse("").is_err());
        assert!(parse("/dev/ttyS0:0").is_err());
        assert!(parse("/dev/ttyS0:99999999999").is_err());
    }

    /// Takes three bytes a call, and nothing every other time.
    struct Slow(Vec<u8>, bool);

    impl Write for Slow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1 = !self.1;
            if self.1 {
                return Err(ErrorKind::TimedOut.into());
            }
            let n = bytes.len().min(3);
            self.0.extend_from_slice(&bytes[..n]);
            Ok(n)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_slow_port_gets_everything() {
        let mut port = Slow(Vec::new(), false);
        write_one(&mut port, b"$RTRPT,1*00").unwrap();
        assert_eq!(port.0, b"$RTRPT,1*00");
    }
}
