//! What a machine did: every window for an hour, a minute for a month, an hour for five years.
//!
//! Three rings of files in a folder. A ring's files are only ever appended to, in records of a fixed length, each with a
//! checksum; the oldest file goes when enough newer records are there. A program that starts begins a new file, so that
//! nothing is written behind a record that a power cut has torn. What was synchronised with the disk stays; a torn record
//! fails its checksum and is passed over.

mod disk;
mod record;
mod ring;
#[cfg(test)]
mod tests;

use std::io;
use std::path::Path;

use rowtone::report::Report;
use rowtone_report::band_velocity;

pub use disk::{Disk, Folder};
pub use record::{CSV_HEADING, LENGTH, Record};
pub use ring::Ring;

/// One of the three rings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// Every window, for an hour of two a second.
    Windows,
    /// A minute, for 31 days.
    Minutes,
    /// An hour, for five years.
    Hours,
}

impl Tier {
    /// All of them, the finest first.
    pub const ALL: [Self; 3] = [Self::Windows, Self::Minutes, Self::Hours];

    /// Its word in names of files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Windows => "windows",
            Self::Minutes => "minutes",
            Self::Hours => "hours",
        }
    }

    /// Records kept.
    pub const fn records(self) -> u64 {
        match self {
            Self::Windows => 7200,
            Self::Minutes => 31 * 24 * 60,
            Self::Hours => 5 * 366 * 24,
        }
    }
}

/// A period that is being added up.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    /// Number of the period since 1970.
    period: u64,
    record: Option<Record>,
}

/// The trend of one machine.
#[derive(Debug)]
pub struct Trend<D> {
    disk: D,
    rings: [Ring; 3],
    minute: Sum,
    hour: Sum,
}

impl Trend<Folder> {
    /// Opens the trend in a folder, which is made where it is not there.
    ///
    /// # Errors
    /// The folder cannot be made or read.
    pub fn open(dir: &Path) -> io::Result<Self> {
        Self::on(Folder::open(dir)?)
    }
}

impl<D: Disk> Trend<D> {
    /// The trend on a disk.
    ///
    /// # Errors
    /// The disk cannot be read.
    pub fn on(mut disk: D) -> io::Result<Self> {
        let [windows, minutes, hours] = Tier::ALL.map(|tier| Ring::open(&mut disk, tier));
        Ok(Self {
            rings: [windows?, minutes?, hours?],
            disk,
            minute: Sum::default(),
            hour: Sum::default(),
        })
    }

    /// Takes a window's report at this time, ms since 1970. A minute and an hour are written with the first report after
    /// them, and synchronised with the disk, and all windows before along with the minute: a power cut costs what came
    /// since.
    ///
    /// # Errors
    /// The disk is full or gone: the report is not kept, the next one may be.
    pub fn push(&mut self, report: &Report, unix_ms: u64) -> io::Result<()> {
        let record = Record::of(report, band_velocity(report), unix_ms);
        let whole_hour = self.hour.add(unix_ms / 3_600_000, record);
        let whole_minute = self.minute.add(unix_ms / 60_000, record);
        if let Some(minute) = whole_minute {
            let [windows, minutes, _] = &mut self.rings;
            windows.sync(&mut self.disk)?;
            minutes.push(&mut self.disk, &minute)?;
            minutes.sync(&mut self.disk)?;
        }
        if let Some(hour) = whole_hour {
            let [_, _, hours] = &mut self.rings;
            hours.push(&mut self.disk, &hour)?;
            hours.sync(&mut self.disk)?;
        }
        self.rings[0].push(&mut self.disk, &record)
    }

    /// The records of a ring, the oldest first.
    ///
    /// # Errors
    /// The disk cannot be read.
    pub fn records(&self, tier: Tier) -> io::Result<Vec<Record>> {
        ring::records(&self.disk, tier)
    }
}

/// The records of a ring in a folder, the oldest first, without writing anything: also while a program writes it.
///
/// # Errors
/// The folder cannot be read.
pub fn read(dir: &Path, tier: Tier) -> io::Result<Vec<Record>> {
    ring::records(&Folder::existing(dir), tier)
}

impl Sum {
    /// Adds a record to its period; the one before it, where it has ended.
    fn add(&mut self, period: u64, record: Record) -> Option<Record> {
        if self.period == period {
            self.record = Some(self.record.map_or(record, |sum| sum.joined(&record)));
            return None;
        }
        self.period = period;
        self.record.replace(record)
    }
}
