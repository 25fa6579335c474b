//! Reports on disk until the broker has them.
//!
//! Every report is appended to a file as one line ([`Entry`]) before it is sent. A cursor says up to
//! where the broker has acknowledged; it is replaced as a whole. After a crash the reports behind
//! the cursor are sent once more, and a receiver drops those it has by board, session and number.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

pub use super::entry::Entry;

/// Length at which a new file is begun, bytes.
const FILE_LEN: u64 = 1 << 20;

/// A place in the spool: behind an entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark {
    pub(super) file: u64,
    pub(super) offset: u64,
}

/// The spool.
#[derive(Debug)]
pub struct Spool {
    dir: PathBuf,
    max_bytes: u64,
    /// Lengths of the files there are.
    files: BTreeMap<u64, u64>,
    write: File,
    reader: Option<(u64, BufReader<File>)>,
    /// The next entry to send is behind this.
    next: Mark,
    /// All before this is acknowledged.
    acknowledged: Mark,
    /// The same, on disk.
    saved: Mark,
    dropped: u64,
}

impl Spool {
    /// Opens the directory, making it where it is not there.
    ///
    /// # Errors
    /// It cannot be written or read.
    pub fn open(dir: PathBuf, max_bytes: u64) -> io::Result<Self> {
        std::fs::create_dir_all(&dir)?;
        let mut files = BTreeMap::new();
        for entry in std::fs::read_dir(&dir)? {
            let path = entry?.path();
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .unwrap_or("");
            if let Some(number) = name.strip_suffix(".spool").and_then(|n| n.parse().ok()) {
                files.insert(number, std::fs::metadata(&path)?.len());
            }
        }
        let cursor = std::fs::read_to_string(dir.join("cursor")).unwrap_or_default();
        let mut numbers = cursor.split_whitespace().map(str::parse);
        let saved = match (numbers.next(), numbers.next()) {
            (Some(Ok(file)), Some(Ok(offset))) => Mark { file, offset },
            _ => Mark::default(),
        };
        // A new file each time: what a crash cut short stays the last line of the old one.
        let newest = files
            .keys()
            .next_back()
            .map_or(0, |n| n + 1)
            .max(saved.file + 1);
        files.insert(newest, 0);
        let mut spool = Self {
            write: new_file(&dir, newest)?,
            dir,
            max_bytes,
            files,
            reader: None,
            next: saved,
            acknowledged: saved,
            saved,
            dropped: 0,
        };
        spool.remove_acknowledged();
        Ok(spool)
    }

    /// Keeps an entry.
    ///
    /// # Errors
    /// The disk refused it.
    pub fn push(&mut self, entry: &Entry) -> io::Result<()> {
        let line = entry.to_line().map_err(io::Error::other)?;
        self.write.write_all(line.as_bytes())?;
        let Some((&number, length)) = self.files.iter_mut().next_back() else {
            return Ok(());
        };
        *length += line.len() as u64;
        if *length >= FILE_LEN {
            self.write = new_file(&self.dir, number + 1)?;
            self.files.insert(number + 1, 0);
            self.make_room();
        }
        Ok(())
    }

    /// The next entry to send and the mark behind it, if there is one.
    ///
    /// # Errors
    /// The disk could not be read.
    pub fn next_entry(&mut self) -> io::Result<Option<(Mark, Entry)>> {
        loop {
            let file = self.next.file;
            if self
                .reader
                .as_ref()
                .is_none_or(|(number, _)| *number != file)
            {
                self.reader = None;
                if self.files.contains_key(&file) {
                    let mut reader = BufReader::new(File::open(self.path(file))?);
                    reader.seek(SeekFrom::Start(self.next.offset))?;
                    self.reader = Some((file, reader));
                }
            }
            let mut line = vec![];
            if let Some((_, reader)) = &mut self.reader {
                reader.read_until(b'\n', &mut line)?;
            }
            self.next.offset += line.len() as u64;
            if line.is_empty() {
                // The end of this file: go on with the next one there is.
                let Some((&file, _)) = self.files.range(file + 1..).next() else {
                    return Ok(None);
                };
                self.next = Mark { file, offset: 0 };
                continue;
            }
            match Entry::from_line(&line) {
                Some(entry) => return Ok(Some((self.next, entry))),
                // Cut short by a crash, or harmed on disk.
                None => self.dropped += 1,
            }
        }
    }

    /// The broker has everything up to this mark.
    pub fn acknowledge(&mut self, mark: Mark) {
        self.acknowledged = self.acknowledged.max(mark);
    }

    /// Starts again behind the last entry that was acknowledged.
    pub fn rewind(&mut self) {
        self.next = self.acknowledged;
        self.reader = None;
    }

    /// Writes down how far the broker has acknowledged, and removes what is no longer needed.
    ///
    /// # Errors
    /// The disk refused it.
    pub fn save(&mut self) -> io::Result<()> {
        if self.saved == self.acknowledged {
            return Ok(());
        }
        let Mark { file, offset } = self.acknowledged;
        replace(&self.dir, "cursor", &format!("{file} {offset}\n"))?;
        self.saved = self.acknowledged;
        self.remove_acknowledged();
        Ok(())
    }

    /// Entries that were dropped: for want of room, or unreadable.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Bytes that wait to be acknowledged.
    pub fn waiting(&self) -> u64 {
        let behind = |(&file, &length): (&u64, &u64)| match file.cmp(&self.acknowledged.file) {
            std::cmp::Ordering::Less => 0,
            std::cmp::Ordering::Equal => length.saturating_sub(self.acknowledged.offset),
            std::cmp::Ordering::Greater => length,
        };
        self.files.iter().map(behind).sum()
    }

    fn path(&self, number: u64) -> PathBuf {
        file_path(&self.dir, number)
    }

    /// Removes the files that lie before the cursor.
    fn remove_acknowledged(&mut self) {
        let newest = self.files.keys().next_back().copied().unwrap_or(0);
        let keep = self.saved.file.min(newest);
        while let Some((&number, &length)) = self.files.first_key_value() {
            let read = self.saved.file == number && self.saved.offset >= length;
            if number >= newest || (number >= keep && !read) {
                return;
            }
            self.remove(number);
        }
    }

    /// Drops the oldest files while there is more than allowed.
    fn make_room(&mut self) {
        while self.files.len() > 1 && self.files.values().sum::<u64>() > self.max_bytes {
            let Some((&number, _)) = self.files.first_key_value() else {
                return;
            };
            let from = match number == self.acknowledged.file {
                true => self.acknowledged.offset as usize,
                false => 0,
            };
            let content = std::fs::read(self.path(number)).unwrap_or_default();
            let lost = content.get(from..).unwrap_or_default();
            self.dropped += lost.iter().filter(|&&byte| byte == b'\n').count() as u64;
            self.remove(number);
        }
    }

    fn remove(&mut self, number: u64) {
        // One that cannot be removed is only in the way.
        let _ = std::fs::remove_file(self.path(number));
        self.files.remove(&number);
    }
}

/// Writes a small file as a whole: the old content or the new, whenever it is cut short.
///
/// # Errors
/// The disk refused it.
pub(super) fn replace(dir: &Path, name: &str, content: &str) -> io::Result<()> {
    let new = dir.join(format!("{name}.new"));
    std::fs::write(&new, content)?;
    std::fs::rename(new, dir.join(name))
}

fn file_path(dir: &Path, number: u64) -> PathBuf {
    dir.join(format!("{number:012}.spool"))
}

fn new_file(dir: &Path, number: u64) -> io::Result<File> {
    OpenOptions::new()
        .append(true)
        .create_new(true)
        .open(file_path(dir, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(seq: u32) -> Entry {
        let mut report = rowtone_report::example(None);
        report.seq = seq;
        Entry {
            unix_ms: 1000 + u64::from(seq),
            board: "press-3".to_owned(),
            session: 1,
            report,
        }
    }

    fn dir(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("rowtone-spool-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        dir
    }

    fn numbers(spool: &mut Spool) -> Vec<u32> {
        let mut numbers = vec![];
        while let Some((_, entry)) = spool.next_entry().unwrap() {
            numbers.push(entry.report.seq);
        }
        numbers
    }

    #[test]
    fn what_is_not_acknowledged_comes_again_in_order() {
        let dir = dir("order");
        let mut spool = Spool::open(dir.clone(), 1 << 30).unwrap();
        (0..10).for_each(|seq| spool.push(&entry(seq)).unwrap());
        let mut marks = vec![];
        while let Some((mark, _)) = spool.next_entry().unwrap() {
            marks.push(mark);
        }
        spool.acknowledge(marks[3]);
        spool.rewind();
        assert_eq!(numbers(&mut spool), [4, 5, 6, 7, 8, 9]);
        spool.save().unwrap();
        spool.acknowledge(marks[6]);
        // Killed before the cursor was saved again, in the middle of a line.
        let file = file_path(&dir, 1);
        let text = std::fs::read(&file).unwrap();
        std::fs::write(&file, &text[..text.len() - 9]).unwrap();
        drop(spool);
        let mut spool = Spool::open(dir.clone(), 1 << 30).unwrap();
        spool.push(&entry(10)).unwrap();
        assert_eq!(numbers(&mut spool), [4, 5, 6, 7, 8, 10]);
        assert_eq!(spool.dropped(), 1);
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn files_go_when_they_are_done_or_there_is_no_room() {
        let dir = dir("room");
        let mut spool = Spool::open(dir.clone(), 3 << 20).unwrap();
        for seq in 0..30_000 {
            spool.push(&entry(seq)).unwrap();
        }
        let left = numbers(&mut spool);
        assert_eq!(left.len() as u64 + spool.dropped(), 30_000);
        assert_eq!(left.last(), Some(&29_999));
        assert!(left.is_sorted() && spool.waiting() <= 4 << 20);
        let mark = spool.next;
        spool.acknowledge(mark);
        spool.save().unwrap();
        assert_eq!((spool.waiting(), spool.files.len()), (0, 1));
        std::fs::remove_dir_all(dir).unwrap();
    }
}
