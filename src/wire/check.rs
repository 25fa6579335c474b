//! What a number must fulfil to go over a wire.

use crate::report::Report;

use super::message::Message;

/// CRC-32/ISO-HDLC, the checksum of every wire and of saved settings.
pub(crate) static CRC_32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// A sum under way.
pub(crate) type Digest = crc::Digest<'static, u32>;

/// Every real number on a wire is smaller than this in size.
pub const MAX_VALUE: f32 = 1e7;

/// A message that cannot be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncodeError {
    /// The lent buffer (or the writer behind it) is full.
    Full,
    /// A value is not a number of a size below [`MAX_VALUE`].
    Value {
        /// Name of the field in [`Report`] or [`crate::report::Peak`].
        field: &'static str,
        /// What it holds.
        value: f32,
    },
    /// The text of a reply holds a character that may not stand in a sentence.
    Text(char),
}

impl core::fmt::Display for EncodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Full => write!(f, "message: the buffer is full; lend a larger one"),
            Self::Value { field, value } => write!(
                f,
                "report: {field} is {value}; give a number below {MAX_VALUE:e} in size"
            ),
            Self::Text(c) => write!(
                f,
                "reply: the text holds {c:?}; use printable ASCII without $ and *"
            ),
        }
    }
}

impl core::error::Error for EncodeError {}

/// Whether every number of a report can go over a wire: finite, and below [`MAX_VALUE`].
///
/// # Errors
/// Names the first field that cannot.
pub fn check_report(report: &Report) -> Result<(), EncodeError> {
    check("window_s", report.window_s)?;
    check("fps", report.fps)?;
    check("noise_px", report.noise_px)?;
    check("um_per_px", report.um_per_px.unwrap_or(0.0))?;
    check("velocity_mm_s_rms", report.velocity_mm_s_rms.unwrap_or(0.0))?;
    for peak in &report.peaks {
        check("hz", peak.hz)?;
        check("hz_sd", peak.hz_sd)?;
        check("amplitude_px", peak.amplitude_px)?;
        check("amplitude_px_sd", peak.amplitude_px_sd)?;
        check("snr_db", peak.snr_db)?;
    }
    Ok(())
}

/// [`check_report`] for any message.
pub(super) fn check_message(message: &Message) -> Result<(), EncodeError> {
    match message {
        Message::Report { report, .. } => check_report(report),
        Message::Status(_) => Ok(()),
        Message::Reply(reply) => match reply.text.chars().find(|&c| !may_stand_in_reply(c)) {
            Some(c) => Err(EncodeError::Text(c)),
            None => Ok(()),
        },
    }
}

/// Printable ASCII that neither starts nor ends a sentence.
pub(super) fn may_stand_in_reply(c: char) -> bool {
    matches!(c, ' '..='~') && c != '$' && c != '*'
}

fn check(field: &'static str, value: f32) -> Result<(), EncodeError> {
    // Written so that NaN fails too.
    if value.abs() < MAX_VALUE {
        Ok(())
    } else {
        Err(EncodeError::Value { field, value })
    }
}
