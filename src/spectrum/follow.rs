//! Peaks from window to window: the same number while the tone is the same; and harmonics of one running speed.

use crate::report::{MAX_PEAKS, Peak};

/// Highest harmonic that is named.
const MOST_HARMONIC: u8 = 20;

/// Windows shorter than one over so much tell too few cells of narrow noise from a tone, Hz.
const SHORT_HZ: f32 = 2.0;

/// A tone of less over the noise may be a peak of narrow noise in a short window, dB.
const WEAK_DB: f32 = 17.0;

/// A tone is the same again within so many standard deviations.
const SAME: f32 = 3.0;

/// In a short window a weak peak is sure only where it is seen again.
fn may_be_noise(peak: &Peak, resolution_hz: f32) -> bool {
    resolution_hz > SHORT_HZ && peak.snr_db < WEAK_DB
}

/// A tone that was seen.
#[derive(Clone, Copy, Debug)]
struct Track {
    number: u16,
    hz: f32,
    hz_sd: f32,
    hz_per_s: f32,
    /// Windows since it was last seen.
    missed: u8,
}

/// Numbers the peaks of successive windows.
#[derive(Clone, Debug, Default)]
pub struct Follower {
    tracks: heapless::Vec<Track, { 2 * MAX_PEAKS }>,
    last: u16,
}

impl Follower {
    /// Nothing followed yet.
    pub const fn new() -> Self {
        Self {
            tracks: heapless::Vec::new(),
            last: 0,
        }
    }

    /// Gives each peak the number of the track it continues, or a new one.
    ///
    /// `resolution_hz`: one over the window's length; a tone further than twice that from where it was expected is
    /// another. `elapsed_s`: since the window before. `hz_per_s`: each peak's slope.
    pub fn follow(
        &mut self,
        peaks: &mut [Peak],
        hz_per_s: &[f32],
        resolution_hz: f32,
        elapsed_s: f32,
    ) {
        for track in &mut self.tracks {
            track.missed = track.missed.saturating_add(1);
            track.hz += track.hz_per_s * elapsed_s;
        }
        // A track not seen for four windows is over.
        self.tracks.retain(|t| t.missed <= 4);
        for peak in peaks.iter_mut() {
            peak.track = 0;
        }
        loop {
            let mut nearest: Option<(usize, usize, f32)> = None;
            for (i, peak) in peaks.iter().enumerate().filter(|(_, p)| p.track == 0) {
                for (j, track) in self.tracks.iter().enumerate().filter(|(_, t)| t.missed > 0) {
                    let away = (peak.hz - track.hz).abs();
                    if away < 2.0 * resolution_hz && nearest.is_none_or(|(_, _, d)| away < d) {
                        nearest = Some((i, j, away));
                    }
                }
            }
            let Some((i, j, _)) = nearest else { break };
            let (Some(peak), Some(track)) = (peaks.get_mut(i), self.tracks.get_mut(j)) else {
                break;
            };
            peak.track = track.number;
            let sd = crate::math::sqrtf(peak.hz_sd * peak.hz_sd + track.hz_sd * track.hz_sd);
            let again = (peak.hz - track.hz).abs() < SAME * sd;
            peak.ambiguous |= may_be_noise(peak, resolution_hz) && !again;
            (track.hz, track.hz_sd) = (peak.hz, peak.hz_sd);
            track.hz_per_s = hz_per_s.get(i).copied().unwrap_or(0.0);
            track.missed = 0;
        }
        for (i, peak) in peaks.iter_mut().enumerate().filter(|(_, p)| p.track == 0) {
            peak.ambiguous |= may_be_noise(peak, resolution_hz);
            self.last = self.last.checked_add(1).unwrap_or(1);
            peak.track = self.last;
            if self.tracks.is_full() {
                let oldest = self.tracks.iter().enumerate().max_by_key(|(_, t)| t.missed);
                if let Some((at, _)) = oldest {
                    self.tracks.swap_remove(at);
                }
            }
            // There is room: one was removed above.
            let _ = self.tracks.push(Track {
                number: peak.track,
                hz: peak.hz,
                hz_sd: peak.hz_sd,
                hz_per_s: hz_per_s.get(i).copied().unwrap_or(0.0),
                missed: 0,
            });
        }
    }
}

/// Names the harmonics of one running speed: the peak of which the most others are whole multiples.
///
/// A multiple is whole within three standard deviations and a tenth of `resolution_hz`. Nothing is named unless at
/// least one other peak is a multiple.
pub fn name_harmonics(peaks: &mut [Peak], resolution_hz: f32) {
    for peak in peaks.iter_mut() {
        peak.harmonic = None;
    }
    let order = |base: &Peak, peak: &Peak| -> Option<u8> {
        let ratio = libm::roundf(peak.hz / base.hz);
        if !(1.0..=f32::from(MOST_HARMONIC)).contains(&ratio) {
            return None;
        }
        let away = (peak.hz - ratio * base.hz).abs();
        let slack = 3.0 * (peak.hz_sd + ratio * base.hz_sd) + 0.1 * resolution_hz;
        // Beyond a quarter of the speed anything is near a multiple.
        (away < slack.min(0.1 * base.hz)).then_some(ratio as u8)
    };
    let mut best: Option<(Peak, usize, f32)> = None;
    for base in peaks.iter() {
        let explained = peaks.iter().filter(|p| order(base, p).is_some());
        let (mut count, mut energy) = (0, 0.0);
        for p in explained {
            count += 1;
            energy += p.amplitude_px * p.amplitude_px;
        }
        let better = best
            .as_ref()
            .is_none_or(|&(_, c, e)| count > c || (count == c && energy > e));
        if count >= 2 && better {
            best = Some((*base, count, energy));
        }
    }
    if let Some((base, _, _)) = best {
        for peak in peaks.iter_mut() {
            peak.harmonic = order(&base, peak);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(hz: f32, amplitude_px: f32) -> Peak {
        Peak {
            hz,
            hz_sd: 0.001,
            amplitude_px,
            amplitude_px_sd: 0.001,
            snr_db: 30.0,
            ambiguous: false,
            track: 0,
            harmonic: None,
            motion: None,
        }
    }

    #[test]
    fn a_tone_keeps_its_number() {
        let mut follower = Follower::new();
        let mut first = [peak(50.0, 1.0), peak(120.0, 0.5)];
        follower.follow(&mut first, &[0.0, 0.0], 1.0, 0.5);
        let mut second = [peak(121.0, 2.0), peak(50.3, 1.0), peak(80.0, 0.1)];
        follower.follow(&mut second, &[0.0; 3], 1.0, 0.5);
        assert_eq!(second.map(|p| p.track), [2, 1, 3]);
    }

    #[test]
    fn a_run_up_is_followed_by_its_slope() {
        let mut follower = Follower::new();
        for i in 0..50_u8 {
            let mut now = [peak(100.0 + 9.0 * f32::from(i), 1.0)];
            follower.follow(&mut now, &[90.0], 5.0, 0.1);
            assert_eq!(now[0].track, 1);
        }
    }

    #[test]
    fn harmonics_are_named_after_their_running_speed() {
        let mut peaks = [
            peak(49.0, 1.0),
            peak(98.001, 0.5),
            peak(147.0, 0.2),
            peak(60.0, 0.9),
        ];
        name_harmonics(&mut peaks, 1.0);
        assert_eq!(peaks.map(|p| p.harmonic), [Some(1), Some(2), Some(3), None]);
        let mut alone = [peak(49.0, 1.0), peak(60.0, 1.0)];
        name_harmonics(&mut alone, 1.0);
        assert_eq!(alone.map(|p| p.harmonic), [None, None]);
    }
}
