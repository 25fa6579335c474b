//! A record: what a window, a minute or an hour was.

use crc::{CRC_32_ISO_HDLC, Crc};
use rowtone::report::Report;

/// Length of a record on the disk, bytes.
pub const LENGTH: usize = 40;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
/// Begins every record, and is counted up when its meaning changes.
const MAGIC: u32 = 0x3154_5452;

/// What a machine did in a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// When its last window ended, ms since 1970.
    pub unix_ms: u64,
    /// Windows in it.
    pub windows: u32,
    /// Warnings of any of its windows, as bits ([`rowtone::report::Warnings`]).
    pub warnings: u32,
    /// Velocity over 10–1000 Hz, mm/s RMS, root of the mean square of its windows; not a number without a scale.
    pub velocity_mm_s_rms: f32,
    /// The same of the window that had most.
    pub velocity_mm_s_rms_most: f32,
    /// Frequency of its largest tone, Hz; not a number where there was none.
    pub tone_hz: f32,
    /// Zero-to-peak amplitude of that, px.
    pub tone_px: f32,
}

/// The heading of the records as CSV.
pub const CSV_HEADING: &str =
    "unix_ms,windows,velocity_mm_s_rms,velocity_mm_s_rms_most,tone_hz,tone_px,warnings";

impl Record {
    /// Of one window.
    pub fn of(report: &Report, velocity_mm_s_rms: Option<f64>, unix_ms: u64) -> Self {
        let sure = report.peaks.iter().filter(|peak| !peak.ambiguous);
        let largest = sure.max_by(|a, b| a.amplitude_px.total_cmp(&b.amplitude_px));
        let velocity = velocity_mm_s_rms.map_or(f32::NAN, |v| v as f32);
        Self {
            unix_ms,
            windows: 1,
            warnings: report.warnings.bits(),
            velocity_mm_s_rms: velocity,
            velocity_mm_s_rms_most: velocity,
            tone_hz: largest.map_or(f32::NAN, |peak| peak.hz),
            tone_px: largest.map_or(f32::NAN, |peak| peak.amplitude_px),
        }
    }

    /// Of both, the later one given.
    #[must_use]
    pub fn joined(&self, later: &Self) -> Self {
        let [a, b] = [self, later].map(|r| (f64::from(r.velocity_mm_s_rms), f64::from(r.windows)));
        let velocity = match (a.0.is_nan(), b.0.is_nan()) {
            (true, _) => b.0,
            (_, true) => a.0,
            _ => ((a.0 * a.0 * a.1 + b.0 * b.0 * b.1) / (a.1 + b.1)).sqrt(),
        };
        // What is not a number is no more than anything.
        let larger = if later.tone_px > self.tone_px || self.tone_px.is_nan() {
            later
        } else {
            self
        };
        Self {
            unix_ms: later.unix_ms,
            windows: self.windows.saturating_add(later.windows),
            warnings: self.warnings | later.warnings,
            velocity_mm_s_rms: velocity as f32,
            velocity_mm_s_rms_most: self
                .velocity_mm_s_rms_most
                .max(later.velocity_mm_s_rms_most),
            tone_hz: larger.tone_hz,
            tone_px: larger.tone_px,
        }
    }

    /// As bytes, with their checksum.
    pub fn bytes(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        let words = [
            MAGIC,
            self.unix_ms as u32,
            (self.unix_ms >> 32) as u32,
            self.windows,
            self.warnings,
            self.velocity_mm_s_rms.to_bits(),
            self.velocity_mm_s_rms_most.to_bits(),
            self.tone_hz.to_bits(),
            self.tone_px.to_bits(),
        ];
        for (to, word) in bytes.chunks_exact_mut(4).zip(words) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        let (of, checksum) = bytes.split_at_mut(LENGTH - 4);
        checksum.copy_from_slice(&CRC.checksum(of).to_le_bytes());
        bytes
    }

    /// Back from bytes; `None` of what is not one, whole.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; LENGTH] = bytes.try_into().ok()?;
        let word = |n: usize| {
            bytes
                .chunks_exact(4)
                .nth(n)?
                .try_into()
                .ok()
                .map(u32::from_le_bytes)
        };
        if word(0)? != MAGIC || word(9)? != CRC.checksum(&bytes[..LENGTH - 4]) {
            return None;
        }
        Some(Self {
            unix_ms: u64::from(word(1)?) | u64::from(word(2)?) << 32,
            windows: word(3)?,
            warnings: word(4)?,
            velocity_mm_s_rms: f32::from_bits(word(5)?),
            velocity_mm_s_rms_most: f32::from_bits(word(6)?),
            tone_hz: f32::from_bits(word(7)?),
            tone_px: f32::from_bits(word(8)?),
        })
    }

    /// A line of CSV, without its end; empty where a number is none.
    pub fn csv(&self) -> String {
        let maybe = |v: f32| {
            if v.is_nan() {
                String::new()
            } else {
                v.to_string()
            }
        };
        let warnings = rowtone::report::Warnings::from_bits(self.warnings);
        let warnings: Vec<_> = warnings.names().collect();
        format!(
            "{},{},{},{},{},{},{}",
            self.unix_ms,
            self.windows,
            maybe(self.velocity_mm_s_rms),
            maybe(self.velocity_mm_s_rms_most),
            maybe(self.tone_hz),
            maybe(self.tone_px),
            warnings.join(" ")
        )
    }
}
