//! One tone over many windows: sums that grow no longer than a window's peak.

use core::cmp::Ordering;

use rowtone::report::Peak;

/// Weighted mean and spread of a figure over the windows (West 1979, Communications of the ACM 22(9)).
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    weight: f64,
    /// Sum of w²·sd², for the standard deviation of the mean that the windows' own tell.
    weight2_sd2: f64,
    mean: f64,
    squares: f64,
}

impl Mean {
    fn take(&mut self, value: f64, sd: f64, weight: f64) {
        let (value, sd) = (finite(value), finite(sd));
        let away = value - self.mean;
        self.weight += weight;
        self.weight2_sd2 += (weight * sd).powi(2);
        self.mean += away * weight / self.weight;
        self.squares += weight * away * (value - self.mean);
    }

    /// Standard deviation between `count` windows; 0 of one window.
    fn spread(&self, count: f64) -> f64 {
        if count < 2.0 {
            return 0.0;
        }
        (self.squares.max(0.0) / self.weight * count / (count - 1.0)).sqrt()
    }

    /// Standard deviation of the mean: what the windows' own tell, or how they differ where that is more.
    fn sd(&self, count: f64, overlap: f64) -> f64 {
        let own = (self.weight2_sd2 * overlap).sqrt() / self.weight;
        own.max(self.spread(count) * (overlap / count).sqrt())
    }
}

/// The number, 0 where it is none.
pub(super) fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

/// A tone that is being gathered.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    latest: Peak,
    count: u32,
    ambiguous: u32,
    hz: Mean,
    amplitude_px: Mean,
    x_px: Option<Mean>,
    y_px: Option<Mean>,
    /// Sum of the windows' lengths, and the time that they cover together, s.
    length_s: f64,
    covered_s: f64,
    begin_s: f64,
    end_s: f64,
    /// Windows that called it this harmonic: of the running speed that explains most of them.
    harmonic: Option<u8>,
}

impl Entry {
    pub(super) fn new(peak: &Peak, begin_s: f64, end_s: f64) -> Self {
        let mut entry = Self {
            latest: *peak,
            count: 0,
            ambiguous: 0,
            hz: Mean::default(),
            amplitude_px: Mean::default(),
            x_px: Some(Mean::default()),
            y_px: Some(Mean::default()),
            length_s: 0.0,
            covered_s: 0.0,
            begin_s,
            end_s: begin_s,
            harmonic: None,
        };
        entry.take(peak, begin_s, end_s);
        entry
    }

    pub(super) fn take(&mut self, peak: &Peak, begin_s: f64, end_s: f64) {
        let length_s = (end_s - begin_s).max(1e-6);
        self.latest = *peak;
        self.count += 1;
        self.ambiguous += u32::from(peak.ambiguous);
        let sd = f64::from(peak.hz_sd).max(1e-6);
        self.hz.take(peak.hz.into(), sd, sd.powi(-2));
        let (px, sd) = (peak.amplitude_px, peak.amplitude_px_sd);
        self.amplitude_px.take(px.into(), sd.into(), length_s);
        let motion = peak.motion.as_ref();
        along(
            &mut self.x_px,
            motion.map(|m| (m.x_px, m.x_px_sd)),
            length_s,
        );
        along(
            &mut self.y_px,
            motion.map(|m| (m.y_px, m.y_px_sd)),
            length_s,
        );
        self.length_s += length_s;
        self.covered_s += (end_s - begin_s.max(self.end_s)).max(0.0);
        self.end_s = self.end_s.max(end_s);
        self.harmonic = peak.harmonic;
    }

    pub(super) const fn track(&self) -> u16 {
        self.latest.track
    }

    pub(super) fn latest_hz(&self) -> f64 {
        self.latest.hz.into()
    }

    /// Those found in most windows first, sure ones before ambiguous ones, then the largest.
    pub(super) fn by_persistence(&self, other: &Self) -> Ordering {
        let sure = |entry: &Self| entry.count - entry.ambiguous;
        sure(other)
            .cmp(&sure(self))
            .then(other.count.cmp(&self.count))
            .then(other.amplitude_px.mean.total_cmp(&self.amplitude_px.mean))
    }

    pub(super) fn persistent(&self) -> Persistent {
        let count = f64::from(self.count);
        let overlap = (self.length_s / self.covered_s.max(1e-6)).max(1.0);
        let mean = |axis: Option<Mean>| axis.map(|mean| (mean.mean, mean.sd(count, overlap)));
        Persistent {
            windows: self.count,
            ambiguous_windows: self.ambiguous,
            from_s: self.begin_s,
            to_s: self.end_s,
            hz: self.hz.mean,
            hz_sd: self.hz.sd(count, overlap),
            hz_spread: self.hz.spread(count),
            amplitude_px: self.amplitude_px.mean,
            amplitude_px_sd: self.amplitude_px.sd(count, overlap),
            amplitude_px_spread: self.amplitude_px.spread(count),
            x_px: mean(self.x_px),
            y_px: mean(self.y_px),
            harmonic: self.harmonic,
        }
    }
}

/// Takes the amplitude along an axis; an axis that a window does not know is not known of the whole.
fn along(mean: &mut Option<Mean>, px: Option<(Option<f32>, Option<f32>)>, length_s: f64) {
    match (mean.as_mut(), px) {
        (Some(mean), Some((Some(px), sd))) => {
            mean.take(px.into(), sd.unwrap_or(0.0).into(), length_s);
        }
        _ => *mean = None,
    }
}

/// A tone of a whole recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Persistent {
    /// Windows in which it was found, and those of them in which it was ambiguous.
    pub windows: u32,
    /// Windows in which its frequency was ambiguous.
    pub ambiguous_windows: u32,
    /// Begin of the first window that has it, s from the start of the recording.
    pub from_s: f64,
    /// End of the last window that has it, s.
    pub to_s: f64,
    /// Frequency, Hz: mean over the windows, weighted with 1/sd².
    pub hz: f64,
    /// Standard deviation of that mean, Hz: the larger of what the windows' own standard deviations and what the differences
    /// between windows tell.
    pub hz_sd: f64,
    /// Standard deviation from window to window, Hz; 0 of a single window.
    pub hz_spread: f64,
    /// Zero-to-peak amplitude, px: mean over the windows, weighted with their lengths.
    pub amplitude_px: f64,
    /// Standard deviation of that mean, px, found as that of the frequency.
    pub amplitude_px_sd: f64,
    /// Standard deviation from window to window, px; 0 of a single window.
    pub amplitude_px_spread: f64,
    /// Amplitude along the rows and its standard deviation, px, where every window knows it.
    pub x_px: Option<(f64, f64)>,
    /// The same along the columns.
    pub y_px: Option<(f64, f64)>,
    /// Which harmonic of the running speed the last window called it.
    pub harmonic: Option<u8>,
}
