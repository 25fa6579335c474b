//! Plain lines, for pipes and files.

use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;

use rowtone::wire::Arrival;

use super::log::Log;
use super::{Format, went_away};
use crate::failure::Failure;
use crate::output::Out;
use rowtone_report::{json, text};
use rowtone_serial::line::Event;
use rowtone_serial::receiver::{Heard, Receiver as Board};

pub(super) fn run(
    port: &str,
    once: bool,
    format: Format,
    events: &Receiver<Event>,
    commands: &Sender<Vec<u8>>,
    mut log: Option<Log>,
) -> Result<(), Failure> {
    let mut board = Board::default();
    let mut out = Out::default();
    for event in events {
        match event {
            Event::Open => board.set_line(true),
            Event::Bytes(bytes) => {
                let mut heard = vec![];
                board.hear(&bytes, |one| heard.push(one));
                for one in heard {
                    if let (
                        Some(log),
                        Heard::Report {
                            session, report, ..
                        },
                    ) = (&mut log, &one)
                    {
                        log.append(*session, report)?;
                    }
                    show(format, &one, &mut out)?;
                }
                if let Some(command) = board.ask(Instant::now()) {
                    let _ = commands.send(command);
                }
            }
            Event::Gone(why) if once => {
                return Err(went_away(port, board.counters().reports, &why));
            }
            Event::Gone(why) => {
                board.set_line(false);
                eprintln!("rowtone: the line went away ({why}); waiting for it");
            }
            Event::End => break,
        }
    }
    let bad = board.counters().bad;
    if bad > 0 {
        eprintln!("rowtone: {bad} damaged lines were refused");
    }
    Ok(())
}

fn show(format: Format, heard: &Heard, out: &mut Out) -> Result<(), Failure> {
    match heard {
        Heard::Report {
            report, arrival, ..
        } => {
            match arrival {
                Arrival::Missed { from, to } => {
                    eprintln!("rowtone: reports {from} to {} are missing", to - 1);
                }
                Arrival::Restarted => eprintln!("rowtone: the board has started anew"),
                Arrival::Again => eprintln!("rowtone: report {} came when asked again", report.seq),
                Arrival::First | Arrival::Next => {}
            }
            out.line(&match format {
                Format::Text => text::report(report),
                Format::Json => json::report(report),
            })
        }
        Heard::Status(status) if format == Format::Text => out.line(&format!(
            "board: version {}.{}.{}, up {:.1} s, {} reports dropped",
            status.version[0],
            status.version[1],
            status.version[2],
            status.uptime_ms as f64 / 1000.0,
            status.dropped_reports
        )),
        Heard::Reply(reply) if format == Format::Text => {
            let verdict = if reply.ok { "done" } else { "refused" };
            out.line(&format!("board: {verdict}: {}", reply.text))
        }
        Heard::Status(_) | Heard::Reply(_) => Ok(()),
    }
}
