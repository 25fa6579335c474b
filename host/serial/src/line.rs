//! A line to a board, read on a thread of its own: opened again whenever it comes back.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use crate::error::SerialError;
use crate::port::{PortName, open_reader};

/// How long to wait before a port that went away is tried again.
const AGAIN: Duration = Duration::from_millis(500);

/// What happens on a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The port is open (again).
    Open,
    /// Bytes came.
    Bytes(Vec<u8>),
    /// The port went away, and why; it is tried again until it is back.
    Gone(String),
    /// A file or standard input has ended.
    End,
}

/// Follows a port for as long as `event` returns true. It calls `event` at least every 100 ms,
/// with no bytes where none came. `commands` are written to the port; those that come while it is
/// away are dropped.
///
/// With `must_be_there`, a port that cannot be opened the first time ends it; else it is waited
/// for from the start. Files and standard input are read once.
///
/// # Errors
/// [`SerialError`] where the first opening failed and the port must be there.
pub fn follow(
    name: &PortName,
    must_be_there: bool,
    commands: &Receiver<Vec<u8>>,
    mut event: impl FnMut(Event) -> bool,
) -> Result<(), SerialError> {
    let is_stream = name.path == "-"
        || std::fs::metadata(&name.path).is_ok_and(|meta| meta.is_file() || is_pipe(&meta));
    if is_stream {
        return read_stream(name, event);
    }
    let mut first = must_be_there;
    let mut said = false;
    loop {
        match leaving_room().and_then(|_room| name.open()) {
            Ok(mut port) => {
                (first, said) = (false, false);
                // What was meant for the board while it was away would come all at once.
                commands.try_iter().for_each(drop);
                if !event(Event::Open) {
                    return Ok(());
                }
                let mut bytes = [0; 4096];
                let why = loop {
                    let came = match port.read(&mut bytes) {
                        Ok(0) => break "the other end is closed".to_owned(),
                        Ok(n) => bytes[..n].to_vec(),
                        Err(error) if waits(error.kind()) => vec![],
                        Err(error) => break error.to_string(),
                    };
                    if !event(Event::Bytes(came)) {
                        return Ok(());
                    }
                    for command in commands.try_iter() {
                        // A command that gets lost is asked again by whoever needs its answer.
                        let _ = port.write_all(&command);
                    }
                };
                if !event(Event::Gone(why)) {
                    return Ok(());
                }
            }
            Err(failure) if first => return Err(failure),
            Err(failure) => {
                let heard = if said {
                    Event::Bytes(vec![])
                } else {
                    Event::Gone(failure.to_string())
                };
                said = true;
                if !event(heard) {
                    return Ok(());
                }
            }
        }
        std::thread::sleep(AGAIN);
    }
}

/// Descriptors that lines leave for what else the program has to open: its files, its connections.
const ROOM: usize = 6;

/// Holds so many descriptors that as many are left when they are given back.
///
/// # Errors
/// There are not so many.
fn leaving_room() -> Result<Vec<File>, SerialError> {
    let some_file = if cfg!(unix) { "/dev/null" } else { "NUL" };
    let held: std::io::Result<Vec<File>> = (0..ROOM).map(|_| File::open(some_file)).collect();
    held.map_err(SerialError::NoRoom)
}

fn read_stream(name: &PortName, mut event: impl FnMut(Event) -> bool) -> Result<(), SerialError> {
    let mut from = open_reader(name)?;
    let mut bytes = [0; 4096];
    event(Event::Open);
    loop {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(n) => {
                if !event(Event::Bytes(bytes[..n].to_vec())) {
                    return Ok(());
                }
            }
            Err(error) if waits(error.kind()) => {}
            Err(error) => {
                return Err(SerialError::Read {
                    path: name.path.clone(),
                    why: error,
                });
            }
        }
    }
    // A last line without its line end.
    event(Event::Bytes(vec![b'\n']));
    event(Event::End);
    Ok(())
}

/// [`follow`] on a thread: its events, and where commands go. The thread ends when the events are
/// no longer received.
///
/// # Errors
/// [`SerialError`] where the port cannot be opened.
pub fn listen(name: &PortName) -> Result<(Receiver<Event>, Sender<Vec<u8>>), SerialError> {
    let (events_to, events) = channel();
    let (commands, commands_from) = channel();
    let (result_to, result) = channel();
    let name = name.clone();
    std::thread::spawn(move || {
        let done = follow(&name, true, &commands_from, |event| {
            let _ = result_to.send(Ok(()));
            events_to.send(event).is_ok()
        });
        let _ = result_to.send(done);
    });
    match result.recv() {
        Ok(Err(failure)) => Err(failure),
        _ => Ok((events, commands)),
    }
}

fn waits(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

#[cfg(unix)]
fn is_pipe(meta: &std::fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&meta.file_type())
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    false
}
