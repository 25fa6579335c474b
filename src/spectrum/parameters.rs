//! What is fitted to a window: tones, and the slow drift below them.

use super::tone::Tone;
use crate::report::MAX_PEAKS;

/// Slow drift along x and along y: px a window length, px a window length squared.
pub(crate) type Drift = [[f32; 2]; 2];

/// What is fitted to a window.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) tones: heapless::Vec<Tone, MAX_PEAKS>,
    pub(crate) drift: Drift,
    /// How many powers of t the drift has, 0 to 2.
    pub(crate) drift_powers: usize,
    /// Weighted sum of squares of what is left.
    pub(crate) squares: f32,
}

impl Model {
    pub(crate) const fn new(drift_powers: usize) -> Self {
        Self {
            tones: heapless::Vec::new(),
            drift: [[0.0; 2]; 2],
            drift_powers,
            squares: 0.0,
        }
    }

    /// Some tone has a notch.
    pub(crate) fn has_notches(&self) -> bool {
        self.tones.iter().any(|t| t.notched)
    }

    /// Frees the tones that have a notch, without it; all others stay as they are.
    pub(crate) fn free_notched(&mut self) {
        for tone in &mut self.tones {
            tone.frozen = !tone.notched;
            tone.notched = false;
        }
    }

    /// No tones, and no drift yet.
    pub(crate) fn clear(&mut self, drift_powers: usize) {
        self.tones.clear();
        (self.drift, self.drift_powers) = ([[0.0; 2]; 2], drift_powers);
        self.squares = 0.0;
    }

    /// Becomes `other`, in place: a model is 1.7 KB, and a board's stack is short.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.tones.clear();
        // Both have the same room.
        let _ = self.tones.extend_from_slice(&other.tones);
        (self.drift, self.drift_powers) = (other.drift, other.drift_powers);
        self.squares = other.squares;
    }

    /// Takes those tones over from `other`, which are free there.
    pub(crate) fn take_free(&mut self, other: &Self) {
        for (own, tone) in self.tones.iter_mut().zip(&other.tones) {
            if !tone.frozen {
                *own = *tone;
                (own.notched, own.frozen) = (true, true);
            }
        }
    }
}
