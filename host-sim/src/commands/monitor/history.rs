//! What the live view remembers: the last reports, and how each tone's amplitude went.

use std::collections::{BTreeMap, VecDeque};

use rowtone::report::Report;

/// Reports remembered, one row of the waterfall each.
const ROWS: usize = 200;
/// Amplitudes remembered of each tone.
pub(super) const TREND: usize = 24;

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

    /// The amplitudes of a track as a line of small bars, its largest the full height.
    pub(super) fn trend(&self, track: u16) -> String {
        const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
        let Some(trend) = self.trends.get(&track) else {
            return String::new();
        };
        let largest = trend.iter().flatten().copied().fold(0.0, f32::max);
        trend
            .iter()
            .map(|amplitude| match amplitude {
                Some(amplitude) if largest > 0.0 => {
                    let step = (amplitude / largest * 8.0).ceil() as usize;
                    BARS[step.clamp(1, 8) - 1]
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
    use crate::output::tests::example;

    #[test]
    fn trends_follow_a_track() {
        let mut history = History::default();
        let mut report = example(None);
        report.peaks.truncate(1);
        for step in 1..=30 {
            report.peaks[0].amplitude_px = step as f32;
            history.push(&report);
        }
        assert_eq!(history.trend(1).chars().count(), TREND);
        let trend = history.trend(1);
        assert!(trend.starts_with('▂') && trend.ends_with('█'), "{trend}");
        assert_eq!(history.trend(2), "");
        assert_eq!((history.max_hz(), history.max_amplitude_px()), (50.0, 30.0));
        report.peaks.clear();
        for _ in 0..TREND {
            history.push(&report);
        }
        assert_eq!(history.trend(1), "");
    }
}
