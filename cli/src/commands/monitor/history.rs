//! What the live view remembers: the last reports, and how each tone's amplitude went.

use std::collections::{BTreeMap, VecDeque};

use rowtone::report::Report;

/// Reports remembered, one row of the waterfall each.
const ROWS: usize = 200;
/// Amplitudes remembered of each tone.
pub(super) const TREND: usize = 48;

/// The last reports.
#[derive(Debug, Default)]
pub(super) struct History {
    /// The newest first.
    pub(super) reports: VecDeque<Report>,
    /// Amplitudes of each track, px, the newest last; none where the tone was not there.
    trends: BTreeMap<u16, VecDeque<Option<f32>>>,
}

impl History {
    pub(super) fn push(&mut self, report: &Report) {
        for peak in &report.peaks {
            self.trends.entry(peak.track).or_default();
        }
        for (track, trend) in &mut self.trends {
            let peak = report.peaks.iter().find(|peak| peak.track == *track);
            trend.push_back(peak.map(|peak| peak.amplitude_px));
            if trend.len() > TREND {
                trend.pop_front();
            }
        }
        self.trends
            .retain(|_, trend| trend.iter().any(Option::is_some));
        self.reports.push_front(report.clone());
        self.reports.truncate(ROWS);
    }

    /// What a new session starts from.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// The last amplitudes of a track as a line of small bars, so many at most. They stand for the
    /// range from the smallest to the largest, and for 10 % around the middle at least: a change that
    /// matters shows, and noise does not.
    pub(super) fn trend(&self, track: u16, columns: usize) -> String {
        const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
        let Some(trend) = self.trends.get(&track) else {
            return String::new();
        };
        let shown = trend.iter().skip(trend.len().saturating_sub(columns));
        let known = || shown.clone().flatten().copied();
        let (low, high) = (
            known().fold(f32::INFINITY, f32::min),
            known().fold(0.0, f32::max),
        );
        let middle = f32::midpoint(low, high);
        let half = ((high - low) / 2.0).max(0.1 * middle);
        // What is quiet stands in the middle of a step, not between two.
        let centre = if half > (high - low) / 2.0 { 3.5 } else { 4.0 };
        shown
            .clone()
            .map(|amplitude| match amplitude {
                Some(amplitude) if half > 0.0 => {
                    let step = centre + 4.0 * (amplitude - middle) / half;
                    BARS[(step as usize).min(7)]
                }
                _ => ' ',
            })
            .collect()
    }

    /// Upper end of the frequency axis: a round number above all peaks remembered, Hz.
    pub(super) fn max_hz(&self) -> f32 {
        let peaks = self.reports.iter().flat_map(|report| &report.peaks);
        let highest = peaks.map(|peak| peak.hz).fold(10.0, f32::max);
        let decade = 10_f32.powf(highest.log10().floor());
        let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
        let above = steps.into_iter().find(|step| step * decade > highest);
        above.unwrap_or(15.0) * decade
    }

    /// The largest amplitude remembered, px.
    pub(super) fn max_amplitude_px(&self) -> f32 {
        let peaks = self.reports.iter().flat_map(|report| &report.peaks);
        peaks.map(|peak| peak.amplitude_px).fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone_report::example;

    #[test]
    fn trends_follow_a_track() {
        let mut history = History::default();
        let mut report = example(None);
        report.peaks.truncate(1);
        for step in 1..=30 {
            report.peaks[0].amplitude_px = step as f32;
            history.push(&report);
        }
        assert_eq!(history.trend(1, TREND).chars().count(), 30);
        let trend = history.trend(1, 8);
        assert_eq!(trend, "▁▂▃▄▅▆▇█");
        assert_eq!(history.trend(2, TREND), "");
        assert_eq!((history.max_hz(), history.max_amplitude_px()), (50.0, 30.0));
        // A thousandth up and down is no trend.
        for step in 0..8 {
            report.peaks[0].amplitude_px = 1.0 + 0.001 * (step % 2) as f32;
            history.push(&report);
        }
        let trend = history.trend(1, 8);
        assert_eq!(trend, "▄▄▄▄▄▄▄▄");
        report.peaks.clear();
        for _ in 0..TREND {
            history.push(&report);
        }
        assert_eq!(history.trend(1, TREND), "");
    }
}
