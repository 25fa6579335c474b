//! What a board can say.

use serde::{Deserialize, Serialize};

use crate::report::Report;

/// Longest text of a [`Reply`], bytes.
pub const REPLY_LEN: usize = 240;

/// Where the settings in use came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SettingsOrigin {
    /// The built-in defaults: nothing was ever saved, or it was cleared.
    Defaults,
    /// Read from the board's memory.
    Saved,
    /// The built-in defaults, because what was saved is torn, corrupt or not valid here.
    Corrupt,
    /// Changed over the line since the start and not saved.
    Changed,
    /// Read from the board's memory, but from before the last save: that one was cut short.
    Previous,
}

/// How the board itself is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Version of the firmware: major, minor, patch.
    pub version: [u16; 3],
    /// Time since the board started, ms; the clock of [`Report::time_ms`].
    pub uptime_ms: u64,
    /// Number of the session, see [`Message::Report`].
    pub session: u32,
    /// Number that the next report will have.
    pub next_seq: u32,
    /// Number of the oldest report that can still be sent again.
    pub oldest_seq: Option<u32>,
    /// Reports dropped before they were sent, because the line was too slow or stuck.
    pub dropped_reports: u32,
    /// Command lines refused since the start.
    pub refused_commands: u32,
    /// Where the settings in use came from.
    pub settings: SettingsOrigin,
}

/// The answer to one command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reply {
    /// Whether the command was carried out.
    pub ok: bool,
    /// What was done, or why it was not. Printable ASCII without `$` and `*`.
    pub text: heapless::String<REPLY_LEN>,
}

/// One thing said over the line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to box a report on, and one message lives at a time"
)]
pub enum Message {
    /// A window of time.
    Report {
        /// Number of the session, so that report 0 after a restart is not taken for the one
        /// before: on a board how often it has started, this time included; on a host any
        /// number that differs from run to run.
        session: u32,
        /// What was measured.
        report: Report,
    },
    /// How the board is doing.
    Status(Status),
    /// The answer to a command.
    Reply(Reply),
}
