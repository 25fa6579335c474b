//! Sentences to messages.

use heapless::Vec;

use crate::report::{Peak, Report, Warnings};
use crate::wire::check::may_stand_in_reply;
use crate::wire::message::{Message, Reply, SettingsOrigin, Status};

use super::fields::{Fields, hexadecimal, integer};
use super::{CRC_32, resolution};

/// Why a sentence was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// Longer than the decoder's buffer.
    TooLong,
    /// No `*` and 8 upper-case hexadecimal digits at its end: cut short, or not from rowtone.
    NoChecksum,
    /// The checksum is not that of the text.
    Checksum {
        /// What the sentence says.
        said: u32,
        /// What its text gives.
        computed: u32,
    },
    /// Intact, but of a kind that this version does not know.
    Unknown,
    /// Intact, but this field is missing, malformed or out of range: sender and receiver are
    /// of different versions.
    Field(&'static str),
}

impl core::fmt::Display for DecodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong => write!(f, "sentence: longer than the buffer, left out"),
            Self::NoChecksum => write!(f, "sentence: no checksum at its end, left out"),
            Self::Checksum { said, computed } => write!(
                f,
                "sentence: its checksum says {said:08X}, its text gives {computed:08X}, left out"
            ),
            Self::Unknown => write!(f, "sentence: unknown kind; update the receiver"),
            Self::Field(name) => write!(
                f,
                "sentence: intact, but {name} makes no sense; sender and receiver differ in version"
            ),
        }
    }
}

impl core::error::Error for DecodeError {}

/// Finds sentences in a stream of bytes; `N` is the longest line it takes
/// ([`super::MAX_LINE`] for all).
///
/// It starts anew at every `$`, so after any fault it is right again with the next sentence.
#[derive(Clone, Debug)]
pub struct Decoder<const N: usize = { super::MAX_LINE }> {
    /// What came since the last `$`.
    line: Vec<u8, N>,
    state: State,
    skipped: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Between sentences.
    Outside,
    /// After a `$`.
    Inside,
    /// After a `$`, and the buffer is full.
    Overflow,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// Waits for the first `$`.
    pub const fn new() -> Self {
        Self {
            line: Vec::new(),
            state: State::Outside,
            skipped: 0,
        }
    }

    /// Takes the next byte. A message (or why there is none) comes with the line end, or with
    /// the `$` of the next sentence where the line end was lost.
    pub fn push(&mut self, byte: u8) -> Option<Result<Message, DecodeError>> {
        let heard = match (byte, self.state) {
            (b'$' | b'\r' | b'\n', State::Inside) => Some(
                core::str::from_utf8(&self.line)
                    .map_err(|_| DecodeError::NoChecksum)
                    .and_then(decode_body),
            ),
            (b'$' | b'\r' | b'\n', State::Overflow) => Some(Err(DecodeError::TooLong)),
            (b'$' | b'\r' | b'\n', State::Outside) => None,
            (_, State::Inside) => {
                if self.line.push(byte).is_err() {
                    self.state = State::Overflow;
                }
                return None;
            }
            (_, State::Overflow) => return None,
            (_, State::Outside) => {
                self.skipped = self.skipped.saturating_add(1);
                return None;
            }
        };
        self.line.clear();
        self.state = if byte == b'$' {
            State::Inside
        } else {
            State::Outside
        };
        heard
    }

    /// Bytes outside any sentence so far, line ends not counted.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// Decodes one whole line: `$…*hhhhhhhh`, with or without its line end.
///
/// # Errors
/// Says why it is not a sentence, see [`DecodeError`].
pub fn decode_line(line: &str) -> Result<Message, DecodeError> {
    let line = line.strip_suffix('\n').unwrap_or(line);
    let line = line.strip_suffix('\r').unwrap_or(line);
    decode_body(line.strip_prefix('$').ok_or(DecodeError::NoChecksum)?)
}

/// What stands behind the `$`.
fn decode_body(line: &str) -> Result<Message, DecodeError> {
    let (body, sum) = line.rsplit_once('*').ok_or(DecodeError::NoChecksum)?;
    let said = hexadecimal(sum, 8).ok_or(DecodeError::NoChecksum)?;
    let computed = CRC_32.checksum(body.as_bytes());
    if said != computed {
        return Err(DecodeError::Checksum { said, computed });
    }
    let mut fields = Fields::new(body, ',');
    match fields.text("name")? {
        "RTRPT" => read_report(fields),
        "RTSTA" => read_status(fields).map(Message::Status),
        "RTACK" => read_reply(true, fields).map(Message::Reply),
        "RTERR" => read_reply(false, fields).map(Message::Reply),
        _ => Err(DecodeError::Unknown),
    }
}

fn read_report(mut fields: Fields<'_>) -> Result<Message, DecodeError> {
    let session = fields.integer("session")?;
    let mut report = Report {
        seq: fields.integer("seq")?,
        time_ms: fields.integer("time_ms")?,
        window_s: fields.real("window_s", resolution::WINDOW_S)?,
        fps: fields.real("fps", resolution::HZ)?,
        lines: fields.integer("lines")?,
        lost_frames: fields.integer("lost_frames")?,
        noise_px: fields.real("noise_px", resolution::PX)?,
        warnings: read_warnings(fields.text("warnings")?)?,
        um_per_px: fields.optional_real("um_per_px", resolution::UM_PER_PX)?,
        velocity_mm_s_rms: fields.optional_real("velocity_mm_s_rms", resolution::MM_S)?,
        peaks: Vec::new(),
        line_time_us_fit: None,
        noise_floor: Default::default(),
        other_px_rms: 0.0,
        broad_band: None,
    };
    let count: u32 = fields.integer("peaks")?;
    for _ in 0..count {
        let peak = read_peak(fields.text("peaks")?)?;
        report
            .peaks
            .push(peak)
            .map_err(|_| DecodeError::Field("peaks"))?;
    }
    fields.end()?;
    Ok(Message::Report { session, report })
}

fn read_warnings(field: &str) -> Result<Warnings, DecodeError> {
    hexadecimal(field, 4)
        .and_then(|bits| u16::try_from(bits).ok())
        .map(Warnings::from)
        .ok_or(DecodeError::Field("warnings"))
}

fn read_peak(text: &str) -> Result<Peak, DecodeError> {
    let mut fields = Fields::new(text, '/');
    let peak = Peak {
        hz: fields.real("hz", resolution::HZ)?,
        hz_sd: fields.real("hz_sd", resolution::HZ)?,
        amplitude_px: fields.real("amplitude_px", resolution::PX)?,
        amplitude_px_sd: fields.real("amplitude_px_sd", resolution::PX)?,
        snr_db: fields.real("snr_db", resolution::DB)?,
        track: fields.integer("track")?,
        harmonic: match fields.text("harmonic")? {
            "-" => None,
            field => Some(integer(field).ok_or(DecodeError::Field("harmonic"))?),
        },
        ambiguous: match fields.text("ambiguous")? {
            "A" => true,
            "-" => false,
            _ => return Err(DecodeError::Field("ambiguous")),
        },
        motion: None,
    };
    fields.end()?;
    Ok(peak)
}

fn read_status(mut fields: Fields<'_>) -> Result<Status, DecodeError> {
    let mut version = Fields::new(fields.text("version")?, '.');
    let status = Status {
        version: [
            version.integer("version")?,
            version.integer("version")?,
            version.integer("version")?,
        ],
        session: fields.integer("session")?,
        uptime_ms: fields.integer("uptime_ms")?,
        next_seq: fields.integer("next_seq")?,
        oldest_seq: match fields.text("oldest_seq")? {
            "" => None,
            field => Some(integer(field).ok_or(DecodeError::Field("oldest_seq"))?),
        },
        dropped_reports: fields.integer("dropped_reports")?,
        refused_commands: fields.integer("refused_commands")?,
        settings: match fields.text("settings")? {
            "D" => SettingsOrigin::Defaults,
            "S" => SettingsOrigin::Saved,
            "C" => SettingsOrigin::Corrupt,
            "M" => SettingsOrigin::Changed,
            "P" => SettingsOrigin::Previous,
            _ => return Err(DecodeError::Field("settings")),
        },
    };
    version.end()?;
    fields.end()?;
    Ok(status)
}

fn read_reply(ok: bool, mut fields: Fields<'_>) -> Result<Reply, DecodeError> {
    let text = fields.remainder("text")?;
    if !text.chars().all(may_stand_in_reply) {
        return Err(DecodeError::Field("text"));
    }
    let text = text.try_into().map_err(|_| DecodeError::Field("text"))?;
    Ok(Reply { ok, text })
}

/// The command in a `$RTCMD,…*hhhhhhhh` sentence, or `None` where it is not one or not intact.
pub(crate) fn command_in_sentence(line: &str) -> Option<&str> {
    // Where the last `*` is, is known, for its sum is of eight digits.
    let line = line.strip_prefix('$')?;
    let (body, sum) = line.split_at_checked(line.len().checked_sub(9)?)?;
    let intact = hexadecimal(sum.strip_prefix('*')?, 8)? == CRC_32.checksum(body.as_bytes());
    body.strip_prefix("RTCMD,").filter(|_| intact)
}
