//! What is slower than the band: waves of whole periods a window, up to 10 Hz, in the frames' means.
//!
//! A frame's mean also holds what is as far from a multiple of the frame rate, weaker by how much of the time is covered
//! (docs/spectrum.md, images). A wave is taken for slow motion where it stands out of what those images and the noise
//! have there on the mean.

use num_complex::Complex32 as Complex;

use super::super::model::Samples;
use super::Given;
use super::axis::Axis;
use super::take::{Lines, variance};
use crate::math::{cos_sin, turns};
use crate::report::{FROM_HZ, SLOW_FROM_HZ};

/// A wave is slow motion from so many times the mean power of images and noise on.
const STANDS_OUT: f32 = 4.0;

/// No more waves than this are looked at: those of a minute.
const MOST_WAVES: usize = 600;

/// Takes slow motion off the samples; gives the square of the velocity, (px/s)², that it has from 2 Hz on.
pub(super) fn take_out(
    samples: &mut Samples<'_>,
    lines: &Lines,
    axis: &Axis<'_>,
    given: &Given<'_>,
) -> f32 {
    let n = samples.frames;
    let length_s = samples.length_s + 1.0 / given.fps.max(1.0);
    let below = (FROM_HZ * length_s * 0.999) as usize;
    let nyquist = n / 2;
    let known = means(samples, axis);
    if known < 8 || below == 0 {
        return 0.0;
    }
    // Waves a window that was looked at, whose times run over a little less.
    let scale = samples.length_s / length_s;
    let wave = |samples: &Samples<'_>, j: usize| -> Complex {
        let mut sum = Complex::new(0.0, 0.0);
        for (&x, &t) in samples.row.iter().zip(samples.frame_t.iter()).take(n) {
            if x.is_finite() {
                let (c, s) = cos_sin(turns(j as f32 * scale * t));
                sum += Complex::new(x * c, -x * s);
            }
        }
        sum.scale(2.0 / known as f32)
    };
    let first_above = below + 1;
    let above = nyquist.saturating_sub(first_above);
    let (mut sum, step) = (0.0, (above / 64).max(1));
    let mut count = 0.0_f32;
    for j in (first_above..nyquist).step_by(step) {
        sum += wave(samples, j).norm_sqr();
        count += 1.0;
    }
    let covered = (lines.taps as f32 * lines.step_s * given.fps).min(1.0);
    let images = (1.0 - covered) * sum / count.max(1.0);
    let expected = images + 4.0 * axis.frame_variance_px2() / known as f32;
    let mut velocity = 0.0;
    for j in 1..=below.min(MOST_WAVES).min(nyquist) {
        let amplitude = wave(samples, j);
        let power = amplitude.norm_sqr();
        if power < STANDS_OUT * expected {
            continue;
        }
        let real = amplitude.scale(1.0 - expected / power);
        let hz = j as f32 / length_s;
        if hz >= SLOW_FROM_HZ {
            let w = core::f32::consts::TAU * hz;
            velocity += 0.5 * w * w * real.norm_sqr();
        }
        for slot in 0..samples.slots {
            let first = (axis.index * samples.slots + slot) * n;
            let late = samples.slot_t[slot];
            let row = &mut samples.shift_px[first..first + n];
            for (x, &t) in row.iter_mut().zip(samples.frame_t.iter()) {
                let (c, s) = cos_sin(turns(j as f32 * scale * (t + late)));
                *x -= real.re * c - real.im * s;
            }
        }
    }
    velocity
}

/// The frames' weighted means into `row`, no number where a frame knows nothing; how many know something.
fn means(samples: &mut Samples<'_>, axis: &Axis<'_>) -> usize {
    let n = samples.frames;
    let mut known = 0;
    for frame in 0..n {
        let (mut sum, mut total) = (0.0, 0.0);
        for slot in 0..samples.slots {
            let at = (axis.index * samples.slots + slot) * n + frame;
            let weight = 1.0 / variance(samples, axis.index, slot);
            let x = samples.shift_px[at];
            if x.is_finite() && weight > 0.0 {
                sum += weight * x;
                total += weight;
            }
        }
        samples.row[frame] = if total > 0.0 {
            known += 1;
            sum / total
        } else {
            f32::NAN
        };
    }
    known
}
