//! A ring of files, each appended to and never changed.

use std::io;

use super::Tier;
use super::disk::Disk;
use super::record::{LENGTH, Record};

/// A file is full with this share of a ring's records.
const FILES: u64 = 8;

/// Where a ring is written.
#[derive(Debug)]
pub struct Ring {
    tier: Tier,
    /// Number of the file that is written next.
    number: u64,
    /// Records in that file; `None` where it must be left, because the last write may be torn.
    written: Option<u64>,
    /// Older files and their records, the oldest first.
    older: Vec<(u64, u64)>,
}

impl Ring {
    /// The ring as it lies on the disk; what is written comes into a new file.
    ///
    /// # Errors
    /// As the disk's.
    pub fn open(disk: &mut impl Disk, tier: Tier) -> io::Result<Self> {
        let mut older = Vec::new();
        for number in files(disk, tier)? {
            let bytes = disk.read(&name(tier, number))?;
            older.push((number, whole(&bytes).count() as u64));
        }
        if let Some((last, _)) = older.last() {
            // The program before this one may have ended before it did.
            disk.sync(&name(tier, *last))?;
        }
        Ok(Self {
            tier,
            number: older.last().map_or(0, |(number, _)| number + 1),
            written: Some(0),
            older,
        })
    }

    /// Appends a record, and takes away the oldest file where it is no longer needed.
    ///
    /// # Errors
    /// As the disk's: the record is not kept, and the next one comes into a new file.
    pub fn push(&mut self, disk: &mut impl Disk, record: &Record) -> io::Result<()> {
        if self
            .written
            .is_none_or(|written| written >= self.tier.records() / FILES)
        {
            self.sync(disk)?;
            self.older.push((self.number, self.written.unwrap_or(0)));
            (self.number, self.written) = (self.number + 1, Some(0));
        }
        // It is torn until it is known to be there.
        let written = self.written.take().unwrap_or(0);
        disk.append(&name(self.tier, self.number), &record.bytes())?;
        self.written = Some(written + 1);
        // What may still be lost by a power cut does not count.
        let newer: u64 = self.older.iter().skip(1).map(|(_, records)| records).sum();
        if newer >= self.tier.records() {
            let (oldest, _) = self.older.remove(0);
            // One that is left is taken away at the next start.
            let _ = disk.remove(&name(self.tier, oldest));
        }
        Ok(())
    }

    /// What was written outlives a power cut from here on.
    ///
    /// # Errors
    /// As the disk's.
    pub fn sync(&mut self, disk: &mut impl Disk) -> io::Result<()> {
        match self.written {
            Some(0) | None => Ok(()),
            Some(_) => disk.sync(&name(self.tier, self.number)),
        }
    }
}

fn name(tier: Tier, number: u64) -> String {
    format!("{}.{number:010}", tier.name())
}

/// The numbers of a ring's files, the oldest first. Files of other names are not looked at.
fn files(disk: &impl Disk, tier: Tier) -> io::Result<Vec<u64>> {
    let number = |file: &str| {
        let digits = file.strip_prefix(tier.name())?.strip_prefix('.')?;
        let number = digits.parse().ok()?;
        (name(tier, number) == file).then_some(number)
    };
    let all = disk.list()?;
    let mut files: Vec<_> = all.iter().filter_map(|file| number(file)).collect();
    files.sort_unstable();
    Ok(files)
}

/// The records of a file that are whole.
fn whole(bytes: &[u8]) -> impl Iterator<Item = Record> {
    bytes.chunks_exact(LENGTH).filter_map(Record::from_bytes)
}

/// The records of a ring that are whole, the oldest first.
pub(super) fn records(disk: &impl Disk, tier: Tier) -> io::Result<Vec<Record>> {
    let mut records = Vec::new();
    for number in files(disk, tier)? {
        let bytes = match disk.read(&name(tier, number)) {
            Ok(bytes) => bytes,
            // Its time was over meanwhile.
            Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
            Err(e) => return Err(e),
        };
        records.extend(whole(&bytes));
    }
    Ok(records)
}
