//! Which part of the picture vibrates (`--roi auto`).
//!
//! The first frames are cut into strips of columns and groups of rows. In each, the shift is estimated against
//! the frames' mean (`shifts.rs`): coarse, but all rows of all frames take part. A row of a strip knows its shift
//! to some hundredths of a pixel and a vibration may be smaller than that; it is found all the same where it
//! stands out of the noise of the strips' spectra taken together (`tones.rs`). How far each tile of the picture
//! follows such a tone is then a matter of least squares, and so is the rectangle in which the tones stand out
//! most (`rectangle.rs`). What is outside of it is left out if it surely stands still, or moves the other way,
//! and no tone is lost by that. In doubt the whole picture is used.

mod rectangle;
mod shifts;
mod tones;

use std::ops::Range;

use rowtone::camera::{Pixels, Timing};

use rowtone_clip::{Frame, Rect};
use shifts::Shifts;

/// Fewer frames tell nothing.
const LEAST_FRAMES: usize = 12;
/// So many tones at most decide.
const TONES: usize = 4;
/// Tiles across lines.
const BANDS: usize = 10;

/// The part that vibrates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// Columns of the picture.
    pub columns: Range<usize>,
    /// Rows of the picture.
    pub rows: Range<usize>,
}

impl Region {
    /// All of a part.
    pub fn whole(part: &Rect) -> Self {
        Self {
            columns: part.x..part.x + part.width,
            rows: part.y..part.y + part.height,
        }
    }
}

/// What the first frames say of the picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The part to measure.
    pub region: Region,
    /// All of the picture shakes by more than a part of it vibrates.
    pub camera_moves: bool,
}

/// A frame, as far as it is needed here.
pub trait Picture {
    /// Start of exposure of its first row, ns.
    fn start_ns(&self) -> i64;
    /// Row `row` of `part`, which lies inside the picture.
    fn row(&self, part: &Rect, row: usize) -> Pixels<'_>;
}

impl Picture for Frame {
    fn start_ns(&self) -> i64 {
        self.start_ns
    }

    fn row(&self, part: &Rect, row: usize) -> Pixels<'_> {
        self.pixels(part, row)
    }
}

/// The part of `part` that vibrates, by the first frames. The whole part where all of it does, nothing does, or it
/// cannot be told. `timing` is the whole picture's.
pub fn choose<P: Picture>(frames: &[P], part: &Rect, timing: &Timing) -> Choice {
    let whole = Choice {
        region: Region::whole(part),
        camera_moves: false,
    };
    if frames.len() < LEAST_FRAMES {
        return whole;
    }
    let mut shifts = Shifts::measure(frames, part, timing);
    if shifts.columns.len() < 2 && shifts.groups.len() < 2 {
        return whole;
    }
    tones::measure_noise(&mut shifts);
    let bands: Vec<Range<usize>> = cut(shifts.groups.len(), 1, BANDS);
    let (mut tones, mut known) = (Vec::new(), Vec::new());
    while known.len() < TONES
        && let Some(tone) = tones::strongest(&shifts, &known)
    {
        known.push(tone);
        tones.push(tones::take_out(&mut shifts, tone.hz, &bands));
    }
    let (across, down) = (shifts.columns.len(), bands.len());
    // A shake may be much stronger than what vibrates.
    let mut all = tones.clone();
    while !known.is_empty()
        && all.len() < TONES
        && let Some(tone) = tones::weaker(&shifts, &known)
    {
        known.push(tone);
        all.push(tones::take_out(&mut shifts, tone.hz, &bands));
    }
    let camera_moves = is_regular(&shifts.starts_s) && rectangle::camera_moves(&all, across, down);
    let Some(found) = rectangle::best_of_motions(tones, across, down) else {
        return Choice {
            camera_moves,
            ..whole
        };
    };
    let span = |pieces: &[Range<usize>], found: &Range<usize>| {
        pieces[found.start].start..pieces[found.end - 1].end
    };
    let columns = span(&shifts.columns, &found.columns);
    let rows = span(&shifts.groups, &span(&bands, &found.rows));
    Choice {
        region: Region {
            columns: part.x + columns.start..part.x + columns.end,
            rows: part.y + rows.start..part.y + rows.end,
        },
        camera_moves,
    }
}

/// No frame is missing: where one is, taking a tone out leaves more of it, which may look like another.
fn is_regular(starts_s: &[f64]) -> bool {
    let steps = || starts_s.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, most) = steps().fold((f64::INFINITY, 0.0f64), |(a, b), s| (a.min(s), b.max(s)));
    most < 1.25 * least
}

/// Up to `most` pieces of about equal length, none shorter than `least`.
fn cut(length: usize, least: usize, most: usize) -> Vec<Range<usize>> {
    let n = (length / least).clamp(1, most);
    (0..n)
        .map(|k| k * length / n..(k + 1) * length / n)
        .collect()
}
