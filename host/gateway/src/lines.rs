//! The boards' lines: a thread each, which hears the reports and asks for those that are missing.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use super::config::Board;
use super::entry::Entry;
use super::{Input, spool, unix_ms};
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
                line::Event::Open => alive = to.send(Input::Line(index, None)).is_ok(),
                line::Event::Gone(why) => alive = to.send(Input::Line(index, Some(why))).is_ok(),
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

/// Up to where each board's reports are complete, on disk.
#[derive(Debug)]
pub(super) struct Complete {
    dir: PathBuf,
    /// Session and number.
    boards: BTreeMap<String, (u32, u32)>,
    changed: bool,
}

impl Complete {
    /// What the last run has written; nothing where there was none.
    pub(super) fn read(dir: &Path) -> Self {
        let text = std::fs::read_to_string(dir.join("complete")).unwrap_or_default();
        let board = |line: &str| {
            let mut words = line.split(' ');
            let board = words.next()?.to_owned();
            let session = words.next()?.parse().ok()?;
            let seq = words.next()?.parse().ok()?;
            Some((board, (session, seq)))
        };
        Self {
            dir: dir.to_owned(),
            boards: text.lines().filter_map(board).collect(),
            changed: false,
        }
    }

    pub(super) fn of(&self, board: &str) -> Option<(u32, u32)> {
        self.boards.get(board).copied()
    }

    /// All reports up to this one lie in the spool, or are given up.
    pub(super) fn set(&mut self, board: &str, complete: (u32, u32)) {
        let before = self.boards.insert(board.to_owned(), complete);
        self.changed |= before != Some(complete);
    }

    /// Writes it down. Where a crash comes first, some reports are asked for and sent once more.
    ///
    /// # Errors
    /// The disk refused it.
    pub(super) fn save(&mut self) -> io::Result<()> {
        if !self.changed {
            return Ok(());
        }
        let line =
            |(board, (session, seq)): (&String, &(u32, u32))| format!("{board} {session} {seq}\n");
        let text: String = self.boards.iter().map(line).collect();
        spool::replace(&self.dir, "complete", &text)?;
        self.changed = false;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_remembered() {
        let dir = std::env::temp_dir().join(format!("rowtone-complete-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let mut complete = Complete::read(&dir);
        complete.set("a", (1, 7));
        complete.set("b", (4, 2));
        complete.set("a", (1, 9));
        complete.save().unwrap();
        let complete = Complete::read(&dir);
        assert_eq!(complete.of("a"), Some((1, 9)));
        assert_eq!(complete.of("b"), Some((4, 2)));
        assert_eq!(complete.of("c"), None);
        std::fs::remove_dir_all(dir).unwrap();
    }
}
