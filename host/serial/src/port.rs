//! Serial ports: where reports go out and come in.
//!
//! A [`PortName`] is what the user writes: a device, and a baud rate if it is not 115200.
//! [`open_reader`] also takes a file or standard input, so that a recorded log can be read like a live
//! port.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use serialport::SerialPort;

use crate::error::SerialError;

/// What a board uses unless it is told otherwise.
const USUAL_BAUD: u32 = 115_200;
/// How long one read or write may wait before it is tried again.
const STEP: Duration = Duration::from_millis(100);

/// A serial device and its speed: `PORT` or `PORT:BAUD`.
///
/// ```
/// use rowtone_serial::port::PortName;
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
    /// [`SerialError`] when it cannot be opened.
    pub fn open(&self) -> Result<Box<dyn SerialPort>, SerialError> {
        serialport::new(&self.path, self.baud)
            .timeout(STEP)
            .exclusive(false)
            .open()
            .map_err(|why| SerialError::Open {
                port: self.path.clone(),
                why,
            })
    }
}

/// Whether it only took too long.
pub(crate) fn may_go_on(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

/// Something to read bytes from: a port, a file, or `-` for standard input.
///
/// # Errors
/// [`SerialError`] when it cannot be opened.
pub fn open_reader(name: &PortName) -> Result<Box<dyn Read>, SerialError> {
    if name.path == "-" {
        return Ok(Box::new(io::stdin()));
    }
    let is_file = std::fs::metadata(&name.path).is_ok_and(|meta| meta.is_file() || is_fifo(&meta));
    if is_file {
        let file = File::open(&name.path).map_err(|why| SerialError::OpenFile {
            path: name.path.clone(),
            why,
        })?;
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
}
