//! A whole recording in one answer: the tones of all its windows, those that persist first.

mod entry;
mod output;
#[cfg(test)]
mod tests;

use rowtone::report::{Report, Warnings};

pub use entry::Persistent;
use entry::{Entry, finite};

/// Tones and figures of all windows of a recording, gathered report by report.
///
/// Memory grows with the number of different tones (not with the windows): what is found once in a noisy recording is
/// kept too, up to [`MOST_TONES`].
#[derive(Clone, Debug, Default)]
pub struct Summary {
    entries: Vec<Entry>,
    windows: u32,
    /// Begin of the first window and end of the last, s.
    span_s: Option<(f64, f64)>,
    /// Sums of window lengths, and of frame rates and squares weighted with them.
    total_s: f64,
    fps_s: f64,
    noise_px2_s: f64,
    /// The same of the squares of the velocity 10–1000 Hz, and the windows' length that has one.
    velocity2_s: f64,
    velocity_s: f64,
    um_per_px: Option<f32>,
    warnings: Warnings,
}

/// Most different tones that are kept; the rarest and smallest go first.
pub const MOST_TONES: usize = 256;

impl Summary {
    /// Takes the report of the next window.
    pub fn take(&mut self, report: &Report) {
        let (end_s, length_s) = (
            report.time_ms as f64 / 1000.0,
            finite(report.window_s.into()),
        );
        let begin_s = (end_s - length_s).max(0.0);
        let (from, to) = self.span_s.unwrap_or((begin_s, end_s));
        self.span_s = Some((from.min(begin_s), to.max(end_s)));
        self.windows += 1;
        self.total_s += length_s;
        self.fps_s += finite(report.fps.into()) * length_s;
        self.noise_px2_s += finite(report.noise_px.into()).powi(2) * length_s;
        self.um_per_px = report.um_per_px.or(self.um_per_px);
        if let Some(velocity) = super::band_velocity(report) {
            self.velocity2_s += velocity.powi(2) * length_s;
            self.velocity_s += length_s;
        }
        self.warnings = self.warnings.union(report.warnings);
        self.peaks(report, begin_s, end_s);
        if self.entries.len() > MOST_TONES {
            self.entries.sort_by(Entry::by_persistence);
            self.entries.truncate(MOST_TONES);
        }
    }

    /// Gives each peak to the tone that it continues, the likeliest pairs first: those of one track, then the nearest
    /// within half a line of the window's resolution. A tone takes at most one peak of a window.
    fn peaks(&mut self, report: &Report, begin_s: f64, end_s: f64) {
        let near_hz = 0.5 / finite(report.window_s.into()).max(1e-3);
        let mut pairs = Vec::new();
        for (p, peak) in report.peaks.iter().enumerate() {
            for (e, entry) in self.entries.iter().enumerate() {
                let away_hz = (entry.latest_hz() - f64::from(peak.hz)).abs();
                // A number that jumped is another tone's: they come round again.
                let same = entry.track() == peak.track && away_hz < 8.0 * near_hz;
                if same || away_hz < near_hz {
                    pairs.push((!same, away_hz, p, e));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut given = vec![false; report.peaks.len()];
        let mut taken = vec![false; self.entries.len()];
        for (_, _, p, e) in pairs {
            if !given[p] && !taken[e] {
                (given[p], taken[e]) = (true, true);
                self.entries[e].take(&report.peaks[p], begin_s, end_s);
            }
        }
        let new = report.peaks.iter().zip(given).filter(|(_, given)| !given);
        let new = new.map(|(peak, _)| Entry::new(peak, begin_s, end_s));
        self.entries.extend(new);
    }
}
