//! The Modbus server, asked by another project's client (rmodbus) and by hand.

mod wire_common;

use proptest::prelude::*;
use rmodbus::{ModbusProto, client::ModbusRequest};
use rowtone::link::modbus::answer;
use rowtone::link::settings::store::{Keep, Nowhere, SaveError};
use rowtone::link::settings::{Console, Region, Settings};
use rowtone::report::Report;
use rowtone::wire::Format;
use rowtone::wire::modbus::{State, decode_report};
use rowtone::wire::{SettingsOrigin, Status};
use wire_common::ordinary_report;

const STATUS: Status = Status {
    version: [1, 2, 3],
    session: 0x0001_0002,
    uptime_ms: 70_000_000,
    next_seq: 13,
    oldest_seq: None,
    dropped_reports: 65_537,
    refused_commands: 4,
    settings: SettingsOrigin::Saved,
};

fn console() -> Console {
    let defaults = Settings {
        unit: 9,
        wire: Format::Modbus,
        ..Settings::default()
    };
    wire_common::console::console(1, defaults, SettingsOrigin::Saved)
}

/// Keeps the last settings saved.
struct Memory(Option<Settings>);

impl Keep for Memory {
    fn save(&mut self, _session: u32, settings: &Settings) -> Result<(), SaveError> {
        self.0 = Some(*settings);
        Ok(())
    }
}

fn ask_with(
    frame: &[u8],
    report: Option<&Report>,
    console: &mut Console,
    store: &mut impl Keep,
) -> Vec<u8> {
    let mut response = heapless::Vec::new();
    let state = State {
        status: &STATUS,
        report,
    };
    answer(frame, &state, console, store, &mut response);
    response.to_vec()
}

fn ask(frame: &[u8], console: &mut Console) -> Vec<u8> {
    ask_with(frame, Some(&ordinary_report(12)), console, &mut Nowhere)
}

fn with_crc(request: &[u8]) -> Vec<u8> {
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(request);
    [request, &crc.to_le_bytes()].concat()
}

fn client() -> ModbusRequest {
    ModbusRequest::new(9, ModbusProto::Rtu)
}

/// What the client reads from input registers, as it reads them.
fn read_inputs(at: u16, count: u16, report: Option<&Report>) -> Vec<u16> {
    let (mut client, mut frame, mut values) = (client(), Vec::new(), Vec::new());
    client.generate_get_inputs(at, count, &mut frame).unwrap();
    let response = ask_with(&frame, report, &mut console(), &mut Nowhere);
    client.parse_u16(&response, &mut values).unwrap();
    values
}

fn real(registers: &[u16]) -> f32 {
    f32::from_bits(u32::from(registers[0]) << 16 | u32::from(registers[1]))
}

#[test]
fn a_plc_reads_the_report() {
    let report = ordinary_report(12);
    let head = read_inputs(0, 36, Some(&report));
    assert_eq!(
        head[..16],
        [1, 1, 2, 3, 1, 2, 1, 4464, 7, 1, 0, 13, 1, 1, 0, 4]
    );
    assert_eq!(head[16..22], [0, 12, 0, 0, 0, 13_000]);
    assert_eq!((real(&head[22..]), real(&head[24..])), (1.0, 60.0));
    assert_eq!(head[26..30], [0, 18_000, 0, 0]);
    assert_eq!(
        (real(&head[30..]), real(&head[32..]), real(&head[34..])),
        (0.0131, 4.4512, 50.0)
    );

    let second = read_inputs(120, 20, Some(&report));
    assert_eq!((real(&second), real(&second[4..])), (98.4, 0.1012));
    assert_eq!(real(&second[10..]), 0.1012 * 50.0);
    let velocity = std::f32::consts::TAU * 98.4 * 0.1012 * 50.0 / 1000.0 / 2_f32.sqrt();
    assert!((real(&second[12..]) - velocity).abs() < 1e-5);
    assert_eq!(second[14..], [2, 0, 1, 0, 0, 0]);
    assert_eq!(read_inputs(160, 20, Some(&report)), [0; 20]);
    assert_eq!(read_inputs(16, 20, None), [0; 20]);
}

#[test]
fn a_plc_sets_the_board() {
    let (mut console, mut store, mut frame) = (console(), Memory(None), Vec::new());
    let mut values = vec![];
    for value in [2.0_f32, 0.5] {
        values.extend([(value.to_bits() >> 16) as u16, value.to_bits() as u16]);
    }
    values.extend([16, 2, 9, 1]); // max_peaks, wire, unit, save
    let mut client = client();
    client
        .generate_set_holdings_bulk(0, &values, &mut frame)
        .unwrap();
    let response = ask_with(&frame, None, &mut console, &mut store);
    client.parse_ok(&response).unwrap();
    let wanted = Settings {
        window_s: 2.0,
        hop_s: 0.5,
        max_peaks: 16,
        ..console.board().defaults
    };
    assert_eq!(*console.settings(), wanted);
    assert_eq!(store.0, Some(wanted));

    // One register at a time for those that are no 32-bit value.
    frame.clear();
    client.generate_set_holding(4, 3, &mut frame).unwrap();
    client.parse_ok(&ask(&frame, &mut console)).unwrap();
    assert_eq!(console.settings().max_peaks, 3);

    frame.clear();
    client
        .generate_set_holdings_bulk(16, &[10, 20, 100, 200], &mut frame)
        .unwrap();
    client.parse_ok(&ask(&frame, &mut console)).unwrap();
    assert_eq!(
        console.settings().roi,
        Some(Region {
            x: 10,
            y: 20,
            width: 100,
            height: 200
        })
    );

    let mut read = Vec::new();
    frame.clear();
    client.generate_get_holdings(0, 20, &mut frame).unwrap();
    client
        .parse_u16(&ask(&frame, &mut console), &mut read)
        .unwrap();
    assert_eq!(read[4..8], [3, 2, 9, 0]);
    assert_eq!(
        (
            real(&read),
            real(&read[2..]),
            real(&read[8..]),
            real(&read[10..])
        ),
        (2.0, 0.5, 1e-3, 0.0)
    );
    assert_eq!(read[16..], [10, 20, 100, 200]);

    frame.clear();
    client.generate_set_holding(7, 2, &mut frame).unwrap();
    client.parse_ok(&ask(&frame, &mut console)).unwrap();
    assert_eq!(*console.settings(), console.board().defaults);
}

/// Function, then why it is refused: 1 function, 2 address, 3 value, 4 failure.
#[test]
fn exceptions() {
    let one = 1.0_f32.to_bits();
    let [a, b, ..] = one.to_be_bytes();
    for (request, code) in [
        (vec![9, 1, 0, 0, 0, 1], 1),
        (vec![9, 5, 0, 0, 255, 0], 1),
        (vec![9, 0x2b], 1),
        (vec![9, 4, 0, 38, 0, 1], 2),
        (vec![9, 4, 1, 164, 0, 1], 2), // register 420
        (vec![9, 4, 0, 37, 0, 2], 2),
        (vec![9, 4, 255, 255, 0, 2], 2),
        (vec![9, 3, 0, 19, 0, 2], 2),
        (vec![9, 4, 0, 0, 0, 0], 3),
        (vec![9, 4, 0, 0, 0, 126], 3),
        (vec![9, 4, 0, 0], 3),
        (vec![9, 4, 0, 0, 0, 1, 0], 3),
        (vec![9, 6, 0, 20, 0, 1], 2),
        (vec![9, 6, 0, 0, a, b], 3),  // half of a real
        (vec![9, 6, 0, 4, 0, 17], 3), // too many peaks
        (vec![9, 6, 0, 5, 0, 3], 3),  // no such wire
        (vec![9, 6, 0, 6, 1, 9], 3),  // unit 265
        (vec![9, 6, 0, 7, 0, 9], 3),  // no such command
        (vec![9, 6, 0, 7, 0, 1], 4),  // nowhere to save
        (vec![9, 16, 0, 0, 0, 1, 2, a, b], 3),
        (vec![9, 16, 0, 1, 0, 2, 4, 0, 0, 0, 0], 3),
        (vec![9, 16, 0, 0, 0, 2, 4, 0, 0, 0, 0], 3), // a window of 0 s
        (vec![9, 16, 0, 0, 0, 2, 3, 0, 0, 0], 3),
        (vec![9, 16, 0, 0, 0, 2, 255, 0, 0, 0, 0], 3),
        (vec![9, 16, 0, 0, 0, 0, 0], 3),
        (vec![9, 16, 0, 19, 0, 2, 4, 0, 0, 0, 0], 2),
    ] {
        let mut console = console();
        let response = ask(&with_crc(&request), &mut console);
        assert_eq!(
            response,
            with_crc(&[9, request[1] | 0x80, code]),
            "{request:?}"
        );
        assert_eq!(*console.settings(), console.board().defaults);
    }
}

#[test]
fn no_answer_where_none_is_due() {
    let mut console = console();
    let mut wrong = with_crc(&[9, 4, 0, 0, 0, 1]);
    wrong[3] ^= 1;
    assert!(ask(&wrong, &mut console).is_empty());
    assert!(ask(&with_crc(&[8, 4, 0, 0, 0, 1]), &mut console).is_empty());
    assert!(ask(&with_crc(&[0, 4, 0, 0, 0, 1]), &mut console).is_empty());
    // What another server has refused, and all that can look like it.
    for function in 0x80..=0xff {
        assert!(ask(&with_crc(&[9, function, 1]), &mut console).is_empty());
    }
    for frame in [&[][..], &[9], &[9, 4], &[9, 4, 1]] {
        assert!(ask(frame, &mut console).is_empty());
    }
    // A broadcast write is carried out in silence.
    assert!(ask(&with_crc(&[0, 6, 0, 4, 0, 5]), &mut console).is_empty());
    assert_eq!(console.settings().max_peaks, 5);
}

/// Writes both registers of the lock.
fn lock(number: u32) -> Vec<u8> {
    let number = number.to_be_bytes();
    with_crc(&[&[9, 16, 0, 30, 0, 2, 4], &number[..]].concat())
}

#[test]
fn a_lock_keeps_writes_off() {
    let (mut console, mut store) = (console(), Memory(None));
    let mut ask = |frame: &[u8]| ask_with(frame, None, &mut console, &mut store);
    let refused = |code| with_crc(&[9, 0x90, code]);
    let is_locked = with_crc(&[9, 3, 0, 30, 0, 2]);
    assert_eq!(ask(&is_locked), with_crc(&[9, 3, 4, 0, 0, 0, 0]));
    assert_eq!(ask(&lock(70_000)), with_crc(&[9, 16, 0, 30, 0, 2]));
    assert_eq!(
        ask(&is_locked),
        with_crc(&[9, 3, 4, 0, 0, 0, 1]),
        "the number is not told"
    );
    // A write, a save, one to all, half of the lock, and one past it.
    assert_eq!(ask(&with_crc(&[9, 6, 0, 4, 0, 5])), with_crc(&[9, 0x86, 1]));
    assert_eq!(ask(&with_crc(&[9, 6, 0, 7, 0, 1])), with_crc(&[9, 0x86, 1]));
    assert!(ask(&with_crc(&[0, 6, 0, 4, 0, 5])).is_empty());
    assert_eq!(
        ask(&with_crc(&[9, 6, 0, 30, 0, 0])),
        with_crc(&[9, 0x86, 3])
    );
    assert_eq!(
        ask(&with_crc(&[9, 6, 0, 32, 0, 0])),
        with_crc(&[9, 0x86, 2])
    );
    assert_eq!(ask(&lock(70_001)), refused(3));
    // The time stands still here, so the right one comes too soon.
    assert_eq!(ask(&lock(70_000)), refused(3));
    assert_eq!(
        store.0.map(|kept| (kept.lock, kept.max_peaks)),
        Some((Some(70_000), 8))
    );
    assert_eq!(console.settings().max_peaks, 8);

    let (mut console, mut store) = (self::console(), Memory(None));
    let mut ask = |frame: &[u8]| ask_with(frame, None, &mut console, &mut store);
    ask(&lock(70_000));
    ask(&lock(70_000));
    assert_eq!(ask(&is_locked), with_crc(&[9, 3, 4, 0, 0, 0, 0]));
    assert_eq!(
        ask(&with_crc(&[9, 6, 0, 4, 0, 5])),
        with_crc(&[9, 6, 0, 4, 0, 5])
    );
    assert_eq!(store.0.map(|kept| kept.lock), Some(None));
}

proptest! {
    #[test]
    fn the_registers_hold_the_whole_report(report in wire_common::report()) {
        let state = State { status: &STATUS, report: Some(&report) };
        prop_assert_eq!(decode_report(|at| state.register(at)), Some(report.clone()));
    }

    /// Any frame with a right CRC: no panic, and the settings stay valid.
    #[test]
    fn any_frame(
        function in prop_oneof![Just(3_u8), Just(4), Just(6), Just(16), any::<u8>()],
        data in proptest::collection::vec(prop_oneof![0..20_u8, any::<u8>()], 0..300),
    ) {
        let mut console = console();
        let response = ask(&with_crc(&[&[9, function], data.as_slice()].concat()), &mut console);
        if function & 0x80 != 0 {
            prop_assert!(response.is_empty(), "a refusal is no request");
        } else {
            prop_assert!(response.len() >= 5 && response[0] == 9 && response[1] & 0x7f == function);
        }
        prop_assert!(console.settings().check(&console.board().limits).is_ok());
    }

    #[test]
    fn any_registers(registers in proptest::collection::vec(any::<u16>(), 420)) {
        let _ = decode_report(|at| registers.get(usize::from(at)).copied());
    }
}
