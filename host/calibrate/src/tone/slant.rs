//! The slanted line: how the phase of a tone turns from row to row.
//!
//! Each cell moves along a line of its own with its own amplitude, be it negative; what they share is the phase
//! 2π(ν·y + φ). Twice the phase of a cell forgets the sign, so ν is where Σ W·e^{2i(θ − 2πν·y)} is largest, and a
//! step of least squares from there. W counts what a cell's noise does to its phase, and beside it a scatter that all cells
//! have: a video codec moves whole blocks of 16 rows, whose phases stand in steps.

use super::steady::Moves;
use rowtone_fourier::Complex64;
use rowtone_linear::median;
use std::f64::consts::TAU;

/// Power over noise from which a cell takes part.
const LEAST_SNR: f64 = 10.0;
/// Cells below which there is no line.
const LEAST_CELLS: usize = 24;
/// Bands of rows that are left out in turn for the standard deviation.
const BANDS: usize = 16;
/// Steepest line that is looked for, periods a row: twice the phase may turn by half a turn.
const STEEPEST: f64 = 0.2;
/// Steps of the search a period in the picture.
const STEPS: f64 = 16.0;
/// Scatter of the phases to begin with, rad.
const SCATTER: f64 = 0.02;

/// The line of one tone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slant {
    /// Frequency from frame to frame, Hz, 0 to half the frame rate.
    pub(super) hz: f64,
    /// Periods a row; negative where the tone's own frequency is k·fps − hz, or the camera reads upwards.
    pub(super) per_row: f64,
    /// Its standard deviation.
    pub(super) sd: f64,
    /// Amplitude of all cells over their noise, squared.
    pub(super) snr: f64,
    /// Phase at the middle row, rad.
    pub(super) phase: f64,
}

struct Cell {
    /// Row from the middle.
    y: f64,
    band: usize,
    double: Complex64,
    /// Variance of the phase by the cell's own noise, rad².
    variance: f64,
}

/// The line through the cells of a tone; none where too few know it.
pub(super) fn slant(rows: &[usize], height: usize, moves: &Moves) -> Option<Slant> {
    let centre = 0.5 * (height as f64 - 1.0);
    let knows = |c: &usize| moves.cells[*c].norm_sqr() > LEAST_SNR * moves.noise[*c];
    let used: Vec<usize> = (0..rows.len()).filter(knows).collect();
    let [first, last] = [used.first()?, used.last()?].map(|c| rows[*c]);
    let spread = (last + 1 - first).max(1);
    let cells: Vec<Cell> = used
        .iter()
        .map(|&c| {
            let z = moves.cells[c];
            let power = z.norm_sqr();
            Cell {
                y: rows[c] as f64 - centre,
                band: (rows[c] - first) * BANDS / spread,
                double: z * z / power,
                variance: 0.5 * moves.noise[c] / power,
            }
        })
        .collect();
    if cells.len() < LEAST_CELLS || spread < BANDS {
        return None;
    }
    let start = search(&cells, spread);
    let mut scatter = SCATTER;
    let (mut per_row, mut phase) = (start, 0.0);
    for _ in 0..4 {
        (per_row, phase) = line(&cells, per_row, scatter, None);
        let off: Vec<f64> = cells.iter().map(|c| c.off(per_row, phase).abs()).collect();
        scatter = (median(&off) / 0.6745).max(1e-4);
    }
    let left_out: Vec<f64> = (0..BANDS)
        .map(|band| line(&cells, per_row, scatter, Some(band)).0)
        .collect();
    let mean = left_out.iter().sum::<f64>() / BANDS as f64;
    let squares: f64 = left_out.iter().map(|v| (v - mean).powi(2)).sum();
    let snr = used
        .iter()
        .map(|&c| moves.cells[c].norm_sqr() / moves.noise[c])
        .sum();
    Some(Slant {
        hz: moves.hz,
        per_row,
        sd: ((BANDS - 1) as f64 / BANDS as f64 * squares).sqrt(),
        snr,
        phase,
    })
}

impl Cell {
    /// Phase of the cell off the line, −π/2 to π/2.
    fn off(&self, per_row: f64, phase: f64) -> f64 {
        let turned = self.double * Complex64::cis(-2.0 * (TAU * per_row * self.y + phase));
        0.5 * turned.im.atan2(turned.re)
    }

    fn weight(&self, scatter: f64) -> f64 {
        1.0 / (self.variance + scatter * scatter)
    }
}

/// Where the cells agree most.
fn search(cells: &[Cell], spread: usize) -> f64 {
    let step = 1.0 / (STEPS * spread as f64);
    let most = (STEEPEST / step) as i32;
    // Rows beside each other first: a picture has many cells a row.
    let mut rows: Vec<(f64, Complex64)> = Vec::new();
    for cell in cells {
        let value = cell.double * cell.weight(0.1);
        match rows.last_mut() {
            Some((y, sum)) if *y == cell.y => *sum += value,
            _ => rows.push((cell.y, value)),
        }
    }
    let agree = |k: i32| {
        let per_row = f64::from(k) * step;
        let turned = rows
            .iter()
            .map(|(y, v)| v * Complex64::cis(-2.0 * TAU * per_row * y));
        turned.sum::<Complex64>().norm_sqr()
    };
    let best = (-most..=most).max_by(|a, b| agree(*a).total_cmp(&agree(*b)));
    best.map_or(0.0, |k| f64::from(k) * step)
}

/// Least squares from `per_row` on, without one band.
fn line(cells: &[Cell], per_row: f64, scatter: f64, without: Option<usize>) -> (f64, f64) {
    let mut at = (per_row, 0.0);
    let used = || cells.iter().filter(|c| Some(c.band) != without);
    for _ in 0..8 {
        let sum: Complex64 = used()
            .map(|c| c.double * Complex64::cis(-2.0 * TAU * at.0 * c.y) * c.weight(scatter))
            .sum();
        at.1 = 0.5 * sum.im.atan2(sum.re);
        // Huber's weights: a cell far off, where something else moves, counts for less.
        let weight = |c: &Cell| {
            let off = c.off(at.0, at.1).abs();
            let sd = (c.variance + scatter * scatter).sqrt();
            c.weight(scatter) * (3.0 * sd / off.max(3.0 * sd))
        };
        let sums = used().fold([0.0; 5], |[w, wy, wr, wyy, wyr], c| {
            let (k, r) = (weight(c), c.off(at.0, at.1));
            [
                w + k,
                wy + k * c.y,
                wr + k * r,
                wyy + k * c.y * c.y,
                wyr + k * c.y * r,
            ]
        });
        let [w, wy, wr, wyy, wyr] = sums;
        let bend = wyy - wy * wy / w;
        if bend.is_nan() || bend <= 0.0 {
            break;
        }
        at.0 += (wyr - wy * wr / w) / bend / TAU;
    }
    at
}
