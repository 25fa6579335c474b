//! The board that tests talk to: 320x240 pixels, just started.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program uses its part of this"
)]

use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::store::Started;
use rowtone::link::settings::{Board, Console, Limits, Settings};
use rowtone::report::Report;
use rowtone::wire::Format;
use rowtone::wire::SettingsOrigin;

/// What the board can do.
pub const LIMITS: Limits = Limits {
    width: 320,
    height: 240,
    min_width: 16,
    max_window_s: 10.0,
};

/// Version 1.2.3, started as `session` with `defaults`, which are told to be of `origin`.
pub fn console(session: u32, defaults: Settings, origin: SettingsOrigin) -> Console {
    let board = Board {
        version: [1, 2, 3],
        limits: LIMITS,
        defaults,
    };
    let started = Started {
        session,
        settings: None,
        origin,
    };
    Console::new(board, started).expect("valid defaults")
}

/// The board's end of a line of 115 200 baud in session 1, its reports in `slots`.
pub fn link(slots: &mut [Option<Report>], wire: Format) -> Link<'_> {
    let defaults = Settings {
        wire,
        ..Settings::default()
    };
    let console = console(1, defaults, SettingsOrigin::Defaults);
    Link::new(console, Outbox::new(slots), 115_200)
}
