//! The rectangle in which the tones stand out most.

use std::ops::{AddAssign, Range, Sub};

/// A rectangle is taken only if a tone stands out so many times better in it, and if no tone stands out less than this
/// share of what it does in the whole: 10 % in its noise.
const GAIN: f64 = 1.05;
const LOSS: f64 = 0.83;
/// What moves with less than this share of the inside's amplitude does not move with it; where the motion is so
/// large that a shift is no linear matter of the pixels, px, with less than that.
const STILL: f64 = 0.7;
const LARGE_PX: f64 = 0.3;
const STILL_OF_LARGE: f64 = 0.3;
/// What knows less of the tone than this share of the whole picture is no part to measure: a lamp's flicker on pixels that
/// are nearly white, something that passes.
const LEAST: f64 = 0.08;
/// Tiles of a part that moves follow the tone alike: their amplitudes vary by less than this share of their mean, squared. Of a
/// motion along the columns, which each tile takes for some motion along the rows by how its edges lean, they vary by more.
const UNLIKE: f64 = 0.25;
/// Of a camera that moves all tiles follow better than that.
const ALIKE: f64 = 0.05;
/// What is weaker than this share of a shake may be what taking the shake out has left.
const LEAST_SHARE: f64 = 0.1;
/// This many standard deviations of the amplitude are in its favour.
const SURE: f64 = 4.0;

/// Least squares of a tile's shifts on the cosine and the sine of a tone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tile {
    /// Normal matrix (cc, cs, ss) and right side, 1/px² and 1/px.
    pub(super) normal: [f64; 3],
    pub(super) right: [f64; 2],
}

impl AddAssign for Tile {
    fn add_assign(&mut self, other: Self) {
        let sum = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        sum(&mut self.normal, &other.normal);
        sum(&mut self.right, &other.right);
    }
}

impl Sub for Tile {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        let [a, b] = [&self.normal, &other.normal];
        let [c, d] = [&self.right, &other.right];
        Self {
            normal: std::array::from_fn(|k| a[k] - b[k]),
            right: std::array::from_fn(|k| c[k] - d[k]),
        }
    }
}

impl Tile {
    /// The inverse of the normal matrix; `None` when nothing is known.
    fn covariance(&self) -> Option<[f64; 3]> {
        let [cc, cs, ss] = self.normal;
        let determinant = cc * ss - cs * cs;
        let known = determinant > 1e-6 * cc * ss && cc > 0.0 && ss > 0.0;
        known.then(|| [ss, -cs, cc].map(|v| v / determinant))
    }

    /// Amplitudes of cosine and sine, px.
    pub(super) fn amplitude(&self) -> Option<[f64; 2]> {
        let [cc, cs, ss] = self.covariance()?;
        let [c, s] = self.right;
        Some([cc * c + cs * s, cs * c + ss * s])
    }

    /// How far the tone stands out of the noise: twice the logarithm of the likelihoods' ratio.
    fn outstanding(&self) -> f64 {
        let [c, s] = self.right;
        self.amplitude().map_or(0.0, |[x, y]| x * c + y * s)
    }

    /// Surely it moves far less than `inside`, or against it.
    fn is_still(&self, inside: &Self) -> bool {
        let (Some([c, s]), Some([cc, cs, ss]), Some([x, y])) =
            (self.amplitude(), self.covariance(), inside.amplitude())
        else {
            return false;
        };
        let px = x.hypot(y);
        let (x, y) = (x / px, y / px);
        let sd = (cc * x * x + 2.0 * cs * x * y + ss * y * y).sqrt();
        let share = if px > LARGE_PX { STILL_OF_LARGE } else { STILL };
        c * x + s * y + SURE * sd < share * px
    }
}

/// By how much tiles differ in how they follow a tone, beyond their noise: the variance of their amplitudes, weighted, over the
/// square of their mean. Infinite where they do not follow it at all.
fn unlikeness(tiles: &[Tile], columns: usize, of: &Rectangle) -> f64 {
    let (mut all, mut own, mut n) = (Tile::default(), 0.0, 0.0);
    for y in of.rows.clone() {
        for x in of.columns.clone() {
            let tile = tiles[y * columns + x];
            if tile.amplitude().is_some() {
                all += tile;
                own += tile.outstanding();
                n += 1.0;
            }
        }
    }
    let mean = all.outstanding();
    // Two degrees of freedom each but for the mean.
    let excess = own - mean - 2.0 * (n - 1.0);
    if mean > 0.0 {
        excess.max(0.0) / mean
    } else {
        f64::INFINITY
    }
}

/// The rectangle of [`best`], by the tones that are motions along the rows; what leaks in from a motion along the
/// columns is no reason to leave anything out.
pub(super) fn best_of_motions(
    mut tones: Vec<Vec<Tile>>,
    columns: usize,
    rows: usize,
) -> Option<Rectangle> {
    loop {
        let found = best(&tones, columns, rows)?;
        let before = tones.len();
        tones.retain(|tone| unlikeness(tone, columns, &found) < UNLIKE);
        if tones.len() == before {
            return Some(found);
        }
    }
}

/// The amplitude of a camera that moves, px: the first tone, the largest, is in all tiles alike, and
/// another one in a part of them alone.
pub(super) fn shake_px(tones: &[Vec<Tile>], columns: usize, rows: usize) -> Option<f64> {
    let (shake, others) = tones.split_first()?;
    let whole = Rectangle {
        columns: 0..columns,
        rows: 0..rows,
    };
    let amplitude = |tone: &[Tile], of: &Rectangle| {
        let mut all = Tile::default();
        for y in of.rows.clone() {
            of.columns
                .clone()
                .for_each(|x| all += tone[y * columns + x]);
        }
        all.amplitude().map_or(0.0, |[c, s]| c.hypot(s))
    };
    let shake_px = amplitude(shake, &whole);
    let in_a_part = |tone: &Vec<Tile>| {
        let part = best_of_motions(vec![tone.clone()], columns, rows);
        part.is_some_and(|part| {
            let share = amplitude(tone, &part) / shake_px;
            (LEAST_SHARE..1.0).contains(&share)
        })
    };
    let shakes = unlikeness(shake, columns, &whole) < ALIKE && others.iter().any(in_a_part);
    shakes.then_some(shake_px)
}

/// Columns and rows, in tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
}

impl Rectangle {
    /// The same without the columns and rows at its sides that are blank, up to one beside those that are not: they know
    /// nothing, and what a codec does there is no motion.
    pub(super) fn without_blank_sides(self, textured: impl Fn(usize, usize) -> bool) -> Self {
        let Self { columns, rows } = self;
        let column = |x: usize| rows.clone().any(|y| textured(x, y));
        let row = |y: usize| columns.clone().any(|x| textured(x, y));
        Self {
            columns: kept(&columns, column),
            rows: kept(&rows, row),
        }
    }
}

/// From one before the first that has something to one behind the last; all where none has.
fn kept(all: &Range<usize>, has: impl Fn(usize) -> bool) -> Range<usize> {
    let first = all.clone().find(|&k| has(k)).unwrap_or(all.start);
    let last = all.clone().rev().find(|&k| has(k)).unwrap_or(all.end);
    first.saturating_sub(1).max(all.start)..(last + 2).min(all.end)
}

/// Sums over rectangles of tiles of one tone.
struct Table {
    columns: usize,
    /// Of the tiles above and left of each corner.
    corners: Vec<Tile>,
}

impl Table {
    fn new(tiles: &[Tile], columns: usize, rows: usize) -> Self {
        let mut corners = vec![Tile::default(); (columns + 1) * (rows + 1)];
        for y in 0..rows {
            let mut row = Tile::default();
            for x in 0..columns {
                row += tiles[y * columns + x];
                let mut sum = corners[y * (columns + 1) + x + 1];
                sum += row;
                corners[(y + 1) * (columns + 1) + x + 1] = sum;
            }
        }
        Self { columns, corners }
    }

    fn sum(&self, columns: &Range<usize>, rows: &Range<usize>) -> Tile {
        let corner = |x: usize, y: usize| self.corners[y * (self.columns + 1) + x];
        let mut sum = corner(columns.end, rows.end) - corner(columns.start, rows.end);
        sum += corner(columns.start, rows.start);
        sum - corner(columns.end, rows.start)
    }
}

/// The rectangle of `columns` by `rows` tiles in which the tones stand out most; `None` for all of it. `tones`: the
/// tiles of each, row by row.
pub(super) fn best(tones: &[Vec<Tile>], columns: usize, rows: usize) -> Option<Rectangle> {
    let tables: Vec<Table> = tones.iter().map(|t| Table::new(t, columns, rows)).collect();
    let (all_columns, all_rows) = (0..columns, 0..rows);
    let mut best: Option<(f64, Rectangle)> = None;
    for columns in ranges(columns) {
        for rows in ranges(rows) {
            let value = tables
                .iter()
                .map(|t| t.sum(&columns, &rows).outstanding())
                .sum();
            if best.as_ref().is_none_or(|(most, _)| value > *most) {
                let columns = columns.clone();
                best = Some((value, Rectangle { columns, rows }));
            }
        }
    }
    let mut found = best?.1;
    // Each side is left out as far as it surely stands still.
    let inside: Vec<Tile> = tables
        .iter()
        .map(|t| t.sum(&found.columns, &found.rows))
        .collect();
    let still = |columns: Range<usize>, rows: Range<usize>| {
        let mut sides = tables.iter().map(|t| t.sum(&columns, &rows)).zip(&inside);
        sides.any(|(side, inside)| side.is_still(inside))
    };
    let (c, r) = (found.columns.clone(), found.rows.clone());
    let first = (0..=c.start)
        .rev()
        .find(|&x| x == 0 || still(0..x, r.clone()));
    let last = (c.end..=columns).find(|&x| x == columns || still(x..columns, r.clone()));
    found.columns = first?..last?;
    let c = found.columns.clone();
    let first = (0..=r.start)
        .rev()
        .find(|&y| y == 0 || still(c.clone(), 0..y));
    let last = (r.end..=rows).find(|&y| y == rows || still(c.clone(), y..rows));
    found.rows = first?..last?;
    let gain = |table: &Table| {
        let whole = table.sum(&all_columns, &all_rows).outstanding();
        table.sum(&found.columns, &found.rows).outstanding() / whole.max(1e-9)
    };
    let knows = |table: &Table, columns: &Range<usize>, rows: &Range<usize>| {
        let [cc, _, ss] = table.sum(columns, rows).normal;
        cc + ss
    };
    let large = tables
        .iter()
        .all(|t| knows(t, &found.columns, &found.rows) > LEAST * knows(t, &all_columns, &all_rows));
    let gains: Vec<f64> = tables.iter().map(gain).collect();
    let worth = gains.iter().any(|&g| g > GAIN) && gains.iter().all(|&g| g > LOSS);
    (large && worth).then_some(found)
}

fn ranges(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n).flat_map(move |start| (start + 1..=n).rev().map(move |end| start..end))
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: usize = 16;
    const ROWS: usize = 10;

    /// Tiles that know the tone's amplitude to `sd_px` each, and read it right.
    fn tiles(sd_px: f64, amplitude_px: impl Fn(usize, usize) -> [f64; 2]) -> Vec<Tile> {
        let known = 1.0 / (sd_px * sd_px);
        let place = (0..ROWS).flat_map(|y| (0..COLUMNS).map(move |x| (x, y)));
        let tile = |(x, y)| Tile {
            normal: [known, 0.0, known],
            right: amplitude_px(x, y).map(|a| a * known),
        };
        place.map(tile).collect()
    }

    fn chosen(tones: &[Vec<Tile>]) -> Option<(Range<usize>, Range<usize>)> {
        best(tones, COLUMNS, ROWS).map(|r| (r.columns, r.rows))
    }

    fn is_left(x: usize) -> bool {
        x < 6
    }

    #[test]
    fn all_of_the_picture_is_taken_where_all_of_it_moves_and_where_it_is_not_sure() {
        assert_eq!(chosen(&[]), None);
        assert_eq!(chosen(&[tiles(0.05, |_, _| [0.02, 0.01])]), None);
        let third = |x, _| if is_left(x) { [0.02, 0.0] } else { [0.0; 2] };
        // Six columns of tiles know it to 0.02 px together.
        assert_eq!(chosen(&[tiles(0.16, third)]), None);
        // Nothing is known of what is beside it.
        let mut blind = tiles(0.02, |_, _| [0.02, 0.0]);
        for row in blind.chunks_mut(COLUMNS) {
            row[..4].fill(Tile::default());
        }
        assert_eq!(chosen(&[blind]), None);
    }

    #[test]
    fn what_moves_by_less_than_its_tiles_know_is_found() {
        let third = |x, _| if is_left(x) { [0.02, 0.0] } else { [0.0; 2] };
        assert_eq!(chosen(&[tiles(0.03, third)]), Some((0..6, 0..10)));
        let corner = |x, y| {
            if x >= 9 && y < 5 {
                [0.0, 0.02]
            } else {
                [0.0; 2]
            }
        };
        assert_eq!(chosen(&[tiles(0.02, corner)]), Some((9..16, 0..5)));
    }

    #[test]
    fn a_single_tile_is_no_part() {
        let tile = |x, y| {
            if (x, y) == (3, 4) {
                [0.3, 0.0]
            } else {
                [0.0; 2]
            }
        };
        assert_eq!(chosen(&[tiles(0.03, tile)]), None);
    }

    #[test]
    fn of_two_sides_that_move_against_each_other_one_is_taken() {
        let rocking = |x, _| if x < 9 { [0.02, 0.0] } else { [-0.02, 0.0] };
        assert_eq!(chosen(&[tiles(0.05, rocking)]), Some((0..9, 0..10)));
    }

    #[test]
    fn no_tone_is_lost_for_another() {
        let left = |x, _| if is_left(x) { [0.02, 0.0] } else { [0.0; 2] };
        let right = |x, _| if is_left(x) { [0.0; 2] } else { [0.01, 0.0] };
        let everywhere = |_, _| [0.02, 0.0];
        assert_eq!(chosen(&[tiles(0.03, left), tiles(0.03, right)]), None);
        assert_eq!(chosen(&[tiles(0.03, left), tiles(0.03, everywhere)]), None);
        let also_left = |x, _| if is_left(x) { [0.0, 0.01] } else { [0.0; 2] };
        let both = [tiles(0.03, left), tiles(0.03, also_left)];
        assert_eq!(chosen(&both), Some((0..6, 0..10)));
    }

    #[test]
    fn what_leaks_from_a_motion_along_the_columns_is_no_part_to_measure() {
        // Edges lean either way, more so on the left.
        let leak = |x: usize, y: usize| {
            let lean = ((x * 7 + y * 5) % 11) as f64 / 5.0 - 1.0;
            let more = if is_left(x) {
                0.05 + 0.1 * lean
            } else {
                0.02 * lean
            };
            [more, 0.3 * more]
        };
        let leaking = vec![tiles(0.005, leak)];
        assert!(best(&leaking, COLUMNS, ROWS).is_some());
        assert_eq!(best_of_motions(leaking.clone(), COLUMNS, ROWS), None);
        // A motion along the rows of a part is still one beside it.
        let third = |x, _| if is_left(x) { [0.1, 0.0] } else { [0.0; 2] };
        let both = vec![tiles(0.005, third), leaking[0].clone()];
        let found = best_of_motions(both, COLUMNS, ROWS).unwrap();
        assert_eq!((found.columns, found.rows), (0..6, 0..10));
    }

    #[test]
    fn a_camera_moves_where_all_follow_one_tone_and_a_part_another() {
        let shake = tiles(0.01, |_, _| [0.3, 0.1]);
        let machine = |px: f64| {
            tiles(
                0.01,
                move |x, _| if is_left(x) { [0.0, px] } else { [0.0; 2] },
            )
        };
        let moves = shake_px(&[shake.clone(), machine(0.05)], COLUMNS, ROWS).unwrap();
        assert!((moves - 0.3f64.hypot(0.1)).abs() < 0.01, "{moves} px");
        assert_eq!(shake_px(std::slice::from_ref(&shake), COLUMNS, ROWS), None);
        // All of the machine is in the picture.
        let all = tiles(0.01, |_, _| [0.0, 0.05]);
        assert_eq!(shake_px(&[shake.clone(), all], COLUMNS, ROWS), None);
        assert_eq!(shake_px(&[machine(0.3), shake], COLUMNS, ROWS), None);
    }

    #[test]
    fn a_large_motion_that_reads_differently_is_no_still_part() {
        let read = |x, _| if is_left(x) { [3.0, 0.0] } else { [1.5, 0.0] };
        assert_eq!(chosen(&[tiles(0.05, read)]), None);
        let still = |x, _| if is_left(x) { [3.0, 0.0] } else { [0.1, 0.0] };
        assert_eq!(chosen(&[tiles(0.05, still)]), Some((0..6, 0..10)));
    }
}
