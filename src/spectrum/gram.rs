//! How much the regressors of the joint fit have in common: the normal matrix, at the cost of frames plus slots.
//!
//! The weight of a sample is taken as a frame's times a slot's. Then every inner product of t^p·e^(iωt)
//! with t^q·e^(iω't), t = t_n + τ_s, is a sum over frames times a sum over slots, and removing the slots'
//! offsets is removing a mean over frames. The samples' true weights enter the residual and its products
//! ([`super::model`]), so the fit's fixed point is exact; only its way there and the stated deviations use this.

use num_complex::Complex32 as Complex;

use super::cholesky::{MOST, Normal};
use super::model::{POWERS, Samples, Tone};

/// Powers of t in the product of two regressors.
const PRODUCT_POWERS: usize = 2 * POWERS - 1;

/// Binomial coefficients up to (t_n + τ_s)².
const BINOMIAL: [[f32; POWERS]; POWERS] = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 1.0]];

const ZERO: Complex = Complex::new(0.0, 0.0);

/// One real regressor Re(conj(factor) · t^power · e^(iωt)) of the tone in table row `table`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Regressor {
    pub(crate) table: u8,
    pub(crate) power: u8,
    pub(crate) factor: Complex,
}

/// What a regressor's coefficient is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// Slow drift: t and t².
    Drift,
    /// Real part of the amplitude.
    Re,
    /// Imaginary part of the amplitude.
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
    /// Drift (`drift` powers of t), then each tone's. A tone without amplitude yet has no frequency to fit.
    pub(crate) fn of(tones: &[Tone], drift: usize) -> Self {
        let mut list = heapless::Vec::new();
        let one = Complex::new(1.0, 0.0);
        let mut add = |table: usize, power: u8, factor, unknown| {
            // A full list leaves the last tones' modulation unfitted; it holds three a tone.
            let table = table as u8;
            let _ = list.push((
                Regressor {
                    table,
                    power,
                    factor,
                },
                unknown,
            ));
        };
        for power in 1..=drift.min(2) {
            add(0, power as u8, one, Unknown::Drift);
        }
        for (i, tone) in tones.iter().enumerate() {
            add(i + 1, 0, one, Unknown::Re);
            add(i + 1, 0, Complex::new(0.0, 1.0), Unknown::Im);
            if tone.amplitude != ZERO {
                let turn = Complex::new(0.0, -core::f32::consts::TAU) * tone.amplitude;
                add(i + 1, 1, turn, Unknown::Frequency);
            }
        }
        for (i, tone) in tones.iter().enumerate() {
            if tone.modulated && tone.amplitude != ZERO {
                let turn = Complex::new(0.0, -0.5 * core::f32::consts::TAU) * tone.amplitude;
                add(i + 1, 2, turn, Unknown::Chirp);
                add(i + 1, 1, tone.amplitude, Unknown::Growth);
            }
        }
        Self { list }
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
        let (rr, ii) = (w * ar * br, w * ai * bi);
        let (ri, ir) = (w * ar * bi, w * ai * br);
        let mut plain = Complex::new(rr + ii, ir - ri);
        let mut pseudo = Complex::new(rr - ii, ir + ri);
        for m in 0..=powers.min(PRODUCT_POWERS - 1) {
            sums.plain[m] += plain;
            sums.pseudo[m] += pseudo;
            plain = plain.scale(t);
            pseudo = pseudo.scale(t);
        }
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

    fn products(
        &self,
        k: usize,
        l: usize,
        means: (&FrameMeans, &FrameMeans),
        powers: (usize, usize),
    ) -> Products {
        let (n, s) = (self.frames, self.slots);
        let both = powers.0 + powers.1;
        let over_frames = sums(
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
            both,
        );
        let over_slots = sums(
            &self.slot_weight[..s],
            &self.slot_t[..s],
            (
                &self.slot_re[k * s..k * s + s],
                &self.slot_im[k * s..k * s + s],
            ),
            (
                &self.slot_re[l * s..l * s + s],
                &self.slot_im[l * s..l * s + s],
            ),
            both,
        );
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
                        plain += (f * over_slots.plain[i + j]).scale(c);
                        pseudo += (g * over_slots.pseudo[i + j]).scale(c);
                    }
                }
                products.plain[p][q] = plain;
                products.pseudo[p][q] = pseudo;
            }
        }
        products
    }

    /// Share of a steady tone's energy that the removal of the slots' offsets leaves, c(f) of estimator.md.
    pub(crate) fn kept(&self, means: &FrameMeans) -> f32 {
        (1.0 - means[0].norm_sqr()).clamp(0.0, 1.0)
    }

    /// Fills the normal matrix of these regressors.
    pub(crate) fn normal(&self, regressors: &Regressors, tones: &[Tone], normal: &mut Normal) {
        let list = regressors.list();
        normal.clear(list.len());
        let mut means = [[ZERO; POWERS]; super::model::TABLE_ROWS];
        for (k, m) in means.iter_mut().enumerate().take(tones.len() + 1) {
            *m = self.frame_means(k);
        }
        let power = |k: usize| match k {
            0 => 2,
            _ => tones.get(k - 1).map_or(1, Tone::top_power),
        };
        for k in 0..=tones.len() {
            for l in 0..=k {
                let products = self.products(k, l, (&means[k], &means[l]), (power(k), power(l)));
                for (i, (a, _)) in list.iter().enumerate() {
                    if usize::from(a.table) != k {
                        continue;
                    }
                    for (j, (b, _)) in list.iter().enumerate() {
                        if usize::from(b.table) != l || (k == l && j > i) {
                            continue;
                        }
                        let (p, q) = (usize::from(a.power), usize::from(b.power));
                        let value = a.factor.conj() * b.factor * products.plain[p][q]
                            + (a.factor * b.factor).conj() * products.pseudo[p][q];
                        normal.set(i.max(j), i.min(j), 0.5 * value.re);
                    }
                }
            }
        }
    }
}
