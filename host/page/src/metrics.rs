//! The figures as Prometheus reads them (text format 0.0.4).

use std::fmt::Write;
use std::sync::atomic::Ordering;
use std::time::Instant;

use rowtone_report::band_velocity;

use crate::live::Live;

/// Kind of answer.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// All figures.
pub fn text(live: &Live, viewers: usize, refused: u64, now: Instant) -> String {
    let mut text = String::new();
    let mut one = |name: &str, kind: &str, help: &str, values: &[(String, f64)]| {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "# HELP rowtone_{name} {help}\n# TYPE rowtone_{name} {kind}"
        );
        for (labels, value) in values {
            let _ = writeln!(text, "rowtone_{name}{labels} {value}");
        }
    };
    let total = |value: u64| [(String::new(), value as f64)];
    let (_, reports) = live.reports.position();
    one(
        "reports_total",
        "counter",
        "Reports since the program began.",
        &total(reports),
    );
    let rows = live.lost.rows.load(Ordering::Relaxed);
    one("rows_total", "counter", "Rows measured.", &total(rows));
    let lost = live.lost.frames.load(Ordering::Relaxed);
    one(
        "lost_frames_total",
        "counter",
        "Frames that were lost.",
        &total(lost),
    );
    let dropped = live.lost.reports.load(Ordering::Relaxed);
    one(
        "dropped_reports_total",
        "counter",
        "Windows or reports dropped because something was busy.",
        &total(dropped),
    );
    one(
        "viewers",
        "gauge",
        "Open connections to the page.",
        &total(viewers as u64),
    );
    one(
        "refused_requests_total",
        "counter",
        "Requests that were refused.",
        &total(refused),
    );
    let Some(last) = live.reports.last() else {
        return text;
    };
    let report = &last.report;
    let value = |value: f64| [(String::new(), value)];
    let age = now.saturating_duration_since(last.came).as_secs_f64();
    one(
        "report_age_seconds",
        "gauge",
        "Age of the last report.",
        &value(age),
    );
    one(
        "noise_pixels",
        "gauge",
        "Standard deviation of one row.",
        &value(report.noise_px.into()),
    );
    one(
        "frame_rate_hertz",
        "gauge",
        "Frame rate of the last window.",
        &value(report.fps.into()),
    );
    one(
        "warnings",
        "gauge",
        "Warnings of the last report.",
        &value(report.warnings.iter().count() as f64),
    );
    if let Some(velocity) = band_velocity(report) {
        let help = "Velocity over 10-1000 Hz, mm/s RMS.";
        one(
            "velocity_mm_per_second_rms",
            "gauge",
            help,
            &value(velocity),
        );
    }
    let of_peaks = |figure: fn(&rowtone::report::Peak) -> f32| -> Vec<(String, f64)> {
        let peaks = report.peaks.iter();
        peaks
            .map(|peak| (format!("{{track=\"{}\"}}", peak.track), figure(peak).into()))
            .collect()
    };
    one(
        "peak_hertz",
        "gauge",
        "Frequency of a tone.",
        &of_peaks(|peak| peak.hz),
    );
    one(
        "peak_pixels",
        "gauge",
        "Zero-to-peak amplitude of a tone.",
        &of_peaks(|peak| peak.amplitude_px),
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_its_name_and_kind() {
        let live = Live::default();
        assert!(!text(&live, 0, 0, Instant::now()).contains("peak"));
        live.report(&rowtone_report::example(Some(100.0)), String::new());
        let text = text(&live, 2, 7, Instant::now());
        for line in [
            "# TYPE rowtone_reports_total counter",
            "rowtone_reports_total 1",
            "rowtone_rows_total 18000",
            "rowtone_lost_frames_total 2",
            "rowtone_viewers 2",
            "rowtone_refused_requests_total 7",
            "rowtone_warnings 2",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} in\n{text}");
        }
        assert!(
            text.contains("rowtone_peak_hertz{track=\"1\"} 49.2"),
            "{text}"
        );
        // Each line is a comment or a name and a number.
        for line in text.lines().filter(|l| !l.starts_with('#')) {
            let (_, number) = line.rsplit_once(' ').unwrap();
            assert!(number.parse::<f64>().is_ok(), "{line}");
        }
    }
}
