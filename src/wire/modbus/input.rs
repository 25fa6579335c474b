//! Input registers: the newest report and the board's status.

use heapless::Vec;

use crate::report::{Peak, Report};
use crate::wire::CRC_32;
use crate::wire::message::{SettingsOrigin, Status};

use super::half;

/// Version of the register map, in register 0.
const MAP: u16 = 1;

/// Address of the first peak.
pub(crate) const PEAKS_AT: u16 = 100;

/// Registers from one peak to the next.
pub(crate) const PEAK_STRIDE: u16 = 20;

/// Address of the CRC-32 of the report.
///
/// The CRC-16 of a frame misses one in 65536 of the faults that it does not find with certainty, and a
/// report takes several frames, between which a newer one can come. This covers both: it is of
/// [`CHECKED`] and of the registers of the peaks that are there, each as two bytes, the upper first.
const CHECK_AT: u16 = 36;

/// Registers before the peaks that the check covers: session, flags, report.
const CHECKED: [core::ops::Range<u16>; 3] = [4..6, 8..9, 16..CHECK_AT];

/// Registers before the peaks.
const HEAD_LEN: u16 = CHECK_AT + 2;

/// What the input registers show.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// How the board is doing.
    pub status: &'a Status,
    /// The newest report, once there is one.
    pub report: Option<&'a Report>,
}

impl State<'_> {
    /// The register at an address, or `None` where there is none.
    pub fn register(&self, at: u16) -> Option<u16> {
        match at {
            0..16 => Some(self.status_register(at)),
            16..CHECK_AT => Some(self.report.map_or(0, |report| report_register(report, at))),
            CHECK_AT..HEAD_LEN => Some(half(self.check(), at - CHECK_AT)),
            _ => {
                let peak = at.checked_sub(PEAKS_AT)?;
                let (index, at) = (peak / PEAK_STRIDE, peak % PEAK_STRIDE);
                if usize::from(index) >= crate::report::MAX_PEAKS {
                    return None;
                }
                let register = self.report.and_then(|report| {
                    let peak = report.peaks.get(usize::from(index))?;
                    Some(peak_register(peak, report.um_per_px, at))
                });
                Some(register.unwrap_or(0))
            }
        }
    }

    /// The CRC-32 of the report's registers, 0 where there is none.
    fn check(&self) -> u32 {
        let peaks = self.report.map(|report| report.peaks.len());
        let sum = peaks.and_then(|peaks| check(peaks, |at| self.register(at)));
        sum.unwrap_or(0)
    }

    fn status_register(&self, at: u16) -> u16 {
        let status = self.status;
        let [major, minor, patch] = status.version;
        match at {
            0 => MAP,
            1 => major,
            2 => minor,
            3 => patch,
            4 | 5 => half(status.session, at - 4),
            6 | 7 => {
                let uptime_s = status.uptime_ms / 1000;
                half(u32::try_from(uptime_s).unwrap_or(u32::MAX), at - 6)
            }
            8 => self.flags(),
            9 => match status.settings {
                SettingsOrigin::Defaults => 0,
                SettingsOrigin::Saved => 1,
                SettingsOrigin::Corrupt => 2,
                SettingsOrigin::Changed => 3,
                SettingsOrigin::Previous => 4,
            },
            10 | 11 => half(status.next_seq, at - 10),
            12 | 13 => half(status.dropped_reports, at - 12),
            _ => half(status.refused_commands, at & 1),
        }
    }

    fn flags(&self) -> u16 {
        let has = |there: fn(&Report) -> bool| u16::from(self.report.is_some_and(there));
        has(|_| true)
            | (has(|report| report.um_per_px.is_some()) << 1)
            | (has(|report| report.velocity_mm_s_rms.is_some()) << 2)
    }
}

fn report_register(report: &Report, at: u16) -> u16 {
    let pair = |value: u32| half(value, at & 1);
    let real = |value: f32| pair(value.to_bits());
    match at {
        16 | 17 => pair(report.seq),
        18 | 19 => half((report.time_ms >> 32) as u32, at & 1),
        20 | 21 => half(report.time_ms as u32, at & 1),
        22 | 23 => real(report.window_s),
        24 | 25 => real(report.fps),
        26 | 27 => pair(report.lines),
        28 => report.lost_frames,
        29 => report.warnings.lower_bits(),
        30 | 31 => real(report.noise_px),
        32 | 33 => real(report.velocity_mm_s_rms.unwrap_or(0.0)),
        _ => real(report.um_per_px.unwrap_or(0.0)),
    }
}

/// Register `at` of a peak, from its first.
fn peak_register(peak: &Peak, um_per_px: Option<f32>, at: u16) -> u16 {
    let real = |value: f32| half(value.to_bits(), at & 1);
    let amplitude_um = peak.amplitude_px * um_per_px.unwrap_or(0.0);
    match at {
        0 | 1 => real(peak.hz),
        2 | 3 => real(peak.hz_sd),
        4 | 5 => real(peak.amplitude_px),
        6 | 7 => real(peak.amplitude_px_sd),
        8 | 9 => real(peak.snr_db),
        10 | 11 => real(amplitude_um),
        // A tone A·sin(2πft) has a velocity of 2πfA/√2 RMS; µm/s to mm/s.
        12 | 13 => real(
            core::f32::consts::TAU
                * core::f32::consts::FRAC_1_SQRT_2
                * 1e-3
                * peak.hz
                * amplitude_um,
        ),
        14 => peak.track,
        15 => peak.harmonic.map_or(0, u16::from),
        16 => 1 | (u16::from(peak.ambiguous) << 1) | (u16::from(peak.harmonic.is_some()) << 2),
        _ => 0,
    }
}

/// The CRC-32 of registers that show a report with so many peaks, where all are there.
fn check(peaks: usize, register: impl Fn(u16) -> Option<u16>) -> Option<u32> {
    let len = PEAK_STRIDE.checked_mul(u16::try_from(peaks).ok()?)?;
    let peaks = PEAKS_AT..PEAKS_AT.checked_add(len)?;
    let mut digest = CRC_32.digest();
    for at in CHECKED.into_iter().chain([peaks]).flatten() {
        digest.update(&register(at)?.to_be_bytes());
    }
    Some(digest.finalize())
}

/// The report that these registers show: what a client does with what it read. `register` gives
/// the register at an address, as [`State::register`] does.
///
/// `None` where there is no report yet, a register is missing, the report's own CRC-32 is not that of
/// its registers (a fault that a frame's CRC-16 missed, or registers of two reports), or a value makes
/// no sense.
pub fn decode_report(register: impl Fn(u16) -> Option<u16>) -> Option<Report> {
    let pair = |at: u16| Some((u32::from(register(at)?) << 16) | u32::from(register(at + 1)?));
    let real = |at: u16| pair(at).map(f32::from_bits);
    let flags = register(8)?;
    if register(0)? != MAP || flags & 1 == 0 {
        return None;
    }
    let mut peaks = Vec::new();
    for index in 0..crate::report::MAX_PEAKS as u16 {
        let at = PEAKS_AT + index * PEAK_STRIDE;
        let flags = register(at + 16)?;
        if flags & 1 == 0 {
            break;
        }
        let harmonic = u8::try_from(register(at + 15)?).ok()?;
        peaks
            .push(Peak {
                hz: real(at)?,
                hz_sd: real(at + 2)?,
                amplitude_px: real(at + 4)?,
                amplitude_px_sd: real(at + 6)?,
                snr_db: real(at + 8)?,
                ambiguous: flags & 2 != 0,
                track: register(at + 14)?,
                harmonic: (flags & 4 != 0).then_some(harmonic),
                motion: None,
            })
            .ok()?;
    }
    if check(peaks.len(), &register)? != pair(CHECK_AT)? {
        return None;
    }
    let report = Report {
        seq: pair(16)?,
        time_ms: (u64::from(pair(18)?) << 32) | u64::from(pair(20)?),
        window_s: real(22)?,
        fps: real(24)?,
        lines: pair(26)?,
        lost_frames: register(28)?,
        warnings: register(29)?.into(),
        noise_px: real(30)?,
        velocity_mm_s_rms: (flags & 4 != 0).then_some(real(32)?),
        um_per_px: (flags & 2 != 0).then_some(real(34)?),
        peaks,
        line_time_us_fit: None,
        noise_floor: Default::default(),
        other_px_rms: 0.0,
        broad_band: None,
    };
    crate::wire::check_report(&report).ok().map(|()| report)
}
