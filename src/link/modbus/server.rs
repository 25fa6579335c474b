//! Requests to responses.

use heapless::Vec;

use crate::link::settings::store::Keep;
use crate::link::settings::{Console, LockError};

use super::holding::{COMMAND_AT, HOLDING_LEN, Image, LOCK_AT, cuts_a_value};
use crate::wire::modbus::{CRC, MAX_FRAME, State};

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exception {
    /// The function is not one of 03, 04, 06 and 16, or it would write settings that are locked.
    IllegalFunction = 1,
    /// A register does not exist.
    IllegalAddress = 2,
    /// The quantity or the request's length is wrong, a 32-bit value would be cut in two, the
    /// settings would not fit together, or the number does not unlock them; nothing was changed.
    IllegalValue = 3,
    /// The settings could not be saved.
    DeviceFailure = 4,
}

/// The second register of the lock.
const LOCK_LAST: u16 = LOCK_AT + 1;

/// Most registers read at once.
const MAX_READ: u16 = 125;

/// Answers one frame ([`FrameReader`](crate::wire::modbus::FrameReader) finds it) into `response`, which comes back empty where there
/// is nothing to answer: the CRC is wrong, another server is meant, or all are (unit 0; writes are
/// carried out then), or it is no request but a refusal (its function has bit 7 set). The unit listened to is [`crate::link::settings::Settings::unit`].
pub fn answer(
    frame: &[u8],
    state: &State<'_>,
    console: &mut Console,
    store: &mut impl Keep,
    response: &mut Vec<u8, MAX_FRAME>,
) {
    response.clear();
    let Some((request, crc)) = frame.split_last_chunk::<2>() else {
        return;
    };
    let unit = console.settings().unit;
    let &[to, function, ref data @ ..] = request else {
        return;
    };
    if CRC.checksum(request) != u16::from_le_bytes(*crc) || (to != unit && to != 0) {
        return;
    }
    // A refusal on a bus that echoes would be refused in turn, and so on.
    if function & 0x80 != 0 || (to == 0 && !matches!(function, 6 | 16)) {
        return;
    }
    let uptime_ms = state.status.uptime_ms;
    let answered = match function {
        3 => {
            let image = Image::of(console.settings());
            let locked = u16::from(console.is_locked());
            read(data, unit, function, |at| match at {
                LOCK_AT => Some(0),
                LOCK_LAST => Some(locked),
                at => image.register(at),
            })
        }
        4 => read(data, unit, function, |at| state.register(at)),
        6 => write_one(data, uptime_ms, console, store).map(|()| echo(request)),
        16 => write_many(data, uptime_ms, console, store).map(|()| echo(request)),
        _ => Err(Exception::IllegalFunction),
    };
    if to == 0 {
        return;
    }
    *response = answered.unwrap_or_else(|exception| {
        let mut refused = Vec::new();
        // Three bytes fit.
        let _ = refused.extend_from_slice(&[unit, function | 0x80, exception as u8]);
        refused
    });
    let crc = CRC.checksum(response).to_le_bytes();
    // At most 253 bytes stand in it so far.
    let _ = response.extend_from_slice(&crc);
}

/// Two big-endian numbers at the start of a request's data, and the rest.
fn two_numbers(data: &[u8]) -> Result<(u16, u16, &[u8]), Exception> {
    match *data {
        [a, b, c, d, ref rest @ ..] => {
            Ok((u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]), rest))
        }
        _ => Err(Exception::IllegalValue),
    }
}

fn read(
    data: &[u8],
    unit: u8,
    function: u8,
    register: impl Fn(u16) -> Option<u16>,
) -> Result<Vec<u8, MAX_FRAME>, Exception> {
    let (first, count, rest) = two_numbers(data)?;
    if !rest.is_empty() || !(1..=MAX_READ).contains(&count) {
        return Err(Exception::IllegalValue);
    }
    let mut response = Vec::new();
    let full = |_| Exception::DeviceFailure; // 253 bytes fit
    response
        .extend_from_slice(&[unit, function, (2 * count) as u8])
        .map_err(full)?;
    for offset in 0..count {
        let value = first
            .checked_add(offset)
            .and_then(&register)
            .ok_or(Exception::IllegalAddress)?;
        response
            .extend_from_slice(&value.to_be_bytes())
            .map_err(full)?;
    }
    Ok(response)
}

fn write_one(
    data: &[u8],
    uptime_ms: u64,
    console: &mut Console,
    store: &mut impl Keep,
) -> Result<(), Exception> {
    let (at, value, rest) = two_numbers(data)?;
    if !rest.is_empty() {
        return Err(Exception::IllegalValue);
    }
    write(at, &value.to_be_bytes(), uptime_ms, console, store)
}

fn write_many(
    data: &[u8],
    uptime_ms: u64,
    console: &mut Console,
    store: &mut impl Keep,
) -> Result<(), Exception> {
    let (at, count, rest) = two_numbers(data)?;
    let (&bytes, values) = rest.split_first().ok_or(Exception::IllegalValue)?;
    let agree = usize::from(bytes) == values.len() && values.len() == 2 * usize::from(count);
    if !(1..=123).contains(&count) || !agree {
        return Err(Exception::IllegalValue);
    }
    write(at, values, uptime_ms, console, store)
}

/// Writes registers from `at` on: all of them or none.
fn write(
    at: u16,
    values: &[u8],
    uptime_ms: u64,
    console: &mut Console,
    store: &mut impl Keep,
) -> Result<(), Exception> {
    let (values, _) = values.as_chunks::<2>();
    let count = u16::try_from(values.len()).map_err(|_| Exception::IllegalValue)?;
    let end = at.checked_add(count).ok_or(Exception::IllegalAddress)?;
    if (LOCK_AT..=LOCK_LAST).contains(&at) && end <= LOCK_LAST + 1 {
        // Both registers or none.
        let &[[a, b], [c, d]] = values else {
            return Err(Exception::IllegalValue);
        };
        return lock(u32::from_be_bytes([a, b, c, d]), uptime_ms, console, store);
    }
    if end > HOLDING_LEN {
        return Err(Exception::IllegalAddress);
    }
    if cuts_a_value(at, count) {
        return Err(Exception::IllegalValue);
    }
    if console.is_locked() {
        return Err(Exception::IllegalFunction);
    }
    let mut image = Image::of(console.settings());
    for (at, value) in (at..).zip(values) {
        image.put(at, u16::from_be_bytes(*value));
    }
    let command = image.register(COMMAND_AT).unwrap_or(0);
    let settings = match command {
        2 => console.board().defaults,
        0 | 1 => image.settings().ok_or(Exception::IllegalValue)?,
        _ => return Err(Exception::IllegalValue),
    };
    console
        .replace(settings)
        .map_err(|_| Exception::IllegalValue)?;
    if command == 1 {
        console.save(store).map_err(|_| Exception::DeviceFailure)?;
    }
    Ok(())
}

/// Locks the settings with a number, or unlocks them where they are locked; 0 does nothing.
fn lock(
    number: u32,
    uptime_ms: u64,
    console: &mut Console,
    store: &mut impl Keep,
) -> Result<(), Exception> {
    let done = match number {
        0 => Ok(()),
        _ if console.is_locked() => console.unlock(number, uptime_ms, store),
        _ => console.lock(number, store),
    };
    done.map_err(|error| match error {
        LockError::NotKept(_) => Exception::DeviceFailure,
        _ => Exception::IllegalValue,
    })
}

/// The start of a write request, which is its response.
fn echo(request: &[u8]) -> Vec<u8, MAX_FRAME> {
    let start = request.get(..6).unwrap_or(request);
    Vec::from_slice(start).unwrap_or_default()
}
