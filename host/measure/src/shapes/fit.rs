//! Tones fitted together in each tile, and what the blocks say of frequencies and noise.
//!
//! In a band of tiles the regressors, cosine and sine of each tone at the rows' own times, have the same products G; a tile
//! multiplies them by its answer M to a shift. So Z = G·C·Mᵀ gives the amplitudes C of a tile from its sums Z with one
//! factorisation a band. A frequency that is off by δ turns block after block by 2πδt: the δ at which all tiles add up
//! best is taken off by turning the blocks back. What is left in the blocks, at frequencies within a few block lengths of the
//! tone, is the noise there, whatever its colour.

use std::f64::consts::TAU;
use std::ops::Range;

use num_complex::Complex64;
use rowtone::shape::{TileTexture, ToneSums};
use rowtone_linear::Symmetric;

use super::blocks::Block;
use super::correct::{centred, unblurred};
use super::error::{RecordingError, ShapesError};
use super::pass::TileBlocks;
use super::tones::{Tones, exposure_gain};
use super::{Shape, semi_major};
use rowtone_clip::{Camera, Rect};

/// Turning whole blocks back leaves this share of a turn within a block.
const TURN_IN_BLOCK: f64 = 0.03;
/// A frequency is set right where all tiles together gain so many standard deviations of chance.
const SURE: f64 = 6.0;
/// No frequency is off by more: it was found in windows, or asked for by someone who knows.
const FARTHEST_HZ: f64 = 0.5;
/// A tile whose deviation is so many times that of a good one has too little texture.
const PLAIN: f64 = 8.0;
/// χ² of four degrees of freedom at 1e-3 over a thousand tiles.
const MOVES: f64 = 33.4;
/// A shape's phase is that of the largest tile among those with this ratio of amplitude to deviation.
const LARGE: f64 = 5.0;

/// Products of the regressors, and where they are.
struct Regressors<'a> {
    hz: &'a [f64],
    /// By how much each frequency was set right since the sums were made, Hz.
    shift_hz: Vec<f64>,
    line_s: f64,
    exposure_s: f64,
}

/// A band of tiles.
struct Band {
    rows: Range<usize>,
    tiles: Range<usize>,
}

fn bands(sums: &TileBlocks) -> impl Iterator<Item = Band> + use<> {
    let (side, columns) = (sums.grid.tile_px(), sums.grid.columns());
    (0..sums.grid.rows()).map(move |row| Band {
        rows: row * side..(row + 1) * side,
        tiles: row * columns..(row + 1) * columns,
    })
}

impl<'a> Regressors<'a> {
    fn new(sums: &TileBlocks, hz: &'a [f64], camera: &Camera) -> Self {
        let line_s = f64::from(camera.timing.line_time_ps()) * 1e-12;
        let summed = sums.blocks.hz();
        Self {
            hz,
            shift_hz: hz.iter().zip(summed).map(|(new, old)| new - old).collect(),
            line_s,
            exposure_s: f64::from(camera.timing.exposure_ns()) * 1e-9,
        }
    }

    /// Cosine and sine of each tone; what stands still has no sine.
    fn columns(&self) -> Vec<(usize, bool)> {
        let tones = 0..self.hz.len();
        let both = tones.flat_map(|k| [(k, false), (k, true)]);
        both.filter(|&(k, sine)| self.hz[k] != 0.0 || !sine)
            .collect()
    }

    /// Products of all regressors over a block's frames, the mean over the rows of a band.
    fn gram(&self, block: &Block, band: &Band) -> Vec<f64> {
        let middle_s = block.middle_s();
        let mut pairs = Vec::with_capacity(block.pairs.len());
        for a in 0..self.hz.len() {
            for b in 0..=a {
                let [minus, plus] = block.pairs[a * (a + 1) / 2 + b];
                let turned = |sign: f64, sum: Complex64| {
                    let hz = self.hz[a] + sign * self.hz[b];
                    let shift = self.shift_hz[a] + sign * self.shift_hz[b];
                    let moved = Complex64::cis(TAU * (shift * middle_s).fract());
                    sum * moved * self.over_rows(hz, &band.rows)
                };
                pairs.push([turned(-1.0, minus), turned(1.0, plus)]);
            }
        }
        let columns = self.columns();
        let n = columns.len();
        let mut gram = vec![0.0; n * n];
        for (i, &(a, sine_a)) in columns.iter().enumerate() {
            for (j, &(b, sine_b)) in columns.iter().enumerate().take(i + 1) {
                let [minus, plus] = pairs[a * (a + 1) / 2 + b];
                let value = 0.5
                    * match (sine_a, sine_b) {
                        (false, false) => minus.re + plus.re,
                        (true, true) => minus.re - plus.re,
                        (false, true) => plus.im - minus.im,
                        (true, false) => plus.im + minus.im,
                    };
                gram[i * n + j] = value;
                gram[j * n + i] = value;
            }
        }
        gram
    }

    /// Mean of e^{2πi·hz·t} over the rows of a band, t from the frame's start to the middle of a row's exposure.
    fn over_rows(&self, hz: f64, rows: &Range<usize>) -> Complex64 {
        let turn = |s: f64| Complex64::cis(TAU * (hz * s).fract());
        let all: Complex64 = rows.clone().map(|row| turn(row as f64 * self.line_s)).sum();
        all / rows.len() as f64 * turn(0.5 * self.exposure_s)
    }

    /// A tile's sums in a block, at the frequencies set right: Σ s·e^{−2πift}, along x and y.
    fn sums(&self, block: &Block, band: &Band, tile: usize) -> Vec<[Complex64; 2]> {
        let row_s = 0.5 * (band.rows.start + band.rows.end - 1) as f64 * self.line_s;
        let at_s = block.middle_s() + row_s + 0.5 * self.exposure_s;
        let tones = self.hz.len();
        let sums = &block.sums[tile * tones..(tile + 1) * tones];
        let phasor = |[cos, sin]: [f32; 2]| Complex64::new(f64::from(cos), -f64::from(sin));
        let turn = |shift: &f64| Complex64::cis(-TAU * (shift * at_s).fract());
        let turned = |(sums, shift): (&ToneSums, &f64)| {
            let turn = turn(shift);
            [phasor(sums.x) * turn, phasor(sums.y) * turn]
        };
        sums.iter().zip(&self.shift_hz).map(turned).collect()
    }

    /// The same, one value a regressor.
    fn values(&self, sums: &[[Complex64; 2]], axis: usize) -> Vec<f64> {
        let value = |(k, sine): (usize, bool)| {
            let phasor = sums[k][axis];
            if sine { -phasor.im } else { phasor.re }
        };
        self.columns().into_iter().map(value).collect()
    }
}

/// What a band's fit leaves of its tiles.
struct BandFit {
    /// G⁻¹·Z of each tile of the band, x and y, and its variance a unit of the scores'.
    scores: Vec<[Vec<f64>; 2]>,
    variance: Vec<f64>,
    /// Where each tone's cosine is among the regressors.
    first: Vec<usize>,
}

impl BandFit {
    /// Amplitude of a tone's scores along an axis, as X of Re X·e^{2πift}.
    fn score(&self, tile: usize, axis: usize, tone: usize) -> Complex64 {
        let all = &self.scores[tile][axis];
        Complex64::new(all[self.first[tone]], -all[self.first[tone] + 1])
    }

    /// Variance of a real or imaginary part of that, where the scores of one frame have a variance of one.
    fn variance(&self, tone: usize) -> f64 {
        let first = self.first[tone];
        0.5 * (self.variance[first] + self.variance[first + 1])
    }
}

/// Fits all tones in all tiles of a band; `None` where the tones cannot be told apart.
fn fit_band(sums: &TileBlocks, regressors: &Regressors<'_>, band: &Band) -> Option<BandFit> {
    let columns = regressors.columns();
    let n = columns.len();
    let mut gram = Symmetric::zeros(n);
    for block in &sums.blocks.all {
        let own = regressors.gram(block, band);
        for i in 0..n {
            for j in 0..=i {
                gram.add(i, j, own[i * n + j]);
            }
        }
    }
    let factor = gram.factor()?;
    let unit = |k: usize| {
        (0..n)
            .map(|j| f64::from(u8::from(j == k)))
            .collect::<Vec<_>>()
    };
    let variance = (0..n).map(|k| factor.solve(&unit(k))[k]).collect();
    let mut scores = Vec::new();
    for tile in band.tiles.clone() {
        let mut all = vec![[Complex64::default(); 2]; regressors.hz.len()];
        for block in &sums.blocks.all {
            for (all, own) in all.iter_mut().zip(regressors.sums(block, band, tile)) {
                all[0] += own[0];
                all[1] += own[1];
            }
        }
        scores.push([0, 1].map(|axis| factor.solve(&regressors.values(&all, axis))));
    }
    let first = (0..regressors.hz.len())
        .map(|tone| columns.iter().position(|&(k, _)| k == tone).unwrap_or(0))
        .collect();
    Some(BandFit {
        scores,
        variance,
        first,
    })
}

/// What is left of each tone in each block of a tile, x and y: the regressors' sums less what the fit explains, and less what
/// stood still in the block.
fn residuals(
    sums: &TileBlocks,
    regressors: &Regressors<'_>,
    band: &Band,
    fit: &BandFit,
    mut take: impl FnMut(usize, usize, usize, [Complex64; 2], f64),
    tones: &Range<usize>,
) {
    for (number, block) in sums.blocks.all.iter().enumerate() {
        let gram = regressors.gram(block, band);
        let n = fit.variance.len();
        let frames = f64::from(block.frames);
        for (k, tile) in band.tiles.clone().enumerate() {
            let own = regressors.sums(block, band, tile);
            let left = [0, 1].map(|axis| {
                let mut left = regressors.values(&own, axis);
                for (i, left) in left.iter_mut().enumerate() {
                    let row = gram[i * n..(i + 1) * n].iter();
                    *left -= row
                        .zip(&fit.scores[k][axis])
                        .map(|(g, c)| g * c)
                        .sum::<f64>();
                }
                left
            });
            for tone in tones.clone() {
                let at = fit.first[tone];
                let (cos, sin) = (gram[at * n], gram[(at + 1) * n]);
                let residual = [0, 1].map(|axis| {
                    let still = left[axis][0] / frames;
                    Complex64::new(
                        left[axis][at] - cos * still,
                        -(left[axis][at + 1] - sin * still),
                    )
                });
                let expected = frames - (cos * cos + sin * sin) / frames;
                take(number, tile, tone, residual, expected);
            }
        }
    }
}

/// All frequencies, set right where the tiles together surely say so; `None` where the tones cannot be told apart.
pub(super) fn refined(sums: &TileBlocks, tones: &Tones, camera: &Camera) -> Option<Vec<f64>> {
    let mut hz = tones.hz();
    for _ in 0..2 {
        let regressors = Regressors::new(sums, &hz, camera);
        let range = tones.tones_at();
        let blocks = &sums.blocks.all;
        let mut phasors = vec![Vec::new(); range.len()];
        for band in bands(sums) {
            let fit = fit_band(sums, &regressors, &band)?;
            let mut kept =
                vec![vec![[Complex64::default(); 2]; blocks.len() * band.tiles.len()]; range.len()];
            let first = band.tiles.start;
            let keep = |block: usize, tile: usize, tone: usize, left: [Complex64; 2], _: f64| {
                let half = 0.5 * f64::from(blocks[block].frames);
                let noise = sums.tiles[tile].noise;
                let own = [0, 1].map(|axis| {
                    let weight = f64::from([noise[0], noise[2]][axis]).sqrt();
                    let whole = left[axis] + fit.score(tile - first, axis, tone) * half;
                    if weight > 0.0 {
                        whole / weight
                    } else {
                        Complex64::default()
                    }
                });
                kept[tone - range.start][(tile - first) * blocks.len() + block] = own;
            };
            residuals(sums, &regressors, &band, &fit, keep, &range);
            for (all, kept) in phasors.iter_mut().zip(kept) {
                all.extend(kept);
            }
        }
        for (tone, phasors) in range.clone().zip(&phasors) {
            hz[tone] += best_shift(phasors, blocks);
        }
    }
    Some(hz)
}

/// The shift of a frequency, Hz, at which all tiles add up best; 0 where chance may do as well.
fn best_shift(phasors: &[[Complex64; 2]], blocks: &[Block]) -> f64 {
    let times: Vec<f64> = blocks.iter().map(Block::middle_s).collect();
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return 0.0;
    };
    let span = (last - first) * times.len() as f64 / (times.len() as f64 - 1.0).max(1.0);
    if times.len() < 3 || span <= 0.0 {
        return 0.0;
    }
    let power = |shift: f64| -> f64 {
        let turns: Vec<Complex64> = times
            .iter()
            .map(|t| Complex64::cis(-TAU * shift * t))
            .collect();
        let tile = |tile: &[[Complex64; 2]]| -> f64 {
            let sum = |axis: usize| -> Complex64 {
                tile.iter()
                    .zip(&turns)
                    .map(|(p, turn)| p[axis] * turn)
                    .sum()
            };
            sum(0).norm_sqr() + sum(1).norm_sqr()
        };
        phasors.chunks_exact(times.len()).map(tile).sum()
    };
    // As far as neighbouring blocks tell, finely enough to meet the peak.
    let reach = (0.4 * times.len() as f64 / span).min(FARTHEST_HZ);
    let step = 0.2 / span;
    let steps = (reach / step) as i32;
    let powers: Vec<f64> = (-steps..=steps)
        .map(|k| power(f64::from(k) * step))
        .collect();
    let Some((best, &most)) = powers.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else {
        return 0.0;
    };
    let mut sorted = powers.clone();
    sorted.sort_by(f64::total_cmp);
    let quarter = sorted.len() / 4;
    let (low, middle) = (sorted[quarter], sorted[sorted.len() / 2]);
    let spread = (middle - low).max(1e-9 * middle) / 0.674;
    if most < middle + SURE * spread {
        return 0.0;
    }
    // A parabola through three points, then through three nearer ones.
    let mut at = (best as f64 - f64::from(steps)) * step;
    let mut width = step;
    for _ in 0..3 {
        let [left, here, right] = [at - width, at, at + width].map(power);
        let bend = left - 2.0 * here + right;
        if bend < 0.0 {
            at += (0.5 * width * (left - right) / bend).clamp(-width, width);
        }
        width *= 0.2;
    }
    at
}

/// A frequency was set right by more than turning whole blocks back can do.
pub(super) fn is_far(sums: &TileBlocks, tones: &Tones) -> bool {
    let blocks = &sums.blocks.all;
    let (Some(first), Some(last)) = (blocks.first(), blocks.last()) else {
        return false;
    };
    let block_s = (last.middle_s() - first.middle_s()) / (blocks.len() as f64 - 1.0).max(1.0);
    let moved = |(new, old): (f64, &f64)| (new - old).abs() * block_s > TURN_IN_BLOCK;
    tones.hz().into_iter().zip(sums.blocks.hz()).any(moved)
}

/// What is known of a tile's motion along both axes at one tone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    /// X along x and Y along y, px.
    pub(super) px: [Complex64; 2],
    /// Covariance of a real or imaginary part, px²: xx, xy, yy.
    covariance: [f64; 3],
    /// Degrees of freedom of the noise it was measured by.
    freedom: f64,
}

impl Estimate {
    /// The tile surely moves: the likelihood ratio against standing still, its noise estimated.
    fn moves(&self) -> bool {
        let [xx, xy, yy] = self.covariance;
        let determinant = xx * yy - xy * xy;
        if determinant <= 0.0 || self.freedom <= 0.0 {
            return false;
        }
        let square = |[x, y]: [f64; 2]| (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant;
        let [x, y] = self.px;
        let ratio = square([x.re, y.re]) + square([x.im, y.im]);
        self.freedom * (1.0 + ratio / self.freedom).ln() > MOVES
    }
}

/// The shapes of the tones wanted.
///
/// # Errors
/// [`ShapesError`] where no tile can be measured, or the frames do not tell the tones apart.
pub(super) fn shapes(
    name: &str,
    sums: &TileBlocks,
    tones: &Tones,
    camera: &Camera,
) -> Result<Vec<Shape>, ShapesError> {
    let refuse = |why| ShapesError::recording(name, why);
    let hz = tones.hz();
    let regressors = Regressors::new(sums, &hz, camera);
    let wanted = tones.wanted_at();
    let mut all = vec![vec![Estimate::default(); sums.grid.tiles()]; wanted.len()];
    for band in bands(sums) {
        let fit =
            fit_band(sums, &regressors, &band).ok_or_else(|| refuse(RecordingError::Singular))?;
        let noise = noise(sums, &regressors, &band, &fit, &tones.tones_at());
        for (k, (tile, noise)) in band.tiles.clone().zip(noise).enumerate() {
            let texture = Inverse::of(&sums.tiles[tile]);
            for (all, tone) in all.iter_mut().zip(wanted.clone()) {
                let gain = exposure_gain(hz[tone], regressors.exposure_s);
                let scores = [0, 1].map(|axis| fit.score(k, axis, tone) / gain);
                let share = noise.variance * fit.variance(tone) / (gain * gain);
                all[tile] = Estimate {
                    px: texture.solve(scores),
                    covariance: texture.covariance.map(|v| v * share),
                    freedom: noise.freedom,
                };
            }
        }
    }
    for all in &mut all {
        for (estimate, texture) in all.iter_mut().zip(&sums.tiles) {
            estimate.px = unblurred(texture, estimate.px);
        }
        centred(sums, all);
    }
    if let Some(background) = &camera.background {
        for all in &mut all {
            steady(sums, all, background).map_err(refuse)?;
        }
    }
    let part = camera
        .part
        .unwrap_or(Rect::whole(camera.size.0, camera.size.1));
    let inside = (0..sums.grid.tiles()).map(|tile| covers(&part, &tile_rect(sums, tile)));
    let inside: Vec<bool> = inside.collect();
    let shapes: Vec<Shape> = (all.iter().zip(wanted))
        .map(|(all, tone)| shape(hz[tone], all, &inside))
        .collect();
    if shapes
        .iter()
        .all(|shape| shape.x.iter().chain(&shape.y).all(Option::is_none))
    {
        return Err(refuse(RecordingError::Plain));
    }
    Ok(shapes)
}

/// Noise of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct Noise {
    /// Variance of a pixel, grey values squared, as it acts at the tones.
    variance: f64,
    freedom: f64,
}

/// Noise of each tile of a band, from what the fit left in the blocks beside all tones.
fn noise(
    sums: &TileBlocks,
    regressors: &Regressors<'_>,
    band: &Band,
    fit: &BandFit,
    tones: &Range<usize>,
) -> Vec<Noise> {
    let mut power = vec![[0.0; 2]; band.tiles.len()];
    let add = |_: usize, tile: usize, _: usize, left: [Complex64; 2], expected: f64| {
        let [xx, _, yy] = sums.tiles[tile].noise.map(f64::from);
        let power = &mut power[tile - band.tiles.start];
        for (left, own) in left.into_iter().zip([xx, yy]) {
            if own > 0.0 {
                power[0] += left.norm_sqr() / own;
                power[1] += expected;
            }
        }
    };
    residuals(sums, regressors, band, fit, add, tones);
    let blocks = sums.blocks.all.len() as f64;
    let free = (blocks - 1.0).max(1.0);
    let noise = |[left, expected]: [f64; 2]| Noise {
        variance: if expected > 0.0 {
            left / expected * blocks / free
        } else {
            0.0
        },
        freedom: 4.0 * tones.len() as f64 * free,
    };
    power.into_iter().map(noise).collect()
}

/// From scores to shifts.
pub(super) struct Inverse {
    inverse: [[f64; 2]; 2],
    /// Of the shifts, where a pixel's variance is one: xx, xy, yy.
    covariance: [f64; 3],
}

impl Inverse {
    /// What a direction knows nothing of gets a variance beyond all use instead of none.
    pub(super) fn of(texture: &TileTexture) -> Self {
        let [[a, b], [c, d]] = texture.response.map(|row| row.map(f64::from));
        let least = (1e-6 * (a + d)).max(1e-9);
        let (a, d) = (a + least, d + least);
        let determinant = a * d - b * c;
        let determinant = if determinant.abs() < least * least {
            least * least
        } else {
            determinant
        };
        let inverse = [[d, -b], [-c, a]].map(|row| row.map(|v| v / determinant));
        let [xx, xy, yy] = texture.noise.map(f64::from);
        let product = |p: [f64; 2], q: [f64; 2]| {
            p[0] * (xx * q[0] + xy * q[1]) + p[1] * (xy * q[0] + yy * q[1])
        };
        let [x, y] = inverse;
        Self {
            inverse,
            covariance: [product(x, x), product(x, y), product(y, y)],
        }
    }

    pub(super) fn solve(&self, scores: [Complex64; 2]) -> [Complex64; 2] {
        self.inverse.map(|[x, y]| scores[0] * x + scores[1] * y)
    }
}

fn tile_rect(sums: &TileBlocks, tile: usize) -> Rect {
    let (side, columns) = (sums.grid.tile_px(), sums.grid.columns());
    Rect {
        x: tile % columns * side,
        y: tile / columns * side,
        width: side,
        height: side,
    }
}

/// The middle of `tile` lies in `part`.
fn covers(part: &Rect, tile: &Rect) -> bool {
    let inside = |from: usize, count: usize, tile: usize, side: usize| {
        (2 * from..2 * (from + count)).contains(&(2 * tile + side))
    };
    inside(part.x, part.width, tile.x, tile.width)
        && inside(part.y, part.height, tile.y, tile.height)
}

/// Takes the motion of the tiles in the background, which is the camera's, off all.
fn steady(
    sums: &TileBlocks,
    all: &mut [Estimate],
    background: &Rect,
) -> Result<(), RecordingError> {
    let mut information = [0.0; 3];
    let mut scores = [Complex64::default(); 2];
    for (tile, estimate) in all.iter().enumerate() {
        let [xx, xy, yy] = estimate.covariance;
        let determinant = xx * yy - xy * xy;
        if !covers(background, &tile_rect(sums, tile)) || determinant <= 0.0 {
            continue;
        }
        let own = [yy, -xy, xx].map(|v| v / determinant);
        let [x, y] = estimate.px;
        scores[0] += x * own[0] + y * own[1];
        scores[1] += x * own[1] + y * own[2];
        for (sum, own) in information.iter_mut().zip(own) {
            *sum += own;
        }
    }
    let [xx, xy, yy] = information;
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-6 * xx * yy {
        return Err(RecordingError::Background);
    }
    let camera = [
        (scores[0] * yy - scores[1] * xy) / determinant,
        (scores[1] * xx - scores[0] * xy) / determinant,
    ];
    let own = [yy, -xy, xx].map(|v| v / determinant);
    for estimate in all {
        for (px, camera) in estimate.px.iter_mut().zip(camera) {
            *px -= camera;
        }
        for (sum, own) in estimate.covariance.iter_mut().zip(own) {
            *sum += own;
        }
    }
    Ok(())
}

/// What of the estimates is known, phase against the largest tile.
fn shape(hz: f64, all: &[Estimate], inside: &[bool]) -> Shape {
    let sd = |axis: usize| {
        let part = [0, 2][axis];
        all.iter().map(move |e| e.covariance[part].sqrt())
    };
    let mut sorted: Vec<f64> = sd(0)
        .chain(sd(1))
        .zip(inside.iter().cycle())
        .filter(|(sd, inside)| **inside && *sd > 0.0)
        .map(|(sd, _)| sd)
        .collect();
    sorted.sort_by(f64::total_cmp);
    let good = sorted.get(sorted.len() / 4).copied().unwrap_or(0.0);
    let deviations = [0, 1].map(|axis| {
        let known =
            |(sd, &inside): (f64, &bool)| (inside && sd > 0.0 && sd <= PLAIN * good).then_some(sd);
        sd(axis)
            .zip(inside)
            .map(known)
            .collect::<Vec<Option<f64>>>()
    });
    let turn = reference_phase(all, &deviations);
    let [x, y] = [0, 1].map(|axis| {
        let known = |(e, sd): (&Estimate, &Option<f64>)| sd.map(|_| e.px[axis] * turn);
        all.iter()
            .zip(&deviations[axis])
            .map(known)
            .collect::<Vec<Option<Complex64>>>()
    });
    let known = |tile: usize| deviations.iter().any(|sd| sd[tile].is_some());
    let moves = all
        .iter()
        .enumerate()
        .map(|(tile, e)| known(tile) && e.moves());
    let moves = moves.collect();
    let [x_sd, y_sd] = deviations;
    Shape {
        hz,
        x,
        y,
        x_sd,
        y_sd,
        moves,
    }
}

/// What turns the larger component of the largest tile to a positive real one.
fn reference_phase(all: &[Estimate], deviations: &[Vec<Option<f64>>; 2]) -> Complex64 {
    let largest = |least: f64| {
        let mut most = (0.0, Complex64::default());
        for (tile, estimate) in all.iter().enumerate() {
            let px = [0, 1].map(|axis| {
                let sure = |sd: &f64| estimate.px[axis].norm() >= least * sd;
                let known = deviations[axis][tile].filter(sure);
                known.map_or(Complex64::default(), |_| estimate.px[axis])
            });
            let amplitude = semi_major(px[0], px[1]);
            if amplitude > most.0 {
                let [x, y] = px;
                most = (amplitude, if x.norm() >= y.norm() { x } else { y });
            }
        }
        most
    };
    let (amplitude, phasor) = match largest(LARGE) {
        (0.0, _) => largest(0.0),
        sure => sure,
    };
    if amplitude > 0.0 {
        phasor.conj() / phasor.norm()
    } else {
        Complex64::new(1.0, 0.0)
    }
}
