//! Reports for a person's eyes.

use std::fmt::Write;

use rowtone::report::{Peak, Report};

use super::broad::{self, velocity_mm_s};
use super::zone::ZoneLimits;
use super::{band_velocity, motion, sentence, velocity_mm_s_rms};

/// A report as a heading and one line a peak, without the last line feed.
pub fn report(report: &Report) -> String {
    zoned(report, None)
}

/// The same, with the machine's zone where the limits are given and there is a scale.
pub fn zoned(report: &Report, limits: Option<&ZoneLimits>) -> String {
    let mut text = format!(
        "{:8.2} s  #{}: {:.2} s at {:.3} fps, {} rows, noise {} px a row",
        report.time_ms as f64 / 1000.0,
        report.seq,
        report.window_s,
        report.fps,
        report.lines,
        digits(report.noise_px.into(), 2),
    );
    // Writing to a string cannot fail.
    if let Some(velocity) = band_velocity(report) {
        let figure = velocity_mm_s(report)
            .as_ref()
            .map_or_else(|| format!("{velocity:.3}"), broad::words);
        let _ = write!(text, ", {figure} mm/s RMS (10-1000 Hz)");
        if let Some(limits) = limits {
            let _ = write!(text, ", zone {}", limits.zone(velocity));
        }
    }
    if report.peaks.is_empty() {
        text.push_str("\n            no vibration above the noise");
    }
    if let Some(broad) = &report.broad_band {
        let _ = write!(text, "\n            {}", broad::line(broad));
    }
    for peak in &report.peaks {
        let _ = write!(text, "\n{}", peak_line(peak, report.um_per_px));
    }
    for sentence in report.warnings.iter().map(sentence) {
        let _ = write!(text, "\n            note: {sentence}");
    }
    text
}

fn peak_line(peak: &Peak, um_per_px: Option<f32>) -> String {
    let mut line = figures(
        [peak.hz.into(), peak.hz_sd.into()],
        [peak.amplitude_px.into(), peak.amplitude_px_sd.into()],
        um_per_px.map(|scale| f64::from(peak.amplitude_px * scale)),
    );
    let _ = write!(line, " {:>6.1} dB", peak.snr_db);
    if let Some(harmonic) = peak.harmonic {
        let _ = write!(line, "  {harmonic}x");
    }
    let motion = motion::words(peak);
    if !motion.is_empty() {
        let _ = write!(line, "  {motion}");
    }
    if let Some(motion) = &peak.motion {
        let _ = write!(line, "  phase {:.1}°", motion::phase_degrees(motion));
    }
    if peak.ambiguous {
        line.push_str("  ambiguous: may be another frequency");
    }
    line
}

/// How every tone's line begins: frequency and amplitude with their standard deviations, Hz and px, and with a scale the
/// amplitude in µm and the velocity.
pub(crate) fn figures([hz, hz_sd]: [f64; 2], [px, px_sd]: [f64; 2], um: Option<f64>) -> String {
    let mut line = format!(
        "{hz:>14.4} Hz ± {:<8} {px:>9.5} px ± {:<8}",
        digits(hz_sd, 2),
        digits(px_sd, 2),
    );
    if let Some(um) = um {
        let speed = velocity_mm_s_rms(hz, um);
        // Writing to a string cannot fail.
        let _ = write!(line, " {um:>9.3} µm {speed:>9.4} mm/s");
    }
    line
}

/// A number with `count` significant digits, without an exponent where it has a sensible size.
///
/// ```
/// use rowtone_report::text::digits;
/// assert_eq!(digits(0.0131, 2), "0.013");
/// assert_eq!(digits(1234.6, 2), "1235");
/// assert_eq!(digits(0.0, 2), "0");
/// assert_eq!(digits(1.2e-9, 2), "1.2e-9");
/// ```
pub fn digits(value: f64, count: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let magnitude = value.abs().log10().floor() as i32;
    if magnitude < -6 {
        return format!("{value:.*e}", count.saturating_sub(1));
    }
    let decimals = (count as i32 - 1 - magnitude).max(0);
    format!("{value:.*}", decimals as usize)
}

#[cfg(test)]
mod tests {
    use crate::example;

    #[test]
    fn a_report_reads_well() {
        let text = super::report(&example(None));
        assert_eq!(
            text,
            "    2.50 s  #3: 1.00 s at 60.000 fps, 18000 rows, noise 0.013 px a row\n\
             \x20      49.2003 Hz ± 0.00040    0.39980 px ± 0.00020    61.2 dB\n\
             \x20    1500.0000 Hz ± 0.00040    0.02000 px ± 0.00020    61.2 dB\n\
             \x20           note: frames were lost\n\
             \x20           note: something passed through the picture: its rows were left out"
        );
        assert!(super::report(&example(Some(10.0))).contains("µm"));
        let limits = "0.5,2.8,7.1".parse().unwrap();
        let text = super::zoned(&example(Some(10.0)), Some(&limits));
        assert!(
            text.contains("0.874 mm/s RMS (10-1000 Hz), zone B"),
            "{text}"
        );
    }
}
