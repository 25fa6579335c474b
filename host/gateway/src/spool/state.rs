//! What is remembered of each board besides its records: two files that take turns.
//!
//! Each is overwritten in its place, so on a full disk too (a new file would need room), and each
//! carries a number and a checksum: whichever of the two a crash cuts short, the other one holds.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::record::CRC_32;

/// What is known of one board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Known {
    /// All records up to this number are acknowledged.
    pub(super) acknowledged: u64,
    /// Session and number up to which none of its reports is missing, or all that are were given up.
    pub(super) complete: Option<(u32, u32)>,
    /// The same, of what is on the disk itself.
    pub(super) on_disk: Option<(u32, u32)>,
}

/// The two files.
#[derive(Debug)]
pub(super) struct State {
    dir: PathBuf,
    /// Number of the newest content.
    generation: u64,
    /// Which start of the computer this is.
    boot: String,
    /// Both files were there, and neither could be read.
    pub(super) is_harmed: bool,
}

/// What stands in front.
const HEAD: &str = "rowtone-spool-2";

impl State {
    /// Reads the newer one of the two. What was not on the disk counts only while the computer has not
    /// been started anew since.
    pub(super) fn read(dir: &Path) -> (Self, BTreeMap<String, Known>) {
        Self::read_at(dir, boot())
    }

    fn read_at(dir: &Path, boot: String) -> (Self, BTreeMap<String, Known>) {
        let files = paths(dir).map(|path| std::fs::read(path).ok());
        let is_harmed = files.iter().flatten().any(|bytes| !bytes.is_empty());
        let newest = files.iter().flatten().filter_map(|bytes| parse(bytes));
        let newest = newest.max_by_key(|content| content.generation);
        let is_harmed = is_harmed && newest.is_none();
        let newest = newest.unwrap_or_default();
        let (generation, mut known) = (newest.generation, newest.known);
        if newest.boot != boot {
            known
                .values_mut()
                .for_each(|one| one.complete = one.on_disk);
        }
        let dir = dir.to_owned();
        let state = Self {
            dir,
            generation,
            boot,
            is_harmed,
        };
        (state, known)
    }

    /// Writes the next one.
    ///
    /// # Errors
    /// The disk refused it; the last one holds.
    pub(super) fn write<'a>(
        &mut self,
        known: impl Iterator<Item = (&'a str, Known)>,
    ) -> io::Result<()> {
        let generation = self.generation + 1;
        let mut text = format!("{HEAD} {generation} {}\n", self.boot);
        let pair = |pair: Option<(u32, u32)>| {
            pair.map_or("- -".to_owned(), |(session, seq)| {
                format!("{session} {seq}")
            })
        };
        for (board, known) in known {
            let (complete, on_disk) = (pair(known.complete), pair(known.on_disk));
            text += &format!("{board} {} {complete} {on_disk}\n", known.acknowledged);
        }
        text += &format!("{:08X}\n", CRC_32.checksum(text.as_bytes()));
        let [even, odd] = paths(&self.dir);
        let path = if generation.is_multiple_of(2) {
            even
        } else {
            odd
        };
        // Not cut to nothing first: what it takes of the disk it keeps.
        let mut file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        file.write_all(text.as_bytes())?;
        file.set_len(text.len() as u64)?;
        self.generation = generation;
        Ok(())
    }
}

/// The files, for generations that are even and odd.
pub(super) fn paths(dir: &Path) -> [PathBuf; 2] {
    ["state.0", "state.1"].map(|name| dir.join(name))
}

/// What a file says that is whole.
#[derive(Default)]
struct Content {
    generation: u64,
    boot: String,
    known: BTreeMap<String, Known>,
}

fn parse(bytes: &[u8]) -> Option<Content> {
    let text = std::str::from_utf8(bytes).ok()?.strip_suffix('\n')?;
    let (body, sum) = text.split_at(text.rfind('\n')? + 1);
    if format!("{:08X}", CRC_32.checksum(body.as_bytes())) != sum {
        return None;
    }
    let mut lines = body.lines();
    let mut head = lines.next()?.split(' ');
    if head.next()? != HEAD {
        return None;
    }
    let generation = head.next()?.parse().ok()?;
    let boot = head.next()?.to_owned();
    let known = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        let &[board, acknowledged, ref pairs @ ..] = words.as_slice() else {
            return None;
        };
        let pair = |at: usize| {
            Some((
                pairs.get(at)?.parse().ok()?,
                pairs.get(at + 1)?.parse().ok()?,
            ))
        };
        let known = Known {
            acknowledged: acknowledged.parse().ok()?,
            complete: pair(0),
            on_disk: pair(2),
        };
        Some((board.to_owned(), known))
    };
    Some(Content {
        generation,
        boot,
        known: lines.filter_map(known).collect(),
    })
}

/// Which start of the computer this is, where the system says so; else every run is one of its own.
fn boot() -> String {
    let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    match id.trim() {
        "" => format!("process-{}", std::process::id()),
        id => id.replace(' ', ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spool::tests::dir;

    fn known(acknowledged: u64) -> Known {
        Known {
            acknowledged,
            complete: Some((4, 9)),
            on_disk: Some((4, 7)),
        }
    }

    #[test]
    fn the_newer_whole_one_holds() {
        let dir = dir("state");
        std::fs::create_dir_all(&dir).unwrap();
        let (mut state, boards) = State::read(&dir);
        assert!(boards.is_empty() && !state.is_harmed);
        for acknowledged in 1..=3 {
            let boards = [("a", known(acknowledged)), ("b", Known::default())];
            state.write(boards.into_iter()).unwrap();
        }
        let read = || State::read(&dir).1.get("a").copied();
        assert_eq!(read(), Some(known(3)));
        assert_eq!(State::read(&dir).1.get("b"), Some(&Known::default()));
        // Every way in which the newest can be cut short or harmed: then it is the one before.
        let [even, odd] = paths(&dir);
        let whole = std::fs::read(&odd).unwrap();
        for at in 0..whole.len() {
            std::fs::write(&odd, &whole[..at]).unwrap();
            assert_eq!(read(), Some(known(2)), "cut at {at}");
            let mut harmed = whole.clone();
            harmed[at] ^= 1;
            std::fs::write(&odd, &harmed).unwrap();
            assert_eq!(read(), Some(known(2)), "harmed at {at}");
        }
        // Started anew: what was not on the disk may be gone.
        let (_, boards) = State::read_at(&dir, "another".to_owned());
        assert_eq!(boards["a"].complete, Some((4, 7)));
        std::fs::write(even, "").unwrap();
        let (state, boards) = State::read(&dir);
        assert!(state.is_harmed && boards.is_empty());
        std::fs::remove_dir_all(dir).unwrap();
    }
}
