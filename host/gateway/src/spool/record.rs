//! One report of one board, as it stands on disk.
//!
//! A record is `\nID UNIX_MS BOARD SENTENCE CHECKSUM\n`. The checksum is the CRC-32 of all between
//! the first line feed and the space before it, so no harmed byte passes for another board, number
//! or time. Between two records stand two line feeds: one of them can be harmed and both records are
//! still parted, so a harmed byte costs one record at most.

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use rowtone::report::Report;
use rowtone::wire::{EncodeError, Message, text};

/// The checksum of records and of the [`state`](super::state).
pub(super) static CRC_32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Longest record, bytes: the sentence, a name of [`MAX_NAME`] characters, and three numbers.
pub(super) const MAX_RECORD: usize = text::MAX_LINE + 256;

/// Longest name of a board, bytes.
pub(crate) const MAX_NAME: usize = 64;

/// One report of one board.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// When it came, ms since 1970.
    pub unix_ms: u64,
    /// Name of the board.
    pub board: String,
    /// Number of the board's session.
    pub session: u32,
    /// What it measured.
    pub report: Report,
}

/// An [`Entry`] with its number.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Number among the records of its board, from 1 on; it only ever grows.
    pub id: u64,
    /// What came.
    pub entry: Entry,
}

impl Record {
    /// The bytes to append to a file.
    ///
    /// # Errors
    /// [`EncodeError`] where the report holds a number that no sentence can.
    pub fn to_bytes(&self) -> Result<Vec<u8>, EncodeError> {
        let Entry {
            unix_ms,
            board,
            session,
            report,
        } = &self.entry;
        let mut line = format!("{} {unix_ms} {board} ", self.id);
        let message = Message::Report {
            session: *session,
            report: report.clone(),
        };
        text::encode(&message, &mut line)?;
        line.truncate(line.trim_end().len());
        let sum = CRC_32.checksum(line.as_bytes());
        Ok(format!("\n{line} {sum:08X}\n").into_bytes())
    }

    /// What stands between two line feeds; `None` where it is no record, or a harmed one.
    pub fn from_line(line: &[u8]) -> Option<Self> {
        let line = std::str::from_utf8(line).ok()?;
        let (body, sum) = line.rsplit_once(' ')?;
        // Only the form in which it is written: "+F" is no checksum.
        if format!("{:08X}", CRC_32.checksum(body.as_bytes())) != sum {
            return None;
        }
        let mut fields = body.splitn(4, ' ');
        let id = fields.next()?.parse().ok()?;
        let unix_ms = fields.next()?.parse().ok()?;
        let board = fields.next()?.to_owned();
        match text::decode_line(fields.next()?).ok()? {
            Message::Report { session, report } => Some(Self {
                id,
                entry: Entry {
                    unix_ms,
                    board,
                    session,
                    report,
                },
            }),
            _ => None,
        }
    }
}

/// The pieces between the line feeds of a part of a file, empty ones left out: where each ends
/// (behind its line feed), and the record that it is, or none.
pub fn pieces(bytes: &[u8]) -> impl Iterator<Item = (usize, Option<Record>)> {
    let mut end = 0;
    bytes.split(|&byte| byte == b'\n').filter_map(move |piece| {
        end += piece.len() + 1;
        (!piece.is_empty()).then(|| (end, Record::from_line(piece)))
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub(crate) fn record(board: &str, id: u64) -> Record {
        let mut report = rowtone_report::example(None);
        report.seq = id as u32;
        Record {
            id,
            entry: Entry {
                unix_ms: 1000 + id,
                board: board.to_owned(),
                session: 1,
                report,
            },
        }
    }

    #[test]
    fn a_record_comes_back() {
        let record = record("press-3", 7);
        let bytes = record.to_bytes().unwrap();
        assert!(bytes.len() <= MAX_RECORD);
        let whole: Vec<_> = pieces(&bytes).collect();
        assert_eq!(whole, [(bytes.len(), Some(record))]);
    }

    /// Whatever one byte becomes, at most its own record is lost, and none is made up.
    #[test]
    fn a_harmed_byte_costs_one_record() {
        let records: Vec<Record> = (1..=3).map(|id| record("c3", id)).collect();
        let bytes = records.iter().flat_map(|record| record.to_bytes().unwrap());
        let bytes: Vec<u8> = bytes.collect();
        for at in 0..bytes.len() {
            for flip in [1_u8, 4, 0x20, 0x40, 0x80, bytes[at] ^ b'\n'] {
                let mut harmed = bytes.clone();
                harmed[at] ^= flip;
                let found: Vec<Record> = pieces(&harmed).filter_map(|(_, one)| one).collect();
                assert!(found.len() >= 2, "byte {at}, {flip}: {}", found.len());
                assert!(found.iter().all(|one| records.contains(one)));
            }
        }
    }

    proptest! {
        /// Nothing panics, and pieces end inside.
        #[test]
        fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
            for (end, record) in pieces(&bytes) {
                prop_assert!(end <= bytes.len() + 1 && record.is_none());
            }
        }
    }
}
