//! The examples do what they say.

#[path = "../examples/decode.rs"]
mod decode;
#[path = "../examples/peaks.rs"]
mod peaks;
#[path = "../examples/shapes.rs"]
#[allow(dead_code)]
mod shapes;
#[path = "../examples/two_threads.rs"]
mod two_threads;

use rowtone::report::Report;
use rowtone::wire::{Message, binary, text};

#[test]
fn peaks_are_the_machine_s_tones() {
    let reports = peaks::reports().expect("a good configuration");
    assert!(reports.len() >= 3, "{}", reports.len());
    for report in &reports {
        let (tones, others) = report.peaks.split_at(peaks::TONES.len());
        for (peak, (hz, px)) in tones.iter().zip(peaks::TONES) {
            assert!((peak.hz - hz).abs() < 0.02, "{peak:?}");
            assert!((peak.amplitude_px / px - 1.0).abs() < 0.05, "{peak:?}");
        }
        // Pixels are whole numbers and have no noise here: what rounding leaves is no noise either.
        let largest_px = peaks::TONES[0].1;
        assert!(
            others
                .iter()
                .all(|peak| peak.amplitude_px < 0.002 * largest_px)
        );
    }
}

#[test]
fn two_threads_lose_no_window_unsaid() {
    let (reports, dropped) = two_threads::reports().expect("a good configuration");
    // Lines come here as fast as they are made, so that windows may be dropped.
    assert!(!reports.is_empty());
    assert!(
        reports.len() as u32 + dropped >= 4,
        "{} {dropped}",
        reports.len()
    );
    for report in &reports {
        let strongest = report.peaks.first().expect("a tone");
        assert!(
            (strongest.hz - two_threads::SWING_HZ).abs() < 0.05,
            "{strongest:?}"
        );
    }
}

#[test]
fn both_wires_are_decoded() {
    let report = Report {
        seq: 7,
        ..Report::EMPTY
    };
    let message = Message::Report { session: 3, report };
    let (mut sentence, mut frame) = ([0; text::MAX_LINE], [0; binary::MAX_FRAME]);
    let sentence = text::encode_to_slice(&message, &mut sentence).expect("room for it");
    let frame = binary::encode_to_slice(&message, &mut frame).expect("room for it");
    for bytes in [sentence, frame] {
        let mut listener = decode::Listener::default();
        let heard: Vec<Message> = bytes.iter().filter_map(|&b| listener.hear(b)).collect();
        assert_eq!(heard.len(), 1);
        assert_eq!(heard[0], message);
        assert_eq!(decode::line(&heard[0]), "session 3, report 7:");
    }
}

#[test]
fn both_edges_of_a_bending_part_move_as_simulated() {
    let edges = shapes::edges().expect("a good configuration");
    for edge in edges {
        for (found, (hz, px)) in edge.into_iter().zip(shapes::TONES) {
            // The middle of the outermost tiles is 7.5 of 63.5 rows from the edge. A tile tells of
            // where its texture is, within some rows of that.
            let truth = px * (1.0 - 7.5 / 63.5);
            assert!(
                (found / truth - 1.0).abs() < 0.07,
                "{hz} Hz: {found}, {truth}"
            );
        }
    }
}
