//! What the rows say at one frequency between frames: shapes at any multiple of the frame rate from it, without a pass.
//!
//! At one row, f and ±f + k·fps are one: a tone and its images differ only in how the phase runs over the rows. So the inner
//! products of each series' residual with a tone's phasor at the *frames* hold all that the window knows of the tone and
//! of all its images. Shapes at any of them are then fitted to two numbers a series: exact where frames come evenly.
//!
//! With h = C·q* the amplitude that a series sees (C its shape's, q the slot's phasor) and E the frames' phasor less its mean,
//! the series' model is Re(h*·E) and its score z = Σ w·x·E. Least squares has M·h = z with
//! M·h = ½W(f₀·h + f₁·h*), f₀ = mean |E|² and f₁ = mean E². (Dropping f₁ is up to 12 % off where 2f is near a multiple of the
//! frame rate.)

use num_complex::Complex32 as Complex;

use super::blur::blur;
use super::model::Samples;
use super::parameters::Model;
use super::phase::Frequency;
use super::rows;
use super::shape::{BASIS, CONSTANTS, ORDERS, Shape};
use super::small::{SMALL, Small};
use crate::math::cos_sin;

const ZERO: Complex = Complex::new(0.0, 0.0);

/// Most bands of rows that have an amplitude of their own.
pub(crate) const BANDS: usize = 12;

/// The frames' part of the scores in [`Samples::score_re`] and [`Samples::score_im`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scores {
    plain: f32,
    pseudo: Complex,
}

impl Scores {
    /// Share of a tone's energy that is left in the scores.
    pub(crate) fn plain(&self) -> f32 {
        self.plain
    }
}

/// A shape that was fitted to the scores at one frequency.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeFit {
    pub(crate) shape: Shape,
    /// By how much it lowers the weighted sum of squares.
    pub(crate) gain: f32,
    /// What of that is lost where the motion along either axis has one phase in all rows, as a vibration's has that stands:
    /// ½(cᴴAc − |cᵀAc|).
    pub(crate) loss: f32,
}

impl Samples<'_> {
    /// One pass: the scores at the alias frequency of tone `i`, of all that `model` without the tones in `without` leaves.
    /// The tables must be at `model`.
    pub(crate) fn score(
        &mut self,
        model: &Model,
        i: usize,
        without: impl Fn(usize) -> bool,
    ) -> Scores {
        let Some(mut others) = self.copy_of(model) else {
            return Scores::default();
        };
        for (j, tone) in others.tones.iter_mut().enumerate() {
            if without(j) {
                tone.shape.clear();
            }
        }
        let (n, k) = (self.frames, i + 1);
        for series in 0..self.series() {
            let mut z = ZERO;
            if self.series_weight[series] > 0.0 {
                self.residual(series, &others.tones, &others.drift);
                let row = &self.row[..n];
                let re = &self.frame_re[k * n..k * n + n];
                let im = &self.frame_im[k * n..k * n + n];
                z = rows::products(row, row, re, im).0;
            }
            (self.score_re[series], self.score_im[series]) = (z.re, z.im);
        }
        let mean = self.frame_means(k)[0];
        let (mut plain, mut pseudo, mut total) = (0.0, ZERO, 0.0);
        for f in 0..n {
            let e = Complex::new(self.frame_re[k * n + f], self.frame_im[k * n + f]);
            let w = self.frame_weight[f];
            plain += w * e.norm_sqr();
            pseudo += (e * e).scale(w);
            total += w;
        }
        let scale = 1.0 / f32::max(total, f32::MIN_POSITIVE);
        Scores {
            plain: (plain * scale - mean.norm_sqr()).max(0.0),
            pseudo: pseudo.scale(scale) - mean * mean,
        }
    }

    /// One pass: chi² for each degree of freedom of what the tones of `model` leave at the alias frequency of tone `i` in
    /// single series, steadily and as it changes linearly in time.
    pub(crate) fn steadiness(&mut self, model: &Model, i: usize, variance: f32) -> (f32, f32) {
        let (n, k) = (self.frames, i + 1);
        let (mut even, mut changing, mut count) = (0.0, 0.0, 0.0);
        for series in 0..self.series() {
            let w = self.series_weight[series];
            if w <= 0.0 {
                continue;
            }
            self.residual(series, &model.tones, &model.drift);
            let (row, row_t) = (&self.row[..n], &mut self.row_t[..n]);
            let _ = rows::times(row, &self.frame_t[..n], row_t);
            let re = &self.frame_re[k * n..k * n + n];
            let im = &self.frame_im[k * n..k * n + n];
            let (zero, one) = rows::products(row, row_t, re, im);
            // ½W of energy each, and of t a twelfth of it.
            even += zero.norm_sqr() / w;
            changing += 12.0 * one.norm_sqr() / w;
            count += 1.0;
        }
        let scale = 1.0 / (variance * f32::max(count, 1.0));
        (scale * even, scale * changing)
    }

    /// The shape of so many coefficients along x and y at `at`, which may be negative for a mirror image, fitted to the
    /// scores of `slots`.
    pub(crate) fn shape_at(
        &self,
        scores: &Scores,
        at: Frequency,
        orders: [usize; 2],
        slots: core::ops::Range<usize>,
    ) -> ShapeFit {
        let mut shape = Shape::of_orders(orders[0], orders[1]);
        let fitted: heapless::Vec<usize, BASIS> = shape.fitted().collect();
        let hz = at.hz();
        let sums = self.inner_products(slots, fitted.len(), |series, columns| {
            let q = self.turned(series, at);
            let sight = self.sight(series);
            for (d, &j) in columns.iter_mut().zip(&fitted) {
                *d = sight.column(j, hz) * q;
            }
        });
        let (coefficients, gain) = sums.solve(scores);
        for (&j, c) in fitted.iter().zip(coefficients) {
            shape.change(j, |own| *own = c);
        }
        let mut loss = 0.0;
        for constant in CONSTANTS {
            let axis = constant..constant + ORDERS;
            let (mut size, mut square) = (0.0, ZERO);
            for (a, &j) in fitted.iter().enumerate() {
                for (b, &l) in fitted.iter().enumerate() {
                    if axis.contains(&j) && axis.contains(&l) {
                        let weight = sums.plain[a.max(b)][a.min(b)].re * 0.5 * scores.plain;
                        let (c, d) = (shape.coefficient(j), shape.coefficient(l));
                        size += weight * (c.conj() * d).re;
                        square += (c * d).scale(weight);
                    }
                }
            }
            loss += 0.5 * (size - crate::math::sqrtf(square.norm_sqr())).max(0.0);
        }
        ShapeFit { shape, gain, loss }
    }

    /// By how much two rigid tones would lower the sum of squares, along those axes.
    pub(crate) fn pair_gain(&self, scores: &Scores, pair: [Frequency; 2], axes: [bool; 2]) -> f32 {
        let mut places: heapless::Vec<(Frequency, usize), 4> = heapless::Vec::new();
        for at in pair {
            for (axis, _) in axes.iter().enumerate().filter(|(_, moves)| **moves) {
                let _ = places.push((at, CONSTANTS[axis]));
            }
        }
        let sums = self.inner_products(self.knowing(), places.len(), |series, columns| {
            let sight = self.sight(series);
            for (d, &(at, j)) in columns.iter_mut().zip(&places) {
                *d = sight.column(j, at.hz()) * self.turned(series, at);
            }
        });
        sums.solve(scores).1
    }

    /// What turns an amplitude at `at` into what a series sees from the frames' times.
    fn turned(&self, series: usize, at: Frequency) -> Complex {
        let slot = series % self.slots.max(1);
        let (c, s) = cos_sin(at.phase(self.slot_ns[slot]));
        (Complex::new(c, s) * blur(at.hz(), &self.spread[slot], &self.even)).conj()
    }

    /// Sums of the scores' fit over the series of `slots`, of `n` columns that `fill` gives for each.
    fn inner_products(
        &self,
        slots: core::ops::Range<usize>,
        n: usize,
        fill: impl Fn(usize, &mut [Complex; BASIS]),
    ) -> ColumnSums {
        let mut sums = ColumnSums {
            n: n.min(BASIS),
            side: [ZERO; BASIS],
            plain: [[ZERO; BASIS]; BASIS],
            pseudo: [[ZERO; BASIS]; BASIS],
        };
        for channel in 0..self.channels {
            for slot in slots.clone() {
                let series = channel * self.slots + slot;
                let w = self.series_weight[series];
                if w <= 0.0 {
                    continue;
                }
                let mut columns = [ZERO; BASIS];
                fill(series, &mut columns);
                let z = Complex::new(self.score_re[series], self.score_im[series]);
                for a in 0..sums.n {
                    let conj = columns[a].conj();
                    sums.side[a] += conj * z;
                    for b in 0..=a {
                        sums.plain[a][b] += (conj * columns[b]).scale(w);
                        sums.pseudo[a][b] += (conj * columns[b].conj()).scale(w);
                    }
                }
            }
        }
        sums
    }

    /// The slots that know something, from the first to the last.
    pub(crate) fn knowing(&self) -> core::ops::Range<usize> {
        let knows = |eta: &f32| eta.abs() < 1.0;
        let eta = &self.slot_eta[..self.slots];
        let first = eta.iter().position(knows).unwrap_or(0);
        let last = eta.iter().rposition(knows).unwrap_or(0);
        first..last + 1
    }

    /// By how much bands of rows with an amplitude each would lower the sum of squares at `at`, and how many numbers they
    /// have.
    pub(crate) fn free_gain(
        &self,
        scores: &Scores,
        at: Frequency,
        axes: [bool; 2],
        bands: usize,
    ) -> (f32, f32) {
        let orders = axes.map(usize::from);
        let (mut gain, mut numbers) = (0.0, 0);
        for band in self.bands(bands) {
            gain += self.shape_at(scores, at, orders, band).gain;
            numbers += 2 * (orders[0] + orders[1]);
        }
        (gain, numbers as f32)
    }

    /// No more than `most` bands of neighbouring slots, of about as many each.
    pub(crate) fn bands(
        &self,
        most: usize,
    ) -> impl Iterator<Item = core::ops::Range<usize>> + use<> {
        let knowing = self.knowing();
        let count = knowing.len();
        let bands = count.min(most).max(1);
        (0..bands).map(move |b| {
            knowing.start + b * count / bands..knowing.start + (b + 1) * count / bands
        })
    }
}

/// Inner products of columns with the scores and with each other.
struct ColumnSums {
    n: usize,
    side: [Complex; BASIS],
    plain: [[Complex; BASIS]; BASIS],
    pseudo: [[Complex; BASIS]; BASIS],
}

impl ColumnSums {
    /// The columns' amplitudes, and by how much they lower the sum of squares.
    fn solve(&self, scores: &Scores) -> ([Complex; BASIS], f32) {
        let n = self.n;
        let mut small = Small::new(2 * n);
        let mut right = [0.0; SMALL];
        for a in 0..n {
            (right[2 * a], right[2 * a + 1]) = (self.side[a].re, self.side[a].im);
            for b in 0..=a {
                let p = self.plain[a][b].scale(0.5 * scores.plain);
                let q = scores.pseudo.scale(0.5) * self.pseudo[a][b];
                small.add(2 * a, 2 * b, p.re + q.re);
                small.add(2 * a, 2 * b + 1, q.im - p.im);
                small.add(2 * a + 1, 2 * b, p.im + q.im);
                small.add(2 * a + 1, 2 * b + 1, p.re - q.re);
            }
        }
        let solution = small.solve(&right);
        let mut amplitudes = [ZERO; BASIS];
        let mut gain = 0.0;
        for (a, c) in amplitudes.iter_mut().enumerate().take(n) {
            *c = Complex::new(solution[2 * a], solution[2 * a + 1]);
            gain += (c.conj() * self.side[a]).re;
        }
        (amplitudes, gain)
    }
}
