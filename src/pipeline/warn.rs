//! What a window warns of: decided here, once, over the whole window.

use crate::report::{Peak, Warning, Warnings};
use crate::spectrum::{Tones, WindowMark};
use crate::timeline::Tally;

/// Sums over the frames of a window.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WindowTally {
    frames: u32,
    rows: u32,
    no_texture: u32,
    occluded: u32,
    unlit: u32,
    repeated_frames: u32,
    relearned: u32,
    thin_groups: u32,
    /// Frames that were added, and the fewest thin groups of one: of rows that never have texture.
    added: u32,
    fewest_thin: Option<u16>,
    dropped_samples: u32,
    bad_light: u32,
    notes: Warnings,
}

impl WindowTally {
    pub(super) fn add(&mut self, of_frame: &Tally) {
        let add = |sum: &mut u32, more: u16| *sum = sum.saturating_add(more.into());
        add(&mut self.frames, of_frame.frames);
        add(&mut self.rows, of_frame.rows);
        add(&mut self.no_texture, of_frame.no_texture);
        add(&mut self.occluded, of_frame.occluded);
        add(&mut self.unlit, of_frame.unlit);
        add(&mut self.repeated_frames, of_frame.repeated_frames);
        add(&mut self.relearned, of_frame.relearned);
        add(&mut self.thin_groups, of_frame.thin_groups);
        add(&mut self.dropped_samples, of_frame.dropped_samples);
        add(&mut self.bad_light, of_frame.bad_light);
        add(&mut self.added, 1);
        let thin = of_frame.thin_groups;
        self.fewest_thin = Some(self.fewest_thin.map_or(thin, |fewest| fewest.min(thin)));
        self.notes = self.notes.union(of_frame.notes);
    }

    /// Frames that came, as far as the line side told.
    pub(super) fn frames(&self) -> u32 {
        self.frames
    }

    /// What the rows of a window of `groups` groups a frame say.
    pub(super) fn warnings(&self, groups: u16) -> Warnings {
        let mut warnings = self.notes;
        // One row in a hundred: fewer are lost to noise.
        let occluded = self.occluded.saturating_mul(100) > self.rows;
        warnings.insert_if(occluded, Warning::Occluded);
        warnings.insert_if(self.relearned > 0, Warning::Relearned);
        let little_texture = self.no_texture.saturating_mul(2) > self.rows;
        warnings.insert_if(little_texture, Warning::LittleTexture);
        warnings.insert_if(self.repeated_frames > 0, Warning::RepeatedFrames);
        let bad_light = self.bad_light.saturating_mul(2) > self.frames
            || self.unlit.saturating_mul(2) > self.rows;
        warnings.insert_if(bad_light, Warning::BadLight);
        let as_a_rule = self
            .added
            .saturating_mul(self.fewest_thin.unwrap_or(0).into());
        let thin = self.thin_groups.saturating_sub(as_a_rule);
        let all = self.added.saturating_mul(groups.into());
        warnings.insert_if(thin.saturating_mul(100) > all, Warning::ThinGroups);
        warnings.insert_if(self.dropped_samples > 0, Warning::DroppedSamples);
        warnings
    }
}

/// What a window's report warns of: what its rows say, and what its tones do.
pub(super) fn of_window(mark: &WindowMark, tones: &Tones, window_s: f32) -> Warnings {
    let mut warnings = mark.warnings;
    warnings.insert_if(mark.lost_frames > 0, Warning::LostFrames);
    warnings.insert_if(mark.short, Warning::ShortWindow);
    warnings.insert_if(tones.more, Warning::MoreTones);
    warnings.insert_if(tones.timing_contradiction, Warning::TimingContradiction);
    let hidden = tones.hidden && depends_on_hidden(&tones.peaks, tones.fps, 1.0 / window_s);
    warnings.insert_if(hidden, Warning::HiddenNearFrameRate);
    warnings
}

/// Whether the report would read otherwise if a vibration hid at a multiple of the frame rate: where it says that there is
/// none at all, where a peak lies beside such a multiple, and where one running speed explains the peaks and one
/// of its multiples, up to twice the highest that was found, would be hidden.
fn depends_on_hidden(peaks: &[Peak], fps: f32, resolution_hz: f32) -> bool {
    let is_hidden = |hz: f32| {
        let multiple = libm::roundf(hz / fps);
        multiple >= 1.0 && (hz - multiple * fps).abs() < resolution_hz
    };
    let series = peaks.iter().filter_map(|peak| {
        let order = peak.harmonic.filter(|&order| order > 0)?;
        Some((peak.hz / f32::from(order), order))
    });
    let highest = series.clone().map(|(_, order)| order).max().unwrap_or(0);
    let base_hz = series.map(|(hz, _)| hz).next().unwrap_or(0.0);
    peaks.is_empty()
        || peaks.iter().any(|peak| is_hidden(peak.hz))
        || (1..=u16::from(highest) * 2).any(|order| is_hidden(base_hz * f32::from(order)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(hz: f32, harmonic: Option<u8>) -> Peak {
        Peak {
            hz,
            hz_sd: 0.001,
            amplitude_px: 0.1,
            amplitude_px_sd: 0.001,
            snr_db: 40.0,
            ambiguous: false,
            track: 1,
            harmonic,
            motion: None,
        }
    }

    #[test]
    fn what_hides_is_said_where_the_figures_depend_on_it() {
        let says = |peaks: &[Peak]| depends_on_hidden(peaks, 60.0, 1.0);
        assert!(says(&[]), "no vibration at all: one could hide");
        assert!(!says(&[peak(44.4, None), peak(133.0, None)]));
        assert!(says(&[peak(44.4, None), peak(120.5, None)]));
        // Four times 45 Hz is three times 60 Hz.
        assert!(says(&[peak(45.0, Some(1)), peak(90.0, Some(2))]));
        assert!(!says(&[peak(44.0, Some(1)), peak(88.0, Some(2))]));
    }

    #[test]
    fn each_count_has_its_warning() {
        let frame = Tally {
            frames: 1,
            rows: 100,
            ..Tally::NONE
        };
        let of = |frames: &[Tally]| {
            let mut sum = WindowTally::default();
            frames.iter().for_each(|frame| sum.add(frame));
            sum.warnings(10)
        };
        assert!(of(&[frame; 60]).is_empty() && of(&[]).is_empty());
        let cases = [
            (
                Tally {
                    occluded: 3,
                    ..frame
                },
                Warning::Occluded,
            ),
            (
                Tally {
                    relearned: 1,
                    ..frame
                },
                Warning::Relearned,
            ),
            (
                Tally {
                    repeated_frames: 1,
                    ..frame
                },
                Warning::RepeatedFrames,
            ),
            (
                Tally {
                    thin_groups: 1,
                    ..frame
                },
                Warning::ThinGroups,
            ),
            (
                Tally {
                    dropped_samples: 1,
                    ..frame
                },
                Warning::DroppedSamples,
            ),
            (
                Tally {
                    notes: Warnings::of(Warning::Compressed),
                    ..frame
                },
                Warning::Compressed,
            ),
        ];
        for (odd, warning) in cases {
            // In the window's first half as in its second.
            for frames in [[odd, frame], [frame, odd]] {
                assert_eq!(of(&frames), Warnings::of(warning));
            }
        }
        for (odd, warning) in [
            (
                Tally {
                    no_texture: 90,
                    ..frame
                },
                Warning::LittleTexture,
            ),
            (Tally { unlit: 90, ..frame }, Warning::BadLight),
            (
                Tally {
                    bad_light: 1,
                    ..frame
                },
                Warning::BadLight,
            ),
        ] {
            assert_eq!(of(&[odd, odd, frame]), Warnings::of(warning));
            assert!(of(&[odd, frame, frame]).is_empty());
        }
        // Rows that never have texture make no sample, and nobody misses them.
        assert!(
            of(&[Tally {
                thin_groups: 4,
                ..frame
            }; 60])
            .is_empty()
        );
    }
}
