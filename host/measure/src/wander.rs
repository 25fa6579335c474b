//! A picture that wanders off: a camera in the hand, a tripod that is pushed, a heap of cables that gives way.
//!
//! A machine's vibration is a sum of tones, which a report names. What the picture does slowly besides is the camera's doing:
//! the means of an eighth of a window each, in which tones average out. Where they span more than the tones of
//! the report explain, the camera moves.

use std::collections::VecDeque;

use rowtone::pipeline::Reading;
use rowtone::report::Report;

/// Pieces of a window.
const PIECES: usize = 8;
/// A picture that wanders by less than this, either way, has not moved, px.
const LEAST_PX: f32 = 0.15;
/// Times the largest tone's amplitude.
const TIMES: f32 = 1.5;
/// A machine that vibrates by more than so many times what its camera shakes by leaves nothing to warn
/// of; a motion along the columns of which the rows see a little everywhere looks like such a shake.
const MUCH_MORE: f32 = 4.0;

/// By how much the picture shakes, and where it was on average in the frames of a window.
#[derive(Clone, Debug)]
pub(crate) struct Wander {
    window_ns: i64,
    /// By how much all of it shakes, px.
    shake_px: Option<f32>,
    /// Start of each frame, ns, and the mean of its samples, px.
    frames: VecDeque<(i64, f32)>,
}

impl Wander {
    pub(crate) fn new(window_ns: i64) -> Self {
        Self {
            window_ns,
            shake_px: None,
            frames: VecDeque::new(),
        }
    }

    /// The first frames showed that all of the picture shakes by this much, px, or does not.
    pub(crate) fn note_shake(&mut self, px: Option<f64>) {
        self.shake_px = px.map(|px| px as f32);
    }

    /// Takes a frame's readings.
    pub(crate) fn note_frame(&mut self, start_ns: i64, readings: &[Reading]) {
        let past = start_ns.saturating_sub(self.window_ns);
        while self.frames.front().is_some_and(|(t, _)| *t < past) {
            self.frames.pop_front();
        }
        let samples = || readings.iter().filter_map(|reading| reading.sample);
        let information: f32 = samples().map(|s| s.information_per_px2).sum();
        let moments = samples().map(|s| s.information_per_px2 * s.shift_px);
        let moment: f32 = moments.sum();
        if information > 0.0 {
            self.frames.push_back((start_ns, moment / information));
        }
    }

    /// The picture shakes, or wanders by more than the tones of the report and what they may leave in pieces of a window.
    pub(crate) fn exceeds(&self, report: &Report) -> bool {
        let largest = report.peaks.iter().map(|p| p.amplitude_px);
        let largest = largest.fold(0.0, f32::max);
        let shakes = self.shake_px.is_some_and(|px| is_told(px, largest));
        let wanders = |px| px > LEAST_PX.max(TIMES * largest);
        shakes || self.half_span_px().is_some_and(wanders)
    }

    /// Half of what the pieces' means span, px; a piece's mean is the median of its frames', so that a frame that is elsewhere
    /// for once is no wandering.
    fn half_span_px(&self) -> Option<f32> {
        let (n, pieces) = (self.frames.len(), PIECES);
        if n < 3 * pieces {
            return None;
        }
        let means = (0..pieces).map(|k| {
            let piece = self.frames.range(k * n / pieces..(k + 1) * n / pieces);
            let mut px: Vec<f32> = piece.map(|(_, px)| *px).collect();
            px.sort_by(f32::total_cmp);
            px[px.len() / 2]
        });
        let (least, most) = means.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), px| {
            (a.min(px), b.max(px))
        });
        Some(0.5 * (most - least))
    }
}

/// Whether a camera that shakes by `shake_px` is to be told where the largest tone of the report has `largest_px`.
fn is_told(shake_px: f32, largest_px: f32) -> bool {
    largest_px < MUCH_MORE * shake_px
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::timeline::{Curvature, Sample, Spread, Tally};

    fn wander(shift_px: impl Fn(f32) -> f32) -> Wander {
        let mut wander = Wander::new(1_000_000_000);
        for frame in 0..90_u32 {
            let start_ns = i64::from(frame) * 16_666_667;
            wander.note_frame(
                start_ns,
                &[Reading {
                    frame,
                    sample: Some(Sample {
                        frame,
                        slot: 0,
                        curvature: Curvature::default(),
                        time_ns: start_ns,
                        shift_px: shift_px(start_ns as f32 * 1e-9),
                        information_per_px2: 1e4,
                        vertical: None,
                        spread: Spread::default(),
                    }),
                    tally: Tally::NONE,
                }],
            );
        }
        wander
    }

    #[test]
    fn a_shake_is_told_unless_the_machine_does_much_more() {
        assert!(is_told(0.001, 0.0));
        assert!(is_told(0.3, 0.31));
        // What the rows see of 0.2 px along the columns.
        assert!(!is_told(0.001, 0.2));
    }

    #[test]
    fn a_hand_is_told_from_a_machine() {
        let tau = std::f32::consts::TAU;
        let nothing = Report::EMPTY;
        assert!(wander(|t| 1.5 * t * t).exceeds(&nothing));
        assert!(wander(|t| if t > 1.0 { 2.0 } else { 0.0 }).exceeds(&nothing));
        // Tones, noise and a slow drift.
        assert!(!wander(|t| 0.4 * (tau * 24.7 * t).sin()).exceeds(&nothing));
        assert!(!wander(|t| 0.2 * t).exceeds(&nothing));
        // One frame that is elsewhere.
        let odd = |t: f32| if (t - 1.0).abs() < 0.01 { 40.0 } else { 0.0 };
        assert!(!wander(odd).exceeds(&nothing));
    }
}
