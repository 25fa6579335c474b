//! Windows in which nothing was measured have a report as well: a lamp is off, a camera delivers one frame for ever,
//! a new scene is being learned. Whoever watches must not mistake silence for health.

use rowtone::report::Report;

/// Decides when a report is due though no sample came, and numbers all reports.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Silence {
    window_ns: i64,
    hop_ns: i64,
    /// Start of the first frame, and of the last one that had samples, ns.
    origin_ns: Option<i64>,
    heard_ns: i64,
    /// When the next report of nothing is due, ns.
    due_ns: i64,
    /// Reports so far.
    reports: u32,
}

impl Silence {
    pub(crate) fn new(window_ns: i64, hop_ns: i64) -> Self {
        Self {
            window_ns,
            hop_ns,
            origin_ns: None,
            heard_ns: 0,
            due_ns: 0,
            reports: 0,
        }
    }

    /// A frame has begun, which had no samples where it is `silent`. Gives the report of nothing where one is due.
    pub(crate) fn note_frame(&mut self, start_ns: i64, silent: bool, fps: f64) -> Option<Report> {
        let origin_ns = *self.origin_ns.get_or_insert_with(|| {
            self.heard_ns = start_ns;
            self.due_ns = start_ns.saturating_add(self.window_ns);
            start_ns
        });
        if !silent {
            self.heard_ns = start_ns;
            self.due_ns = self.due_ns.max(start_ns.saturating_add(self.window_ns));
            return None;
        }
        if start_ns < self.due_ns || start_ns.saturating_sub(self.heard_ns) < self.window_ns {
            return None;
        }
        self.due_ns = start_ns.saturating_add(self.hop_ns);
        Some(Report {
            time_ms: (start_ns.saturating_sub(origin_ns) / 1_000_000) as u64,
            window_s: self.window_ns as f32 * 1e-9,
            fps: fps as f32,
            ..Report::EMPTY
        })
    }

    /// Numbers a report: those of nothing count too.
    pub(crate) fn number(&mut self, report: &mut Report) {
        report.seq = self.reports;
        self.reports = self.reports.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_of_nothing_is_reported_and_every_hop_after_it() {
        let mut silence = Silence::new(1_000_000_000, 500_000_000);
        let mut times = Vec::new();
        for frame in 0..240_i64 {
            // Half a second of samples, one frame of them at 2 s.
            let silent = frame >= 30 && frame != 120;
            if let Some(report) = silence.note_frame(frame * 16_666_667, silent, 60.0) {
                times.push(report.time_ms);
            }
        }
        assert_eq!(times, [1500, 3000, 3500]);
    }
}
