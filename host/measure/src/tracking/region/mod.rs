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
use tones::Tone;

/// Fewer frames tell nothing.
const LEAST_FRAMES: usize = 12;
/// So many tones at most decide.
const TONES: usize = 4;
/// What has fewer periods in the time that is looked at is wandering, where anything has more.
const PERIODS: f64 = 6.0;
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
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The part to measure.
    pub region: Region,
    /// By how much all of the picture shakes along the rows, zero to peak, px, where that is more than
    /// a part of it vibrates.
    pub shake_px: Option<f64>,
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
        shake_px: None,
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
    let shake_px = is_regular(&shifts.starts_s)
        .then(|| rectangle::shake_px(&all, across, down))
        .flatten();
    let vibrates = |tone: &Tone| tone.hz * shifts.span_s() >= PERIODS;
    let decisive = &known[..tones.len()];
    if decisive.iter().any(vibrates) {
        let mut decisive = decisive.iter();
        tones.retain(|_| decisive.next().is_some_and(vibrates));
    }
    let Some(found) = rectangle::best_of_motions(tones, across, down) else {
        return Choice { shake_px, ..whole };
    };
    let span = |pieces: &[Range<usize>], found: &Range<usize>| {
        pieces[found.start].start..pieces[found.end - 1].end
    };
    let textured = |x: usize, y: usize| bands[y].clone().any(|group| shifts.grips[x][group] > 0.0);
    let found = found.without_blank_sides(textured);
    let columns = span(&shifts.columns, &found.columns);
    let rows = span(&shifts.groups, &span(&bands, &found.rows));
    Choice {
        region: Region {
            columns: part.x + columns.start..part.x + columns.end,
            rows: part.y + rows.start..part.y + rows.end,
        },
        shake_px,
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (320, 160);

    /// A frame of a high-speed camera.
    struct Still(i64, Vec<u8>);

    impl Picture for Still {
        fn start_ns(&self) -> i64 {
            self.0
        }

        fn row(&self, part: &Rect, row: usize) -> Pixels<'_> {
            Pixels::U8(&self.1[(part.y + row) * SIZE.0 + part.x..][..part.width])
        }
    }

    /// A tuning fork before a blank wall at 1000 fps, 256 frames: two bright prongs, below row 64, that move against each
    /// other by 1.5 px at 31.97 Hz. Both wander together by 0.5 px at 5 Hz.
    fn fork() -> Vec<Still> {
        let mut state = 9_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / (1 << 24) as f64 - 0.5
        };
        let frame = |k: i64| {
            let t = k as f64 * 1e-3;
            let swing = 1.5 * (std::f64::consts::TAU * 31.97 * t).sin();
            let wander = 0.5 * (std::f64::consts::TAU * 5.0 * t).sin();
            let prong = |x: f64, middle: f64| 100.0 / (1.0 + ((x - middle).abs() - 6.0).exp());
            let mut pixels = Vec::with_capacity(SIZE.0 * SIZE.1);
            for y in 0..SIZE.1 {
                for x in 0..SIZE.0 {
                    let x = x as f64 - wander;
                    let light = match y < 64 {
                        true => 0.0,
                        false => prong(x, 138.0 - swing) + prong(x, 182.0 + swing),
                    };
                    pixels.push((60.0 + light + 3.0 * noise()) as u8);
                }
            }
            Still(k * 1_000_000, pixels)
        };
        (0..256).map(frame).collect()
    }

    #[test]
    fn of_a_fork_before_a_blank_wall_one_prong_is_chosen() {
        let part = Rect::whole(SIZE.0, SIZE.1);
        let timing = Timing::new(0, 0, SIZE.1 as u16).unwrap();
        let Region { columns, rows } = choose(&fork(), &part, &timing).region;
        let has =
            |middle: usize| columns.contains(&(middle - 9)) && columns.contains(&(middle + 9));
        assert!(has(138) != has(182), "{columns:?} {rows:?}");
        assert!(columns.len() < 90, "{columns:?}");
        assert!(
            rows.start > 0 && rows.start < 65 && rows.end == SIZE.1,
            "{rows:?}"
        );
    }

    /// A texture whose edges lean more to one side on the left, moved along the columns alone by 0.2 px at 24.7 Hz, 60 fps,
    /// 30 frames.
    fn moving_down() -> Vec<Still> {
        let mut state = 5_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / (1 << 24) as f64 - 0.5
        };
        let mut waves = |spread: f64| -> Vec<[f64; 3]> {
            let wave = |_| {
                let (angle, k) = (0.8 + spread * noise(), 0.35 + 0.5 * noise());
                [k * angle.cos(), k * angle.sin(), 6.0 * noise()]
            };
            (0..40).map(wave).collect()
        };
        let (left, right) = (waves(1.2), waves(6.3));
        let frame = |k: i64| {
            let mut pixels = Vec::with_capacity(SIZE.0 * SIZE.1);
            for y in 0..SIZE.1 {
                let t = k as f64 / 60.0 + y as f64 * 90e-6;
                let down = 0.2 * (std::f64::consts::TAU * 24.7 * t).sin();
                for x in 0..SIZE.0 {
                    let at = |[kx, ky, phase]: &[f64; 3]| {
                        (kx * x as f64 + ky * (y as f64 - down) + phase).cos()
                    };
                    let waves = if x < 130 { &left } else { &right };
                    let light: f64 = waves.iter().map(at).sum();
                    pixels.push((120.0 + 12.0 * light + 3.0 * noise()).clamp(0.0, 255.0) as u8);
                }
            }
            Still(k * 16_666_667, pixels)
        };
        (0..30).map(frame).collect()
    }

    #[test]
    fn a_motion_along_the_columns_is_no_reason_to_leave_anything_out() {
        let part = Rect::whole(SIZE.0, SIZE.1);
        let timing = Timing::new(90_000_000, 800_000, SIZE.1 as u16).unwrap();
        let choice = choose(&moving_down(), &part, &timing);
        assert_eq!(choice.region, Region::whole(&part));
        assert_eq!(choice.shake_px, None);
    }
}
