//! Where a frame ends: silence.

use heapless::Vec;

use super::MAX_FRAME;

/// Collects a frame from bytes and the times they came at.
///
/// A frame ends when the line was silent for 3.5 characters (1.75 ms above 19200 baud; *Modbus
/// over Serial Line V1.02*, 2.5.1.1). Frames longer than [`MAX_FRAME`] are left out.
///
/// ```
/// use rowtone::wire::modbus::FrameReader;
///
/// let mut reader = FrameReader::new(115_200);
/// for (i, byte) in [1, 4, 0, 0, 0, 1, 0x31, 0xca].into_iter().enumerate() {
///     reader.push(byte, 87 * i as u64);
/// }
/// assert_eq!(reader.frame(700), None);
/// assert_eq!(reader.frame(3000).map(<[u8]>::len), Some(8));
/// reader.clear();
/// assert_eq!(reader.frame(5000), None);
/// ```
#[derive(Clone, Debug)]
pub struct FrameReader {
    frame: Vec<u8, MAX_FRAME>,
    too_long: bool,
    first_us: u64,
    last_us: u64,
    silence_us: u64,
    /// Length of a character.
    character_us: u64,
}

impl FrameReader {
    /// For a line of this speed, 11 bits a character.
    pub const fn new(baud: u32) -> Self {
        let baud = if baud == 0 { 1 } else { baud as u64 };
        let silence_us = match baud {
            0..=19_200 => 38_500_000 / baud,
            _ => 1_750,
        };
        Self {
            frame: Vec::new(),
            too_long: false,
            first_us: 0,
            last_us: 0,
            silence_us,
            character_us: 11_000_000 / baud,
        }
    }

    /// Takes a byte that came at `now_us`. A byte after a silence starts a new frame, also where
    /// the one before was never asked for.
    pub fn push(&mut self, byte: u8, now_us: u64) {
        // Bytes are seen at their end, and silence is up to the next one's start.
        if self.silent(now_us.saturating_sub(self.character_us)) {
            self.clear();
        }
        if self.frame.is_empty() {
            self.first_us = now_us;
        }
        self.last_us = now_us;
        self.too_long |= self.frame.push(byte).is_err();
    }

    /// The frame, once the silence behind it has lasted long enough. [`FrameReader::clear`] it
    /// when it is answered.
    pub fn frame(&self, now_us: u64) -> Option<&[u8]> {
        let done = !self.frame.is_empty() && !self.too_long && self.silent(now_us);
        done.then_some(self.frame.as_slice())
    }

    /// When the frame's first byte came, µs.
    pub(crate) fn began_us(&self) -> u64 {
        self.first_us
    }

    /// How long a frame of so many bytes takes, with the silence behind it, µs.
    pub(crate) fn duration_us(&self, bytes: usize) -> u64 {
        (bytes as u64)
            .saturating_mul(self.character_us)
            .saturating_add(self.silence_us)
    }

    /// Forgets what came so far.
    pub fn clear(&mut self) {
        self.frame.clear();
        self.too_long = false;
    }

    fn silent(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.last_us) >= self.silence_us
    }
}
