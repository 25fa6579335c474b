//! `wire::modbus`: any request under a right CRC, and any registers as a report.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone::link::settings::store::{Nowhere, Started};
use rowtone::link::settings::{Board, Console, Limits, Settings};
use rowtone::wire::Format;
use rowtone::link::modbus::answer;
use rowtone::wire::modbus::{FrameReader, State, decode_report};
use rowtone::wire::{SettingsOrigin, Status};

const LIMITS: Limits = Limits { width: 320, height: 240, min_width: 16, max_window_s: 10.0 };

fuzz_target!(|data: &[u8]| {
    let registers: Vec<u16> = data.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
    decode_report(|at| registers.get(usize::from(at)).copied());

    let defaults = Settings { wire: Format::Modbus, ..Settings::default() };
    let board = Board { version: [0; 3], limits: LIMITS, defaults };
    let started = Started { session: 1, settings: None, origin: SettingsOrigin::Defaults };
    let mut console = Console::new(board, started).expect("the defaults are valid");
    let status = Status {
        version: [0; 3],
        session: 1,
        uptime_ms: 0,
        next_seq: 0,
        oldest_seq: None,
        dropped_reports: 0,
        refused_commands: 0,
        settings: SettingsOrigin::Defaults,
    };
    let request = [&[1], data].concat();
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(&request);
    let frame = [&request[..], &crc.to_le_bytes()].concat();
    let mut reader = FrameReader::new(115_200);
    for &byte in &frame {
        reader.push(byte, 0);
    }
    let Some(frame) = reader.frame(1_000_000) else { return };
    let mut response = heapless::Vec::new();
    let state = State { status: &status, report: None };
    answer(frame, &state, &mut console, &mut Nowhere, &mut response);
    assert_eq!(response.is_empty(), data.first().is_none_or(|function| function & 0x80 != 0));
    assert!(console.settings().check(&LIMITS).is_ok());
});
