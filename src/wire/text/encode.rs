//! Messages to sentences.

use core::fmt::{self, Write};

use crate::report::{Peak, Report};
use crate::wire::check::{Digest, EncodeError, check_message};
use crate::wire::message::{Message, SettingsOrigin, Status};
use crate::wire::{decimal, slice::SliceWriter};

use super::{CRC_32, resolution};

/// Writes one message as one line, its `\r\n` included: at most [`super::MAX_LINE`] bytes.
///
/// # Errors
/// [`EncodeError::Value`] or [`EncodeError::Text`], then nothing was written;
/// [`EncodeError::Full`] where the writer refused, and then the start of a line may be written.
pub fn encode(message: &Message, out: &mut impl Write) -> Result<(), EncodeError> {
    check_message(message)?;
    sentence(message, out).map_err(|fmt::Error| EncodeError::Full)
}

/// [`encode`] into a lent slice; gives back the part that is the line.
///
/// # Errors
/// As [`encode`].
pub fn encode_to_slice<'a>(
    message: &Message,
    buffer: &'a mut [u8],
) -> Result<&'a [u8], EncodeError> {
    let mut out = SliceWriter::new(buffer);
    encode(message, &mut out)?;
    Ok(out.into_written())
}

fn sentence(message: &Message, out: &mut impl Write) -> fmt::Result {
    out.write_char('$')?;
    let mut body = Summed {
        out,
        digest: CRC_32.digest(),
    };
    match message {
        Message::Report { session, report } => write_report(*session, report, &mut body)?,
        Message::Status(status) => write_status(status, &mut body)?,
        Message::Reply(reply) => {
            let name = if reply.ok { "RTACK" } else { "RTERR" };
            write!(body, "{name},{}", reply.text)?;
        }
    }
    let sum = body.digest.finalize();
    write!(out, "*{sum:08X}\r\n")
}

fn write_report(session: u32, report: &Report, out: &mut impl Write) -> fmt::Result {
    write!(out, "RTRPT,{session},{},{}", report.seq, report.time_ms)?;
    real(out, ',', report.window_s, resolution::WINDOW_S)?;
    real(out, ',', report.fps, resolution::HZ)?;
    write!(out, ",{},{}", report.lines, report.lost_frames)?;
    real(out, ',', report.noise_px, resolution::PX)?;
    write!(out, ",{:04X}", report.warnings.lower_bits())?;
    optional(out, report.um_per_px, resolution::UM_PER_PX)?;
    optional(out, report.velocity_mm_s_rms, resolution::MM_S)?;
    write!(out, ",{}", report.peaks.len())?;
    report
        .peaks
        .iter()
        .try_for_each(|peak| write_peak(peak, out))
}

fn write_peak(peak: &Peak, out: &mut impl Write) -> fmt::Result {
    real(out, ',', peak.hz, resolution::HZ)?;
    real(out, '/', peak.hz_sd, resolution::HZ)?;
    real(out, '/', peak.amplitude_px, resolution::PX)?;
    real(out, '/', peak.amplitude_px_sd, resolution::PX)?;
    real(out, '/', peak.snr_db, resolution::DB)?;
    write!(out, "/{}", peak.track)?;
    match peak.harmonic {
        Some(harmonic) => write!(out, "/{harmonic}")?,
        None => out.write_str("/-")?,
    }
    out.write_str(if peak.ambiguous { "/A" } else { "/-" })
}

fn write_status(status: &Status, out: &mut impl Write) -> fmt::Result {
    let [major, minor, patch] = status.version;
    write!(
        out,
        "RTSTA,{major}.{minor}.{patch},{},{},{},",
        status.session, status.uptime_ms, status.next_seq,
    )?;
    if let Some(oldest) = status.oldest_seq {
        write!(out, "{oldest}")?;
    }
    let settings = match status.settings {
        SettingsOrigin::Defaults => 'D',
        SettingsOrigin::Saved => 'S',
        SettingsOrigin::Corrupt => 'C',
        SettingsOrigin::Changed => 'M',
        SettingsOrigin::Previous => 'P',
    };
    write!(
        out,
        ",{},{},{settings}",
        status.dropped_reports, status.refused_commands
    )
}

fn real(out: &mut impl Write, before: char, value: f32, decimals: u32) -> fmt::Result {
    out.write_char(before)?;
    decimal::write(out, value, decimals)
}

fn optional(out: &mut impl Write, value: Option<f32>, decimals: u32) -> fmt::Result {
    match value {
        Some(value) => real(out, ',', value, decimals),
        None => out.write_char(','),
    }
}

/// Passes text on and sums it up.
struct Summed<'a, W> {
    out: &'a mut W,
    digest: Digest,
}

impl<W: Write> Write for Summed<'_, W> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.digest.update(text.as_bytes());
        self.out.write_str(text)
    }
}

/// Writes a command as a `$RTCMD,…*hhhhhhhh` sentence, for programs that talk to a board.
///
/// # Errors
/// Only where `out` refuses.
pub fn encode_command(command: &str, out: &mut impl Write) -> fmt::Result {
    out.write_char('$')?;
    let mut body = Summed {
        out,
        digest: CRC_32.digest(),
    };
    write!(body, "RTCMD,{command}")?;
    let sum = body.digest.finalize();
    write!(out, "*{sum:08X}\r\n")
}
