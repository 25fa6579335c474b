//! The program on its simulated camera, heard over the wires that are no text: COBS frames, and Modbus asked by another
//! project's client (rmodbus).

mod common;

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use common::{PATIENCE, start, terminate};
use rmodbus::{ModbusProto, client::ModbusRequest};
use rowtone::report::Report;
use rowtone::wire::modbus::decode_report;
use rowtone::wire::{Message, binary};
use serialport::TTYPort;

/// The simulated machine's two tones.
fn is_right(report: &Report) -> bool {
    let near = |hz: f32, px: f32| {
        let close = |p: &rowtone::report::Peak| {
            (p.hz - hz).abs() < 0.5 && (p.amplitude_px / px - 1.0).abs() < 0.05
        };
        report.peaks.iter().any(close)
    };
    report.peaks.len() == 2 && near(97.3, 0.4) && near(211.7, 0.1)
}

const MEASURE: &str = "[measure]\nwindow_s = 0.5\nhop_s = 0.5\n[output]\n";

#[test]
fn binary_frames_carry_the_reports() {
    let (mut program, mut ours, _theirs) = start("binary", &format!("{MEASURE}wire = \"binary\""));
    let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
    let mut reports = Vec::new();
    let mut bytes = [0; 512];
    let began = Instant::now();
    while reports.len() < 3 {
        assert!(began.elapsed() < PATIENCE, "so far {reports:?}");
        let count = ours.read(&mut bytes).unwrap_or(0);
        let messages = bytes[..count].iter().filter_map(|&b| decoder.push(b));
        reports.extend(messages.filter_map(
            |message| match message.expect("every frame is intact") {
                Message::Report { report, .. } => Some(report),
                _ => None,
            },
        ));
    }
    assert!(reports.iter().all(is_right), "{reports:?}");
    assert!(reports.windows(2).all(|two| two[1].seq == two[0].seq + 1));
    terminate(&program);
    assert_eq!(program.0.wait().unwrap().code(), Some(0));
}

/// Input registers from `at` on; `None` where no sound answer comes within 2 s.
fn ask(port: &mut TTYPort, at: u16, count: u16) -> Option<Vec<u16>> {
    let mut client = ModbusRequest::new(9, ModbusProto::Rtu);
    let mut request = Vec::new();
    client.generate_get_inputs(at, count, &mut request).ok()?;
    port.write_all(&request).ok()?;
    let (began, mut answer, mut bytes) = (Instant::now(), Vec::new(), [0; 512]);
    let length = 5 + 2 * usize::from(count);
    while answer.len() < length && began.elapsed() < Duration::from_secs(2) {
        let came = port.read(&mut bytes).unwrap_or(0);
        answer.extend_from_slice(&bytes[..came]);
    }
    let mut values = Vec::new();
    client.parse_u16(&answer, &mut values).ok()?;
    Some(values)
}

#[test]
fn modbus_registers_show_the_newest_report() {
    let (mut program, mut ours, _theirs) =
        start("modbus", &format!("{MEASURE}wire = \"modbus\"\nunit = 9"));
    let began = Instant::now();
    let mut read = || {
        while began.elapsed() < PATIENCE {
            // The report, and the peaks, of which a frame holds six.
            let head = ask(&mut ours, 0, 38);
            let first = ask(&mut ours, 100, 120);
            let second = ask(&mut ours, 220, 40);
            let (Some(head), Some(first), Some(second)) = (head, first, second) else {
                continue;
            };
            let register = |at: u16| {
                let peak = usize::from(at).checked_sub(100);
                peak.map_or_else(
                    || head.get(usize::from(at)).copied(),
                    |at| first.iter().chain(&second).nth(at).copied(),
                )
            };
            if let Some(report) = decode_report(register) {
                return report;
            }
        }
        panic!("no report within {PATIENCE:?}");
    };
    let first = read();
    assert!(is_right(&first), "{first:?}");
    let mut next = read();
    while next.seq == first.seq {
        next = read();
    }
    assert!(is_right(&next) && next.seq > first.seq, "{next:?}");
    terminate(&program);
    assert_eq!(program.0.wait().unwrap().code(), Some(0));
}
