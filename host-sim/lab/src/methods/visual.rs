//! The Visual Microphone (Davis et al. 2014) on the complex steerable pyramid: phase against the first frame, summed
//! with the squared amplitude as weight, sub-bands aligned and summed.
//!
//! The original's sum has no unit, and its scale differs from row to row with the texture; here it is divided by what a
//! pixel of motion adds to it (the first frame's slope of the phase across, with the same weights).

use super::fourier::C;
use super::steerable::{ORIENTATIONS, Pyramid, SCALES};
use super::thesis::align_and_sum;
use super::{Clip, Method, Shifts};

/// Over what phases are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// A row: the original's way with a rolling shutter.
    Row,
    /// A frame: a sample a frame, every row of which is given the same value.
    Frame,
}

/// The Visual Microphone.
#[derive(Clone, Copy, Debug)]
pub struct VisualMicrophone {
    /// What makes a sample.
    pub by: By,
}

impl Method for VisualMicrophone {
    fn name(&self) -> &'static str {
        match self.by {
            By::Row => "Visual Microphone",
            By::Frame => "Visual Microphone, by frame",
        }
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let pyramid = Pyramid::new(clip.width, clip.height, SCALES, ORIENTATIONS);
        let Some(first) = clip.frames.first().map(|f| pyramid.bank.spectrum(f)) else {
            return Vec::new();
        };
        let length = match self.by {
            By::Row => clip.width,
            By::Frame => clip.width * clip.height,
        };
        // Bands that look down are left out: what moves sideways does not show there.
        let bands: Vec<usize> = (0..pyramid.bands.len())
            .filter(|&band| pyramid.bands[band].angle == 0.0)
            .collect();
        let references: Vec<Vec<C>> = bands
            .iter()
            .map(|&band| pyramid.bank.band(&first, band))
            .collect();
        let mut signals = vec![Shifts::new(); bands.len()];
        for frame in &clip.frames {
            let spectrum = pyramid.bank.spectrum(frame);
            for ((&band, reference), signal) in bands.iter().zip(&references).zip(&mut signals) {
                let here = pyramid.bank.band(&spectrum, band);
                signal.push(phases(&here, reference, length));
            }
        }
        let mut shifts = align_and_sum(signals);
        // The sum is an average over the sub-bands; so is what a pixel would make of it.
        let mut turn = vec![f64::MIN_POSITIVE; clip.width * clip.height / length.max(1)];
        for &band in &bands {
            let of_band = turns(&pyramid, &first, band, length);
            turn.iter_mut()
                .zip(of_band)
                .for_each(|(t, b)| *t += b / bands.len() as f64);
        }
        for frame in &mut shifts {
            frame.iter_mut().zip(&turn).for_each(|(v, t)| *v /= t);
        }
        match self.by {
            By::Row => shifts,
            By::Frame => shifts.iter().map(|f| vec![f[0]; clip.height]).collect(),
        }
    }
}

/// Sum of the phase against the first frame, weighted by squared amplitude, of every `length` coefficients.
fn phases(here: &[C], reference: &[C], length: usize) -> Vec<f64> {
    let against = |here: &[C], reference: &[C]| -> f64 {
        let pairs = here.iter().zip(reference);
        pairs
            .map(|(c, r)| c.norm_sqr() * (c * r.conj()).arg())
            .sum()
    };
    let rows = here
        .chunks_exact(length)
        .zip(reference.chunks_exact(length));
    // A shift to the right turns phases back.
    rows.map(|(here, reference)| -against(here, reference))
        .collect()
}

/// What a pixel of motion adds to that sum: the equally weighted slope of the phase across.
fn turns(pyramid: &Pyramid, spectrum: &[C], band: usize, length: usize) -> Vec<f64> {
    let bank = &pyramid.bank;
    let sloped: Vec<C> = (0..spectrum.len())
        .map(|bin| C::i() * bank.plane().frequency(bin).0 * spectrum[bin])
        .collect();
    let (here, slope) = (bank.band(spectrum, band), bank.band(&sloped, band));
    let rows = here.chunks_exact(length).zip(slope.chunks_exact(length));
    rows.map(|(c, s)| s.iter().zip(c).map(|(s, c)| (s * c.conj()).im).sum())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::bank::tests::noise;
    use super::super::fourier::Plane;
    use super::*;
    use rowtone_linear::dot;

    const SIZE: (usize, usize) = (96, 64);

    /// A blurred random picture, moved in a circle: row `y` by `shift(y)`.
    fn moved(shift: impl Fn(usize) -> f64) -> Vec<f64> {
        let plane = Plane::new(SIZE.0, 1);
        let picture = noise(SIZE.0 * SIZE.1);
        let rows = picture.chunks_exact(SIZE.0).enumerate();
        rows.flat_map(|(y, row)| {
            let spectrum = plane.forward(row).into_iter().enumerate();
            let moved = spectrum.map(|(bin, v)| {
                let across = plane.frequency(bin).0;
                let nyquist = 2 * bin == SIZE.0;
                let blur = if nyquist {
                    0.0
                } else {
                    (-across * across).exp()
                };
                v * C::from_polar(blur, -across * shift(y))
            });
            let moved = plane.inverse(moved.collect());
            moved.into_iter().map(|v| 100.0 * v.re).collect::<Vec<_>>()
        })
        .collect()
    }

    fn clip(frames: Vec<Vec<f64>>) -> Clip {
        Clip {
            width: SIZE.0,
            height: SIZE.1,
            frames,
        }
    }

    /// Both variants read a whole picture's motion; the means over the frames are removed.
    #[test]
    fn a_moving_picture_is_read() {
        let truth = [0.0, 0.3, -0.1, -0.2, 0.2, -0.2];
        let clip = clip(truth.iter().map(|&t| moved(|_| t)).collect());
        for (by, wide) in [(By::Row, 0.15), (By::Frame, 0.05)] {
            let shifts = VisualMicrophone { by }.shifts(&clip);
            for y in [0, 20, 63] {
                let found: Vec<f64> = shifts.iter().map(|f| f[y]).collect();
                let gain = dot(&found, &truth) / dot(&truth, &truth);
                assert!((gain - 1.0).abs() < wide, "{by:?}, row {y}: {gain}");
            }
        }
    }

    /// Rows that move each in their own way: row by row hears it, frame by frame hears only their mean.
    #[test]
    fn a_rolling_shutter_needs_rows() {
        let wave =
            |y: usize, turn: f64| 0.2 * (std::f64::consts::TAU * y as f64 / 64.0 + turn).sin();
        let turns = [0.0, 1.5, 3.0, 4.5];
        let clip = clip(turns.iter().map(|&turn| moved(|y| wave(y, turn))).collect());
        let gain = |by| {
            let found: Vec<f64> = VisualMicrophone { by }.shifts(&clip).concat();
            let mut truth: Shifts = turns
                .iter()
                .map(|&turn| (0..64).map(|y| wave(y, turn)).collect())
                .collect();
            super::super::remove_row_means(&mut truth);
            let truth = truth.concat();
            dot(&found, &truth) / dot(&truth, &truth)
        };
        let (rows, frames) = (gain(By::Row), gain(By::Frame));
        assert!((rows - 1.0).abs() < 0.15, "{rows}");
        assert!(frames.abs() < 0.05, "{frames}");
    }

    /// Weighted by squared amplitude, a part without texture does not count, whatever its phase.
    #[test]
    fn noise_without_texture_has_little_weight() {
        let truth = [0.0, 0.3, -0.3];
        let dim = |n: usize, t: f64| {
            let mut frame = moved(|_| t);
            let hiss = noise(SIZE.0 * SIZE.1 * (n + 1));
            for (i, v) in frame.iter_mut().enumerate() {
                if i % SIZE.0 >= SIZE.0 / 2 {
                    *v = 50.0 + 0.3 * hiss[SIZE.0 * SIZE.1 * n + i];
                }
            }
            frame
        };
        let clip = clip(truth.iter().enumerate().map(|(n, &t)| dim(n, t)).collect());
        let shifts = VisualMicrophone { by: By::Frame }.shifts(&clip);
        let found: Vec<f64> = shifts.iter().map(|f| f[0]).collect();
        let gain = dot(&found, &truth) / dot(&truth, &truth);
        assert!((gain - 1.0).abs() < 0.15, "{gain}");
    }
}
