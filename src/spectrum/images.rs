//! Images: what the blank time makes of power elsewhere.
//!
//! A periodogram shows power at f again at f ± k·fps, weaker by |w_k|², w_k the mean of e^(2πi·k·fps·τ) over
//! the slots' times τ. Noise in a band has images too, and they have peaks where its own are: so each place
//! of the residual is asked for, not an average.

use super::model::Samples;
use super::periodogram::Periodogram;

/// Multiples of the frame rate that are looked at.
const MULTIPLES: usize = 40;

/// Images weaker than this are not counted.
const LEAST: f32 = 2e-4;

/// How strong images are, |w_k|² for k from 1.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    power: heapless::Vec<f32, MULTIPLES>,
    fps: f32,
}

impl Images {
    /// None.
    pub(crate) const fn new() -> Self {
        Self {
            power: heapless::Vec::new(),
            fps: 0.0,
        }
    }

    /// Those of a window of one frame rate; without one they are not sought.
    pub(crate) fn measure(&mut self, samples: &Samples<'_>, fps: Option<f32>, highest_hz: f32) {
        self.power.clear();
        let Some(fps) = fps else { return };
        self.fps = fps;
        let most = ((2.0 * highest_hz / fps) as usize + 1).min(MULTIPLES);
        for k in 1..=most {
            // There is room for all of them.
            let _ = self.power.push(samples.ghost(k as f32 * fps));
        }
    }

    /// The power that images of what is elsewhere may have at `hz`.
    pub(crate) fn at(&self, hz: f32, p: &Periodogram<'_>) -> f32 {
        let mut sum = 0.0;
        for (k, &power) in (1..).zip(&self.power) {
            if power < LEAST {
                continue;
            }
            let away = k as f32 * self.fps;
            sum += power * (p.largest_near(hz - away) + p.largest_near(hz + away));
        }
        sum
    }
}
