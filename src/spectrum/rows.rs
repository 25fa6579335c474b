//! The loops over the samples of one slot: nearly all of a window's time is spent here.
//!
//! On a desktop the sums run in eight lanes, which the compiler makes vectors of. A microcontroller has no vectors, and its
//! compiler, told to make small code, unrolls nothing: there two samples are written out a turn (four save another 2 % and
//! take 0.7 KiB of flash), and one sum is enough.
//! (Its fused multiply-add would save a quarter more, but stable Rust without `std` has no way to ask for it: the
//! function is in `std` and assembly may not name the registers.)

use num_complex::Complex32 as Complex;

use super::window::unpack_weight;

/// Most notches at once.
pub(crate) const NOTCHES: usize = 6;

/// Regressors of a notch: cos, sin, t·cos, t·sin.
pub(super) const NOTCH_PARTS: usize = 4;

/// A notch at the alias frequency of the tone in table row `table`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Notch {
    pub(crate) table: u8,
    /// Of their weighted inner products over the frames.
    pub(super) inverse: [[f32; NOTCH_PARTS]; NOTCH_PARTS],
    /// Their weighted means over the frames: of E and t·E.
    pub(super) mean: [Complex; 2],
}

/// Samples a turn.
const LANES: usize = if cfg!(target_arch = "arm") { 2 } else { 8 };

/// a + b·c.
#[inline(always)]
fn plus(a: f32, b: f32, c: f32) -> f32 {
    a + b * c
}

/// Does `$body` for either lane one after the other, and on a desktop for all eight in a loop, which becomes vectors.
macro_rules! lanes {
    ($l:ident => $body:expr) => {
        if cfg!(target_arch = "arm") {
            {
                let $l = 0;
                $body
            }
            {
                let $l = 1;
                $body
            }
        } else {
            for $l in 0..LANES {
                $body
            }
        }
    };
}

/// The sum that lane `l` adds to.
const fn of(l: usize) -> usize {
    if cfg!(target_arch = "arm") { 0 } else { l }
}

/// x − t·(linear + square·t) into `row`.
pub(crate) fn less_drift(row: &mut [f32], x: &[f32], t: &[f32], linear: f32, square: f32) {
    let (rows, rest) = row.as_chunks_mut::<LANES>();
    let (xs, x_rest) = x.as_chunks::<LANES>();
    let (ts, t_rest) = t.as_chunks::<LANES>();
    let one = |x: f32, t: f32| plus(x, -t, plus(linear, square, t));
    for ((r, x), t) in rows.iter_mut().zip(xs).zip(ts) {
        lanes!(l => r[l] = one(x[l], t[l]));
    }
    for ((r, &x), &t) in rest.iter_mut().zip(x_rest).zip(t_rest) {
        *r = one(x, t);
    }
}

/// Takes Re(conj(g)·(re + i·im)) off the row; what g is here is the amplitude seen from the slot.
pub(crate) fn less_tone(row: &mut [f32], re: &[f32], im: &[f32], g: Complex) {
    let (rows, rest) = row.as_chunks_mut::<LANES>();
    let (ps, p_rest) = re.as_chunks::<LANES>();
    let (qs, q_rest) = im.as_chunks::<LANES>();
    let one = |r: f32, p: f32, q: f32| plus(plus(r, -g.re, p), -g.im, q);
    for ((r, p), q) in rows.iter_mut().zip(ps).zip(qs) {
        lanes!(l => r[l] = one(r[l], p[l], q[l]));
    }
    for ((r, &p), &q) in rest.iter_mut().zip(p_rest).zip(q_rest) {
        *r = one(*r, p, q);
    }
}

/// The same where the samples are late by `late` steps, each of which turns the tone by `turn` rad, to first order.
pub(crate) fn less_late_tone(
    row: &mut [f32],
    (re, im): (&[f32], &[f32]),
    late: &[f32],
    turn: f32,
    g: Complex,
) {
    let (rows, rest) = row.as_chunks_mut::<LANES>();
    let (ps, p_rest) = re.as_chunks::<LANES>();
    let (qs, q_rest) = im.as_chunks::<LANES>();
    let (ds, d_rest) = late.as_chunks::<LANES>();
    let (re, im) = (turn * g.re, turn * g.im);
    let one = |r: f32, p: f32, q: f32, d: f32| {
        plus(plus(r, -plus(g.re, im, d), p), -plus(g.im, -re, d), q)
    };
    for (((r, p), q), d) in rows.iter_mut().zip(ps).zip(qs).zip(ds) {
        lanes!(l => r[l] = one(r[l], p[l], q[l], d[l]));
    }
    for (((r, &p), &q), &d) in rest.iter_mut().zip(p_rest).zip(q_rest).zip(d_rest) {
        *r = one(*r, p, q, d);
    }
}

/// Takes weight·(Re(conj(g₀ + g₁·t)·(re + i·im)) − mean) off the row.
pub(crate) fn less_notch(
    row: &mut [f32],
    weight: &[u16],
    (re, im): (&[f32], &[f32]),
    t: &[f32],
    g: [Complex; 2],
    mean: f32,
) {
    let (rows, rest) = row.as_chunks_mut::<LANES>();
    let (ws, w_rest) = weight.as_chunks::<LANES>();
    let (ps, p_rest) = re.as_chunks::<LANES>();
    let (qs, q_rest) = im.as_chunks::<LANES>();
    let (ts, t_rest) = t.as_chunks::<LANES>();
    let one = |w: u16, p: f32, q: f32, t: f32| {
        let (a, b) = (plus(g[0].re, g[1].re, t), plus(g[0].im, g[1].im, t));
        unpack_weight(w) * plus(plus(-mean, a, p), b, q)
    };
    for ((((r, w), p), q), t) in rows.iter_mut().zip(ws).zip(ps).zip(qs).zip(ts) {
        lanes!(l => r[l] -= one(w[l], p[l], q[l], t[l]));
    }
    let tail = rest.iter_mut().zip(w_rest).zip(p_rest).zip(q_rest);
    for ((((r, &w), &p), &q), &t) in tail.zip(t_rest) {
        *r -= one(w, p, q, t);
    }
}

/// Σ weight·row.
pub(crate) fn weighted_sum(weight: &[u16], row: &[f32]) -> f32 {
    let mut sums = [0.0_f32; LANES];
    let (ws, w_rest) = weight.as_chunks::<LANES>();
    let (rs, r_rest) = row.as_chunks::<LANES>();
    for (w, r) in ws.iter().zip(rs) {
        lanes!(l => sums[of(l)] = plus(sums[of(l)], unpack_weight(w[l]), r[l]));
    }
    for (&w, &r) in w_rest.iter().zip(r_rest) {
        sums[0] = plus(sums[0], unpack_weight(w), r);
    }
    sums.iter().sum()
}

/// Takes `mean` off the row and multiplies by the weights; returns the weighted sum of squares.
pub(crate) fn center(weight: &[u16], row: &mut [f32], mean: f32) -> f32 {
    let mut sums = [0.0_f32; LANES];
    let (ws, w_rest) = weight.as_chunks::<LANES>();
    let (rs, r_rest) = row.as_chunks_mut::<LANES>();
    for (w, r) in ws.iter().zip(rs) {
        lanes!(l => {
            let x = r[l] - mean;
            r[l] = x * unpack_weight(w[l]);
            sums[of(l)] = plus(sums[of(l)], x, r[l]);
        });
    }
    for (&w, r) in w_rest.iter().zip(r_rest) {
        let x = *r - mean;
        *r = x * unpack_weight(w);
        sums[0] = plus(sums[0], x, *r);
    }
    sums.iter().sum()
}

/// row·t into `row_t`; returns Σ row·t and Σ row·t².
pub(crate) fn times(row: &[f32], t: &[f32], row_t: &mut [f32]) -> (f32, f32) {
    let mut sums = [[0.0_f32; LANES]; 2];
    let (rs, r_rest) = row.as_chunks::<LANES>();
    let (ts, t_rest) = t.as_chunks::<LANES>();
    let (outs, rest) = row_t.as_chunks_mut::<LANES>();
    for ((r, t), out) in rs.iter().zip(ts).zip(outs) {
        lanes!(l => {
            out[l] = r[l] * t[l];
            sums[0][of(l)] += out[l];
            sums[1][of(l)] = plus(sums[1][of(l)], out[l], t[l]);
        });
    }
    for ((&r, &t), out) in r_rest.iter().zip(t_rest).zip(rest) {
        *out = r * t;
        sums[0][0] += *out;
        sums[1][0] = plus(sums[1][0], *out, t);
    }
    (sums[0].iter().sum(), sums[1].iter().sum())
}

/// Σ row·(re + i·im) and Σ row_t·(re + i·im).
pub(crate) fn products(row: &[f32], row_t: &[f32], re: &[f32], im: &[f32]) -> (Complex, Complex) {
    let mut sums = [[0.0_f32; LANES]; 4];
    let (rs, r_rest) = row.as_chunks::<LANES>();
    let (ts, t_rest) = row_t.as_chunks::<LANES>();
    let (ps, p_rest) = re.as_chunks::<LANES>();
    let (qs, q_rest) = im.as_chunks::<LANES>();
    for (((r, t), p), q) in rs.iter().zip(ts).zip(ps).zip(qs) {
        lanes!(l => {
            sums[0][of(l)] = plus(sums[0][of(l)], r[l], p[l]);
            sums[1][of(l)] = plus(sums[1][of(l)], r[l], q[l]);
            sums[2][of(l)] = plus(sums[2][of(l)], t[l], p[l]);
            sums[3][of(l)] = plus(sums[3][of(l)], t[l], q[l]);
        });
    }
    for (((&r, &t), &p), &q) in r_rest.iter().zip(t_rest).zip(p_rest).zip(q_rest) {
        sums[0][0] = plus(sums[0][0], r, p);
        sums[1][0] = plus(sums[1][0], r, q);
        sums[2][0] = plus(sums[2][0], t, p);
        sums[3][0] = plus(sums[3][0], t, q);
    }
    let total = sums.map(|s| s.iter().sum::<f32>());
    (
        Complex::new(total[0], total[1]),
        Complex::new(total[2], total[3]),
    )
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn numbers(n: usize, seed: u32) -> Vec<f32> {
        (0..n as u32)
            .map(|i| ((i * 7919 + seed * 104_729) % 1009) as f32 / 1009.0 - 0.5)
            .collect()
    }

    /// Every length, so that whole turns and what is left over are both met.
    #[test]
    fn every_loop_is_what_it_says() {
        for n in 0..20 {
            let (x, t, p, q) = (numbers(n, 1), numbers(n, 2), numbers(n, 3), numbers(n, 4));
            let late: Vec<f32> = numbers(n, 5).iter().map(|d| 100.0 * d).collect();
            let weight: Vec<u16> = (0..n)
                .map(|i| if i % 5 == 3 { 0 } else { 0x3f80 })
                .collect();
            let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{n}: {a} {b}");
            let mut row = std::vec![0.0; n];
            less_drift(&mut row, &x, &t, 0.3, -0.2);
            let g = Complex::new(0.7, -0.4);
            less_tone(&mut row, &p, &q, g);
            less_late_tone(&mut row, (&p, &q), &late, 1e-3, g);
            for i in 0..n {
                let drift = t[i] * (0.3 - 0.2 * t[i]);
                let tone = g.re * p[i] + g.im * q[i];
                let turned = 1e-3 * late[i] * (g.im * p[i] - g.re * q[i]);
                close(row[i], x[i] - drift - 2.0 * tone - turned);
            }
            let before = row.clone();
            let w = |i: usize| unpack_weight(weight[i]);
            close(
                weighted_sum(&weight, &row),
                (0..n).map(|i| w(i) * row[i]).sum(),
            );
            let mut notched = row.clone();
            less_notch(&mut notched, &weight, (&p, &q), &t, [g, g], 0.2);
            for i in 0..n {
                let taken = (1.0 + t[i]) * (g.re * p[i] + g.im * q[i]) - 0.2;
                close(notched[i], row[i] - w(i) * taken);
            }
            let squares = center(&weight, &mut row, 0.1);
            close(
                squares,
                (0..n).map(|i| w(i) * (before[i] - 0.1).powi(2)).sum(),
            );
            let mut row_t = std::vec![0.0; n];
            let (first, second) = times(&row, &t, &mut row_t);
            close(first, (0..n).map(|i| row[i] * t[i]).sum());
            close(second, (0..n).map(|i| row[i] * t[i] * t[i]).sum());
            let (zero, one) = products(&row, &row_t, &p, &q);
            close(zero.re, (0..n).map(|i| row[i] * p[i]).sum());
            close(one.im, (0..n).map(|i| row_t[i] * q[i]).sum());
        }
    }
}
