//! The records of one board: files one behind the other, each named after its first record.

use std::collections::{BTreeMap, VecDeque};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::name;
use super::record::{Entry, MAX_RECORD, Record, pieces};
use super::state::Known;

/// Read from a file at once, bytes; some records.
const CHUNK: u64 = 8 * MAX_RECORD as u64;

/// A place in the files: number of the first record of one, and an offset in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    segment: u64,
    offset: u64,
}

/// One board's records.
#[derive(Debug)]
pub(super) struct Lane {
    pub(super) board: String,
    pub(super) known: Known,
    /// Lengths of the files there are, bytes, by their first records.
    segments: BTreeMap<u64, u64>,
    /// Number of the next record.
    next_id: u64,
    /// The file that grows; a new one is begun where there is none.
    growing: Option<u64>,
    /// Behind the last record that is acknowledged.
    acknowledged_at: Place,
    /// What is read next, and the last record that was.
    read_at: Place,
    last_read: u64,
    /// Read, and not handed out yet; each with the place behind it.
    ahead: VecDeque<(Place, Record)>,
    /// The last record handed out.
    handed_out: u64,
    /// Records that the disk refused, until they are acknowledged.
    memory: BTreeMap<u64, Record>,
    /// Gaps up to this record were counted.
    checked: u64,
    /// Records found to be harmed or gone, not collected yet.
    harmed: u64,
}

impl Lane {
    /// A board with these files and their lengths.
    pub(super) fn open(
        dir: &Path,
        board: &str,
        segments: BTreeMap<u64, u64>,
        known: Known,
    ) -> Self {
        let mut next_id = known.acknowledged + 1;
        if let Some((&first, &length)) = segments.last_key_value() {
            // Where it cannot be read: no file has more records than bytes.
            let last = last_in(&path(dir, board, first), first).unwrap_or(first + length);
            next_id = next_id.max(last + 1);
        }
        let oldest = segments.range(..=known.acknowledged + 1).next_back();
        let oldest = oldest.or(segments.first_key_value());
        let start = Place {
            segment: oldest.map_or(0, |(&first, _)| first),
            offset: 0,
        };
        // What went before the oldest file was counted when it went.
        let checked = start.segment.saturating_sub(1).max(known.acknowledged);
        Self {
            board: board.to_owned(),
            known,
            segments,
            next_id,
            growing: None,
            acknowledged_at: start,
            read_at: start,
            last_read: known.acknowledged,
            ahead: VecDeque::new(),
            handed_out: known.acknowledged,
            memory: BTreeMap::new(),
            checked,
            harmed: 0,
        }
    }

    /// Appends an entry; whether a new file was begun for it, and which file it stands in.
    ///
    /// # Errors
    /// The disk refused it, and nothing of it is left there.
    pub(super) fn push(
        &mut self,
        dir: &Path,
        entry: &Entry,
        segment_bytes: u64,
    ) -> io::Result<(bool, PathBuf)> {
        let id = self.next_id;
        let entry = entry.clone();
        let bytes = Record { id, entry }.to_bytes().map_err(io::Error::other)?;
        let has_room = |first: &u64| self.segments.get(first).is_some_and(|&l| l < segment_bytes);
        let growing = self.growing.filter(has_room);
        let first = growing.unwrap_or(id);
        let path = path(dir, &self.board, first);
        let mut file = OpenOptions::new().append(true).create(true).open(&path)?;
        let before = file.metadata()?.len();
        if let Err(error) = file.write_all(&bytes) {
            // The part that was written goes again; where it cannot, it stands behind the last file's
            // last record, and is passed over.
            if file.set_len(before).is_err() {
                let length = file.metadata().map_or(before, |meta| meta.len());
                self.segments.insert(first, length);
                self.growing = None;
            }
            return Err(error);
        }
        self.segments.insert(first, before + bytes.len() as u64);
        self.growing = Some(first);
        self.next_id += 1;
        Ok((growing.is_none(), path))
    }

    /// Keeps an entry without the disk, `most` at the most; how many older ones that costs.
    pub(super) fn remember(&mut self, entry: &Entry, most: usize) -> u64 {
        let (id, entry) = (self.next_id, entry.clone());
        self.memory.insert(id, Record { id, entry });
        self.next_id += 1;
        let mut lost = 0;
        while self.memory.len() > most {
            if let Some((id, _)) = self.memory.pop_first() {
                lost += 1;
                self.checked = self.checked.max(id);
            }
        }
        lost
    }

    /// The next record to send, and the place behind it where it stands on disk.
    ///
    /// # Errors
    /// The disk could not be read.
    pub(super) fn next(&mut self, dir: &Path) -> io::Result<Option<(Option<Place>, Record)>> {
        let filled = self.fill(dir);
        let remembered = self.memory.range(self.handed_out + 1..).next();
        let remembered = remembered.map(|(_, record)| record);
        let on_disk = self.ahead.front().map_or(u64::MAX, |(_, record)| record.id);
        let next = match remembered {
            Some(record) if record.id < on_disk => Some((None, record.clone())),
            _ => self
                .ahead
                .pop_front()
                .map(|(at, record)| (Some(at), record)),
        };
        if let Some((_, record)) = &next {
            self.handed_out = record.id;
            return Ok(next);
        }
        filled.map(|()| None)
    }

    /// Reads on until something is there to be handed out, or there is no more.
    fn fill(&mut self, dir: &Path) -> io::Result<()> {
        while self.ahead.is_empty() {
            let mut rest = self.segments.range(self.read_at.segment..);
            let Some((&segment, &length)) = rest.next() else {
                return Ok(());
            };
            if segment != self.read_at.segment {
                self.read_at = Place { segment, offset: 0 };
            }
            if self.read_at.offset >= length {
                let Some((&next, _)) = rest.next() else {
                    self.end(segment);
                    return Ok(());
                };
                self.note_gap(next);
                self.read_at = Place {
                    segment: next,
                    offset: 0,
                };
                continue;
            }
            let mut file = File::open(path(dir, &self.board, segment))?;
            file.seek(SeekFrom::Start(self.read_at.offset))?;
            let mut chunk = vec![];
            file.take(CHUNK).read_to_end(&mut chunk)?;
            self.sort(segment, length, &chunk);
        }
        Ok(())
    }

    /// Takes what stands at the place that is read next.
    fn sort(&mut self, segment: u64, length: u64, chunk: &[u8]) {
        let start = self.read_at.offset;
        let end = start + chunk.len() as u64;
        if chunk.is_empty() {
            // Somebody has cut it.
            self.segments.insert(segment, start);
            return;
        }
        // The chunk's last piece goes on in the next one, but at the end of the file, or where it is
        // too long to be a record.
        let last = chunk.iter().rposition(|&byte| byte == b'\n');
        let whole = match last {
            Some(at) if end < length => at + 1,
            _ => chunk.len(),
        };
        for (behind, record) in pieces(&chunk[..whole]) {
            let Some(record) = record else { continue };
            if record.entry.board != self.board || record.id <= self.last_read {
                continue;
            }
            self.note_gap(record.id);
            self.last_read = record.id;
            let offset = (start + behind as u64).min(end);
            self.ahead.push_back((Place { segment, offset }, record));
        }
        self.read_at.offset = start + whole as u64;
    }

    /// All is read. What the last file of an earlier run does not hold, though it should, is gone; and
    /// where nothing is left to be acknowledged, the file is no longer needed.
    fn end(&mut self, segment: u64) {
        if self.growing == Some(segment) {
            return;
        }
        self.note_gap(self.next_id);
        if self.handed_out == self.known.acknowledged && self.memory.is_empty() {
            self.known.acknowledged = self.next_id - 1;
            self.handed_out = self.known.acknowledged;
            self.acknowledged_at = self.read_at;
        }
    }

    /// The record of this number comes next, so those before it that were not read are gone.
    fn note_gap(&mut self, next: u64) {
        let from = self.last_read.max(self.checked) + 1;
        if from < next {
            let remembered = self.memory.range(from..next).count() as u64;
            self.harmed += (next - from).saturating_sub(remembered);
            self.checked = next - 1;
        }
    }

    /// Records found to be harmed since the last call.
    pub(super) fn take_harmed(&mut self) -> u64 {
        std::mem::take(&mut self.harmed)
    }

    /// The broker has everything up to this record.
    pub(super) fn acknowledge(&mut self, id: u64, at: Option<Place>) {
        self.known.acknowledged = self.known.acknowledged.max(id);
        self.acknowledged_at = self.acknowledged_at.max(at.unwrap_or_default());
        self.memory = self.memory.split_off(&(self.known.acknowledged + 1));
    }

    /// Hands out again what is not acknowledged.
    pub(super) fn rewind(&mut self) {
        self.ahead.clear();
        self.handed_out = self.known.acknowledged;
        self.last_read = self.known.acknowledged;
        self.read_at = self.acknowledged_at;
    }

    /// Bytes on disk.
    pub(super) fn bytes(&self) -> u64 {
        self.segments.values().sum()
    }

    /// Bytes on disk that wait to be acknowledged.
    pub(super) fn waiting(&self) -> u64 {
        if self.known.acknowledged + 1 >= self.next_id {
            return 0;
        }
        let from = self.acknowledged_at.segment;
        let rest: u64 = self.segments.range(from..).map(|(_, length)| length).sum();
        let done = match self.segments.contains_key(&from) {
            true => self.acknowledged_at.offset,
            false => 0,
        };
        rest.saturating_sub(done)
    }

    /// Removes files that are acknowledged; the last one only from this length on, so that one that
    /// is in use is not made anew with every record.
    pub(super) fn clean(&mut self, dir: &Path, last_from: u64) {
        while let Some((&first, &length)) = self.segments.first_key_value() {
            let next = self.segments.range(first + 1..).next();
            let (end, keep) = match next {
                Some((&next, _)) => (next, false),
                None => (self.next_id, length < last_from),
            };
            if keep || end > self.known.acknowledged + 1 {
                return;
            }
            self.remove(dir, first);
        }
    }

    /// Whether it can give up a file for others: an older one, or one of this length at least.
    pub(super) fn can_give_up(&self, last_from: u64) -> bool {
        self.segments.len() > 1 || self.segments.values().any(|&length| length >= last_from)
    }

    /// Drops the oldest file; how many records that loses.
    pub(super) fn give_up_oldest(&mut self, dir: &Path) -> u64 {
        let mut firsts = self.segments.keys().copied();
        let Some(first) = firsts.next() else { return 0 };
        let end = firsts.next().unwrap_or(self.next_id);
        self.remove(dir, first);
        let from = first.max(self.known.acknowledged + 1);
        let remembered = self.memory.range(from..end.max(from)).count() as u64;
        self.ahead.retain(|(_, record)| record.id >= end);
        self.checked = self.checked.max(end - 1);
        end.saturating_sub(from).saturating_sub(remembered)
    }

    fn remove(&mut self, dir: &Path, first: u64) {
        // One that cannot be removed is only in the way.
        let _ = std::fs::remove_file(path(dir, &self.board, first));
        self.segments.remove(&first);
        self.growing = self.growing.filter(|&growing| growing != first);
    }
}

/// The last record of a file that starts with this one, those behind it that are harmed included.
fn last_in(path: &Path, first: u64) -> io::Result<u64> {
    let mut file = File::open(path)?;
    let (mut last, mut behind) = (first.saturating_sub(1), 0);
    let mut chunk = vec![];
    loop {
        let kept = chunk.len();
        (&mut file).take(CHUNK).read_to_end(&mut chunk)?;
        let ended = chunk.len() == kept;
        let cut = chunk.iter().rposition(|&byte| byte == b'\n');
        let whole = match cut {
            Some(at) if !ended => at + 1,
            _ => chunk.len(),
        };
        for (_, record) in pieces(&chunk[..whole]) {
            match record {
                Some(record) => (last, behind) = (last.max(record.id), 0),
                None => behind += 1,
            }
        }
        chunk.drain(..whole);
        if ended {
            return Ok(last + behind);
        }
    }
}

fn path(dir: &Path, board: &str, first: u64) -> PathBuf {
    dir.join(name::of(board, first))
}
