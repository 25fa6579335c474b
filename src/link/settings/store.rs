//! Settings that survive a restart, and a cut of the power at any moment.
//!
//! Two slots of flash take turns. A save erases and writes the older one; only when its last byte
//! is there does its checksum fit and is it the newer one. Until then, and if it is cut short at
//! any byte, the other slot holds. Every start is counted in the same way, which numbers the
//! sessions of [`crate::wire::Message::Report`].
//!
//! A slot: `RTS` and a version byte, number of the write (u32), length of the content (u16),
//! content (postcard), CRC-32 of all before; integers little end first, the rest of the 256 bytes
//! erased.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;
use serde::{Deserialize, Serialize};

use super::Settings;
use crate::wire::{CRC_32, SettingsOrigin};

/// Bytes of a slot that are used.
pub const SLOT_LEN: usize = 256;

/// `RTS`, and the version of the content.
const MAGIC: [u8; 4] = *b"RTS\x02";
/// The version before it, which is read: its settings end before the lock.
const MAGIC_1: [u8; 4] = *b"RTS\x01";

/// Why settings could not be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// This board has nowhere to keep them.
    NoStore,
    /// The flash refused or did not keep what was written.
    Flash,
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoStore => "save: this board cannot keep settings; set them after every start",
            Self::Flash => "save: the flash did not take it; the settings saved before still hold",
        })
    }
}

impl core::error::Error for SaveError {}

/// Two slots that do not fit this flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutError {
    /// Reads or writes must be of more bytes, or of a number that does not divide [`SLOT_LEN`].
    Granularity(usize),
    /// The offset is not a multiple of what is erased at once.
    Offset(u32),
    /// The flash ends before the second slot does.
    Capacity(usize),
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Granularity(size) => {
                write!(
                    f,
                    "settings: the flash reads or writes {size} bytes at once; {SLOT_LEN} must be a multiple"
                )
            }
            Self::Offset(offset) => {
                write!(
                    f,
                    "settings: offset {offset} is not a multiple of the flash's erase size"
                )
            }
            Self::Capacity(size) => write!(f, "settings: two slots do not fit into {size} bytes"),
        }
    }
}

impl core::error::Error for LayoutError {}

/// What a start found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Started {
    /// Number of this session: how often the board has started.
    pub session: u32,
    /// What was saved, unchecked; the board's defaults hold where there is nothing.
    pub settings: Option<Settings>,
    /// Where it comes from.
    pub origin: SettingsOrigin,
}

/// Something that keeps settings.
pub trait Keep {
    /// Keeps them over the next start.
    ///
    /// # Errors
    /// See [`SaveError`]; what was kept before still holds.
    fn save(&mut self, session: u32, settings: &Settings) -> Result<(), SaveError>;
}

/// Keeps nothing, and says so.
#[derive(Clone, Copy, Debug)]
pub struct Nowhere;

impl Keep for Nowhere {
    fn save(&mut self, _session: u32, _settings: &Settings) -> Result<(), SaveError> {
        Err(SaveError::NoStore)
    }
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Record {
    session: u32,
    /// Nothing as long as nothing was ever saved.
    settings: Option<Settings>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Slot {
    Blank,
    Bad,
    Valid { number: u32, record: Record },
}

/// Two slots in a flash.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    /// Offset of the first slot.
    offset: u32,
    /// From one slot to the next.
    stride: u32,
    /// The slot to write next, 0 or 1, and the number it gets.
    turn: (u32, u32),
    kept: Option<Settings>,
}

impl<F: NorFlash> Store<F> {
    /// Uses two erasable parts of the flash from `offset` on, each at least [`SLOT_LEN`] long.
    ///
    /// # Errors
    /// The slots do not fit there.
    pub fn new(flash: F, offset: u32) -> Result<Self, LayoutError> {
        for size in [F::READ_SIZE, F::WRITE_SIZE] {
            if size == 0 || SLOT_LEN.checked_rem(size) != Some(0) {
                return Err(LayoutError::Granularity(size));
            }
        }
        let erase = F::ERASE_SIZE.max(1);
        let too_small = LayoutError::Capacity(flash.capacity());
        let stride =
            u32::try_from(SLOT_LEN.div_ceil(erase).saturating_mul(erase)).map_err(|_| too_small)?;
        if u32::try_from(erase).is_ok_and(|erase| !offset.is_multiple_of(erase)) {
            return Err(LayoutError::Offset(offset));
        }
        let end = u64::from(offset) + 2 * u64::from(stride);
        if end > flash.capacity() as u64 || end > u64::from(u32::MAX) {
            return Err(too_small);
        }
        Ok(Self {
            flash,
            offset,
            stride,
            turn: (0, 0),
            kept: None,
        })
    }

    /// Reads what was saved and counts this start. Call it once, before anything is saved.
    ///
    /// It always gives something to work with; where the flash cannot be read or written, the
    /// session counts from what could be read.
    pub fn start(&mut self) -> Started {
        let (first, second) = (self.read(0), self.read(1));
        let (newest, other, index) = match (first, second) {
            (Slot::Valid { number: a, .. }, Slot::Valid { number: b, .. }) if newer(b, a) => {
                (second, first, 1)
            }
            (Slot::Valid { .. }, _) => (first, second, 0),
            (_, Slot::Valid { .. }) => (second, first, 1),
            // Nothing valid; if either was ever written, something was lost.
            (Slot::Bad, _) => (first, second, 0),
            _ => (second, first, 1),
        };
        let (session, kept, origin) = match (newest, other) {
            (Slot::Valid { number, record }, other) => {
                self.turn = (1 - index, number.wrapping_add(1));
                let origin = match (record.settings, other) {
                    (_, Slot::Bad) => SettingsOrigin::Previous,
                    (Some(_), _) => SettingsOrigin::Saved,
                    (None, _) => SettingsOrigin::Defaults,
                };
                (record.session, record.settings, origin)
            }
            (Slot::Bad, _) => (0, None, SettingsOrigin::Corrupt),
            (Slot::Blank, _) => (0, None, SettingsOrigin::Defaults),
        };
        self.kept = kept;
        let session = session.wrapping_add(1);
        // Counting the start may fail with the flash; measuring goes on all the same.
        let _ = self.write(Record {
            session,
            settings: kept,
        });
        Started {
            session,
            settings: kept,
            origin,
        }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    fn at(&self, slot: u32) -> u32 {
        self.offset + slot * self.stride // within what `new` checked
    }

    fn read(&mut self, slot: u32) -> Slot {
        let mut bytes = [0; SLOT_LEN];
        let at = self.at(slot);
        if self.flash.read(at, &mut bytes).is_err() {
            return Slot::Bad;
        }
        if bytes.iter().all(|&byte| byte == 0xff) {
            return Slot::Blank;
        }
        decode(&bytes).unwrap_or(Slot::Bad)
    }

    fn write(&mut self, record: Record) -> Result<(), SaveError> {
        let (slot, number) = self.turn;
        let bytes = encode(number, &record).ok_or(SaveError::Flash)?;
        let at = self.at(slot);
        self.flash
            .erase(at, at + self.stride)
            .and_then(|()| self.flash.write(at, &bytes))
            .map_err(|_| SaveError::Flash)?;
        if self.read(slot) != (Slot::Valid { number, record }) {
            return Err(SaveError::Flash);
        }
        self.turn = (1 - slot, number.wrapping_add(1));
        Ok(())
    }
}

impl<F: NorFlash> Keep for Store<F> {
    fn save(&mut self, session: u32, settings: &Settings) -> Result<(), SaveError> {
        self.write(Record {
            session,
            settings: Some(*settings),
        })?;
        self.kept = Some(*settings);
        Ok(())
    }
}

/// Whether write `a` came after write `b`; the numbers may have wrapped around.
fn newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}

fn encode(number: u32, record: &Record) -> Option<[u8; SLOT_LEN]> {
    let mut bytes = [0xff; SLOT_LEN];
    let (head, rest) = bytes.split_first_chunk_mut::<10>()?;
    let length = postcard::to_slice(record, rest).ok()?.len();
    let (magic, numbers) = head.split_first_chunk_mut::<4>()?;
    let (write, content) = numbers.split_first_chunk_mut::<4>()?;
    *magic = MAGIC;
    *write = number.to_le_bytes();
    content.copy_from_slice(&u16::try_from(length).ok()?.to_le_bytes());
    let end = length.checked_add(10)?;
    let sum = CRC_32.checksum(bytes.get(..end)?);
    bytes
        .get_mut(end..end.checked_add(4)?)?
        .copy_from_slice(&sum.to_le_bytes());
    Some(bytes)
}

fn decode(bytes: &[u8; SLOT_LEN]) -> Option<Slot> {
    let (magic, rest) = bytes.split_first_chunk::<4>()?;
    let (number, rest) = rest.split_first_chunk::<4>()?;
    let (length, content) = rest.split_first_chunk::<2>()?;
    let length = usize::from(u16::from_le_bytes(*length));
    let end = length.checked_add(10)?;
    let sum = bytes.get(end..)?.first_chunk::<4>()?;
    if CRC_32.checksum(bytes.get(..end)?) != u32::from_le_bytes(*sum) {
        return None;
    }
    let content = content.get(..length)?;
    let record = match *magic {
        MAGIC => whole(content)?,
        MAGIC_1 => {
            // Without settings there is no lock to be missed; with settings it is none.
            let mut longer = [0; SLOT_LEN];
            longer.get_mut(..length)?.copy_from_slice(content);
            whole(content).or_else(|| whole(longer.get(..=length)?))?
        }
        _ => return None,
    };
    let number = u32::from_le_bytes(*number);
    Some(Slot::Valid { number, record })
}

/// A record that takes all of the bytes.
fn whole(bytes: &[u8]) -> Option<Record> {
    match postcard::take_from_bytes(bytes) {
        Ok((record, [])) => Some(record),
        _ => None,
    }
}
