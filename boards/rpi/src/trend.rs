//! What the machine did over the last hour, month and years, kept on the disk.

use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{SystemTime, UNIX_EPOCH};

use rowtone::report::Report;
use rowtone_trend::{Folder, Trend};

use crate::journal::log;

/// Reports that may wait for the disk.
const QUEUE: usize = 64;

/// The way to the thread that writes: nobody who measures waits for a disk.
#[derive(Clone, Debug)]
pub struct Keeper(SyncSender<(Report, u64)>);

impl Keeper {
    /// Starts the thread; `None` where the folder cannot be used, which is logged.
    pub fn start(dir: &Path) -> Option<Self> {
        let failed = |why: &dyn std::fmt::Display| {
            log(&format!(
                "service.trend: {}: {why}; no trend is kept",
                dir.display()
            ));
        };
        let trend = Trend::open(dir).inspect_err(|e| failed(e)).ok()?;
        let (to, reports) = sync_channel(QUEUE);
        let named = dir.to_owned();
        let thread = std::thread::Builder::new().name("trend".to_owned());
        let spawned = thread.spawn(move || write(trend, &reports, &named));
        spawned.inspect_err(|e| failed(e)).ok()?;
        Some(Self(to))
    }

    /// Keeps a report; one that finds no room, because the disk is stuck, is not kept.
    pub fn push(&self, report: &Report) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let unix_ms = now.map_or(0, |t| t.as_millis() as u64);
        let _ = self.0.try_send((report.clone(), unix_ms));
    }
}

fn write(mut trend: Trend<Folder>, reports: &Receiver<(Report, u64)>, dir: &Path) {
    let mut told = false;
    for (report, unix_ms) in reports {
        match trend.push(&report, unix_ms) {
            Ok(()) => told = false,
            Err(e) if !told => {
                told = true;
                log(&format!("{}: the trend has gaps: {e}", dir.display()));
            }
            Err(_) => {}
        }
    }
}
