//! Many boards on serial lines, one MQTT broker.
//!
//! Each line has a thread (`lines`) that hears its reports and asks for those that are missing.
//! Every report goes to disk (`spool`) before it is sent, and leaves it when the broker has
//! acknowledged it (QoS 1) and can be believed (`delivery`), so neither a broker nor a gateway that
//! is killed loses any. One loop (`hub`) owns the spool and the connection (`mqtt`) and takes all
//! that happens as `Input`s; `speech` knows topics and payloads, `broker` when to try again, `watch`
//! which boards speak.
//! `docs/gateway.md` is for whoever sets it up.

mod alarms;
mod broker;
mod config;
mod delivery;
mod discovery;
mod error;
mod files;
mod hub;
mod lines;
mod log;
pub mod mqtt;
mod payload;
mod sparkplug;
mod speech;
pub mod spool;
mod watch;

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use broker::Address;
pub use config::{Board, Broker, Config, Payload};
pub use error::GatewayError;
pub use files::{check, open_secret};
use hub::Hub;
use mqtt::connection::Note;
use rowtone_serial::receiver::Counters;
use spool::Spool;
use spool::record::Entry;

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Reports heard.
    pub heard: u64,
    /// Reports that the broker has acknowledged.
    pub acknowledged: u64,
    /// Reports that boards sent, or should have, and that were never heard.
    pub lost: u64,
    /// Damaged sentences and frames.
    pub bad: u64,
    /// Reports that are lost to the spool: dropped for want of room, harmed on disk, or set aside.
    pub dropped: u64,
    /// Bytes in the spool that wait for the broker.
    pub waiting: u64,
}

/// Something happened.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "reports are what comes; the rest is rare"
)]
enum Input {
    /// A report of a board.
    Report(Entry),
    /// A line came or went: index of the board, and why it went.
    Line(usize, Option<String>),
    /// What a line has counted, by index of the board, and up to which session and number none of its
    /// reports is missing.
    Counted(usize, Counters, Option<(u32, u32)>),
    /// On the connection of this number.
    Broker(u64, Note),
}

/// Runs the gateway, for so long, until `stop`, or until it is killed. No error of the disk or of the
/// broker ends it.
///
/// # Errors
/// [`GatewayError`] when a file of the configuration or the spool cannot be used at the start.
pub fn run(
    config: &Config,
    limit: Option<Duration>,
    stop: &AtomicBool,
) -> Result<Totals, GatewayError> {
    let address = Address::new(&config.broker)?;
    files::twins(config)?;
    let dir = &config.spool.dir;
    let max_bytes = u64::from(config.spool.max_mb) << 20;
    let boards = config.boards.iter().map(|board| board.name.as_str());
    let spool = Spool::open(dir.clone(), max_bytes, boards).map_err(|why| GatewayError::Spool {
        dir: dir.clone(),
        why,
    })?;
    let (to, inputs) = channel();
    for (index, board) in config.boards.iter().enumerate() {
        let complete = spool.complete_of(&board.name);
        lines::listen(index, board, complete, to.clone()).map_err(|why| GatewayError::Thread {
            board: board.name.clone(),
            why,
        })?;
    }
    let mut hub = Hub::new(config, address, spool, to);
    hub.follow(&inputs, limit.map(|limit| Instant::now() + limit), stop);
    Ok(hub.totals())
}

fn unix_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
    })
}
