//! `link`: a board's whole end of the line under any bytes, reports and pauses, on any wire.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::report::Report;
use rowtone::link::settings::store::{Nowhere, Started};
use rowtone::link::settings::{Board, Console, Limits, Settings};
use rowtone::wire::Format;
use rowtone::wire::{Message, SettingsOrigin, binary, text};

const LIMITS: Limits = Limits { width: 320, height: 240, min_width: 16, max_window_s: 10.0 };

fn report() -> Report {
    Report {
        time_ms: 1000,
        window_s: 1.0,
        fps: 60.0,
        lines: 18_000,
        noise_px: 0.01,
        ..Report::EMPTY
    }
}

// A byte of 0xf0 and above does something; all others go to the board as they are.
fuzz_target!(|data: &[u8]| {
    let Some((&first, data)) = data.split_first() else { return };
    let wire = [Format::Text, Format::Binary, Format::Modbus][usize::from(first) % 3];
    let board = Board { version: [0; 3], limits: LIMITS, defaults: Settings { wire, ..Settings::default() } };
    let started = Started { session: 1, settings: None, origin: SettingsOrigin::Defaults };
    let console = Console::new(board, started).expect("the defaults are valid");
    let mut slots = [const { None }; 3];
    let mut link = Link::new(console, Outbox::new(&mut slots), 115_200);
    let (mut now_us, mut said, mut pushed) = (0, vec![], 0);
    for &byte in data {
        now_us += 87;
        match byte {
            0xf0 => now_us += 10_000,
            0xf1 => {
                link.push(report());
                pushed += 1;
            }
            0xf2 => link.announce(now_us),
            0xf3..=0xff => {
                // The line takes some of it.
                let bytes = link.poll(now_us, &mut Nowhere);
                let some = bytes.len().min(1 << (byte - 0xf3));
                said.extend_from_slice(&bytes[..some]);
                link.sent(some);
            }
            byte => link.receive(byte, now_us, &mut Nowhere),
        }
    }
    loop {
        let bytes = link.poll(now_us, &mut Nowhere);
        if bytes.is_empty() {
            break;
        }
        let len = bytes.len();
        said.extend_from_slice(bytes);
        link.sent(len);
    }
    assert!(link.console().settings().check(&LIMITS).is_ok());
    assert_eq!(link.outbox().next_seq(), pushed);

    // Where it spoke one wire all the while, a host understands every word, and every report was sent or counted.
    let was = |wanted: Format| wire == wanted && link.console().settings().wire == wanted;
    let switched = data.windows(4).any(|w| w == b"wire");
    let mut numbers = std::collections::BTreeSet::new();
    let mut take = |message| {
        if let Message::Report { report, .. } = message {
            numbers.insert(report.seq);
        }
    };
    if was(Format::Text) && !switched {
        let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
        said.iter().filter_map(|&byte| decoder.push(byte)).for_each(|heard| take(heard.expect("a whole sentence")));
    } else if was(Format::Binary) && !switched {
        let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
        said.iter().filter_map(|&byte| decoder.push(byte)).for_each(|heard| take(heard.expect("a whole frame")));
    } else {
        return;
    }
    assert_eq!(numbers.len() as u32 + link.outbox().dropped(), pushed);
});
