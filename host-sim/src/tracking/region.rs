//! Which part of the picture vibrates (`--roi auto`).
//!
//! The first frames are cut into tiles. In each tile the shift of groups of rows is estimated against the
//! frames' mean, by the slope of the mean (least squares): that is coarse, and blind to nothing. A tile
//! whose shifts vary far less than those of the tiles that vibrate most, beyond the doubt that its noise
//! leaves, stands still; columns and rows in which all tiles stand still are left out. What has no
//! texture takes no part in the choice. In doubt the whole picture is used: a still tile that stays costs
//! a little amplitude's worth of noise, a vibrating one that goes costs information.

use std::ops::Range;

use rowtone::camera::Pixels;

use crate::input::{Frame, Rect};

/// Frames that are looked at.
const FRAMES: usize = 16;
/// Fewer frames tell nothing.
const LEAST_FRAMES: usize = 12;
/// Rows that are taken together: a vibration hardly moves while they are read.
const GROUP: usize = 8;
/// Tiles along a line and across lines, and the least width of one, px.
const STRIPS: usize = 16;
const BANDS: usize = 10;
const LEAST_PX: usize = 16;
/// A tile that moves with less than this share of the power of the strongest ones stands still.
const STILL: f64 = 0.5;
/// A tile's power is known to this many standard deviations.
const SURE: f64 = 3.0;
/// Of a group only every so-many-th row is looked at.
const SKIP: usize = 2;

/// The part that vibrates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Region {
    /// Columns of the picture.
    pub(super) columns: Range<usize>,
    /// Rows of the picture.
    pub(super) rows: Range<usize>,
}

impl Region {
    /// All of a part.
    pub(super) fn whole(part: &Rect) -> Self {
        Self {
            columns: part.x..part.x + part.width,
            rows: part.y..part.y + part.height,
        }
    }
}

/// What is known of one tile.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// Power of its motion, px², the noise taken off; and the standard deviation of that.
    power: f64,
    sd: f64,
    /// That standard deviation if it stood still.
    still_sd: f64,
    /// Σ slope²: how much texture it has.
    texture: f64,
}

impl Tile {
    fn moves(&self) -> bool {
        self.power > SURE * self.still_sd && self.texture > 0.0
    }
}

/// The part of `part` that vibrates, by the first frames. The whole part where all of it does, nothing
/// does, or it cannot be told.
pub(super) fn choose(frames: &[Frame], part: &Rect) -> Region {
    let whole = Region::whole(part);
    let strips = cut(part.width, LEAST_PX, STRIPS);
    let groups = cut(part.height, GROUP, usize::MAX);
    if frames.len() < LEAST_FRAMES || strips.len() < 2 || groups.len() < 2 {
        return whole;
    }
    let step = frames.len().div_ceil(FRAMES);
    let frames: Vec<&Frame> = frames.iter().step_by(step).collect();
    let looked: Vec<Vec<Moments>> = groups
        .iter()
        .map(|rows| look(&frames, part, rows, &strips))
        .collect();
    // Columns by tiles of several groups of rows; then rows, group by group, in those columns.
    let bands: Vec<Vec<Tile>> = looked
        .chunks(groups.len().div_ceil(BANDS))
        .map(|band| {
            (0..strips.len())
                .map(|x| Moments::sum(band.iter().map(|group| &group[x])).tile())
                .collect()
        })
        .collect();
    let Some(strong) = strong(bands.iter().flatten()) else {
        return whole;
    };
    let strips_out: Vec<bool> = (0..strips.len())
        .map(|x| all_still(bands.iter().map(|band| &band[x]), strong))
        .collect();
    let inside = |x: &usize| !strips_out[*x];
    let rows: Vec<Tile> = looked
        .iter()
        .map(|group| {
            let columns = (0..strips.len()).filter(inside);
            Moments::sum(columns.map(|x| &group[x])).tile()
        })
        .collect();
    let rows_out: Vec<bool> = rows
        .iter()
        .map(|row| all_still([row].into_iter(), strong))
        .collect();
    let (columns, rows) = (span(&strips, &strips_out), span(&groups, &rows_out));
    Region {
        columns: part.x + columns.start..part.x + columns.end,
        rows: part.y + rows.start..part.y + rows.end,
    }
}

/// The power of the tiles that vibrate most, px²: their upper quartile, so that single ones (a shadow, a
/// reflection) do not decide. `None` when nothing moves for sure.
fn strong<'a>(tiles: impl Iterator<Item = &'a Tile>) -> Option<f64> {
    let mut powers: Vec<f64> = tiles.filter(|t| t.moves()).map(|t| t.power).collect();
    powers.sort_by(f64::total_cmp);
    powers.get(powers.len() * 3 / 4).copied()
}

/// At least one of the tiles surely stands still against `strong`, and the others have no texture.
fn all_still<'a>(tiles: impl Iterator<Item = &'a Tile> + Clone, strong: f64) -> bool {
    let still = |t: &Tile| t.texture > 0.0 && t.power + SURE * t.sd < STILL * strong;
    tiles.clone().any(still) && tiles.clone().all(|t| t.texture == 0.0 || still(t))
}

/// From the first that is in to the last that is in, all of it when none is.
fn span(pieces: &[Range<usize>], out: &[bool]) -> Range<usize> {
    let first = out.iter().position(|out| !out).unwrap_or(0);
    let last = out.iter().rposition(|out| !out).unwrap_or(out.len() - 1);
    pieces[first].start..pieces[last].end
}

/// Up to `most` pieces of about equal length, none shorter than `least`.
fn cut(length: usize, least: usize, most: usize) -> Vec<Range<usize>> {
    let n = (length / least).clamp(1, most);
    (0..n)
        .map(|k| k * length / n..(k + 1) * length / n)
        .collect()
}

/// One group of rows, strip by strip.
fn look(
    frames: &[&Frame],
    part: &Rect,
    rows: &Range<usize>,
    strips: &[Range<usize>],
) -> Vec<Moments> {
    let mut mean = vec![0.0f32; part.width];
    let mut slope = vec![0.0f32; part.width];
    let mut line = vec![0.0f32; part.width];
    // Per frame and strip: −Σ slope·(p − g·r), Σ slope², Σ (p − g·r)².
    let mut sums = vec![[0.0f64; 3]; frames.len() * strips.len()];
    for row in rows.clone().step_by(SKIP) {
        mean.fill(0.0);
        for frame in frames {
            read(frame.pixels(part, row), &mut line);
            mean.iter_mut().zip(&line).for_each(|(m, p)| *m += p);
        }
        mean.iter_mut().for_each(|m| *m /= frames.len() as f32);
        for (s, around) in slope.iter_mut().skip(1).zip(mean.windows(3)) {
            *s = (around[2] - around[0]) / 2.0;
        }
        let bright: f32 = mean.iter().sum();
        for (frame, sums) in frames.iter().zip(sums.chunks_exact_mut(strips.len())) {
            let line_sum = read(frame.pixels(part, row), &mut line);
            let gain = line_sum / bright.max(1.0);
            for (strip, sums) in strips.iter().zip(sums) {
                // The slope is not known at the picture's edge.
                let inner = strip.start.max(1)..strip.end.min(part.width - 1);
                let [across, steep, rest] = moments(
                    &line[inner.clone()],
                    &mean[inner.clone()],
                    &slope[inner],
                    gain,
                );
                sums[0] -= f64::from(across);
                sums[1] += f64::from(steep);
                sums[2] += f64::from(rest);
            }
        }
    }
    let looked_at = rows.len().div_ceil(SKIP);
    (0..strips.len())
        .map(|x| {
            let frames = sums.iter().skip(x).step_by(strips.len());
            Moments::of(frames, (strips[x].len() * looked_at) as f64)
        })
        .collect()
}

/// The pixels as floats, and their sum.
fn read(pixels: Pixels<'_>, line: &mut [f32]) -> f32 {
    match pixels {
        Pixels::U8(p) => {
            line.iter_mut().zip(p).for_each(|(l, &p)| *l = f32::from(p));
            p.iter().map(|&p| u32::from(p)).sum::<u32>() as f32
        }
        Pixels::U16(p) => {
            line.iter_mut().zip(p).for_each(|(l, &p)| *l = f32::from(p));
            p.iter().map(|&p| u64::from(p)).sum::<u64>() as f32
        }
        Pixels::Upper(p) => {
            line.iter_mut()
                .zip(p.iter())
                .for_each(|(l, p)| *l = f32::from(p));
            p.iter().map(u32::from).sum::<u32>() as f32
        }
    }
}

/// Σ slope·e, Σ slope², Σ e² of e = line − gain·mean, in several sums side by side, as vectors have them.
fn moments(line: &[f32], mean: &[f32], slope: &[f32], gain: f32) -> [f32; 3] {
    const LANES: usize = 8;
    let mut sums = [[0.0f32; LANES]; 3];
    let chunks = line.chunks(LANES).zip(mean.chunks(LANES));
    for ((line, mean), slope) in chunks.zip(slope.chunks(LANES)) {
        for (lane, ((&p, &r), &s)) in line.iter().zip(mean).zip(slope).enumerate() {
            let e = p - gain * r;
            sums[0][lane] += s * e;
            sums[1][lane] += s * s;
            sums[2][lane] += e * e;
        }
    }
    sums.map(|lanes| lanes.iter().sum())
}

/// Sums over groups of rows and strips, weighted by their texture.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    weight: f64,
    power: f64,
    noise: f64,
    /// Σ weight²/freedom: for the standard deviation.
    spread: f64,
}

impl Moments {
    /// Of one group and strip, from its sums in each frame.
    fn of<'a>(frames: impl Iterator<Item = &'a [f64; 3]> + Clone, pixels: f64) -> Self {
        let n = frames.clone().count() as f64;
        let shift = |s: &[f64; 3]| s[0] / s[1];
        let steep = frames.clone().map(|s| s[1]).sum::<f64>() / n;
        if steep <= 0.0 {
            return Self::default();
        }
        let mean = frames.clone().map(shift).sum::<f64>() / n;
        let squares = frames.clone().map(|s| (shift(s) - mean).powi(2));
        let power = squares.sum::<f64>() / (n - 1.0);
        // What the shift does not explain is the pixels' noise; the mean took one frame's worth. The
        // least of the frames' serves: where the motion is large, the rest is not noise alone.
        let variance = frames
            .map(|s| s[2] - s[0] * s[0] / s[1])
            .fold(f64::INFINITY, f64::min)
            .max(0.0)
            / pixels
            * n
            / (n - 1.0);
        // A slope that is no steeper than noise makes it is no texture.
        if steep < 4.0 * pixels * variance / (2.0 * n) {
            return Self::default();
        }
        Self {
            weight: steep,
            power: steep * power,
            // The noise of a shift is variance / steep; weighted like the power.
            noise: variance,
            spread: steep * steep / (n - 1.0),
        }
    }

    fn sum<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            weight: a.weight + b.weight,
            power: a.power + b.power,
            noise: a.noise + b.noise,
            spread: a.spread + b.spread,
        })
    }

    fn tile(&self) -> Tile {
        if self.weight <= 0.0 {
            return Tile::default();
        }
        let noise = self.noise / self.weight;
        let total = self.power / self.weight;
        // The estimated power of n independent shifts has a relative deviation of sqrt(2/(n − 1)).
        let relative = (2.0 * self.spread).sqrt() / self.weight;
        Tile {
            power: total - noise,
            sd: relative * total.max(noise),
            still_sd: relative * noise,
            texture: self.weight,
        }
    }
}
