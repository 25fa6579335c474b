//! Windows in which nothing was measured have a report as well: a lamp is off, a camera delivers one frame for ever,
//! a new scene is being learned. Whoever watches must not mistake silence for health.

use super::warn::WindowTally;
use crate::report::Report;
use crate::timeline::Tally;

/// Decides when a report is due though no sample came, says what became of the rows, and numbers all reports.
#[derive(Clone, Copy, Debug)]
pub struct Silence {
    window_ns: i64,
    hop_ns: i64,
    /// Start of the first frame, and of the last one that had samples, ns.
    origin_ns: Option<i64>,
    heard_ns: i64,
    /// When the next report of nothing is due, ns.
    due_ns: i64,
    /// What became of the rows since a frame had samples.
    tally: WindowTally,
    /// Reports so far.
    reports: u32,
}

impl Silence {
    /// For windows of this length, one every `hop_ns`.
    pub fn new(window_ns: i64, hop_ns: i64) -> Self {
        Self {
            window_ns,
            hop_ns,
            origin_ns: None,
            heard_ns: 0,
            due_ns: 0,
            tally: WindowTally::default(),
            reports: 0,
        }
    }

    /// A frame has begun, which had no samples where it is `silent`; `tally` says what became of its rows. Gives the report of
    /// nothing where one is due: after a window without samples, and then every hop.
    pub fn note_frame(
        &mut self,
        start_ns: i64,
        silent: bool,
        fps: f32,
        tally: &Tally,
    ) -> Option<Report> {
        let origin_ns = *self.origin_ns.get_or_insert_with(|| {
            self.heard_ns = start_ns;
            self.due_ns = start_ns.saturating_add(self.window_ns);
            start_ns
        });
        if !silent {
            self.tally = WindowTally::default();
            self.heard_ns = start_ns;
            self.due_ns = self.due_ns.max(start_ns.saturating_add(self.window_ns));
            return None;
        }
        self.tally.add(tally);
        if start_ns < self.due_ns || start_ns.saturating_sub(self.heard_ns) < self.window_ns {
            return None;
        }
        self.due_ns = start_ns.saturating_add(self.hop_ns);
        Some(Report {
            time_ms: (start_ns.saturating_sub(origin_ns) / 1_000_000) as u64,
            window_s: self.window_ns as f32 * 1e-9,
            fps,
            warnings: self.tally.warnings(1),
            ..Report::EMPTY
        })
    }

    /// Numbers a report: those of nothing count too.
    pub fn number(&mut self, report: &mut Report) {
        report.seq = self.reports;
        self.reports = self.reports.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::report::{Warning, Warnings};
    use std::vec::Vec;

    #[test]
    fn a_second_of_nothing_is_reported_and_every_hop_after_it() {
        let mut silence = Silence::new(1_000_000_000, 500_000_000);
        let mut times = Vec::new();
        let tally = Tally {
            frames: 1,
            rows: 100,
            unlit: 90,
            ..Tally::NONE
        };
        for frame in 0..240_i64 {
            // Half a second of samples, one frame of them at 2 s.
            let silent = frame >= 30 && frame != 120;
            if let Some(report) = silence.note_frame(frame * 16_666_667, silent, 60.0, &tally) {
                assert_eq!(report.warnings, Warnings::of(Warning::BadLight));
                times.push(report.time_ms);
            }
        }
        assert_eq!(times, [1483, 1983, 3000, 3500]);
    }
}
