//! A board's end of the line against a host's, with a line that is slow, stuck, noisy or pulled.

mod wire_common;

use rowtone::link::Link;
use rowtone::link::settings::store::Nowhere;
use rowtone::wire::Format;
use rowtone::wire::{Arrival, Message, Sequence, binary, text};
use rowtone_chance::XorShiftStar;
use wire_common::console::link;
use wire_common::{harm, ordinary_report};

/// All that the board has to say, without waiting.
fn drain(link: &mut Link<'_>) -> Vec<u8> {
    let mut said = vec![];
    loop {
        let bytes = link.poll(0, &mut Nowhere).len();
        if bytes == 0 {
            return said;
        }
        // The line takes a few bytes at a time.
        let some = link.poll(0, &mut Nowhere)[..bytes.min(7)].to_vec();
        link.sent(some.len());
        said.extend(some);
    }
}

fn type_in(link: &mut Link<'_>, line: &str) {
    for byte in line.bytes() {
        link.receive(byte, 0, &mut Nowhere);
    }
}

/// A stuck line costs the oldest reports, they are counted, and the board says so.
#[test]
fn a_stuck_line_drops_the_oldest_and_counts() {
    let mut slots = [const { None }; 4];
    let mut link = link(&mut slots, Format::Text);
    for seq in 0..10 {
        link.push(ordinary_report(seq));
        link.poll(0, &mut Nowhere); // says 0, but nothing of it is taken
    }
    let said = String::from_utf8(drain(&mut link)).unwrap();
    let numbers: Vec<u32> = said
        .lines()
        .filter_map(|line| match text::decode_line(line) {
            Ok(Message::Report { report, .. }) => Some(report.seq),
            _ => None,
        })
        .collect();
    // 0 was being sent all the while.
    assert_eq!(numbers, [0, 6, 7, 8, 9]);
    assert_eq!(link.outbox().dropped(), 5);
    type_in(&mut link, "status\n");
    assert!(
        String::from_utf8(drain(&mut link))
            .unwrap()
            .contains(",10,6,5,0,D*")
    );
}

#[test]
fn the_wire_can_be_changed_and_changed_back() {
    let mut slots = [const { None }; 4];
    let mut link = link(&mut slots, Format::Text);
    type_in(&mut link, "set wire binary\nset wire modbus\nget\nget\n");
    assert!(
        drain(&mut link).is_empty(),
        "on Modbus nothing is said unasked"
    );
    let request = [1, 6, 0, 5, 0, 0];
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(&request);
    let frame = [&request[..], &crc.to_le_bytes()].concat();
    for (at, &byte) in frame.iter().enumerate() {
        link.receive(byte, 1_000_000 + 90 * at as u64, &mut Nowhere);
    }
    assert_eq!(link.poll(1_010_000, &mut Nowhere), frame);
    link.sent(frame.len());
    type_in(&mut link, "get wire\n");
    assert!(drain(&mut link).starts_with(b"$RTACK,wire=text*"));
}

/// On a line that harms one byte in 500, both ways, a host that asks again for what it missed gets
/// every report, and never a wrong one.
#[test]
fn a_host_that_asks_again_misses_none() {
    for wire in [Format::Text, Format::Binary] {
        let mut slots = [const { None }; 32];
        let mut link = link(&mut slots, wire);
        let mut dice = XorShiftStar(2026);
        let mut text = text::Decoder::<{ text::MAX_LINE }>::new();
        let mut binary = binary::Decoder::<{ binary::MAX_FRAME }>::new();
        let mut sequence = Sequence::default();
        let mut missing = vec![];
        let mut heard = vec![];
        let mut faults = 0;
        for seq in 0..400 {
            link.push(ordinary_report(seq));
            // Two rounds of asking for every report that comes.
            for _ in 0..2 {
                let mut received = vec![];
                faults += u32::from(harm(&mut dice, &drain(&mut link), 2e-3, &mut received));
                for byte in received {
                    let message = match wire {
                        Format::Text => text.push(byte).and_then(Result::ok),
                        _ => binary.push(byte).and_then(Result::ok),
                    };
                    let Some(Message::Report { session, report }) = message else {
                        continue;
                    };
                    let mut sent = ordinary_report(report.seq);
                    if wire == Format::Text {
                        sent.noise_px = report.noise_px; // the rest is exact as well
                        sent.peaks = report.peaks.clone();
                    }
                    assert_eq!(sent, report);
                    match sequence.arrive(session, report.seq) {
                        Arrival::First => missing.extend(0..report.seq),
                        Arrival::Missed { from, to } => missing.extend(from..to),
                        _ => {}
                    }
                    missing.retain(|&seq| seq != report.seq);
                    if !heard.contains(&report.seq) {
                        heard.push(report.seq);
                    }
                }
                if let Some(&seq) = missing.first() {
                    let mut command = String::new();
                    text::encode_command(&format!("resend {seq}"), &mut command).unwrap();
                    let mut received = vec![];
                    harm(&mut dice, command.as_bytes(), 2e-3, &mut received);
                    for byte in received {
                        link.receive(byte, 0, &mut Nowhere);
                    }
                }
            }
        }
        heard.sort_unstable();
        let newest = sequence.newest().unwrap().1;
        assert!(newest >= 390 && faults > 20, "{wire:?}: {newest} {faults}");
        assert_eq!(heard, (0..=newest).collect::<Vec<_>>(), "{wire:?}");
    }
}

/// A line that echoes: what the board says comes back to it, and is not answered.
#[test]
fn its_own_sentences_are_no_commands() {
    let mut slots = [const { None }; 4];
    let mut link = link(&mut slots, Format::Text);
    link.announce(0);
    link.push(ordinary_report(0));
    type_in(&mut link, "get hop\nnonsense\n");
    let mut said = drain(&mut link);
    assert_eq!(
        said.iter().filter(|&&byte| byte == b'$').count(),
        3,
        "a third answer has no place"
    );
    for _ in 0..3 {
        for &byte in &said {
            link.receive(byte, 0, &mut Nowhere);
        }
        said = drain(&mut link);
        assert!(said.is_empty(), "{}", String::from_utf8_lossy(&said));
    }
}
