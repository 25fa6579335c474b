//! `wire::binary` against random messages, and against a line that harms them.

mod wire_common;

use proptest::prelude::*;
use rowtone::wire::{EncodeError, Message, binary};
use wire_common::{message, ordinary_report};

fn encoded(message: &Message) -> Vec<u8> {
    let mut buffer = [0; binary::MAX_FRAME];
    binary::encode_to_slice(message, &mut buffer)
        .unwrap()
        .to_vec()
}

fn decoded(bytes: &[u8]) -> Vec<Result<Message, binary::DecodeError>> {
    let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
    bytes.iter().filter_map(|&b| decoder.push(b)).collect()
}

fn report(seq: u32) -> Message {
    Message::Report {
        session: 1,
        report: ordinary_report(seq),
    }
}

/// The frame that docs/wire.md shows. When it changes, other programs' decoders break: raise
/// [`binary::FORMAT`] with it.
#[test]
fn the_documented_frame() {
    let mut report = ordinary_report(12);
    report.peaks.truncate(1);
    report.um_per_px = None;
    report.velocity_mm_s_rms = None;
    let frame = encoded(&Message::Report { session: 3, report });
    let hex: Vec<String> = frame.iter().map(|b| format!("{b:02X}")).collect();
    let doc = include_str!("../docs/wire.md").replace("\n    ", " ");
    assert!(
        doc.contains(&hex.join(" ")),
        "docs/wire.md does not show {}",
        hex.join(" ")
    );
}

#[test]
fn values_that_cannot_be_said_are_refused() {
    let mut bad = ordinary_report(0);
    bad.fps = f32::INFINITY;
    let mut buffer = [0; binary::MAX_FRAME];
    let error = binary::encode_to_slice(
        &Message::Report {
            session: 0,
            report: bad,
        },
        &mut buffer,
    );
    assert!(matches!(
        error,
        Err(EncodeError::Value { field: "fps", .. })
    ));
    for room in 0..encoded(&report(0)).len() {
        let error = binary::encode_to_slice(&report(0), &mut buffer[..room]);
        assert_eq!(error, Err(EncodeError::Full));
    }
}

/// A lost zero, a cut and garbage before cost only what they hit.
#[test]
fn finds_the_next_frame() {
    let good = |bytes: &[u8]| -> Vec<u32> {
        let seq = |heard| match heard {
            Ok(Message::Report { report, .. }) => Some(report.seq),
            _ => None,
        };
        decoded(bytes).into_iter().filter_map(seq).collect()
    };
    let frame = |seq| encoded(&report(seq));
    let mut no_end = frame(1);
    no_end.pop();
    assert_eq!(good(&[no_end, frame(2)].concat()), [1, 2]);
    let mut cut = frame(1);
    cut.truncate(20);
    assert_eq!(good(&[cut, frame(2)].concat()), [2]);
    assert_eq!(good(&[vec![7; 10_000], frame(3)].concat()), [3]);
}

proptest! {
    #[test]
    fn round_trip(message in message()) {
        let frame = encoded(&message);
        prop_assert!(frame[1..frame.len() - 1].iter().all(|&b| b != 0));
        let heard = decoded(&frame);
        prop_assert_eq!(heard.len(), 1);
        prop_assert_eq!(heard[0].as_ref().unwrap(), &message);
        let bits = |m: &Message| format!("{m:?}"); // minus zero is kept as well
        prop_assert_eq!(bits(heard[0].as_ref().unwrap()), bits(&message));
    }

    /// Any bytes at all: no panic, and no message out of noise.
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..4000)) {
        prop_assert!(decoded(&bytes).iter().all(Result::is_err));
    }

    /// Any content under a right checksum: no panic, and what is accepted is encoded and read again.
    #[test]
    fn any_intact_frame(content in proptest::collection::vec(any::<u8>(), 0..600)) {
        let mut frame = [&[binary::FORMAT], content.as_slice()].concat();
        let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&frame);
        frame.extend(sum.to_le_bytes());
        let mut stuffed = vec![0; cobs::max_encoding_length(frame.len())];
        let used = cobs::encode(&frame, &mut stuffed);
        stuffed.truncate(used);
        stuffed.push(0);
        for heard in decoded(&stuffed).into_iter().flatten() {
            prop_assert_eq!(decoded(&encoded(&heard)), [Ok(heard)]);
        }
    }
}
