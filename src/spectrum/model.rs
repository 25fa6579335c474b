//! The samples, the tones' phasor tables, and the one pass over the samples that everything else is made of.
//!
//! A *series* is one channel of one slot over the frames. Where the samples know one axis, a series is a slot. Where they know
//! both there are twice as many: first those of the sums u + κ·v, then those of v alone, whose noise is independent.

use core::cell::{RefCell, RefMut};

use num_complex::Complex32 as Complex;

use super::blur::blur;
use super::knowing::KnowingRows;
use super::parameters::{Drift, Model};
use super::phase::Frequency;
use super::rows::{self, NOTCHES, Notch};
use super::shape::{BASIS, Sight};
use super::tone::Tone;
use super::window::{NO_SKEW, SlotCoupling};
use crate::math::{cos_sin, turns};
use crate::report::MAX_PEAKS;
use crate::timeline::Spread;

/// Rows of the phasor tables: row 0 is the slow drift (frequency 0), the others are tones.
pub(crate) const TABLE_ROWS: usize = MAX_PEAKS + 1;

/// Powers of time a tone's amplitude and phase may need: 1, t, t².
pub(crate) const POWERS: usize = 3;

/// Weighted inner products of the residual with t^p·e^(iωt) times each of the shape's polynomials, p from 0.
pub(crate) type Moments = [[Complex; POWERS]; BASIS];

/// No moments.
pub(crate) const NO_MOMENTS: Moments = [[Complex::new(0.0, 0.0); POWERS]; BASIS];

/// The window as the passes see it: slices of one length a frame or a slot, tables of one row a tone.
#[derive(Debug)]
pub(crate) struct Samples<'a> {
    pub(crate) frames: usize,
    pub(crate) slots: usize,
    /// 1 where the samples know x alone, 2 where they know both axes.
    pub(crate) channels: usize,
    /// Axes along which motion is told: as many, but 1 where all edges lean one way.
    pub(crate) axes: usize,
    /// The direction across the edges where all of them lean one way, x and y: what is fitted along "x" is along it then.
    pub(crate) lean: Option<[f32; 2]>,
    /// One series after the other, `frames` each.
    pub(crate) shift_px: &'a mut [f32],
    pub(crate) weight: &'a mut [u16],
    /// One slot after the other: of both of its series.
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
    /// Where a slot is among the rows that know something, −1 to 1.
    pub(crate) slot_eta: &'a [f32],
    /// How places among them are rows of the part.
    pub(crate) rows: KnowingRows,
    /// How the two series of a slot see both axes.
    pub(crate) couplings: &'a [SlotCoupling],
    /// Sum of weights of each series.
    pub(crate) series_weight: &'a mut [f32],
    /// How a slot's rows lie in time.
    pub(crate) spread: &'a [Spread],
    /// The same where all rows of a slot know the same: amplitudes are told as if all slots were so.
    pub(crate) even: Spread,
    /// Scores of each series at a tone's alias frequency ([`Samples::score`]).
    pub(crate) score_re: &'a mut [f32],
    pub(crate) score_im: &'a mut [f32],
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
    /// What is taken out of each series like its mean.
    pub(crate) notches: heapless::Vec<Notch, NOTCHES>,
    /// Sum of weights.
    pub(crate) total_weight: f32,
    /// Samples with a weight.
    pub(crate) count: u32,
    /// Length of the window, s.
    pub(crate) length_s: f32,
    /// Models to try things on ([`Samples::copy_of`]).
    pub(crate) spares: &'a [RefCell<Model>],
}

impl<'a> Samples<'a> {
    /// A copy of a model in memory of the window's, until it is dropped; `None` where all spare ones are in use, which
    /// [`SPARES`](super::workspace::SPARES) rules out.
    pub(crate) fn copy_of(&self, model: &Model) -> Option<RefMut<'a, Model>> {
        let mut spares = self.spares.iter();
        let mut copy = spares.find_map(|spare| spare.try_borrow_mut().ok())?;
        copy.copy(model);
        Some(copy)
    }
}

impl Model {
    /// Fills the phasor tables.
    pub(crate) fn tabulate(&self, samples: &mut Samples<'_>) {
        for (i, tone) in self.tones.iter().enumerate() {
            samples.tabulate(i + 1, tone);
        }
        samples.set_notches(&self.tones);
    }
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
        let (mut sum, mut total) = (Complex::new(0.0, 0.0), 0.0);
        for (&ns, &w) in self
            .slot_ns
            .iter()
            .zip(self.series_weight.iter())
            .take(self.slots)
        {
            let (re, im) = cos_sin(frequency.phase(ns));
            sum += Complex::new(re, im).scale(w);
            total += w;
        }
        sum.norm_sqr() / (total * total).max(f32::MIN_POSITIVE)
    }

    /// Series of samples there are.
    pub(crate) fn series(&self) -> usize {
        self.channels * self.slots
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
                phasor = phasor.scale(tone.grown_within(t));
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
    pub(crate) fn own_phasors(&mut self, tone: &Tone, slot: usize) {
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

    /// Leaves the weighted residual of one series, its mean removed, in `row`; returns its weighted sum of squares.
    ///
    /// Removing the mean is the projection off the series' unknown offset.
    pub(crate) fn residual(&mut self, series: usize, tones: &[Tone], drift: &Drift) -> f32 {
        let n = self.frames;
        let here = series * n..series * n + n;
        let slot = series % self.slots.max(1);
        let sight = self.sight(series);
        let at = self.slot_t[slot];
        let along = |power: usize| {
            drift[0][power] * sight.of_drift(0) + drift[1][power] * sight.of_drift(1)
        };
        let (linear, square) = (along(0) + 2.0 * along(1) * at, along(1));
        let shifts = &self.shift_px[here.clone()];
        rows::less_drift(
            &mut self.row[..n],
            shifts,
            &self.frame_t[..n],
            linear,
            square,
        );
        let late = self.late(slot * n..slot * n + n);
        for (i, tone) in tones.iter().enumerate().filter(|(_, t)| !t.modulated) {
            let k = i + 1;
            let hz = tone.frequency.hz();
            let g = sight.seen(&tone.shape, hz) * self.slot_phasor(k, slot).conj();
            let phasors = (
                &self.frame_re[k * n..k * n + n],
                &self.frame_im[k * n..k * n + n],
            );
            let row = &mut self.row[..n];
            match late {
                None => rows::less_tone(row, phasors.0, phasors.1, g),
                Some(step_ns) => {
                    let turn = core::f32::consts::TAU * hz * 1e-9 * step_ns;
                    rows::less_late_tone(row, phasors, &self.row_t[..n], turn, g);
                }
            }
        }
        // These use `row_t` for their own times.
        for tone in tones.iter().filter(|t| t.modulated) {
            self.own_phasors(tone, slot);
            let a = sight.seen(&tone.shape, tone.frequency.hz());
            for i in 0..n {
                self.row[i] -= a.re * self.own_re[i] + a.im * self.own_im[i];
            }
        }
        let weight = &self.weight[here];
        let row = &mut self.row[..n];
        let total = self.series_weight[series];
        let mean = if total > 0.0 {
            rows::weighted_sum(weight, row) / total
        } else {
            0.0
        };
        let squares = rows::center(weight, row, mean);
        if self.notches.is_empty() {
            return squares;
        }
        squares - self.take_notches(series)
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

    /// One pass: the residual's weighted sum of squares, its products with the drift (t, t² along either axis) and the
    /// moments of every tone.
    pub(crate) fn pass(
        &mut self,
        tones: &[Tone],
        drift: &Drift,
        moments: &mut [Moments; MAX_PEAKS],
    ) -> (f32, Drift) {
        let n = self.frames;
        let mut squares = 0.0;
        let mut slow = [[0.0_f32; 2]; 2];
        moments[..tones.len().min(MAX_PEAKS)].fill(NO_MOMENTS);
        for series in 0..self.series() {
            if self.series_weight[series] <= 0.0 {
                continue;
            }
            let slot = series % self.slots;
            let sight = self.sight(series);
            squares += self.residual(series, tones, drift);
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
                add(&mut moments[i], tone, &sight, &sums);
            }
            let (row, row_t) = (&self.row[..n], &mut self.row_t[..n]);
            let (first, second) = rows::times(row, &self.frame_t[..n], row_t);
            let row_t = &self.row_t[..n];
            for (axis, slow) in slow.iter_mut().enumerate() {
                let share = sight.of_drift(axis);
                slow[0] += share * first;
                slow[1] += share * (second + 2.0 * t * first);
            }
            for (i, tone) in tones.iter().enumerate() {
                if tone.modulated {
                    continue;
                }
                let k = i + 1;
                let re = &self.frame_re[k * n..k * n + n];
                let im = &self.frame_im[k * n..k * n + n];
                let q = self.slot_phasor(k, slot);
                let (zero, one) = rows::products(row, row_t, re, im);
                let sums = [q * zero, q * (one + zero.scale(t)), Complex::new(0.0, 0.0)];
                add(&mut moments[i], tone, &sight, &sums);
            }
        }
        (squares, slow)
    }
}

/// Adds what a series' sums are to the coefficients of the tone's shape.
fn add(moments: &mut Moments, tone: &Tone, sight: &Sight, sums: &[Complex; POWERS]) {
    let hz = tone.frequency.hz();
    for j in tone.shape.fitted() {
        let seen = sight.column(j, hz).conj();
        for (m, s) in moments[j].iter_mut().zip(sums) {
            *m += seen * s;
        }
    }
}
