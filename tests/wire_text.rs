//! `wire::text` against random messages, and against a line that harms them.

mod wire_common;

use proptest::prelude::*;
use rowtone::wire::{EncodeError, Message, text};
use wire_common::{message, ordinary_report};

type Decoder = text::Decoder<{ text::MAX_LINE }>;

fn encoded(message: &Message) -> Vec<u8> {
    let mut buffer = [0; text::MAX_LINE];
    text::encode_to_slice(message, &mut buffer)
        .unwrap()
        .to_vec()
}

fn decoded(bytes: &[u8]) -> Vec<Result<Message, text::DecodeError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|&b| decoder.push(b)).collect()
}

/// The line that docs/wire.md shows.
#[test]
fn the_documented_line() {
    let mut report = ordinary_report(12);
    report.peaks.truncate(1);
    report.um_per_px = None;
    report.velocity_mm_s_rms = None;
    let line = encoded(&Message::Report { session: 3, report });
    let line = String::from_utf8(line).unwrap();
    let doc = include_str!("../docs/wire.md");
    assert!(
        doc.contains(line.trim_end()),
        "docs/wire.md does not show {line}"
    );
    let module = include_str!("../src/wire/text/mod.rs");
    assert!(
        module.contains(line.trim_end()),
        "wire::text does not show {line}"
    );
}

#[test]
fn values_that_cannot_be_said_are_refused_whole() {
    let mut report = ordinary_report(0);
    report.peaks[1].hz = f32::NAN;
    let mut buffer = [0; text::MAX_LINE];
    let error = text::encode_to_slice(&Message::Report { session: 0, report }, &mut buffer);
    assert!(matches!(error, Err(EncodeError::Value { field: "hz", .. })));
    assert_eq!(buffer[0], 0);

    let report = ordinary_report(0);
    let mut small = [0; 40];
    let error = text::encode_to_slice(&Message::Report { session: 0, report }, &mut small);
    assert_eq!(error, Err(EncodeError::Full));
}

/// A lost line end costs nothing; a stray `$`, garbage before and a cut cost only what they hit.
#[test]
fn finds_the_next_sentence() {
    let report = |seq| Message::Report {
        session: 1,
        report: ordinary_report(seq),
    };
    let line = |seq| encoded(&report(seq));
    let good = |bytes: &[u8]| -> Vec<u32> {
        decoded(bytes)
            .into_iter()
            .filter_map(|heard| match heard {
                Ok(Message::Report { report, .. }) => Some(report.seq),
                _ => None,
            })
            .collect()
    };

    let mut no_line_end = line(1);
    no_line_end.truncate(no_line_end.len() - 2);
    assert_eq!(good(&[no_line_end, line(2)].concat()), [1, 2]);

    let mut cut = line(1);
    cut.truncate(50);
    assert_eq!(good(&[cut, line(2)].concat()), [2]);

    let garbage = [0_u8, 0xff, b'$', b'*', 7, b'$'].repeat(1000);
    assert_eq!(good(&[garbage, line(3)].concat()), [3]);

    let endless = [b"$RTRPT,".to_vec(), vec![b'1'; 10_000], line(4)].concat();
    assert_eq!(good(&endless), [4]);
}

/// Found by fuzzing: a line that rowtone would not write, with more digits than an f32 has.
#[test]
fn more_digits_than_there_are_are_read_as_the_nearest() {
    let body = "RTRPT,1,0,1000,0.5000,60.0000,0,0,9999999.000900,0000,,,0";
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(body.as_bytes());
    let message = text::decode_line(&format!("${body}*{sum:08X}\r\n")).unwrap();
    let Message::Report { report, .. } = &message else {
        panic!("{message:?}");
    };
    assert_eq!(report.noise_px, 9_999_999.0);
    assert_eq!(decoded(&encoded(&message)), [Ok(message)]);
}

proptest! {
    /// What is decoded is within half a resolution, and is encoded to the same bytes again.
    #[test]
    fn round_trip(message in message()) {
        let line = encoded(&message);
        prop_assert!(line.len() <= text::MAX_LINE);
        prop_assert!(line.strip_suffix(b"\r\n").unwrap().iter().all(|b| matches!(b, b' '..=b'~')));
        let heard = decoded(&line);
        prop_assert_eq!(heard.len(), 1);
        let heard = heard.into_iter().next().unwrap();
        let heard = heard.unwrap();
        prop_assert_eq!(&encoded(&heard), &line);
        if let (Message::Report { report: sent, .. }, Message::Report { report: got, .. }) = (&message, &heard) {
            prop_assert_eq!(sent.seq, got.seq);
            prop_assert_eq!(sent.peaks.len(), got.peaks.len());
            for (sent, got) in sent.peaks.iter().zip(&got.peaks) {
                let step = f64::from(sent.hz.abs()) * f64::from(f32::EPSILON);
                let apart = (f64::from(sent.hz) - f64::from(got.hz)).abs();
                prop_assert!(apart <= 0.5e-4 + step, "{} {}", sent.hz, got.hz);
            }
        } else {
            prop_assert_eq!(message, heard);
        }
    }

    /// Any bytes at all: no panic, and no message out of noise.
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..4000)) {
        prop_assert!(decoded(&bytes).iter().all(Result::is_err));
    }

    /// Any fields under a right checksum: no panic, and what is accepted is encoded, and read as the same again.
    #[test]
    fn any_intact_sentence(body in "(RTRPT|RTSTA|RTACK|RTERR)(,(-?[0-9]{1,8}(\\.[0-9]{1,6})?|[0-9A-F]{4}|/|-|A|\\.)?){0,30}") {
        let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(body.as_bytes());
        let line = format!("${body}*{sum:08X}\r\n");
        if let Ok(message) = text::decode_line(&line) {
            prop_assert_eq!(decoded(&encoded(&message)), [Ok(message)]);
        }
    }
}
