//! Broad-band velocity, displacement and acceleration of a window (ISO 20816-1), and how unlike noise the motion is.
//!
//! Steady tones count by their fits, over all of the window. What is left of the samples goes, frame by frame, through
//! filters that make velocity of displacement ([`filter`]): they never reach over the time between frames, so that time
//! makes no images, which would weigh with the square of their frequency. The noise of the samples is measured above the
//! band ([`axis`]) and its share is subtracted. What is slower than the band is taken out before, from the frames' means
//! ([`slow`]).

mod axis;
mod filter;
mod moments;
mod slow;
mod take;

use super::judge::Noise;
use super::largest::largest;
use super::model::Samples;
use super::parameters::Model;
use super::rows::NOTCHES;
use super::smear::Smear;
use super::tone::Tone;
use crate::report::{BroadBand, FROM_HZ, Figure, Measures, SLOW_FROM_HZ, TO_HZ};
use crate::timeline::Group;

use axis::{ACCELERATION, Axis, DISPLACEMENT, Powers, SLOW_VELOCITY, VELOCITY};
use filter::{Grid, Kind, MOST_HALF, WORK};
use take::Lines;

/// Filters reach no farther than this to either side, s.
const REACH_S: f32 = 3e-3;

/// Fewest taps on either side.
const LEAST_HALF: usize = 6;

/// What the exposure and the averaging of rows leave of a tone has to be as much at least to be undone.
const LEAST_LEFT: f32 = 0.2;

/// A band that ends below this is no broad band, Hz.
const LEAST_TOP_HZ: f32 = 100.0;

/// A tone of which less than this is left by the projection off the slots' means is not taken out.
const LEAST_KEPT: f32 = 0.2;

/// What rows differ in of a tone with more than so many times the power of a sample's noise is not lost in the noise.
const UNLIKE: f32 = 3.0;

/// In windows shorter than this nothing is known from [`SLOW_FROM_HZ`] on, s.
const SLOW_WINDOW_S: f32 = 0.95 / SLOW_FROM_HZ;

/// In windows shorter than this nothing is known of [`FROM_HZ`], s.
const LEAST_WINDOW_S: f32 = 0.95 / FROM_HZ;

/// What is given of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given<'a> {
    pub(crate) group: &'a Group,
    /// Frame rate, Hz.
    pub(crate) fps: f32,
    pub(crate) smear: Smear<'a>,
    /// The noise along either axis, for where it cannot be seen above the band, and under tones.
    pub(crate) noise: &'a [Noise; 2],
}

/// The measures of the loaded window, of which `model` explains the tones; `None` where the samples lie too far apart, or
/// are too few. Uses up the samples, the model and the grid.
pub(crate) fn measure(
    samples: &mut Samples<'_>,
    model: &mut Model,
    grid: &mut [f32],
    given: &Given<'_>,
) -> Option<BroadBand> {
    let lines = Lines::of(samples, given)?;
    if 3 * lines.taps + WORK > grid.len() || samples.length_s < LEAST_WINDOW_S {
        return None;
    }
    let (work, grid) = grid.split_at_mut(WORK);
    let run = longest_run(samples, &lines, grid);
    let (filters, top_hz) = band(given, &lines, run)?;
    keep_steady(samples, model, given);
    let removed = take::residual(samples, model);
    let mut all = Powers::default();
    let mut each = [None; 2];
    let slow_known = samples.length_s >= SLOW_WINDOW_S;
    for (index, own) in each.iter_mut().enumerate().take(samples.axes.clamp(1, 2)) {
        let Some(mut axis) = Axis::new(samples, &lines, index, (given.noise, removed)) else {
            continue;
        };
        let slow = slow::take_out(samples, &lines, &axis, given);
        let Some(mut powers) = axis.powers(samples, (&filters, top_hz), (grid, work)) else {
            continue;
        };
        powers.add_slow(slow);
        for tone in &model.tones {
            powers.add_tone(tone, samples, given, &axis);
        }
        all = all.plus(&powers);
        let mut measures = measures_of(&powers, slow_known);
        // From here on with the tones, but for those below the band.
        take::put_back(samples, model, index);
        // The shorter it is, the more of a frame it sees.
        let filter = filters.short().pass(Kind::Displacement, top_hz, work);
        axis.distribution(samples, &filter, &mut measures, grid);
        *own = Some(measures);
    }
    let [x, y] = each;
    let mut sum = measures_of(&all, slow_known);
    match (x, y) {
        (None, None) => return None,
        (Some(one), None) | (None, Some(one)) => {
            sum.kurtosis = one.kurtosis;
            (sum.peak_to_peak_px, sum.crest_factor) = (one.peak_to_peak_px, one.crest_factor);
        }
        (Some(x), Some(y)) => {
            let both = x.peak_to_peak_px.zip(y.peak_to_peak_px);
            sum.peak_to_peak_px = both.map(|(x, y)| resultant(x, y));
            let filter = filters.short().pass(Kind::Displacement, top_hz, work);
            let farthest = axis::farthest_px(samples, &lines, &filter, grid);
            let noise = x.crest_factor.zip(y.crest_factor);
            sum.crest_factor = sum.displacement_px.zip(noise).and_then(|(rms, noise)| {
                let sd = noise.0.sd.max(noise.1.sd);
                axis::crest_factor(farthest, rms, sd)
            });
        }
    }
    Some(BroadBand {
        known_to_hz: top_hz,
        x,
        y,
        sum,
    })
}

/// Most neighbours of a line that are known all along; of the axis that has fewer, if they are enough.
fn longest_run(samples: &Samples<'_>, lines: &Lines, grid: &mut [f32]) -> usize {
    let axes = 0..samples.axes.clamp(1, 2);
    let runs = axes.map(|axis| lines.longest_run(samples, axis, &mut grid[..lines.taps]));
    runs.filter(|&run| run >= 3 * LEAST_HALF).min().unwrap_or(0)
}

/// Filters for these samples, of which so many in a row are known, and up to which frequency they know all.
fn band<'a>(given: &Given<'a>, lines: &Lines, run: usize) -> Option<(Grid<'a>, f32)> {
    let half = (REACH_S / lines.step_s) as usize;
    let half = half.min(MOST_HALF).min(run / 3);
    if half < LEAST_HALF {
        return None;
    }
    let filters = Grid {
        group: given.group,
        step_s: lines.step_s,
        half,
    };
    let mut top_hz = TO_HZ.min(0.5 / lines.step_s - filters.transition_hz());
    while top_hz >= LEAST_TOP_HZ && given.group.attenuation(top_hz) < LEAST_LEFT {
        top_hz *= 0.99;
    }
    (top_hz >= LEAST_TOP_HZ).then_some((filters, top_hz))
}

/// Leaves the tones that are steady and of which enough is seen: the others are measured with the rest. What rows differ in
/// of the strongest of them would look fast within a frame: it is at their alias frequency, where they get a notch.
fn keep_steady(samples: &mut Samples<'_>, model: &mut Model, given: &Given<'_>) {
    model.tones.retain(|t| !t.modulated && !t.shape.is_zero());
    for tone in &mut model.tones {
        tone.notched = false;
    }
    model.tabulate(samples);
    let mut i = 0;
    model.tones.retain(|_| {
        i += 1;
        samples.kept(&samples.frame_means(i)) >= LEAST_KEPT
    });
    if samples.slots > 1 {
        let [x, y] = given.noise.each_ref().map(Noise::quietest);
        let most = (samples.frames / take::FRAMES_A_NOTCH).min(NOTCHES);
        for _ in 0..most {
            let free = model.tones.iter_mut().filter(|t| !t.notched);
            let strongest = free.max_by(|a, b| a.shape.power().total_cmp(&b.shape.power()));
            match strongest {
                Some(tone) if tone.shape.power() > UNLIKE * x.max(y) => tone.notched = true,
                _ => break,
            }
        }
    }
    model.tabulate(samples);
}

impl Powers {
    /// Adds a steady tone, at the row where it is largest.
    fn add_tone(&mut self, tone: &Tone, samples: &Samples<'_>, given: &Given<'_>, axis: &Axis<'_>) {
        let hz = tone.frequency.hz();
        let left = given.group.attenuation(hz);
        if !(SLOW_FROM_HZ..=TO_HZ).contains(&hz) || left < LEAST_LEFT {
            return;
        }
        let (_, orbit) = largest(&tone.shape, samples.rows.ends());
        let smeared = given.smear.correction(orbit.semi_major_px / left, hz).scale;
        let square = orbit.amplitudes[axis.index].norm_sqr() * (smeared / left) * (smeared / left);
        // An amplitude's variance is 2σ²/N.
        let variance =
            axis.tone_variance_px2(samples, given.noise[axis.index].at(hz, None)) / (left * left);
        let w = core::f32::consts::TAU * hz;
        let first = if hz < FROM_HZ {
            SLOW_VELOCITY..SLOW_VELOCITY + 1
        } else {
            0..ACCELERATION + 1
        };
        for kind in first {
            let factor = match kind {
                DISPLACEMENT => 0.5,
                ACCELERATION => 0.5 * w * w * w * w,
                _ => 0.5 * w * w,
            };
            self.add(
                kind,
                factor * square,
                4.0 * factor * factor * square * variance,
            );
        }
    }
}

fn measures_of(powers: &Powers, slow_known: bool) -> Measures {
    Measures {
        velocity_px_s: Some(powers.root(VELOCITY)),
        velocity_from_2_hz_px_s: slow_known.then(|| powers.root(SLOW_VELOCITY)),
        displacement_px: Some(powers.root(DISPLACEMENT)),
        acceleration_px_s2: Some(powers.root(ACCELERATION)),
        ..Measures::default()
    }
}

/// √(x² + y²) of two figures.
fn resultant(x: Figure, y: Figure) -> Figure {
    let root = |a: f32, b: f32| crate::math::sqrtf(a * a + b * b);
    let value = root(x.value, y.value);
    let share = |f: Figure| f.value * f.sd / value.max(f32::MIN_POSITIVE);
    Figure {
        value,
        sd: root(share(x), share(y)),
        at_most: root(x.at_most, y.at_most),
    }
}
