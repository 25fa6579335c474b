//! From samples at uneven times to amplitudes at even frequencies.
//!
//! Each sample is shared between the two places of a fine grid of times that lie next to it, which weakens a frequency by
//! sinc²(f·step); that is undone.

use std::f64::consts::PI;

use rowtone_fourier::{Complex64, Fourier};

use super::residual::Residual;

/// Frequencies a cell of 1/window, and times a period of the highest frequency: the first that stay below [`MOST_POINTS`].
const DENSITIES: [(usize, f64); 4] = [(8, 16.0), (4, 12.0), (2, 8.0), (1, 4.0)];

/// Most points of the transform.
const MOST_POINTS: usize = 1 << 22;

/// The frequencies of a spectrum, and the grid of times behind them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Numbers of the first frequency and of the one after the last.
    from: usize,
    to: usize,
    step_hz: f64,
    /// Frequencies a cell.
    pub(super) a_cell: usize,
    points: usize,
    step_s: f64,
}

impl Grid {
    /// For a window, s, and a band, Hz.
    pub(super) fn new(window_s: f64, (low, high): (f64, f64)) -> Self {
        let points = |(a_cell, fine): (usize, f64)| {
            ((a_cell as f64 * window_s * fine * high).ceil() as usize).next_power_of_two()
        };
        let fits = DENSITIES.into_iter().find(|&d| points(d) <= MOST_POINTS);
        let density = fits.unwrap_or(DENSITIES[DENSITIES.len() - 1]);
        let (a_cell, points) = (density.0, points(density));
        let step_hz = 1.0 / (a_cell as f64 * window_s);
        let to = (high / step_hz + 1e-6).floor() as usize + 1;
        Self {
            from: ((low / step_hz - 1e-6).ceil() as usize).min(to),
            to,
            step_hz,
            a_cell,
            points,
            step_s: 1.0 / (step_hz * points as f64),
        }
    }

    /// The frequencies, Hz.
    pub(super) fn frequencies(&self) -> Vec<f64> {
        let each = self.from..self.to;
        each.map(|k| k as f64 * self.step_hz).collect()
    }

    /// Squares of the zero-to-peak amplitudes of what is left, px², one a frequency.
    pub(super) fn squares(&self, of: &Residual) -> Vec<f64> {
        let mut line = vec![Complex64::default(); self.points];
        for (t, px) in of.times_s.iter().zip(&of.weighed_px) {
            let at = t / self.step_s;
            let share = at.fract();
            for (place, share) in [(0, 1.0 - share), (1, share)] {
                // A window a little longer than the first one folds around, which is what frequencies at its cells do.
                line[(at as usize + place) % self.points].re += share * px;
            }
        }
        Fourier::forward(self.points).transform(&mut line);
        let each = (self.from..self.to).map(|k| {
            let x = PI * k as f64 / self.points as f64;
            let left = if k > 0 { (x.sin() / x).powi(2) } else { 1.0 };
            4.0 * line[k].norm_sqr() / (left * left)
        });
        each.collect()
    }
}
