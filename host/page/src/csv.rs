//! Reports as a table: one line a peak.

use std::fmt::Write;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use rowtone_report::{band_velocity, velocity_mm_s_rms};

use crate::reports::Entry;

/// The heading.
const HEADING: &str = "unix_s,seq,t_s,window_s,fps,rows,lost_frames,noise_px,velocity_mm_s_rms,warnings,track,hz,hz_sd,\
amplitude_px,amplitude_px_sd,amplitude_um,peak_velocity_mm_s_rms,snr_db,x_px,x_px_sd,y_px,y_px_sd,harmonic,ambiguous,\
phase_rad,y_phase_rad,hz_per_s\n";

/// Seconds since 1970.
pub(crate) fn unix_s(time: SystemTime) -> f64 {
    time.duration_since(UNIX_EPOCH)
        .map_or(0.0, |t| t.as_secs_f64())
}

/// All reports, the oldest first; one without peaks has a line too.
pub fn text(entries: &[Arc<Entry>]) -> String {
    let mut text = HEADING.to_owned();
    for entry in entries {
        let report = &entry.report;
        let maybe = |value: Option<f32>| value.map_or(String::new(), |v| v.to_string());
        let warnings: Vec<&str> = report.warnings.names().collect();
        let mut head = String::new();
        // Writing to a string cannot fail.
        let _ = write!(
            head,
            "{:.3},{},{},{},{},{},{},{},{},{}",
            unix_s(entry.wall),
            report.seq,
            report.time_ms as f64 / 1000.0,
            report.window_s,
            report.fps,
            report.lines,
            report.lost_frames,
            report.noise_px,
            maybe(band_velocity(report).map(|v| v as f32)),
            warnings.join(" ")
        );
        if report.peaks.is_empty() {
            let _ = writeln!(text, "{head},,,,,,,,,,,,,,,,,");
        }
        for peak in &report.peaks {
            let um = report.um_per_px.map(|scale| scale * peak.amplitude_px);
            let velocity = um.map(|um| velocity_mm_s_rms(peak.hz.into(), um.into()) as f32);
            let motion = peak.motion.as_ref();
            let _ = writeln!(
                text,
                "{head},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                peak.track,
                peak.hz,
                peak.hz_sd,
                peak.amplitude_px,
                peak.amplitude_px_sd,
                maybe(um),
                maybe(velocity),
                peak.snr_db,
                maybe(motion.and_then(|m| m.x_px)),
                maybe(motion.and_then(|m| m.x_px_sd)),
                maybe(motion.and_then(|m| m.y_px)),
                maybe(motion.and_then(|m| m.y_px_sd)),
                peak.harmonic.map_or(String::new(), |n| n.to_string()),
                u8::from(peak.ambiguous),
                maybe(motion.map(|m| m.phase_rad)),
                maybe(motion.and_then(|m| m.y_phase_rad)),
                maybe(motion.and_then(|m| m.hz_per_s)),
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::Live;

    #[test]
    fn every_line_has_as_many_fields_as_the_heading() {
        let live = Live::default();
        for scale in [None, Some(100.0)] {
            live.report(&rowtone_report::example(scale), String::new());
        }
        let mut empty = rowtone_report::example(None);
        empty.peaks.clear();
        live.report(&empty, String::new());
        let text = text(&live.reports.after(0, 9));
        let fields = HEADING.matches(',').count();
        assert_eq!(text.lines().count(), 1 + 2 + 2 + 1);
        for line in text.lines() {
            assert_eq!(line.matches(',').count(), fields, "{line}");
        }
        assert!(text.contains(",49.2003,0.0004,0.3998,"), "{text}");
        assert!(text.contains("lost_frames occluded"), "{text}");
    }
}
