//! The mean picture, the noise of a pixel, and frames that do not belong to it.

use rowtone::camera::Pixels;

use super::error::{RecordingError, ShapesError};
use super::readings::Readings;
use rowtone_clip::{Feed, Frame, Rect};
use rowtone_linear::upper_median;

/// Of so many rows one is compared from frame to frame.
const COMPARED: usize = 8;
/// A frame that differs so many times more than usual from both its neighbours is of something else.
const OUT_OF_PLACE: f64 = 25.0;
/// Frames whose sum fits 32 bits whatever the pixels are.
const SUMMED: u32 = 1 << 16;
/// Fewer frames tell no shape.
pub(super) const LEAST_FRAMES: usize = 12;

/// What the second reading found.
#[derive(Clone, Debug)]
pub(super) struct Mean {
    /// Grey values, row by row.
    pub(super) pixels: Vec<f32>,
    /// Variance of one pixel of one frame, grey values squared, motion included.
    pub(super) variance: f64,
    /// Whether each frame is used, in the order of the recording.
    pub(super) used: Vec<bool>,
    /// Start of the first frame and of the last, ns.
    pub(super) span_ns: [i64; 2],
}

impl Mean {
    /// Reads the recording, as far as `readings` go.
    ///
    /// # Errors
    /// [`ShapesError`] of the input, and where there are too few frames.
    pub(super) fn read(
        feed: &mut Feed,
        readings: &mut Readings<impl FnMut(Option<u64>)>,
    ) -> Result<Self, ShapesError> {
        let (width, height) = feed.camera.size;
        let whole = Rect::whole(width, height);
        let mut picture = Picture::new(width * height);
        let mut differences = Vec::new();
        let mut before: Option<Frame> = None;
        let mut span_ns = [0; 2];
        while !readings.is_over()
            && let Some(frame) = feed.next_frame()?
        {
            readings.frame();
            for y in 0..height {
                picture.add(y * width, frame.pixels(&whole, y));
            }
            picture.end_frame();
            if let Some(before) = before.take() {
                differences.push(difference(&before, &frame, &whole));
                feed.recycle(before);
            } else {
                span_ns[0] = frame.start_ns;
            }
            span_ns[1] = frame.start_ns;
            before = Some(frame);
        }
        if differences.len() + 1 < LEAST_FRAMES {
            return Err(ShapesError::recording(
                &feed.name,
                RecordingError::Frames(differences.len() + 1),
            ));
        }
        Ok(Self {
            pixels: picture.mean(),
            variance: 0.5 * upper_median(&differences),
            used: used(&differences),
            span_ns,
        })
    }

    /// Length of the recording, s.
    pub(super) fn seconds(&self) -> f64 {
        let frames = self.used.len() as f64;
        (self.span_ns[1] - self.span_ns[0]) as f64 * 1e-9 * frames / (frames - 1.0).max(1.0)
    }
}

/// Sums of pixels.
struct Picture {
    recent: Vec<u32>,
    frames: u32,
    all: Vec<f64>,
    all_frames: f64,
}

impl Picture {
    fn new(pixels: usize) -> Self {
        Self {
            recent: vec![0; pixels],
            frames: 0,
            all: vec![0.0; pixels],
            all_frames: 0.0,
        }
    }

    fn add(&mut self, from: usize, row: Pixels<'_>) {
        let sums = self.recent[from..].iter_mut();
        match row {
            Pixels::U8(p) => sums.zip(p).for_each(|(sum, &p)| *sum += u32::from(p)),
            Pixels::U16(p) => sums.zip(p).for_each(|(sum, &p)| *sum += u32::from(p)),
            deep @ Pixels::Upper(_) => {
                sums.zip(deep.values())
                    .for_each(|(sum, p)| *sum += u32::from(p));
            }
        }
    }

    fn end_frame(&mut self) {
        self.frames += 1;
        if self.frames == SUMMED {
            self.flush();
        }
    }

    fn flush(&mut self) {
        for (all, recent) in self.all.iter_mut().zip(&mut self.recent) {
            *all += f64::from(std::mem::take(recent));
        }
        self.all_frames += f64::from(std::mem::take(&mut self.frames));
    }

    fn mean(mut self) -> Vec<f32> {
        self.flush();
        let share = 1.0 / self.all_frames.max(1.0);
        self.all.iter().map(|sum| (sum * share) as f32).collect()
    }
}

/// Mean square of what differs between two frames, of some of their rows.
fn difference(a: &Frame, b: &Frame, whole: &Rect) -> f64 {
    let rows = (COMPARED / 2..whole.height).step_by(COMPARED);
    let (mut sum, mut count) = (0.0, 0usize);
    for y in rows {
        let (a, b) = (a.pixels(whole, y), b.pixels(whole, y));
        count += a.len();
        sum += match (a, b) {
            (Pixels::U8(a), Pixels::U8(b)) => {
                let square = |(&a, &b): (&u8, &u8)| u32::from(a.abs_diff(b)).pow(2);
                f64::from(a.iter().zip(b).map(square).sum::<u32>())
            }
            (a, b) => {
                let square = |(a, b): (u16, u16)| u64::from(a.abs_diff(b)).pow(2);
                a.values().zip(b.values()).map(square).sum::<u64>() as f64
            }
        };
    }
    sum / count.max(1) as f64
}

/// Not a copy of the frame before, and not something else between two that are alike.
fn used(differences: &[f64]) -> Vec<bool> {
    let most = OUT_OF_PLACE * upper_median(differences);
    let beyond = |k: usize| differences.get(k).is_none_or(|&d| d > most);
    (0..=differences.len())
        .map(|frame| {
            let copy = frame > 0 && differences[frame - 1] == 0.0;
            let before = frame == 0 || beyond(frame - 1);
            let elsewhere = before && beyond(frame) && most > 0.0;
            !copy && !elsewhere
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_and_frames_of_something_else_are_left_out() {
        let mut differences = vec![4.0; 20];
        differences[0] = 400.0; // A bad first frame.
        differences[5] = 0.0; // The seventh is a copy of the sixth.
        differences[10] = 900.0;
        differences[11] = 900.0; // The twelfth is bad.
        differences[15] = 900.0; // A cut.
        let used = used(&differences);
        let left_out: Vec<usize> = (0..used.len()).filter(|&k| !used[k]).collect();
        assert_eq!(left_out, [0, 6, 11]);
    }

    #[test]
    fn a_mean_is_the_mean_however_many_frames() {
        let mut picture = Picture::new(2);
        for k in 0..(SUMMED + 3) {
            picture.add(0, Pixels::U16(&[65_535, (k % 2) as u16]));
            picture.end_frame();
        }
        let mean = picture.mean();
        assert!((mean[0] - 65_535.0).abs() < 0.01 && (mean[1] - 0.5).abs() < 1e-4);
    }
}
