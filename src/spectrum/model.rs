//! Tones, their phasor tables, and the one pass over the samples that everything else is made of.

use num_complex::Complex32 as Complex;

use super::blur::blur;
use super::phase::Frequency;
use super::rows;
use crate::math::{cos_sin, turns};
use crate::report::MAX_PEAKS;
use crate::timeline::Spread;

/// Rows of the phasor tables: row 0 is the slow drift (frequency 0), the others are tones.
pub(crate) const TABLE_ROWS: usize = MAX_PEAKS + 1;

/// Powers of time a tone's amplitude and phase may need: 1, t, t².
pub(crate) const POWERS: usize = 3;

/// A sample is skewed where its time is off its frame's and slot's by more than this many steps.
pub(crate) const NO_SKEW: u16 = 16;

/// One sinusoid: Re(conj(amplitude) · e^(growth·t + 2πi(f·t + chirp·t²/2))), t in window lengths from the middle.
///
/// What was struck dies away so: a linear growth in place of e^(growth·t) leaves beside it what it does not follow, and
/// where the blank time is long that has ghosts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tone {
    pub(crate) frequency: Frequency,
    /// px.
    pub(crate) amplitude: Complex,
    /// Turns per window length squared.
    pub(crate) chirp: f32,
    /// Relative change of amplitude, 1 a window length.
    pub(crate) growth: f32,
    /// `chirp` and `growth` are fitted.
    pub(crate) modulated: bool,
}

impl Tone {
    pub(crate) fn steady(frequency: Frequency) -> Self {
        Self {
            frequency,
            amplitude: Complex::new(0.0, 0.0),
            chirp: 0.0,
            growth: 0.0,
            modulated: false,
        }
    }

    /// How much larger it is at `t`.
    #[inline(never)]
    fn grown(&self, t: f32) -> f32 {
        exp(self.growth * t)
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

/// Weighted inner products of the residual with t^p·e^(iωt), p from 0.
pub(crate) type Moments = [Complex; POWERS];

/// The window as the passes see it: slices of one length a frame or a slot, tables of one row a tone.
#[derive(Debug)]
pub(crate) struct Samples<'a> {
    pub(crate) frames: usize,
    pub(crate) slots: usize,
    /// Slot-major, `frames` a slot.
    pub(crate) shift_px: &'a mut [f32],
    pub(crate) weight: &'a mut [u16],
    pub(crate) skew: &'a mut [i16],
    /// A step of the skew, ns; `None` where no sample is skewed.
    pub(crate) skew_ns: Option<f32>,
    /// Start of a frame after the middle of the window, ns, and in window lengths.
    pub(crate) frame_ns: &'a mut [i64],
    pub(crate) frame_t: &'a mut [f32],
    pub(crate) frame_weight: &'a mut [f32],
    /// Time of a slot after its frame's mean, ns, and in window lengths.
    pub(crate) slot_ns: &'a mut [i64],
    pub(crate) slot_t: &'a mut [f32],
    pub(crate) slot_weight: &'a mut [f32],
    /// How a slot's rows lie in time.
    pub(crate) spread: &'a [Spread],
    /// The same where all rows of a slot know the same: amplitudes are told as if all slots were so.
    pub(crate) even: Spread,
    /// Phasors, a row a tone.
    pub(crate) frame_re: &'a mut [f32],
    pub(crate) frame_im: &'a mut [f32],
    pub(crate) slot_re: &'a mut [f32],
    pub(crate) slot_im: &'a mut [f32],
    /// Scratch, one of each a frame.
    pub(crate) row: &'a mut [f32],
    pub(crate) row_t: &'a mut [f32],
    pub(crate) own_re: &'a mut [f32],
    pub(crate) own_im: &'a mut [f32],
    /// Sum of weights.
    pub(crate) total_weight: f32,
    /// Samples with a weight.
    pub(crate) count: u32,
    /// Length of the window, s.
    pub(crate) length_s: f32,
}

impl Samples<'_> {
    /// Tones the tables have room for.
    pub(crate) fn most_tones(&self) -> usize {
        let frames = self.frame_re.len() / self.frames.max(1);
        let slots = self.slot_re.len() / self.slots.max(1);
        frames.min(slots).min(TABLE_ROWS).saturating_sub(1)
    }

    /// Power that a periodogram has `hz`, a multiple of the frame rate, away from a tone, over the tone's own.
    pub(crate) fn ghost(&self, hz: f32) -> f32 {
        let frequency = Frequency::from_hz(hz);
        let mut sum = Complex::new(0.0, 0.0);
        for (&ns, &w) in self
            .slot_ns
            .iter()
            .zip(self.slot_weight.iter())
            .take(self.slots)
        {
            let (re, im) = cos_sin(frequency.phase(ns));
            sum += Complex::new(re, im).scale(w);
        }
        sum.norm_sqr() / (self.total_weight * self.total_weight)
    }

    /// Fills table row `k` for `tone`.
    pub(crate) fn tabulate(&mut self, k: usize, tone: &Tone) {
        let n = self.frames;
        let rows = self.frame_re[k * n..]
            .iter_mut()
            .zip(self.frame_im[k * n..].iter_mut());
        for ((re, im), (&ns, &t)) in rows.zip(self.frame_ns.iter().zip(self.frame_t.iter()).take(n))
        {
            let mut phase = tone.frequency.phase(ns);
            if tone.modulated {
                phase = phase.wrapping_add(turns(0.5 * tone.chirp * t * t));
            }
            (*re, *im) = cos_sin(phase);
            if tone.modulated {
                let grown = tone.grown(t);
                (*re, *im) = (grown * *re, grown * *im);
            }
        }
        let s = self.slots;
        let rows = self.slot_re[k * s..]
            .iter_mut()
            .zip(self.slot_im[k * s..].iter_mut());
        let hz = tone.frequency.hz();
        let slots = self.slot_ns.iter().zip(self.slot_t.iter());
        for ((re, im), ((&ns, &t), spread)) in rows.zip(slots.zip(self.spread).take(s)) {
            let (c, s) = cos_sin(tone.frequency.phase(ns));
            let mut phasor = Complex::new(c, s) * blur(hz, spread, &self.even);
            if tone.modulated {
                phasor = phasor.scale(tone.grown(t));
            }
            (*re, *im) = (phasor.re, phasor.im);
        }
    }

    /// The slot's phasor of table row `k`.
    pub(crate) fn slot_phasor(&self, k: usize, slot: usize) -> Complex {
        Complex::new(
            self.slot_re[k * self.slots + slot],
            self.slot_im[k * self.slots + slot],
        )
    }

    /// A modulated tone's exact phasors at the samples of one slot, into the scratch rows, and their times
    /// into `row_t`: its phase is no product of frame and slot.
    fn own_phasors(&mut self, tone: &Tone, slot: usize) {
        let n = self.frames;
        let (ns, t) = (self.slot_ns[slot], self.slot_t[slot]);
        let blur = blur(tone.frequency.hz(), &self.spread[slot], &self.even);
        for i in 0..n {
            let at = self.frame_t[i] + t;
            let phase = tone
                .frequency
                .phase(self.frame_ns[i].wrapping_add(ns))
                .wrapping_add(turns(0.5 * tone.chirp * at * at));
            let (c, s) = cos_sin(phase);
            let phasor = (Complex::new(c, s) * blur).scale(tone.grown(at));
            (self.own_re[i], self.own_im[i]) = (phasor.re, phasor.im);
            self.row_t[i] = at;
        }
    }

    /// Leaves the weighted residual of one slot, its mean removed, in `row`; returns its weighted sum of squares.
    ///
    /// Removing the mean is the projection off the slot's unknown offset.
    pub(crate) fn residual(&mut self, slot: usize, tones: &[Tone], drift: [f32; 2]) -> f32 {
        let n = self.frames;
        let here = slot * n..slot * n + n;
        let at = self.slot_t[slot];
        let (linear, square) = (drift[0] + 2.0 * drift[1] * at, drift[1]);
        let shifts = &self.shift_px[here.clone()];
        rows::less_drift(
            &mut self.row[..n],
            shifts,
            &self.frame_t[..n],
            linear,
            square,
        );
        let late = self.late(here.clone());
        for (i, tone) in tones.iter().enumerate().filter(|(_, t)| !t.modulated) {
            let k = i + 1;
            let g = tone.amplitude * self.slot_phasor(k, slot).conj();
            let phasors = (
                &self.frame_re[k * n..k * n + n],
                &self.frame_im[k * n..k * n + n],
            );
            let row = &mut self.row[..n];
            match late {
                None => rows::less_tone(row, phasors.0, phasors.1, g),
                Some(step_ns) => {
                    let turn = core::f32::consts::TAU * tone.frequency.hz() * 1e-9 * step_ns;
                    rows::less_late_tone(row, phasors, &self.row_t[..n], turn, g);
                }
            }
        }
        // These use `row_t` for their own times.
        for tone in tones.iter().filter(|t| t.modulated) {
            self.own_phasors(tone, slot);
            let a = tone.amplitude;
            for i in 0..n {
                self.row[i] -= a.re * self.own_re[i] + a.im * self.own_im[i];
            }
        }
        let weight = &self.weight[here];
        let row = &mut self.row[..n];
        let total = self.slot_weight[slot];
        let mean = if total > 0.0 {
            rows::weighted_sum(weight, row) / total
        } else {
            0.0
        };
        rows::center(weight, row, mean)
    }

    /// Leaves the skews of one slot's samples in `row_t`, where there are any; a step of them, ns.
    fn late(&mut self, here: core::ops::Range<usize>) -> Option<f32> {
        let step_ns = self.skew_ns?;
        let mut any = false;
        for (late, &skew) in self.row_t.iter_mut().zip(&self.skew[here]) {
            *late = f32::from(skew);
            any |= skew.unsigned_abs() > NO_SKEW;
        }
        any.then_some(step_ns)
    }

    /// One pass: the residual's weighted sum of squares, its products with the drift (t, t²) and the moments of
    /// every tone.
    pub(crate) fn pass(
        &mut self,
        tones: &[Tone],
        drift: [f32; 2],
        moments: &mut [Moments; MAX_PEAKS],
    ) -> (f32, [f32; 2]) {
        let n = self.frames;
        let mut squares = 0.0;
        let mut slow = [0.0_f32; 2];
        *moments = [[Complex::new(0.0, 0.0); POWERS]; MAX_PEAKS];
        for slot in 0..self.slots {
            if self.slot_weight[slot] <= 0.0 {
                continue;
            }
            squares += self.residual(slot, tones, drift);
            let t = self.slot_t[slot];
            for (i, tone) in tones.iter().enumerate() {
                if !tone.modulated {
                    continue;
                }
                self.own_phasors(tone, slot);
                let mut sums = [Complex::new(0.0, 0.0); POWERS];
                for i in 0..n {
                    let at = self.row_t[i];
                    let product = Complex::new(self.own_re[i], self.own_im[i]).scale(self.row[i]);
                    sums[0] += product;
                    sums[1] += product.scale(at);
                    sums[2] += product.scale(at * at);
                }
                for (m, s) in moments[i].iter_mut().zip(sums) {
                    *m += s;
                }
            }
            let (row, row_t) = (&self.row[..n], &mut self.row_t[..n]);
            let (first, second) = rows::times(row, &self.frame_t[..n], row_t);
            let row_t = &self.row_t[..n];
            slow[0] += first;
            slow[1] += second + 2.0 * t * first;
            for (i, tone) in tones.iter().enumerate() {
                if tone.modulated {
                    continue;
                }
                let k = i + 1;
                let re = &self.frame_re[k * n..k * n + n];
                let im = &self.frame_im[k * n..k * n + n];
                let q = self.slot_phasor(k, slot);
                let (zero, one) = rows::products(row, row_t, re, im);
                let m = &mut moments[i];
                m[0] += q * zero;
                m[1] += q * (one + zero.scale(t));
            }
        }
        (squares, slow)
    }
}
