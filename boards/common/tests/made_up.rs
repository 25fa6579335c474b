//! The made-up board measures what its machine does.

#[path = "../examples/made_up.rs"]
mod made_up;

use rowtone::wire::{Message, text};

#[test]
fn the_made_up_board_reports_its_machine() {
    let mut line = Vec::new();
    made_up::run(250, &mut line).expect("memory takes it");
    let reports: Vec<_> = line
        .split_inclusive(|&byte| byte == b'\n')
        .filter_map(|sentence| {
            text::decode_line(std::str::from_utf8(sentence).ok()?.trim_end()).ok()
        })
        .filter_map(|message| match message {
            Message::Report { report, .. } => Some(report),
            _ => None,
        })
        .collect();
    assert!(reports.len() >= 3, "{} reports", reports.len());
    for report in reports {
        let peak = report.peaks.first().expect("it swings");
        assert!(
            (f64::from(peak.hz) - made_up::SWING_HZ).abs() < 0.02,
            "{peak:?}"
        );
        let off = f64::from(peak.amplitude_px) / made_up::SWING_PX - 1.0;
        assert!(off.abs() < 0.02, "{peak:?}");
    }
}
