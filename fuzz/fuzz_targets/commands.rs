//! `settings::command`: any bytes as command lines.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::command::LineReader;
use rowtone::link::settings::store::{Nowhere, Started};
use rowtone::link::settings::{Board, Console, Limits, Settings};
use rowtone::wire::{SettingsOrigin, text};

const LIMITS: Limits = Limits { width: 320, height: 240, min_width: 16, max_window_s: 10.0 };

fuzz_target!(|data: &[u8]| {
    let board = Board { version: [0; 3], limits: LIMITS, defaults: Settings::default() };
    let started = Started { session: 1, settings: None, origin: SettingsOrigin::Defaults };
    let mut console = Console::new(board, started).expect("the defaults are valid");
    let mut slots = [const { None }; 2];
    let mut outbox = Outbox::new(&mut slots);
    let mut reader = LineReader::new();
    for &byte in data.iter().chain(b"\n") {
        let said = match reader.push(byte) {
            None => continue,
            Some(Ok(line)) => console.carry_out(line, 0, &mut outbox, &mut Nowhere),
            Some(Err(error)) => console.refuse(&error),
        };
        let mut buffer = [0; text::MAX_LINE];
        text::encode_to_slice(&said, &mut buffer).expect("an answer can be sent");
        assert!(console.settings().check(&LIMITS).is_ok());
    }
});
