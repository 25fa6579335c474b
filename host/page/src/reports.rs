//! The reports so far, as JSON, and whoever waits for the next one.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use rowtone::report::Report;

/// Most bytes of JSON that are kept, and most reports.
const ROOM: usize = 8 << 20;
const MOST: usize = 4096;

/// A report, as it is given out.
#[derive(Debug)]
pub struct Entry {
    /// Counts the reports since the program began, from 1, also over a new start of the measurement.
    pub id: u64,
    /// The object of `rowtone analyze --format json`.
    pub json: String,
    /// What it says.
    pub report: Report,
    /// When it came.
    pub came: Instant,
    /// When it came, by the clock on the wall.
    pub wall: SystemTime,
}

/// See the [module](self).
#[derive(Debug, Default)]
pub struct Reports {
    inner: Mutex<Inner>,
    news: Condvar,
}

#[derive(Debug, Default)]
struct Inner {
    entries: VecDeque<Arc<Entry>>,
    bytes: usize,
    /// The id of the newest report there ever was.
    newest: u64,
    /// Counts how often the measurement began anew.
    epoch: u64,
    closed: bool,
}

/// What a listener learns.
#[derive(Debug)]
pub enum News {
    /// Reports that it has not had, the oldest first.
    Reports(Vec<Arc<Entry>>),
    /// The measurement has begun anew: what was before belongs to other settings.
    Restarted(u64),
    /// Nothing within the time.
    Nothing,
    /// There is to be no more.
    Closed,
}

impl Reports {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes in a report and its JSON. The lock is held only while lists change, by readers too.
    pub fn push(&self, report: &Report, json: String) {
        let mut inner = self.lock();
        inner.newest += 1;
        inner.bytes += json.len();
        let entry = Entry {
            id: inner.newest,
            json,
            report: report.clone(),
            came: Instant::now(),
            wall: SystemTime::now(),
        };
        inner.entries.push_back(Arc::new(entry));
        while inner.entries.len() > 1 && (inner.bytes > ROOM || inner.entries.len() > MOST) {
            let oldest = inner.entries.pop_front();
            inner.bytes -= oldest.map_or(0, |entry| entry.json.len());
        }
        drop(inner);
        self.news.notify_all();
    }

    /// Forgets all reports, because other settings hold from now on.
    pub fn restart(&self) {
        let mut inner = self.lock();
        inner.entries.clear();
        inner.bytes = 0;
        inner.epoch += 1;
        drop(inner);
        self.news.notify_all();
    }

    /// No more come: listeners are told.
    pub fn close(&self) {
        self.lock().closed = true;
        self.news.notify_all();
    }

    /// The newest report.
    pub fn last(&self) -> Option<Arc<Entry>> {
        self.lock().entries.back().cloned()
    }

    /// How often the measurement began anew, and the newest id.
    pub fn position(&self) -> (u64, u64) {
        let inner = self.lock();
        (inner.epoch, inner.newest)
    }

    /// The reports after the one with this id, at most the newest `most`.
    pub fn after(&self, id: u64, most: usize) -> Vec<Arc<Entry>> {
        let inner = self.lock();
        let first = inner.entries.partition_point(|entry| entry.id <= id);
        let first = first.max(inner.entries.len().saturating_sub(most));
        inner.entries.iter().skip(first).cloned().collect()
    }

    /// Waits for what a listener that knows this epoch and all up to this id has not had.
    pub fn wait(&self, epoch: u64, id: u64, most: usize, patience: Duration) -> News {
        let deadline = Instant::now() + patience;
        let mut inner = self.lock();
        loop {
            if inner.epoch != epoch {
                return News::Restarted(inner.epoch);
            }
            if inner.entries.back().is_some_and(|entry| entry.id > id) {
                break;
            }
            if inner.closed {
                return News::Closed;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return News::Nothing;
            }
            let waited = self.news.wait_timeout(inner, left);
            inner = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(inner);
        News::Reports(self.after(id, most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listeners_get_what_they_have_not_had() {
        let reports = Reports::default();
        let report = rowtone_report::example(None);
        let soon = Duration::from_millis(1);
        assert!(matches!(reports.wait(0, 0, 9, soon), News::Nothing));
        for k in 1..=5 {
            reports.push(&report, format!("{{\"k\":{k}}}"));
        }
        let ids = |entries: Vec<Arc<Entry>>| entries.iter().map(|e| e.id).collect::<Vec<_>>();
        match reports.wait(0, 2, 9, soon) {
            News::Reports(entries) => assert_eq!(ids(entries), [3, 4, 5]),
            other => panic!("{other:?}"),
        }
        assert_eq!(ids(reports.after(0, 2)), [4, 5]);
        reports.restart();
        assert!(matches!(reports.wait(0, 5, 9, soon), News::Restarted(1)));
        assert!(reports.last().is_none());
        reports.push(&report, "{}".to_owned());
        assert_eq!(reports.last().map(|entry| entry.id), Some(6));
        reports.close();
        assert!(matches!(reports.wait(1, 6, 9, soon), News::Closed));
    }

    #[test]
    fn memory_is_bounded_and_the_newest_stays() {
        let reports = Reports::default();
        let report = rowtone_report::example(None);
        for _ in 0..20 {
            reports.push(&report, "x".repeat(1 << 20));
        }
        assert_eq!(reports.after(0, usize::MAX).len(), 8);
        reports.push(&report, "x".repeat(20 << 20));
        assert_eq!(reports.after(0, usize::MAX).len(), 1);
    }
}
