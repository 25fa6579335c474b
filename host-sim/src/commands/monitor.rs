//! `rowtone monitor`: what a board says, decoded.

use std::io::Read;

use clap::ValueEnum;
use rowtone::wire::text::{Decoder, MAX_LINE};
use rowtone::wire::{Arrival, Message, Sequence};

use crate::failure::Failure;
use crate::output::{Out, json, text};
use crate::serial::{PortName, open_reader};

/// Options of `rowtone monitor`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  rowtone monitor /dev/ttyUSB0\n  \
    rowtone analyze clip.y4m --line-time-us 18.9 --format wire | rowtone monitor -")]
pub struct Args {
    /// A serial port, with its speed if it is not 115200; a file, or `-` for standard input
    #[arg(value_name = "PORT[:BAUD]")]
    port: PortName,
    /// Format of the output
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// Formats of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// Decodes until the port, file or pipe ends.
///
/// # Errors
/// [`Failure::Input`] when the port cannot be opened or goes away.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut from = open_reader(&args.port)?;
    let mut listener = Listener {
        format: args.format,
        decoder: Decoder::new(),
        sequence: Sequence::default(),
        out: Out::default(),
        reports: 0,
        refused: 0,
    };
    let mut bytes = [0; 4096];
    let ending = loop {
        match from.read(&mut bytes) {
            Ok(0) => break None,
            Ok(n) => listener.hear(&bytes[..n])?,
            Err(error) => break Some(error),
        }
    };
    // A last line without its line end.
    listener.hear(b"\n")?;
    if listener.refused > 0 {
        eprintln!("rowtone: {} damaged lines were refused", listener.refused);
    }
    match ending {
        None => Ok(()),
        Some(error) => Err(Failure::input(format!(
            "{}: went away after {} reports ({error})",
            args.port.path, listener.reports
        ))),
    }
}

/// What is heard, and what was heard so far.
struct Listener {
    format: Format,
    decoder: Decoder<MAX_LINE>,
    sequence: Sequence,
    out: Out,
    reports: u64,
    refused: u64,
}

impl Listener {
    fn hear(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        for &byte in bytes {
            match self.decoder.push(byte) {
                None => {}
                Some(Ok(message)) => self.show(&message)?,
                Some(Err(_)) => self.refused += 1,
            }
        }
        Ok(())
    }

    fn show(&mut self, message: &Message) -> Result<(), Failure> {
        match message {
            Message::Report { session, report } => {
                self.reports += 1;
                match self.sequence.arrive(*session, report.seq) {
                    Arrival::Missed { from, to } => {
                        eprintln!("rowtone: reports {from} to {} are missing", to - 1);
                    }
                    Arrival::Restarted => eprintln!("rowtone: the board has started anew"),
                    Arrival::First | Arrival::Next | Arrival::Again => {}
                }
                self.out.line(&match self.format {
                    Format::Text => text::report(report),
                    Format::Json => json::report(report),
                })
            }
            Message::Status(status) if self.format == Format::Text => self.out.line(&format!(
                "board: version {}.{}.{}, up {:.1} s, {} reports dropped",
                status.version[0],
                status.version[1],
                status.version[2],
                status.uptime_ms as f64 / 1000.0,
                status.dropped_reports
            )),
            Message::Reply(reply) if self.format == Format::Text => {
                let verdict = if reply.ok { "done" } else { "refused" };
                self.out.line(&format!("board: {verdict}: {}", reply.text))
            }
            Message::Status(_) | Message::Reply(_) => Ok(()),
        }
    }
}
