//! The Python decoder in docs/decoders reads what the core writes, and refuses what is harmed.
//!
//! Left out, and said so, where there is no `python3`.

mod wire_common;

use std::io::Write;
use std::process::{Command, Stdio};

use rowtone::wire::{Message, Reply, binary, text};
use wire_common::ordinary_report;

/// The lines that the decoder prints for these bytes, or `None` without Python.
fn python(bytes: &[u8]) -> Option<Vec<String>> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/decoders/rowtone_wire.py");
    let child = Command::new("python3")
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let Ok(mut child) = child else {
        eprintln!("left out: python3 is not there");
        return None;
    };
    child.stdin.take().unwrap().write_all(bytes).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let output = String::from_utf8(output.stdout).unwrap();
    Some(output.lines().map(str::to_owned).collect())
}

fn messages() -> Vec<Message> {
    let mut second = ordinary_report(300);
    second.peaks[1].harmonic = Some(2);
    second.peaks[2].ambiguous = true;
    second.warnings = 0x00A1.into();
    second.velocity_mm_s_rms = None;
    vec![
        Message::Report {
            session: 3,
            report: ordinary_report(299),
        },
        Message::Reply(Reply {
            ok: true,
            text: "saved".try_into().unwrap(),
        }),
        Message::Report {
            session: 3,
            report: second,
        },
    ]
}

fn check(printed: &[String]) {
    assert_eq!(printed.len(), 2, "{printed:?}");
    assert!(printed[0].contains(r#""session": 3, "seq": 299, "time_ms": 300000, "window_s": 1.0"#));
    for part in [
        r#""warnings": 161, "um_per_px": 50.0, "velocity_mm_s_rms": null"#,
        r#""ambiguous": false, "track": 2, "harmonic": 2"#,
        r#""ambiguous": true, "track": 3, "harmonic": null"#,
    ] {
        assert!(printed[1].contains(part), "{part} in {}", printed[1]);
    }
}

#[test]
fn text_is_read_by_python() {
    let mut bytes = b"garbage\r\n".to_vec();
    for message in messages() {
        let mut line = [0; text::MAX_LINE];
        bytes.extend(text::encode_to_slice(&message, &mut line).unwrap());
    }
    let Some(printed) = python(&bytes) else {
        return;
    };
    check(&printed);
    let digit = bytes.iter().position(|&b| b == b'6').unwrap();
    bytes[digit] = b'7';
    assert_eq!(python(&bytes).unwrap().len(), 1);
}

#[test]
fn binary_is_read_by_python() {
    let mut bytes = vec![];
    for message in messages() {
        let mut frame = [0; binary::MAX_FRAME];
        bytes.extend(binary::encode_to_slice(&message, &mut frame).unwrap());
    }
    let Some(printed) = python(&bytes) else {
        return;
    };
    check(&printed);
    bytes[20] ^= 4;
    assert_eq!(python(&bytes).unwrap().len(), 1);
}
