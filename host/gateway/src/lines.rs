//! The boards' lines: a thread each, which hears the reports and asks for those that are missing.

use std::io;
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use super::config::Board;
use super::spool::record::Entry;
use super::{Input, unix_ms};
use rowtone_serial::line;
use rowtone_serial::receiver::{Counters, Heard, Receiver as Ear};

/// Starts the thread of one line. `complete` is the session and number up to which no report was
/// missing when the gateway ran the last time: what the board has said since is asked for.
pub(super) fn listen(
    index: usize,
    board: &Board,
    complete: Option<(u32, u32)>,
    to: Sender<Input>,
) -> io::Result<()> {
    let board = board.clone();
    let (commands_to, commands) = channel();
    let work = move || {
        let mut ear = complete.map_or_else(Ear::default, |(session, seq)| Ear::after(session, seq));
        let mut counted = Counters::default();
        // The port may come later, so it never fails.
        let _ = line::follow(&board.port, false, &commands, |event| {
            let mut alive = true;
            match event {
                line::Event::Open => {
                    ear.set_line(true);
                    alive = to.send(Input::Line(index, None)).is_ok();
                }
                line::Event::Gone(why) => {
                    ear.set_line(false);
                    alive = to.send(Input::Line(index, Some(why))).is_ok();
                }
                line::Event::End => {}
                line::Event::Bytes(bytes) => ear.hear(&bytes, |heard| {
                    if let Heard::Report {
                        session, report, ..
                    } = heard
                    {
                        let (unix_ms, board) = (unix_ms(), board.name.clone());
                        let entry = Entry {
                            unix_ms,
                            board,
                            session,
                            report,
                        };
                        alive &= to.send(Input::Report(entry)).is_ok();
                    }
                }),
            }
            if let Some(command) = ear.ask(Instant::now()) {
                let _ = commands_to.send(command);
            }
            if ear.counters() != counted {
                counted = ear.counters();
                let counted = Input::Counted(index, counted, ear.complete());
                alive &= to.send(counted).is_ok();
            }
            alive
        });
    };
    // A line needs little; there may be hundreds.
    let thread = std::thread::Builder::new().stack_size(256 * 1024);
    thread.spawn(work).map(drop)
}
