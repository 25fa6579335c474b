//! Modbus on its line: silences, other units, and what a client reads in several frames.

#[path = "wire_common/server.rs"]
mod server;
mod wire_common;

use rmodbus::{ModbusProto, client::ModbusRequest};
use rowtone::wire::modbus::decode_report;
use server::{SILENCE_US, Server, UNIT, read_inputs, registers};
use wire_common::ordinary_report;

/// A frame ends with 3.5 characters of silence, and only there.
#[test]
fn silences_part_frames() {
    for (baud, short_us, long_us) in [(115_200, 1_000, 1_800), (9600, 3_000, 4_100)] {
        let mut slots = [const { None }; 4];
        let mut server = Server::new(&mut slots, baud);
        let (client, frame) = read_inputs(0, 4);
        let right = |answer: &[u8]| registers(&client, answer, 4) == Some(vec![1, 1, 2, 3]);

        server.hear(&frame);
        assert!(
            server.after(short_us).is_empty(),
            "{baud}: it may go on yet"
        );
        assert!(right(&server.after(long_us - short_us)));

        // A pause within a frame.
        for (pause_us, answered) in [(short_us, true), (long_us, false)] {
            server.hear(&frame[..3]);
            assert!(server.after(pause_us).is_empty());
            server.hear(&frame[3..]);
            assert_eq!(right(&server.after(SILENCE_US)), answered, "{baud}");
        }

        // Garbage when the cable is plugged in: alone, and with a request right behind it.
        server.hear(&[0, 0xff, 0x55]);
        assert!(server.after(long_us).is_empty());
        assert!(right(&server.ask(&frame)));
        server.hear(&[0xff; 7]);
        assert!(server.ask(&frame).is_empty());
        assert!(right(&server.ask(&frame)));

        // More than a frame holds, and a request cut short by the pulled cable.
        assert!(server.ask(&[UNIT; 300]).is_empty());
        assert!(right(&server.ask(&frame)));
        assert!(server.ask(&frame[..5]).is_empty());
        assert!(right(&server.ask(&frame)));

        // Two requests of which the board heard the first too late to answer.
        server.hear(&frame);
        server.now_us += SILENCE_US;
        assert!(right(&server.ask(&frame)));
        assert!(server.after(SILENCE_US).is_empty());
    }
}

/// Other units on the same two wires, and their answers.
#[test]
fn others_on_the_bus_do_not_matter() {
    let mut slots = [const { None }; 4];
    let mut server = Server::new(&mut slots, 19_200);
    let (client, frame) = read_inputs(0, 4);
    let mut other = ModbusRequest::new(UNIT + 1, ModbusProto::Rtu);
    let mut to_other = vec![];
    other.generate_get_inputs(0, 4, &mut to_other).unwrap();
    let mut answer = vec![UNIT + 1, 4, 8, 0, 1, 0, 2, 0, 3, 0, 4];
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(&answer);
    answer.extend(crc.to_le_bytes());
    for _ in 0..3 {
        assert!(server.ask(&to_other).is_empty());
        assert!(server.ask(&answer).is_empty());
        assert!(registers(&client, &server.ask(&frame), 4).is_some());
    }
}

/// Reports that a PLC never reads are not dropped reports: the newest is what it wants.
#[test]
fn nothing_counts_as_dropped() {
    let mut slots = [const { None }; 4];
    let mut server = Server::new(&mut slots, 115_200);
    (0..10).for_each(|seq| server.link.push(ordinary_report(seq)));
    let (client, frame) = read_inputs(10, 8);
    let heard = registers(&client, &server.ask(&frame), 8).unwrap();
    // Next number 10, dropped 0, refused 0, newest 9.
    assert_eq!(heard, [0, 10, 0, 0, 0, 0, 0, 9]);
}

/// The report's own checksum tells a fault that a frame's CRC-16 would miss, and registers of two reports.
#[test]
fn a_report_is_whole_or_none() {
    let map = |seq: u32| -> Vec<Option<u16>> {
        let mut slots = [const { None }; 4];
        let mut server = Server::new(&mut slots, 115_200);
        (0..=seq).for_each(|seq| server.link.push(ordinary_report(seq)));
        let mut map = vec![None; 420];
        for (at, count) in [(0, 38), (100, 80)] {
            let (client, frame) = read_inputs(at, count);
            let values = registers(&client, &server.ask(&frame), count).unwrap();
            for (slot, value) in map[usize::from(at)..].iter_mut().zip(values) {
                *slot = Some(value);
            }
        }
        map
    };
    let decode = |map: &[Option<u16>]| decode_report(|at| *map.get(usize::from(at))?);
    let map = map(3);
    assert_eq!(decode(&map), Some(ordinary_report(3)));
    for at in (4..6).chain([8]).chain(16..38).chain(100..160) {
        for bit in 0..16 {
            let mut harmed = map.clone();
            harmed[at] = harmed[at].map(|value| value ^ 1 << bit);
            // The third flag of a peak says that it is there; without it there are fewer peaks.
            assert_eq!(decode(&harmed), None, "register {at}, bit {bit}");
        }
    }
}

/// A bus on which the board hears itself: each of its responses comes back once, and is no request.
#[test]
fn a_bus_that_echoes() {
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS);
    let framed = |request: &[u8]| [request, &crc.checksum(request).to_le_bytes()].concat();
    let requests = [
        framed(&[UNIT, 6, 0, 4, 0, 5]), // answered by itself
        framed(&[UNIT, 6, 0, 7, 0, 1]), // save, which is refused here
        framed(&[UNIT, 16, 0, 4, 0, 1, 2, 0, 6]),
        framed(&[UNIT, 3, 0, 0, 0, 4]),
        framed(&[UNIT, 4, 0, 0, 0, 1]),
        framed(&[UNIT, 7]),
    ];
    for (request, late_us) in requests.iter().flat_map(|r| [(r, 0), (r, 15_000)]) {
        let mut slots = [const { None }; 4];
        let mut server = Server::new(&mut slots, 115_200);
        let response = server.ask(request);
        assert!(!response.is_empty());
        server.now_us += late_us;
        server.hear(&response);
        for _ in 0..5 {
            let again = server.after(SILENCE_US);
            assert!(again.is_empty(), "{request:?}: {again:?}");
        }
        // The client says the same once more, and is answered.
        server.now_us += 100_000;
        assert_eq!(server.ask(request), response);
        server.now_us += 100_000;
        assert_eq!(server.ask(request), response);
    }
}
