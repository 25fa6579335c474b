//! Rows of frames that were exposed at once, or nearly, and that a codec has been at: measured together.
//!
//! What a row alone can say of compressed video is little: predicted blocks hold still and jump, blank parts creep, and a
//! row that has been lost is searched for among the codec's errors. But where a frame is exposed within a short time, its
//! rows all follow one smooth motion: a constant with a global shutter, a parabola over the rows with a rolling one. It is
//! found by least squares over the tiles of the part that have texture, the reference moved along until nothing is left to
//! be gained (Lucas & Kanade 1981; Gauss–Newton from where the frame before was). Each tile's own brightness is taken off,
//! because a codec's commonest error is a block's level, and the frame's gain is fitted along. What a row then still says
//! beside that motion is added to it, so that parts that move otherwise show.
//!
//! What a row knows is taken from the reference alone, and the noise from what all rows leave: a frame that leaves far more
//! than is usual counts less, and one that is a copy of the frame before counts nothing.

mod patch;

use std::ops::Range;

use rowtone::camera::Timing;
use rowtone::pipeline::Reading;
use rowtone::timeline::{Binner, Displacement, Group, Tally, Vertical};
use rowtone::tracker::Axes;
use rowtone_clip::Rect;
use rowtone_linear::Symmetric;

use super::region::Picture;
use patch::{Plane, RowSums, Tile};

/// Coefficients of the motion along each axis: over the rows 1, η and η² with a rolling shutter, η from −1 to 1.
const ORDERS: usize = 3;
const UNKNOWNS: usize = 2 * ORDERS;
/// Side of a tile, px, about.
const TILE: usize = 16;
/// Tiles that know most are read, so many at most, and none that knows less than this share of what a tile of them does.
const MOST_TILES: usize = 480;
const LEAST_SHARE: f64 = 0.02;
/// Frames that the reference is learned from, and how often.
const LEARN_FRAMES: usize = 64;
const ROUNDS: usize = 3;
/// Steps of a frame, and a step that is none any more, px.
const STEPS: usize = 8;
const SMALL_STEP: f64 = 0.004;
/// The picture moves by about so much at most, px: what no texture tells is taken for still.
const USUAL_PX: f64 = 2.0;
/// A row that knows less than this share of what one knows on average along x tells of y alone.
const LEAST_ROW: f64 = 1e-3;
/// A frame that leaves so many times what is usual counts less, and beyond this many times not at all.
const MORE: f64 = 3.0;
const LOST: f64 = 30.0;
/// What is usual follows by this share a frame.
const FOLLOW: f64 = 0.02;
/// No pixel is known better than this, grey values².
const LEAST_VARIANCE: f64 = 0.02;

/// The motion of a frame: coefficients along x and along y.
type Motion = [f64; UNKNOWNS];

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Became {
    /// Its rows were measured.
    Measured,
    /// It is a copy of the frame before.
    Repeated,
    /// It shows something else.
    Lost,
}

/// See the [module](self).
#[derive(Debug)]
pub(super) struct Together {
    /// The columns that are measured, of all rows of the part; and which of these.
    columns: Rect,
    rows: Range<usize>,
    timing: Timing,
    axes: Axes,
    orders: usize,
    tiles: Vec<Tile>,
    reference: Plane,
    /// What each row of the reference knows.
    known: Vec<RowSums>,
    motion: Motion,
    /// What a pixel usually leaves, grey values²; 0 where no frame was measured.
    usual: f64,
    frame: Plane,
    before: Vec<f32>,
    /// Where rows are combined.
    binner: Option<Binner>,
}

impl Together {
    /// Of these columns of a part, and these rows of it, learned from the first frames; rows are combined in these groups.
    pub(super) fn learn<P: Picture>(
        (columns, rows): (Rect, Range<usize>),
        (timing, axes): (Timing, Axes),
        groups: Option<Group>,
        frames: &[P],
    ) -> Self {
        let plane = Plane {
            width: columns.width,
            height: rows.len(),
            values: vec![0.0; columns.width * rows.len()],
        };
        let mut learned = Self {
            columns,
            rows,
            timing,
            axes,
            orders: if timing.is_global_shutter() {
                1
            } else {
                ORDERS
            },
            tiles: Vec::new(),
            reference: plane.clone(),
            known: Vec::new(),
            motion: [0.0; UNKNOWNS],
            usual: 0.0,
            frame: plane,
            before: Vec::new(),
            binner: groups.map(Binner::new),
        };
        let step = frames.len().div_ceil(LEARN_FRAMES).max(1);
        for round in 0..ROUNDS {
            learned.average(frames.iter().step_by(step), round > 0);
        }
        (learned.motion, learned.usual) = ([0.0; UNKNOWNS], 0.0);
        learned
    }

    /// Makes the reference the mean of these frames, each moved back by its motion where that is known.
    fn average<'f, P: Picture + 'f>(&mut self, frames: impl Iterator<Item = &'f P>, moved: bool) {
        let (width, height) = (self.reference.width, self.reference.height);
        let mut sums = vec![0.0_f32; width * height];
        let mut line = [0.0_f32; patch::SIDE];
        let mut count = 0.0_f32;
        self.motion = [0.0; UNKNOWNS];
        for frame in frames {
            self.read(frame);
            if moved && self.follow().is_none() {
                continue;
            }
            count += 1.0;
            for (y, row) in sums.chunks_exact_mut(width).enumerate() {
                let back = self.at(y).map(|px| -px);
                for (k, part) in row.chunks_mut(patch::SIDE).enumerate() {
                    let line = &mut line[..part.len()];
                    let place = [(k * patch::SIDE) as isize, y as isize];
                    self.frame.moved(place, back, line);
                    part.iter_mut().zip(&*line).for_each(|(s, v)| *s += v);
                }
            }
        }
        if count > 0.0 {
            let mean = sums.iter().map(|sum| sum / count);
            self.reference.values = mean.collect();
        }
        self.choose_tiles();
    }

    /// The tiles that know most, and what their rows know.
    fn choose_tiles(&mut self) {
        let reference = &self.reference;
        let mut tiles: Vec<(f64, Tile)> = Vec::new();
        for rows in cut(reference.height) {
            for columns in cut(reference.width) {
                let tile = Tile {
                    x: columns.start,
                    y: rows.start,
                    width: columns.len(),
                    height: rows.len(),
                };
                let mut knows = 0.0;
                tile.sums(
                    reference,
                    reference,
                    |_| [0.0; 2],
                    |_, row| knows += row.slopes[0] + row.slopes[2],
                );
                tiles.push((knows, tile));
            }
        }
        tiles.sort_by(|a, b| b.0.total_cmp(&a.0));
        tiles.truncate(MOST_TILES);
        let some = tiles.len().min(1 + tiles.len() / 4);
        let usual = tiles[..some].iter().map(|t| t.0).sum::<f64>() / some.max(1) as f64;
        tiles.retain(|(knows, _)| *knows > LEAST_SHARE * usual);
        self.tiles = tiles.into_iter().map(|(_, tile)| tile).collect();
        self.known = vec![RowSums::default(); self.reference.height];
        for tile in &self.tiles {
            let known = &mut self.known;
            let add = |y: usize, row: RowSums| known[y].add(&row);
            tile.sums(&self.reference, &self.reference, |_| [0.0; 2], add);
        }
    }

    /// Takes a frame's pixels in.
    fn read<P: Picture>(&mut self, frame: &P) {
        let rows = self.frame.values.chunks_exact_mut(self.columns.width);
        for (y, row) in self.rows.clone().zip(rows) {
            let pixels = frame.row(&self.columns, y);
            let values = row.iter_mut().zip(pixels.values());
            values.for_each(|(v, p)| *v = p.into());
        }
    }

    /// Powers of a row's place from −1 to 1.
    fn powers(&self, y: usize) -> [f64; ORDERS] {
        let half = 0.5 * (self.reference.height.max(2) - 1) as f64;
        let place = y as f64 / half - 1.0;
        std::array::from_fn(|k| {
            if k < self.orders {
                place.powi(k as i32)
            } else {
                0.0
            }
        })
    }

    /// The motion of a row.
    fn at(&self, y: usize) -> [f32; 2] {
        let powers = self.powers(y);
        let along = |axis: usize| -> f64 {
            let coefficients = &self.motion[axis * ORDERS..][..ORDERS];
            powers.iter().zip(coefficients).map(|(p, c)| p * c).sum()
        };
        [along(0) as f32, along(1) as f32]
    }

    /// What the rows say of the frame that was read, the reference moved to where it is thought to be.
    fn sums(&self) -> Vec<RowSums> {
        let motion: Vec<[f32; 2]> = (0..self.frame.height).map(|y| self.at(y)).collect();
        let mut sums = vec![RowSums::default(); self.frame.height];
        for tile in &self.tiles {
            let add = |y: usize, row: RowSums| sums[y].add(&row);
            tile.sums(&self.reference, &self.frame, |y| motion[y], add);
        }
        let (mut bright, mut off) = (0.0, 0.0);
        for row in &sums {
            bright += row.light[0];
            off += row.light[1];
        }
        // The frame is so much brighter, as a share.
        let gain = off / bright.max(1e-9);
        for row in &mut sums {
            for (pull, bright) in row.pulls.iter_mut().zip(row.bright) {
                *pull -= gain * bright;
            }
            row.light[2] -= gain * (2.0 * row.light[1] - gain * row.light[0]);
        }
        sums
    }

    /// Finds the motion of the frame that was read: what its rows say there, and what a pixel leaves, grey values².
    fn follow(&mut self) -> Option<(Vec<RowSums>, f64)> {
        let before = self.motion;
        let mut found = self.step_from(before);
        let lost = |found: &Option<(Vec<RowSums>, f64)>| {
            found
                .as_ref()
                .is_none_or(|f| self.usual > 0.0 && f.1 > MORE * self.usual)
        };
        if lost(&found) && before != [0.0; UNKNOWNS] {
            let there = self.motion;
            let again = self.step_from([0.0; UNKNOWNS]);
            let left = |f: &Option<(Vec<RowSums>, f64)>| f.as_ref().map_or(f64::INFINITY, |f| f.1);
            if left(&again) < left(&found) {
                found = again;
            } else {
                self.motion = there;
            }
        }
        if found.is_none() {
            self.motion = before;
        }
        found
    }

    fn step_from(&mut self, motion: Motion) -> Option<(Vec<RowSums>, f64)> {
        self.motion = motion;
        for _ in 0..STEPS {
            let sums = self.sums();
            let step = self.step(&sums)?;
            let largest = step.iter().fold(0.0, |a: f64, s| a.max(s.abs()));
            if largest < SMALL_STEP {
                return Some(left(sums));
            }
            for (m, s) in self.motion.iter_mut().zip(step) {
                *m += s;
            }
            let far = self
                .motion
                .iter()
                .any(|m| m.abs() > self.reference.width as f64);
            if far || !largest.is_finite() {
                return None;
            }
        }
        Some(left(self.sums()))
    }

    /// By how much the motion is to be changed.
    fn step(&self, sums: &[RowSums]) -> Option<Motion> {
        let mut normal = Symmetric::zeros(UNKNOWNS);
        let mut right = [0.0; UNKNOWNS];
        let planar = self.axes == Axes::Xy;
        for (y, row) in sums.iter().enumerate().filter(|(_, row)| row.pixels > 0.0) {
            let powers = self.powers(y);
            let [xx, xy, yy] = row.slopes;
            for i in 0..self.orders {
                right[i] += powers[i] * row.pulls[0];
                right[ORDERS + i] += powers[i] * row.pulls[1];
                for j in 0..=i {
                    let both = powers[i] * powers[j];
                    normal.add(i, j, both * xx);
                    normal.add(ORDERS + i, ORDERS + j, both * yy);
                    normal.add(ORDERS + i, j, both * xy);
                    if i != j {
                        normal.add(ORDERS + j, i, both * xy);
                    }
                }
            }
        }
        let still = self.usual.max(LEAST_VARIANCE) / (USUAL_PX * USUAL_PX);
        for (k, right) in right.iter_mut().enumerate() {
            let asked = k % ORDERS < self.orders && (planar || k < ORDERS);
            normal.add(k, k, if asked { still } else { 1e15 });
            *right -= still * self.motion[k];
        }
        let step = normal.factor()?.solve(&right);
        Some(std::array::from_fn(|k| {
            let asked = k % ORDERS < self.orders && (planar || k < ORDERS);
            if asked { step[k] } else { 0.0 }
        }))
    }

    /// Measures the frame of this number: the rows that know something, in order.
    pub(super) fn measure<P: Picture>(
        &mut self,
        (number, frame): (u32, &P),
        to: &mut Vec<Displacement>,
    ) -> Became {
        self.read(frame);
        if self.before == self.frame.values {
            return Became::Repeated;
        }
        self.before.clone_from(&self.frame.values);
        let Some((sums, left)) = self.follow() else {
            return Became::Lost;
        };
        let left = left.max(LEAST_VARIANCE);
        if self.usual > 0.0 && left > LOST * self.usual {
            return Became::Lost;
        }
        let unusual = self.usual > 0.0 && left > MORE * self.usual;
        let variance = if unusual { left } else { self.usual.max(left) };
        let follow = if self.usual > 0.0 { FOLLOW } else { 1.0 };
        self.usual += follow * (left.min(MORE * self.usual.max(left / MORE)) - self.usual);
        let all: f64 = self.known.iter().map(|row| row.slopes[0]).sum();
        let least = LEAST_ROW * all / self.known.len().max(1) as f64;
        for (y, row) in self.rows.clone().enumerate() {
            let Some(measured) = self.row(y, &sums[y], variance, least) else {
                continue;
            };
            let in_picture = (self.columns.y + row) as u16;
            let start_ns = frame.start_ns() + self.timing.start_ns(in_picture);
            to.push(Displacement {
                frame: number,
                row: row as u16,
                time_ns: start_ns + i64::from(self.timing.exposure_ns() / 2),
                ..measured
            });
        }
        Became::Measured
    }

    /// Combines a frame's rows and hands what comes of them to `take`, with what became of the frame of that number.
    pub(super) fn combine(
        &mut self,
        rows: impl IntoIterator<Item = Displacement>,
        (frame, became): (u32, Became),
        mut take: impl FnMut(Reading),
    ) {
        let Some(binner) = &mut self.binner else {
            return;
        };
        let mut samples = rows.into_iter().filter_map(|row| binner.push(row));
        samples.by_ref().for_each(|sample| take(sample.into()));
        drop(samples);
        let height = self.rows.len() as u16;
        let tally = Tally {
            frames: 1,
            rows: height,
            occluded: if became == Became::Lost { height } else { 0 },
            repeated_frames: u16::from(became == Became::Repeated),
            ..Tally::NONE
        };
        take(Reading {
            sample: binner.finish(),
            tally,
            frame,
        });
    }

    /// What row `y` comes to; `None` where it knows nothing. `least`: what it must know to be asked along x.
    fn row(&self, y: usize, said: &RowSums, variance: f64, least: f64) -> Option<Displacement> {
        let [xx, xy, yy] = self.known[y].slopes;
        let [right, down] = self.at(y).map(f64::from);
        let knows_x = xx > least;
        let coupling = if knows_x { xy / xx } else { 0.0 };
        let first = if knows_x { said.pulls[0] / xx } else { 0.0 };
        let planar = self.axes == Axes::Xy;
        let beside = yy - coupling * xy;
        let vertical = (planar && beside > least).then(|| Vertical {
            shift_px: (down + (said.pulls[1] - coupling * said.pulls[0]) / beside) as f32,
            information_per_px2: (beside / variance) as f32,
            coupling: coupling as f32,
            ..Vertical::default()
        });
        let alone = Vertical {
            coupling: coupling as f32,
            ..Vertical::default()
        };
        let lean = if planar { coupling * down } else { 0.0 };
        (knows_x || vertical.is_some()).then(|| Displacement {
            frame: 0,
            row: 0,
            time_ns: 0,
            shift_px: if knows_x {
                (right + lean + first) as f32
            } else {
                0.0
            },
            information_per_px2: if knows_x { (xx / variance) as f32 } else { 0.0 },
            vertical: planar.then(|| vertical.unwrap_or(alone)),
        })
    }
}

/// The sums, and what a pixel leaves, grey values².
fn left(sums: Vec<RowSums>) -> (Vec<RowSums>, f64) {
    let (mut squares, mut pixels) = (0.0, 0.0);
    for row in &sums {
        squares += row.light[2];
        pixels += row.pixels;
    }
    (sums, squares / f64::max(pixels, 1.0))
}

/// A side in pieces of about a tile.
fn cut(length: usize) -> impl Iterator<Item = Range<usize>> {
    let n = ((length + TILE / 2) / TILE).max(1);
    (0..n).map(move |k| k * length / n..(k + 1) * length / n)
}

#[cfg(test)]
mod tests;
