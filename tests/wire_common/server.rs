//! A Modbus server's end of a line, and another project's client (rmodbus) to ask it.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program uses its part of this"
)]

use rmodbus::{ModbusProto, client::ModbusRequest};
use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::Settings;
use rowtone::link::settings::store::Nowhere;
use rowtone::report::Report;
use rowtone::wire::Format;
use rowtone::wire::SettingsOrigin;

use crate::wire_common::console::console;

/// The server's address.
pub const UNIT: u8 = 9;

/// Long enough a silence at any speed used here, µs.
pub const SILENCE_US: u64 = 10_000;

/// A board's end of a line, and the time.
pub struct Server<'a> {
    pub link: Link<'a>,
    pub now_us: u64,
    pub byte_us: u64,
}

impl<'a> Server<'a> {
    pub fn new(slots: &'a mut [Option<Report>], baud: u32) -> Self {
        let defaults = Settings {
            unit: UNIT,
            wire: Format::Modbus,
            ..Settings::default()
        };
        let console = console(7, defaults, SettingsOrigin::Defaults);
        Self {
            link: Link::new(console, Outbox::new(slots), baud),
            now_us: 0,
            byte_us: 11_000_000 / u64::from(baud),
        }
    }

    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.now_us += self.byte_us;
            self.link.receive(byte, self.now_us, &mut Nowhere);
        }
    }

    /// What the board says after a pause.
    pub fn after(&mut self, pause_us: u64) -> Vec<u8> {
        self.now_us += pause_us;
        let said = self.link.poll(self.now_us, &mut Nowhere).to_vec();
        self.link.sent(said.len());
        said
    }

    pub fn ask(&mut self, request: &[u8]) -> Vec<u8> {
        self.hear(request);
        self.after(SILENCE_US)
    }

    pub fn settings(&self) -> Settings {
        *self.link.console().settings()
    }
}

pub fn client() -> ModbusRequest {
    ModbusRequest::new(UNIT, ModbusProto::Rtu)
}

/// A request of the client, and the client that takes its answer.
pub fn request(of: impl FnOnce(&mut ModbusRequest, &mut Vec<u8>)) -> (ModbusRequest, Vec<u8>) {
    let (mut client, mut frame) = (client(), vec![]);
    of(&mut client, &mut frame);
    (client, frame)
}

pub fn read_inputs(at: u16, count: u16) -> (ModbusRequest, Vec<u8>) {
    request(|client, frame| client.generate_get_inputs(at, count, frame).unwrap())
}

pub fn read_holdings() -> (ModbusRequest, Vec<u8>) {
    request(|client, frame| client.generate_get_holdings(0, 20, frame).unwrap())
}

/// The registers in an answer, if the client accepts it and they are as many as were asked for.
pub fn registers(client: &ModbusRequest, answer: &[u8], count: u16) -> Option<Vec<u16>> {
    let mut values = vec![];
    client.parse_u16(answer, &mut values).ok()?;
    (values.len() == usize::from(count)).then_some(values)
}
