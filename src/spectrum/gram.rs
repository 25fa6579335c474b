//! How much the regressors of the joint fit have in common: the normal matrix, at the cost of frames plus slots.
//!
//! The weight of a sample is taken as a frame's times a slot's. Then every inner product of t^p·e^(iωt)
//! with t^q·e^(iω't), t = t_n + τ_s, is a sum over frames times a sum over slots, and removing the slots'
//! offsets is removing a mean over frames. The samples' true weights enter the residual and its products
//! ([`super::model`]), so the fit's fixed point is exact; only its way there and the stated deviations use this.

use num_complex::Complex32 as Complex;

use super::cholesky::{MOST, Normal};
use super::model::{POWERS, Samples};
use super::shape::{BASIS, CONSTANTS};
use super::tone::Tone;

/// Powers of t in the product of two regressors.
const PRODUCT_POWERS: usize = 2 * POWERS - 1;

/// Binomial coefficients up to (t_n + τ_s)².
const BINOMIAL: [[f32; POWERS]; POWERS] = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 1.0]];

const ZERO: Complex = Complex::new(0.0, 0.0);

/// One real regressor Re(conj(factor·b) · t^power · e^(iωt)) of the tone in table row `table`; b is what the basis of a
/// series has at `column`, or without one the whole shape of the tone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Regressor {
    pub(crate) table: u8,
    pub(crate) power: u8,
    pub(crate) column: Option<u8>,
    pub(crate) factor: Complex,
}

impl Regressor {
    /// What it has of column `j` of the basis, for the tone of its table row.
    pub(crate) fn share(&self, tone: Option<&Tone>, j: usize) -> Complex {
        match (self.column, tone) {
            (Some(column), _) if usize::from(column) == j => self.factor,
            (None, Some(tone)) => self.factor * tone.shape.coefficient(j),
            _ => ZERO,
        }
    }
}

/// What a regressor's coefficient is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// Slow drift: t and t², along x and y.
    Drift,
    /// Real part of a coefficient of the shape.
    Re,
    /// Imaginary part of a coefficient of the shape.
    Im,
    /// Frequency, turns a window length.
    Frequency,
    /// Chirp, turns a window length squared.
    Chirp,
    /// Growth a window length.
    Growth,
}

/// The regressors of the fit, in the order of the unknowns.
#[derive(Debug)]
pub(crate) struct Regressors {
    list: heapless::Vec<(Regressor, Unknown), MOST>,
}

impl Regressors {
    /// Drift (`drift` powers of t along each of the samples' axes), then each tone's. A tone without amplitude yet has no
    /// frequency to fit.
    pub(crate) fn of(tones: &[Tone], drift: usize, axes: usize) -> Self {
        let mut regressors = Self {
            list: heapless::Vec::new(),
        };
        let one = Complex::new(1.0, 0.0);
        for column in CONSTANTS.into_iter().take(axes) {
            for power in 1..=drift.min(2) {
                regressors.add((0, power, Some(column)), one, Unknown::Drift);
            }
        }
        let free = || tones.iter().enumerate().filter(|(_, t)| !t.frozen);
        for (i, tone) in free() {
            for j in tone.shape.fitted() {
                regressors.add((i + 1, 0, Some(j)), one, Unknown::Re);
                regressors.add((i + 1, 0, Some(j)), Complex::new(0.0, 1.0), Unknown::Im);
            }
            if !tone.shape.is_zero() {
                let turn = Complex::new(0.0, -core::f32::consts::TAU);
                regressors.add((i + 1, 1, None), turn, Unknown::Frequency);
            }
        }
        for (i, tone) in free() {
            if tone.modulated && !tone.shape.is_zero() {
                if tone.onset.is_none() {
                    let turn = Complex::new(0.0, -0.5 * core::f32::consts::TAU);
                    regressors.add((i + 1, 2, None), turn, Unknown::Chirp);
                }
                regressors.add((i + 1, 1, None), one, Unknown::Growth);
            }
        }
        regressors
    }

    /// One more: table row, power of t, column. A full list leaves it unfitted; it holds those of rigid tones, and shapes
    /// are given only while there is room ([`Regressors::have_room`]).
    fn add(
        &mut self,
        (table, power, column): (usize, usize, Option<usize>),
        factor: Complex,
        unknown: Unknown,
    ) {
        let regressor = Regressor {
            table: table as u8,
            power: power as u8,
            column: column.map(|c| c as u8),
            factor,
        };
        let _ = self.list.push((regressor, unknown));
    }

    /// Whether these tones and a few rigid ones more can be fitted at once.
    pub(crate) fn have_room(tones: &[Tone], axes: usize) -> bool {
        let a_tone = |t: &Tone| 2 * t.shape.count() + if t.modulated { 3 } else { 1 };
        let used: usize = tones.iter().map(a_tone).sum();
        let left = crate::report::MAX_PEAKS.saturating_sub(tones.len());
        used + 2 * axes + 3 * left.min(4) <= MOST
    }

    pub(crate) fn list(&self) -> &[(Regressor, Unknown)] {
        &self.list
    }
}

/// Σ over frames or slots of weight · t^m · a · b* and · a · b.
#[derive(Clone, Copy)]
struct Sums {
    plain: [Complex; PRODUCT_POWERS],
    pseudo: [Complex; PRODUCT_POWERS],
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, w: f32, t: f32, a: Complex, b: Complex, powers: usize) {
        let (rr, ii) = (w * a.re * b.re, w * a.im * b.im);
        let (ri, ir) = (w * a.re * b.im, w * a.im * b.re);
        let mut plain = Complex::new(rr + ii, ir - ri);
        let mut pseudo = Complex::new(rr - ii, ir + ri);
        for m in 0..=powers.min(PRODUCT_POWERS - 1) {
            self.plain[m] += plain;
            self.pseudo[m] += pseudo;
            plain = plain.scale(t);
            pseudo = pseudo.scale(t);
        }
    }
}

fn sums(
    weight: &[f32],
    t: &[f32],
    a: (&[f32], &[f32]),
    b: (&[f32], &[f32]),
    powers: usize,
) -> Sums {
    let mut sums = Sums {
        plain: [ZERO; PRODUCT_POWERS],
        pseudo: [ZERO; PRODUCT_POWERS],
    };
    let a = a.0.iter().zip(a.1);
    let b = b.0.iter().zip(b.1);
    for (((&w, &t), (&ar, &ai)), (&br, &bi)) in weight.iter().zip(t).zip(a).zip(b) {
        sums.add(w, t, Complex::new(ar, ai), Complex::new(br, bi), powers);
    }
    sums
}

/// Inner products of all powers of t of two table rows, plain (with the conjugate) and pseudo (without).
pub(crate) struct Products {
    plain: [[Complex; POWERS]; POWERS],
    pseudo: [[Complex; POWERS]; POWERS],
}

/// The weighted means over frames of t^p·phasor, p from 0.
pub(crate) type FrameMeans = [Complex; POWERS];

impl Samples<'_> {
    pub(crate) fn frame_means(&self, k: usize) -> FrameMeans {
        let n = self.frames;
        let mut means = [ZERO; POWERS];
        let phasors = self.frame_re[k * n..k * n + n]
            .iter()
            .zip(&self.frame_im[k * n..k * n + n]);
        for ((&re, &im), (&w, &t)) in phasors.zip(self.frame_weight.iter().zip(self.frame_t.iter()))
        {
            let mut term = Complex::new(re, im).scale(w);
            for mean in &mut means {
                *mean += term;
                term = term.scale(t);
            }
        }
        means.map(|m| m.unscale(self.total_weight))
    }

    /// Sums over frames of table rows `k` and `l`.
    fn over_frames(&self, k: usize, l: usize, powers: usize) -> Sums {
        let n = self.frames;
        sums(
            &self.frame_weight[..n],
            &self.frame_t[..n],
            (
                &self.frame_re[k * n..k * n + n],
                &self.frame_im[k * n..k * n + n],
            ),
            (
                &self.frame_re[l * n..l * n + n],
                &self.frame_im[l * n..l * n + n],
            ),
            powers,
        )
    }

    /// Sums over series of column `i` of table row `k` and column `j` of table row `l`.
    fn over_series(
        &self,
        tones: &[Tone],
        (k, i): (usize, usize),
        (l, j): (usize, usize),
        powers: usize,
    ) -> Sums {
        let s = self.slots;
        let hz = |k: usize| tone_of(tones, k).map_or(0.0, |t| t.frequency.hz());
        let (hz_k, hz_l) = (hz(k), hz(l));
        let mut sums = Sums {
            plain: [ZERO; PRODUCT_POWERS],
            pseudo: [ZERO; PRODUCT_POWERS],
        };
        for series in 0..self.series() {
            let w = self.series_weight[series];
            if w <= 0.0 {
                continue;
            }
            let sight = self.sight(series);
            let slot = series % s;
            let a = self.slot_phasor(k, slot) * sight.column(i, hz_k).conj();
            let b = self.slot_phasor(l, slot) * sight.column(j, hz_l).conj();
            sums.add(w, self.slot_t[slot], a, b, powers);
        }
        sums
    }

    /// Inner products from the sums over frames and those over series.
    fn products(
        &self,
        (over_frames, over_series): (&Sums, &Sums),
        means: (&FrameMeans, &FrameMeans),
        powers: (usize, usize),
    ) -> Products {
        let mut products = Products {
            plain: [[ZERO; POWERS]; POWERS],
            pseudo: [[ZERO; POWERS]; POWERS],
        };
        let scale = 1.0 / self.total_weight;
        for p in 0..=powers.0 {
            for q in 0..=powers.1 {
                let (mut plain, mut pseudo) = (ZERO, ZERO);
                for i in 0..=p {
                    for j in 0..=q {
                        let c = BINOMIAL[p][i] * BINOMIAL[q][j] * scale;
                        let (a, b) = (p - i, q - j);
                        let removed = (means.0[a] * means.1[b].conj(), means.0[a] * means.1[b]);
                        let f = over_frames.plain[a + b] - removed.0.scale(self.total_weight);
                        let g = over_frames.pseudo[a + b] - removed.1.scale(self.total_weight);
                        plain += (f * over_series.plain[i + j]).scale(c);
                        pseudo += (g * over_series.pseudo[i + j]).scale(c);
                    }
                }
                products.plain[p][q] = plain;
                products.pseudo[p][q] = pseudo;
            }
        }
        products
    }

    /// Share of a steady tone's energy that the removal of the slots' offsets leaves, c(f) of docs/spectrum.md.
    pub(crate) fn kept(&self, means: &FrameMeans) -> f32 {
        (1.0 - means[0].norm_sqr()).clamp(0.0, 1.0)
    }

    /// Fills the normal matrix of these regressors.
    pub(crate) fn normal(&self, regressors: &Regressors, tones: &[Tone], normal: &mut Normal) {
        normal.clear(regressors.list().len());
        let mut means = [[ZERO; POWERS]; super::model::TABLE_ROWS];
        for (k, m) in means.iter_mut().enumerate().take(tones.len() + 1) {
            *m = self.frame_means(k);
        }
        let power = |k: usize| match k {
            0 => 2,
            _ => tone_of(tones, k).map_or(1, Tone::top_power),
        };
        for k in 0..=tones.len() {
            for l in 0..=k {
                let powers = (power(k), power(l));
                let over_frames = self.over_frames(k, l, powers.0 + powers.1);
                for i in self.columns(tones, k) {
                    for j in self.columns(tones, l) {
                        let over_series =
                            self.over_series(tones, (k, i), (l, j), powers.0 + powers.1);
                        let products = self.products(
                            (&over_frames, &over_series),
                            (&means[k], &means[l]),
                            powers,
                        );
                        regressors.add_products(tones, (k, i), (l, j), &products, normal);
                    }
                }
            }
        }
    }

    /// Columns of the basis that table row `k` uses.
    fn columns(&self, tones: &[Tone], k: usize) -> heapless::Vec<usize, BASIS> {
        match tone_of(tones, k) {
            Some(tone) => tone.shape.fitted().collect(),
            None => CONSTANTS.into_iter().take(self.axes).collect(),
        }
    }
}

/// The tone of table row `k`; none of the drift's.
fn tone_of(tones: &[Tone], k: usize) -> Option<&Tone> {
    k.checked_sub(1).and_then(|i| tones.get(i))
}

impl Regressors {
    /// Adds what the regressors of two table rows have in common by these two columns.
    fn add_products(
        &self,
        tones: &[Tone],
        (k, column): (usize, usize),
        (l, other): (usize, usize),
        products: &Products,
        normal: &mut Normal,
    ) {
        let of = |table: usize| {
            let list = self.list.iter().enumerate();
            list.filter(move |(_, (r, _))| usize::from(r.table) == table)
        };
        for (i, (a, _)) in of(k) {
            let mine = a.share(tone_of(tones, k), column);
            if mine == ZERO {
                continue;
            }
            for (j, (b, _)) in of(l) {
                if k == l && j > i {
                    continue;
                }
                let its = b.share(tone_of(tones, l), other);
                let (p, q) = (usize::from(a.power), usize::from(b.power));
                let value = mine.conj() * its * products.plain[p][q]
                    + (mine * its).conj() * products.pseudo[p][q];
                normal.add(i.max(j), i.min(j), 0.5 * value.re);
            }
        }
    }
}
