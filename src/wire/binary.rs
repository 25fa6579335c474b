//! Messages as short frames of bytes.
//!
//! A frame is [`FORMAT`], the message in postcard's encoding, and the CRC-32 of both, little end
//! first; all of that is stuffed by COBS (Cheshire and Baker, *Consistent Overhead Byte Stuffing*,
//! 1999) so that it holds no zero, and a zero stands before and behind it. Reals are kept to the
//! last bit, and a report is about half as long as in [`super::text`].
//!
//! ```
//! use rowtone::wire::{Message, Reply, binary};
//!
//! let said = Message::Reply(Reply { ok: true, text: "window=1.0000 s".try_into()? });
//! let mut frame = [0; binary::MAX_FRAME];
//! let frame = binary::encode_to_slice(&said, &mut frame)?;
//!
//! let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
//! let mut heard = frame.iter().filter_map(|&byte| decoder.push(byte));
//! assert_eq!(heard.next(), Some(Ok(said)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;
use postcard::ser_flavors::{Cobs, Slice, crc::CrcModifier};

use super::check::{CRC_32, EncodeError, check_message};
use super::message::Message;

/// The same sum in the form that postcard takes, which is always by a table.
static POSTCARDS_CRC_32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// First byte of every frame before stuffing. It changes when the order of a message's fields does.
pub const FORMAT: u8 = 1;

/// Longest frame, both zeros included, bytes: a report with [`crate::report::MAX_PEAKS`] peaks and
/// every number as long as it gets.
pub const MAX_FRAME: usize = 512;

/// Why a frame was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// Longer than the decoder's buffer.
    TooLong,
    /// Too short to hold a checksum, or its stuffing is wrong: cut, or not from rowtone.
    Broken,
    /// The checksum is not that of the frame.
    Checksum {
        /// What the frame says.
        said: u32,
        /// What its bytes give.
        computed: u32,
    },
    /// Intact, but in a format that this version does not know.
    Format(u8),
    /// Intact, but it makes no message.
    Content,
}

impl core::fmt::Display for DecodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong => write!(f, "frame: longer than the buffer, left out"),
            Self::Broken => write!(f, "frame: cut or wrongly stuffed, left out"),
            Self::Checksum { said, computed } => write!(
                f,
                "frame: its checksum says {said:08X}, its bytes give {computed:08X}, left out"
            ),
            Self::Format(format) => write!(
                f,
                "frame: format {format}, but {FORMAT} is known here; update the older side"
            ),
            Self::Content => write!(f, "frame: intact, but no message; update the older side"),
        }
    }
}

impl core::error::Error for DecodeError {}

/// Writes one message as one frame into `buffer` ([`MAX_FRAME`] bytes hold any) and gives back the
/// part used, both zeros included.
///
/// # Errors
/// [`EncodeError`]: a value cannot be said, or the buffer is too small. The buffer's content is
/// then undefined.
pub fn encode_to_slice<'a>(
    message: &Message,
    buffer: &'a mut [u8],
) -> Result<&'a [u8], EncodeError> {
    check_message(message)?;
    let (first, stuffed) = buffer.split_first_mut().ok_or(EncodeError::Full)?;
    *first = 0;
    let full = |_| EncodeError::Full;
    let flavor = CrcModifier::new(
        Cobs::try_new(Slice::new(stuffed)).map_err(full)?,
        POSTCARDS_CRC_32.digest(),
    );
    let used = postcard::serialize_with_flavor(&(FORMAT, message), flavor).map_err(full)?;
    let end = used.len().saturating_add(1);
    buffer.get(..end).ok_or(EncodeError::Full)
}

/// Finds frames in a stream of bytes; `N` is the longest it takes ([`MAX_FRAME`] for all).
///
/// It starts anew at every zero, so after any fault it is right again with the next frame.
#[derive(Debug)]
pub struct Decoder<const N: usize = MAX_FRAME> {
    stuffing: DecoderState,
    /// What came since the last zero, stuffing undone.
    frame: Vec<u8, N>,
    fault: Option<DecodeError>,
    /// A byte came since the last zero.
    started: bool,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// Waits for the first frame.
    pub const fn new() -> Self {
        Self {
            stuffing: DecoderState::Idle,
            frame: Vec::new(),
            fault: None,
            started: false,
        }
    }

    /// Takes the next byte. A message (or why there is none) comes with the zero behind a frame.
    pub fn push(&mut self, byte: u8) -> Option<Result<Message, DecodeError>> {
        match self.stuffing.feed(byte) {
            Ok(DecodeResult::DataContinue(data)) => {
                if self.frame.push(data).is_err() {
                    self.fault = Some(DecodeError::TooLong);
                }
            }
            Ok(DecodeResult::NoData | DecodeResult::DataComplete) => {}
            Err(_) => self.fault = Some(DecodeError::Broken),
        }
        if byte != 0 {
            self.started = true;
            return None;
        }
        let heard = match (self.started, self.fault) {
            (false, _) => None,
            (true, Some(fault)) => Some(Err(fault)),
            (true, None) => Some(decode_content(&self.frame)),
        };
        self.frame.clear();
        self.fault = None;
        self.started = false;
        heard
    }
}

/// A frame with its stuffing undone.
fn decode_content(frame: &[u8]) -> Result<Message, DecodeError> {
    let (content, sum) = frame.split_last_chunk::<4>().ok_or(DecodeError::Broken)?;
    let said = u32::from_le_bytes(*sum);
    let computed = CRC_32.checksum(content);
    if said != computed {
        return Err(DecodeError::Checksum { said, computed });
    }
    let (&format, content) = content.split_first().ok_or(DecodeError::Broken)?;
    if format != FORMAT {
        return Err(DecodeError::Format(format));
    }
    match postcard::take_from_bytes(content) {
        Ok((message, [])) if check_message(&message).is_ok() => Ok(message),
        _ => Err(DecodeError::Content),
    }
}
