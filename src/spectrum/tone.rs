//! One tone: a frequency, a shape over the rows, and how it may change within the window.

use super::phase::Frequency;
use super::shape::Shape;

/// One sinusoid: Re(conj(c) · e^(growth·t + 2πi(f·t + chirp·t²/2))), t in window lengths from the middle,
/// c what its shape says of the row.
///
/// What was struck dies away so: a linear growth in place of e^(growth·t) leaves beside it what it does not follow, and
/// where the blank time is long that has ghosts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tone {
    pub(crate) frequency: Frequency,
    pub(crate) shape: Shape,
    /// Turns per window length squared.
    pub(crate) chirp: f32,
    /// Relative change of amplitude, 1 a window length.
    pub(crate) growth: f32,
    /// Another multiple of the frame rate explains it all but as well.
    pub(crate) unsure: bool,
    /// It stays as it is while others are fitted.
    pub(crate) frozen: bool,
    /// What is at its alias frequency is taken out of every series.
    pub(crate) notched: bool,
    /// `chirp` and `growth` are fitted; of what was struck `growth` alone.
    pub(crate) modulated: bool,
    /// When it was struck, in window lengths from the middle: before that it is not there, and its shape is as it was then.
    pub(crate) onset: Option<f32>,
}

impl Tone {
    /// The same in all rows and at all times, along x, 0, or y, 1; without amplitude.
    pub(crate) fn steady(frequency: Frequency, axis: usize) -> Self {
        Self {
            frequency,
            shape: Shape::along(axis),
            chirp: 0.0,
            growth: 0.0,
            unsure: false,
            frozen: false,
            notched: false,
            modulated: false,
            onset: None,
        }
    }

    /// How much larger it is at `t`.
    #[inline(never)]
    pub(crate) fn grown(&self, t: f32) -> f32 {
        match self.onset {
            None => exp(self.growth * t),
            Some(onset) if t >= onset => libm::expf((self.growth * (t - onset)).max(-60.0)),
            Some(_) => 0.0,
        }
    }

    /// How much larger it is `t` after the middle of a frame.
    pub(crate) fn grown_within(&self, t: f32) -> f32 {
        match self.onset {
            None => self.grown(t),
            Some(_) => libm::expf((self.growth * t).clamp(-20.0, 20.0)),
        }
    }

    /// Highest power of t among the regressors.
    pub(crate) fn top_power(&self) -> usize {
        if self.modulated { 2 } else { 1 }
    }
}

/// e^x to 0.3 % for |x| up to 4, in a few multiplications: it is asked of every sample.
fn exp(x: f32) -> f32 {
    let y = x * (1.0 / 16.0);
    let mut power = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0)));
    for _ in 0..4 {
        power *= power;
    }
    power
}
