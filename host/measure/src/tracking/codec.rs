//! Whether a codec or a denoiser stands between the sensor and the pixels.
//!
//! A sensor's noise is another in every frame. A codec that predicts frames from each other copies the
//! noise along with the picture, and a temporal denoiser mixes it in: what is left of a pixel when
//! everything known is taken out then resembles what was left of it a frame before. Both take small
//! motions away together with the noise, so amplitudes are lower bounds.
//!
//! Of each row, its offset, its gain and what small motions along both axes make of the frames' mean are
//! taken out by least squares, then each pixel's mean over the frames and the mean of its two neighbours.
//! The correlation of the rest with that of the frame before, on the third of the pixels with the least
//! gradient, is −0.06 to +0.01 for raw pixels, MJPEG and ProRes, 0.1 to 0.2 for H.264 at 50 Mb/s and 0.3 to
//! 0.9 below that and for denoisers. A codec whose key frames are the whole clip, and one that loses
//! nothing, do not show, and rightly.

use rowtone::camera::Pixels;
use rowtone_clip::Rect;

use super::region::Picture;

/// A correlation above this is no sensor's.
const COPIED: f64 = 0.1;
/// Fewer frames tell nothing: the mean of so few takes a share of the noise with it.
const LEAST_FRAMES: usize = 8;
/// Pixels that are looked at, of all frames together: the correlation of raw noise then has a standard
/// deviation of some 0.002.
const PIXELS: usize = 1 << 20;
/// What a row's known changes look like: offset, gain, motion along x and y.
const KNOWN: usize = 4;

/// Frames were predicted from each other or mixed, by the first frames of a part.
pub(super) fn is_between<P: Picture>(frames: &[P], part: &Rect) -> bool {
    correlation(frames, part).is_some_and(|rho| rho > COPIED)
}

/// The correlation of a pixel's rest with that of the frame before; `None` where there is too little of it.
fn correlation<P: Picture>(frames: &[P], part: &Rect) -> Option<f64> {
    if part.width < 4 || part.height < 3 {
        return None;
    }
    let frames = &distinct(frames, part);
    if frames.len() < LEAST_FRAMES {
        return None;
    }
    let rows = (PIXELS / (frames.len() * part.width)).clamp(1, part.height - 2);
    let step = (part.height - 2).div_ceil(rows);
    let mut rests = Vec::new();
    for y in (1..part.height - 1).step_by(step) {
        rests.push(Rest::of_row(frames, part, y));
    }
    let flat = third(
        rests
            .iter()
            .flat_map(|rest| rest.gradient2.iter().copied())
            .collect(),
    )?;
    let (mut product, mut before, mut after) = (0.0, 0.0, 0.0);
    for rest in &rests {
        let columns = rest.gradient2.len();
        for (old, new) in rest
            .frames
            .chunks_exact(columns)
            .zip(rest.frames.chunks_exact(columns).skip(1))
        {
            for ((old, new), gradient2) in old.iter().zip(new).zip(&rest.gradient2) {
                if *gradient2 <= flat {
                    product += f64::from(old * new);
                    before += f64::from(old * old);
                    after += f64::from(new * new);
                }
            }
        }
    }
    let power = (before * after).sqrt();
    (power > 0.0).then(|| product / power)
}

/// The frames without exact copies of the one before: those are no codec's work.
pub(super) fn distinct<'a, P: Picture>(frames: &'a [P], part: &Rect) -> Vec<&'a P> {
    let differs = |a: &P, b: &P| (0..part.height).any(|y| a.row(part, y) != b.row(part, y));
    let first = frames.first().into_iter();
    let others = frames.windows(2).filter(|pair| differs(&pair[0], &pair[1]));
    first.chain(others.map(|pair| &pair[1])).collect()
}

/// A value that a third of these are not above.
fn third(mut values: Vec<f32>) -> Option<f32> {
    let place = values.len() / 3;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(place, f32::total_cmp).1)
}

/// What is left of a row when everything known is taken out, frame after frame.
struct Rest {
    /// Of each column but the first and the last.
    gradient2: Vec<f32>,
    frames: Vec<f32>,
}

impl Rest {
    fn of_row<P: Picture>(frames: &[&P], part: &Rect, y: usize) -> Self {
        let width = part.width;
        let [above, row, below] = [y - 1, y, y + 1].map(|y| mean(frames, part, y));
        let slope = |x: usize| {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            0.5 * (row[right] - row[left])
        };
        let along: Vec<f32> = (0..width).map(slope).collect();
        let down: Vec<f32> = above
            .iter()
            .zip(&below)
            .map(|(a, b)| 0.5 * (b - a))
            .collect();
        let squares = along.iter().zip(&down).map(|(x, y)| x * x + y * y);
        let gradient2: Vec<f32> = squares.collect();
        let known = orthonormal([vec![1.0; width], row, along, down]);

        let mut left: Vec<f32> = Vec::with_capacity(frames.len() * width);
        for frame in frames {
            let mut rest = values(frame.row(part, y));
            for shape in &known {
                let share: f32 = rest.iter().zip(shape).map(|(a, b)| a * b).sum();
                rest.iter_mut()
                    .zip(shape)
                    .for_each(|(a, b)| *a -= share * b);
            }
            left.extend(rest);
        }
        let mut means = vec![0.0; width];
        for rest in left.chunks_exact(width) {
            means
                .iter_mut()
                .zip(rest)
                .for_each(|(mean, value)| *mean += value);
        }
        let count = frames.len() as f32;
        let mut sharp = Vec::with_capacity(frames.len() * (width - 2));
        for rest in left.chunks_exact_mut(width) {
            rest.iter_mut()
                .zip(&means)
                .for_each(|(value, sum)| *value -= sum / count);
            sharp.extend(rest.windows(3).map(|w| w[1] - 0.5 * (w[0] + w[2])));
        }
        Self {
            gradient2: gradient2[1..width - 1].to_vec(),
            frames: sharp,
        }
    }
}

/// A row's mean over the frames.
fn mean<P: Picture>(frames: &[&P], part: &Rect, y: usize) -> Vec<f32> {
    let mut sum = vec![0.0; part.width];
    for frame in frames {
        let row = values(frame.row(part, y));
        sum.iter_mut()
            .zip(row)
            .for_each(|(sum, value)| *sum += value);
    }
    let count = frames.len() as f32;
    sum.iter_mut().for_each(|sum| *sum /= count);
    sum
}

pub(super) fn values(row: Pixels<'_>) -> Vec<f32> {
    match row {
        Pixels::U8(row) => row.iter().map(|&value| f32::from(value)).collect(),
        Pixels::U16(row) => row.iter().map(|&value| f32::from(value)).collect(),
        Pixels::Upper(row) => row.iter().map(f32::from).collect(),
    }
}

/// The shapes made orthonormal (Gram and Schmidt, twice); one that adds nothing becomes zeros.
fn orthonormal(mut shapes: [Vec<f32>; KNOWN]) -> [Vec<f32>; KNOWN] {
    for k in 0..KNOWN {
        let (done, rest) = shapes.split_at_mut(k);
        let shape = &mut rest[0];
        let norm = |shape: &[f32]| shape.iter().map(|v| v * v).sum::<f32>().sqrt();
        let whole = norm(shape);
        for _ in 0..2 {
            for other in done.iter() {
                let share: f32 = shape.iter().zip(other).map(|(a, b)| a * b).sum();
                shape
                    .iter_mut()
                    .zip(other)
                    .for_each(|(a, b)| *a -= share * b);
            }
        }
        let left = norm(shape);
        let scale = if left > 1e-4 * whole { 1.0 / left } else { 0.0 };
        shape.iter_mut().for_each(|v| *v *= scale);
    }
    shapes
}

#[cfg(test)]
mod tests {
    use rowtone_chance::{Chance, XorShift};

    use super::*;

    /// A picture in memory.
    struct Still(Vec<u8>);

    const PART: Rect = Rect::whole(64, 48);

    impl Picture for Still {
        fn start_ns(&self) -> i64 {
            0
        }

        fn row(&self, part: &Rect, row: usize) -> Pixels<'_> {
            Pixels::U8(&self.0[(part.y + row) * 64 + part.x..][..part.width])
        }
    }

    /// Noise of some four grey levels.
    fn noise(chance: &mut XorShift) -> f32 {
        let mut sum = 0.0;
        for _ in 0..4 {
            sum += (chance.next() >> 40) as f32 / (1 << 24) as f32 - 0.5;
        }
        7.0 * sum
    }

    /// Thirty frames of a texture that moves; of a frame's noise, `kept` is that of the frame before.
    fn clip(seed: u64, kept: f32) -> Vec<Still> {
        let mut chance = XorShift(seed);
        let mut grain = vec![0.0_f32; 64 * 48];
        let fresh = (1.0 - kept * kept).sqrt();
        (0..30)
            .map(|frame| {
                let shift = 0.3 * (frame as f32 * 1.3).sin();
                let light = 1.0 + 0.02 * (frame as f32 * 0.7).cos();
                grain
                    .iter_mut()
                    .for_each(|g| *g = kept * *g + fresh * noise(&mut chance));
                let pixels = grain.iter().enumerate().map(|(k, grain)| {
                    let (x, y) = ((k % 64) as f32 - shift, (k / 64) as f32);
                    let texture =
                        30.0 * (0.31 * x + 0.2 * y).sin() + 20.0 * (0.17 * x - 0.23 * y).cos();
                    (light * (120.0 + texture) + grain).round() as u8
                });
                Still(pixels.collect())
            })
            .collect()
    }

    /// The correlation of 20 raw clips has a mean of −1/30 and an sd of 0.007: 0.1 is beyond 15 of them.
    #[test]
    fn raw_noise_is_nobody_s_copy_and_copied_noise_is() {
        for seed in 1..=20 {
            let raw = correlation(&clip(seed, 0.0), &PART).unwrap();
            assert!((-0.1..0.05).contains(&raw), "{seed}: {raw}");
            for kept in [0.3, 0.6] {
                let copied = correlation(&clip(seed, kept), &PART).unwrap();
                assert!(
                    (copied - kept as f64).abs() < 0.15,
                    "{seed}: {copied} for {kept}"
                );
                assert!(is_between(&clip(seed, kept), &PART));
            }
        }
    }

    #[test]
    fn copies_of_frames_are_no_codec_s() {
        for seed in 1..=5 {
            let twice = |still: Still| [Still(still.0.clone()), still];
            let copied: Vec<Still> = clip(seed, 0.0).into_iter().flat_map(twice).collect();
            assert!(!is_between(&copied, &PART), "{seed}");
        }
    }

    #[test]
    fn what_tells_nothing_is_not_accused() {
        let flat: Vec<Still> = (0..30).map(|_| Still(vec![90; 64 * 48])).collect();
        assert_eq!(correlation(&flat, &PART), None);
        assert_eq!(correlation(&clip(1, 0.9)[..4], &PART), None);
        let narrow = Rect { width: 3, ..PART };
        assert_eq!(correlation(&clip(1, 0.9), &narrow), None);
    }
}
