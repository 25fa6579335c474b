//! The residual seen from one frequency: a slow complex series, two points a frame.
//!
//! A tone that changes within the window is spread over many cells of a periodogram. Turned back by a
//! frequency near its own it is slow, and what its changing looks like can be tried on a few points
//! instead of all samples: how fast it speeds up ([`Demodulated::ramp`]), when it was struck ([`Demodulated::struck`]).

use super::model::Samples;
use super::parameters::Model;
use super::phase::Frequency;
use super::tone::Tone;
use crate::math::{cos_sin, turns};

/// Fastest change of frequency that is looked for, turns a window length squared.
const MOST_CHIRP: f32 = 48.0;

/// From one change of frequency that is tried to the next: the fit finds what is between.
const CHIRP_STEP: f32 = 3.0;

/// From one frequency that is tried to the next, turns a window length.
const STEP: f32 = 0.5;

/// A tone is looked for within half of its change of frequency and so much of where it stands out, turns a window length.
const REACH: f32 = 3.0;

/// Floats of lent memory a frame.
const A_FRAME: usize = 8;

/// Decays that are tried for what was struck, s: the fit finds what is between.
const DECAYS_S: [f32; 4] = [0.03, 0.08, 0.2, 0.5];

/// A residual turned back by a frequency: weighted sums over half a frame each.
#[derive(Debug)]
pub(crate) struct Demodulated<'g> {
    re: &'g mut [f32],
    im: &'g mut [f32],
    /// Middle of each half frame, window lengths.
    t: &'g mut [f32],
    /// Sum of its samples' weights.
    weight: &'g mut [f32],
}

/// Where a tone may have been struck.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Struck {
    /// When, in window lengths from the middle.
    pub(crate) onset: f32,
    /// How fast it dies away, 1 a window length.
    pub(crate) growth: f32,
}

impl<'g> Demodulated<'g> {
    /// What `model` leaves, seen from `frequency`; `None` where the lent memory or the tables are too small.
    pub(crate) fn of(
        samples: &mut Samples<'_>,
        model: &Model,
        (frequency, axis): (Frequency, usize),
        grid: &'g mut [f32],
    ) -> Option<Self> {
        let (n, k) = (samples.frames, model.tones.len() + 1);
        if k > samples.most_tones() {
            return None;
        }
        let (grid, _) = grid.split_at_mut_checked(A_FRAME * n)?;
        grid.fill(0.0);
        let (re, rest) = grid.split_at_mut(2 * n);
        let (im, rest) = rest.split_at_mut(2 * n);
        let (t, weight) = rest.split_at_mut(2 * n);
        model.tabulate(samples);
        samples.tabulate(k, &Tone::steady(frequency, axis));
        let total: f32 = samples.series_weight[..samples.slots].iter().sum();
        let mut so_far = 0.0;
        // Where the halves' middles are in the frame.
        let mut late = [(0.0, 0.0_f32); 2];
        for series in 0..samples.series() {
            let slot = series % samples.slots;
            if slot == 0 {
                so_far = 0.0;
            }
            let known = samples.series_weight[slot];
            let half = usize::from(so_far + 0.5 * known > 0.5 * total);
            so_far += known;
            let share = samples.sight(series).of_drift(axis);
            if samples.series_weight[series] <= 0.0 || share == 0.0 {
                continue;
            }
            late[half].0 += known * samples.slot_t[slot];
            late[half].1 += known;
            samples.residual(series, &model.tones, &model.drift);
            let q = samples.slot_phasor(k, slot).scale(share);
            for i in 0..n {
                let at = 2 * i + half;
                let (c, s) = (samples.frame_re[k * n + i], samples.frame_im[k * n + i]);
                re[at] += samples.row[i] * (q.re * c - q.im * s);
                im[at] += samples.row[i] * (q.re * s + q.im * c);
            }
        }
        for i in 0..2 * n {
            let (late, known) = late[i % 2];
            t[i] = samples.frame_t[i / 2] + late / known.max(f32::MIN_POSITIVE);
            weight[i] = samples.frame_weight[i / 2] * known / total.max(f32::MIN_POSITIVE);
        }
        Some(Self { re, im, t, weight })
    }

    /// The frequency, in turns a window length from where it is seen from, and its change, turns a window length
    /// squared, at which an evenly changing one holds most.
    pub(crate) fn ramp(&self) -> (f32, f32) {
        let mut best = (0.0, 0.0, 0.0);
        let most = (MOST_CHIRP / CHIRP_STEP) as i32;
        for step in -most..=most {
            let chirp = CHIRP_STEP * step as f32;
            let reach = ((0.5 * chirp.abs() + REACH) / STEP) as i32;
            for away in -reach..=reach {
                let away = STEP * away as f32;
                let held = self.held(away, chirp);
                if held > best.0 {
                    best = (held, away, chirp);
                }
            }
        }
        (best.1, best.2)
    }

    /// When a tone that dies away may have been struck so that it holds most, the window being `length_s` long.
    pub(crate) fn struck(&self, length_s: f32) -> Struck {
        let mut best = (0.0, Struck::default());
        for decay_s in DECAYS_S {
            let growth = -length_s / decay_s;
            // From the end on: what a tone that is struck there holds, and could.
            let (mut re, mut im, mut could) = (0.0_f32, 0.0_f32, 0.0_f32);
            for i in (0..self.t.len()).rev() {
                let later = self.t.get(i + 1).map_or(0.0, |next| next - self.t[i]);
                let left = libm::expf((growth * later).max(-60.0));
                re = self.re[i] + left * re;
                im = self.im[i] + left * im;
                could = self.weight[i] + left * left * could;
                let held = (re * re + im * im) / could.max(f32::MIN_POSITIVE);
                if held > best.0 {
                    let before = i.checked_sub(1).map_or(-1.0, |b| self.t[b]);
                    let onset = 0.5 * (before + self.t[i]);
                    best = (held, Struck { onset, growth });
                }
            }
        }
        best.1
    }

    /// Power at a frequency and its change.
    fn held(&self, away: f32, chirp: f32) -> f32 {
        let (mut re, mut im) = (0.0, 0.0);
        for ((&a, &b), &t) in self.re.iter().zip(self.im.iter()).zip(self.t.iter()) {
            let (c, s) = cos_sin(turns((away + 0.5 * chirp * t) * t));
            re += a * c - b * s;
            im += a * s + b * c;
        }
        re * re + im * im
    }
}
