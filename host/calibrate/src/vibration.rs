//! A steady machine tone in place of a flashing light: the displacement of every row instead of its brightness.
//!
//! The same fit then applies, with all its ambiguities. A row's displacement is the closed form of the core's own
//! estimator (one inner product against the row's mean over time), which needs no line time.

use std::fmt;

/// Why no displacement could be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoDisplacement {
    /// Fewer than this many frames.
    TooFewFrames(usize),
}

impl fmt::Display for NoDisplacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewFrames(least) => {
                write!(f, "a vibration needs a video of at least {least} frames")
            }
        }
    }
}

impl std::error::Error for NoDisplacement {}

/// Fewest frames from which a row's mean position is known.
const LEAST_FRAMES: usize = 8;

/// Displacement of every row, `[frame][row]`, px. `pictures` are (values, width), all alike.
///
/// A row without texture reads what its neighbours within a few rows read.
///
/// # Errors
/// [`NoDisplacement`].
pub fn displacements(pictures: &[(Vec<u16>, usize)]) -> Result<Vec<Vec<f64>>, NoDisplacement> {
    if pictures.len() < LEAST_FRAMES {
        return Err(NoDisplacement::TooFewFrames(LEAST_FRAMES));
    }
    let width = pictures[0].1.max(1);
    let height = pictures[0].0.len() / width;
    let count = pictures.len() as f64;
    let mut shifts = vec![vec![0.0; height]; pictures.len()];
    let mut information = vec![0.0; height];
    for y in 0..height {
        let row = |n: usize| {
            pictures[n].0[y * width..(y + 1) * width]
                .iter()
                .map(|&v| f64::from(v))
        };
        let mut mean = vec![0.0; width];
        for n in 0..pictures.len() {
            mean.iter_mut()
                .zip(row(n))
                .for_each(|(m, v)| *m += v / count);
        }
        let smooth = smoothed(&smoothed(&mean));
        let mut slope: Vec<f64> = (0..width)
            .map(|x| {
                if x > 0 && x + 1 < width {
                    0.5 * (smooth[x + 1] - smooth[x - 1])
                } else {
                    0.0
                }
            })
            .collect();
        // Blind to brightness: orthogonal to a constant and to the row itself.
        let basis = rowtone_linear::orthonormal(vec![vec![1.0; width], mean.clone()]);
        rowtone_linear::remove(&basis, &mut slope);
        let power = rowtone_linear::dot(&slope, &slope);
        information[y] = power;
        for (n, frame) in shifts.iter_mut().enumerate() {
            let product: f64 = slope.iter().zip(row(n)).map(|(h, v)| h * v).sum();
            frame[y] = if power > 0.0 { -product / power } else { 0.0 };
        }
    }
    Ok(shifts
        .iter()
        .map(|frame| spread(frame, &information))
        .collect())
}

/// Binomial smoothing over three pixels.
fn smoothed(row: &[f64]) -> Vec<f64> {
    let last = row.len() - 1;
    (0..row.len())
        .map(|x| 0.25 * row[x.saturating_sub(1)] + 0.5 * row[x] + 0.25 * row[(x + 1).min(last)])
        .collect()
}

/// Each row averaged with its two neighbours by what they know.
fn spread(frame: &[f64], information: &[f64]) -> Vec<f64> {
    (0..frame.len())
        .map(|y| {
            let near = y.saturating_sub(1)..(y + 2).min(frame.len());
            let total: f64 = information[near.clone()].iter().sum();
            if total > 0.0 {
                near.map(|k| frame[k] * information[k]).sum::<f64>() / total
            } else {
                0.0
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_shift_is_read() {
        let picture = |shift: f64| {
            let row = |_| {
                (0..64).map(move |x| {
                    (600.0 + 300.0 * (0.2 * (f64::from(x) - shift)).sin()).round() as u16
                })
            };
            ((0..20).flat_map(row).collect::<Vec<u16>>(), 64)
        };
        let pictures: Vec<_> = (0..20).map(|n| picture(0.2 * f64::from(n).sin())).collect();
        let shifts = displacements(&pictures).unwrap();
        let mean: f64 = (0..20).map(|n| 0.2 * f64::from(n).sin()).sum::<f64>() / 20.0;
        let offset: f64 = shifts.iter().map(|f| f[5]).sum::<f64>() / 20.0;
        for (n, frame) in shifts.iter().enumerate() {
            let truth = 0.2 * (n as f64).sin() - mean;
            assert!(
                (frame[5] - offset - truth).abs() < 0.02,
                "{n}: {} for {truth}",
                frame[5] - offset
            );
        }
    }

    #[test]
    fn a_picture_is_no_video() {
        assert_eq!(
            displacements(&[(vec![0; 4], 2)]),
            Err(NoDisplacement::TooFewFrames(8))
        );
    }
}
