//! A line that was exposed for so long that the picture moved on by several pixels meanwhile.
//!
//! Such a line p is the mean of the reference along the whole path of the picture: p(x) = mean of r(x − d − s) over the
//! exposure, with the path s about its own mean. So Σ h·p is the mean of the row's phase-correlation function q along the
//! path, exactly and whatever its length: no moment of it has to be small, as in [`super::blur`]. The path is that of an
//! oscillation ([`Oscillation`]) whose rows, each the mean over an exposure of E rows, show sinc(ωE/2) of it.
//!
//! The reference was learned from lines that were smeared themselves, so q is first sharpened by what that smear, a
//! histogram of the paths while learning, has taken from each wave number. Both are sums over some tens of whole
//! shifts, at which q is an inner product each: some microseconds a line of a desktop, and only where the motion is swift.
//! A tracker whose lines must be short ([`Config::columns_per_line`](super::Config::columns_per_line)) does without.

mod ahead;
mod oscillation;
mod response;

use crate::camera::Timing;
use ahead::Ahead;
use oscillation::{Basis, Oscillation};

/// Points of a path.
const SAMPLES: usize = 16;
/// No path goes further from its mean, steps.
const MOST_REACH: usize = 12;
/// Whole shifts either way that sharpening takes.
const SHARPEN: usize = 12;
/// Pixels that [`between`](crate::reference::align::between) takes on either side.
const TAPS: usize = 4;
/// Whole shifts either way at which q is taken: two more, as a line need not lie at the nearest.
const LAGS: usize = MOST_REACH + 2 + TAPS + SHARPEN;
const SHARP: usize = LAGS - SHARPEN;

/// Paths are counted in bins of this, px.
const BIN_PX: f32 = 0.25;
const BINS: usize = 48;
/// Frames over which they are.
const KEEP_PATHS: f32 = 0.8;

/// Less than this of a motion is left in rows that average over its period: it is no longer told what it was.
const LEAST_LEFT: f32 = 0.25;
/// A texture that is as like itself so many steps away, as a share of its likeness to itself, repeats.
const REPEATS: f32 = 0.75;
const LEAST_DISTANCE: usize = 5;
/// On one that does, a line so far from where it is expected was read at another of its repetitions, px.
const SLIP_PX: f32 = 3.0;
/// A motion that smears by less, variance, is left to the spectrum, px².
const LEAST_PX2: f32 = 0.05;
/// A correction beyond this is no correction, px.
const MOST_PX: f32 = 1.5;
/// Nor where the smeared line knows so little less than its reference.
const LEAST_SLOPE: f32 = 0.1;
/// What sharpening leaves alone: wave numbers that have lost more, as a share squared.
const LEAST_KEPT2: f32 = 0.0025;

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct Paths {
    /// Exposure in rows; 0 with a global shutter, or where lines must be short.
    exposure_rows: f32,
    line_ns: f32,
    /// Pixels from one to the next of the same colour: a step.
    stride: u8,
    start_ns: i64,
    oscillation: Oscillation,
    ahead: Ahead,
    /// How alike a row of late was to itself further on, 0 to 1.
    repeats: f32,
    /// See [`Tracker::slips`](super::Tracker::slips).
    pub(super) slips: u32,
    /// The path at each of its points, for a speed and an acceleration of 1, in px; all 0 where none is known.
    points: [[f32; 2]; SAMPLES],
    /// Where pictures were along the paths that the reference was learned from.
    histogram: [f32; BINS],
    /// What sharpens q, at whole shifts from 0 on, of a row whose paths were the usual ones, and what comes on top for
    /// each px² of variance, and for its square; the first is 0 while that is not known.
    sharpen: [[f32; SHARPEN + 1]; 3],
    /// Variance of the usual paths, px².
    usual_px2: f32,
    /// Frames over which each row's place is averaged, and of the round that made the reference.
    frames: f32,
    learned: f32,
}

impl Paths {
    const MEMORY_FRAMES: f32 = 256.0;

    pub(super) fn new(timing: &Timing, stride: u8, hurried: bool) -> Self {
        let line_ns = timing.line_time_ps() as f32 / 1000.0;
        let exposure_rows = match hurried || timing.is_global_shutter() {
            true => 0.0,
            false => timing.exposure_ns() as f32 / line_ns,
        };
        Self::unlearned(exposure_rows, line_ns, stride)
    }

    fn unlearned(exposure_rows: f32, line_ns: f32, stride: u8) -> Self {
        Self {
            exposure_rows,
            line_ns,
            stride,
            start_ns: 0,
            oscillation: Oscillation::new(exposure_rows, exposure_rows.clamp(8.0, 64.0)),
            ahead: Ahead::default(),
            repeats: 0.0,
            slips: 0,
            points: [[0.0; 2]; SAMPLES],
            histogram: [0.0; BINS],
            sharpen: [[0.0; SHARPEN + 1]; 3],
            usual_px2: 0.0,
            frames: 0.0,
            learned: 1.0,
        }
    }

    pub(super) fn relearn(&mut self) {
        *self = Self {
            start_ns: self.start_ns,
            slips: self.slips,
            learned: self.learned,
            ..Self::unlearned(self.exposure_rows, self.line_ns, self.stride)
        };
    }

    pub(super) fn are_of_use(&self) -> bool {
        self.exposure_rows >= 2.0
    }

    /// Share of a motion that rows show, which average over the exposure.
    fn left(&self) -> f32 {
        let half = 0.5 * self.exposure_rows;
        Basis::new(self.oscillation.omega(), half).speed / half
    }

    pub(super) fn begin_frame(&mut self, start_ns: i64, refining: bool) {
        if !self.are_of_use() {
            return;
        }
        let since = start_ns.saturating_sub(self.start_ns) as f32 / self.line_ns;
        self.start_ns = start_ns;
        let since = libm::roundf(since);
        self.oscillation.begin_frame(since);
        self.ahead.begin_frame(since, &self.oscillation);
        self.frames = (self.frames + 1.0).min(Self::MEMORY_FRAMES);
        self.settle_points();
        if refining {
            self.settle_sharpening(false);
            for n in &mut self.histogram {
                *n *= KEEP_PATHS;
            }
        }
    }

    /// Ends a round of learning; the next one's frames are counted again.
    pub(super) fn end_round(&mut self, refined: bool) {
        self.ahead = Ahead::default();
        if refined {
            self.settle_sharpening(true);
        } else {
            self.learned = self.frames.max(1.0);
            self.frames = 0.0;
        }
    }

    /// A line was found so far from where the lines before led: on a texture that repeats, at another of its repetitions.
    fn note_slip(&mut self, off_px: f32) {
        if off_px.abs() > SLIP_PX && self.repeats > 0.5 {
            self.slips = self.slips.saturating_add(1);
        }
    }

    /// How alike the row is to itself further on, of whose correlation function this is.
    fn note_repetition(&mut self, q: &[f32; 2 * LAGS + 1]) {
        let slope = |lag: usize| q[LAGS + lag + 1] - q[LAGS + lag - 1];
        let most = (LEAST_DISTANCE..LAGS).map(slope).fold(0.0, f32::max);
        let repeats = f32::from(most > REPEATS * slope(0));
        self.repeats += (repeats - self.repeats) / 64.0;
    }

    /// The motion smears the lines: more than what it does to the amplitude must be undone.
    pub(super) fn smear(&self) -> bool {
        let left = self.left();
        // In the first round the first frame's own motion is in there too.
        let power = 0.5 * self.oscillation.power_px2();
        self.are_of_use() && power * (1.0 / (left * left) - 1.0) > LEAST_PX2
    }

    fn settle_points(&mut self) {
        self.points = [[0.0; 2]; SAMPLES];
        let omega = self.oscillation.omega();
        let left = self.left();
        if omega == 0.0 || left < LEAST_LEFT {
            return;
        }
        let mut mean = 0.0;
        for (k, [speed, change]) in self.points.iter_mut().enumerate() {
            let share = (k as u16 as f32 + 0.5) / SAMPLES as f32 - 0.5;
            let basis = Basis::new(omega, share * self.exposure_rows);
            (*speed, *change) = (basis.speed / left, basis.change / left);
            mean += *change / SAMPLES as f32;
        }
        for [_, change] in &mut self.points {
            *change -= mean;
        }
    }

    /// The path of a row; `None` where it is not known or too long.
    fn path(&self, [speed, change]: [f32; 2]) -> Option<[f32; SAMPLES]> {
        let path = self.points.map(|[s, c]| speed * s + change * c);
        let known = self.points[0][0] != 0.0;
        let most = (MOST_REACH * usize::from(self.stride)) as f32;
        let within = path.iter().all(|s| s.abs() <= most);
        (known && within).then_some(path)
    }

    fn count(&mut self, path: &[f32; SAMPLES]) {
        for s in path {
            let place = s.abs() / BIN_PX;
            let bin = place as u8;
            let share = place - f32::from(bin);
            for (bin, share) in [
                (usize::from(bin), 1.0 - share),
                (usize::from(bin) + 1, share),
            ] {
                if let Some(n) = self.histogram.get_mut(bin) {
                    *n += share;
                }
            }
        }
    }

    /// What undoes the smear of the reference: the inverse of the mean of cos ks over its paths, without what lies
    /// beyond 0.45 cycles a step or is all but gone.
    fn settle_sharpening(&mut self, ended: bool) {
        const WAVES: u16 = 64;
        let all: f32 = self.histogram.iter().sum();
        if all <= 0.0 && !ended {
            return;
        }
        self.sharpen = [[0.0; SHARPEN + 1]; 3];
        let share = 1.0 / all.max(1.0);
        let squares = (0u8..).zip(&self.histogram).map(|(bin, n)| {
            let px = f32::from(bin) * BIN_PX;
            n * px * px
        });
        self.usual_px2 = squares.sum::<f32>() * share;
        let per_step = 1.0 / f32::from(self.stride);
        for wave in 0..WAVES {
            let k = (f32::from(wave) + 0.5) * core::f32::consts::PI / f32::from(WAVES);
            let mut kept = 0.0;
            for (bin, n) in (0u8..).zip(&self.histogram) {
                kept += n * libm::cosf(k * f32::from(bin) * BIN_PX * per_step);
            }
            kept = if all > 0.0 { kept * share } else { 1.0 };
            // 1 up to a quarter of a cycle a step.
            let off = ((k - 1.57) / 1.25).clamp(0.0, 1.0);
            let window = 0.5 + 0.5 * libm::cosf(core::f32::consts::PI * off);
            let square = kept * kept + LEAST_KEPT2;
            let gain = window * kept * (1.0 + LEAST_KEPT2) / square / f32::from(WAVES);
            // One px² more takes exp(−k²/2) more, where that is not left alone.
            let bend = 0.5 * (k * per_step) * (k * per_step);
            let more = bend * (kept * kept - LEAST_KEPT2) / square;
            let gains = [gain, gain * more, 0.5 * gain * more * more];
            for (sharpen, gain) in self.sharpen.iter_mut().zip(gains) {
                for (lag, s) in (0u8..).zip(sharpen) {
                    *s += gain * libm::cosf(k * f32::from(lag));
                }
            }
        }
    }

    /// q without the reference's smear, from q of a row whose own paths varied by so much.
    fn sharpened(&self, q: &[f32; 2 * LAGS + 1], own_px2: Option<f32>) -> [f32; 2 * SHARP + 1] {
        let more = (own_px2.unwrap_or(self.usual_px2) - self.usual_px2).clamp(-1.5, 1.5);
        let [usual, per_px2, per_px4] = &self.sharpen;
        let sharpen: [f32; SHARPEN + 1] =
            core::array::from_fn(|lag| usual[lag] + more * (per_px2[lag] + more * per_px4[lag]));
        core::array::from_fn(|at| {
            let mut sum = 0.0;
            for (k, s) in sharpen.iter().enumerate() {
                let [left, right] = [at + SHARPEN - k, at + SHARPEN + k];
                let both = q[left] + if k == 0 { 0.0 } else { q[right] };
                sum += s * both;
            }
            sum
        })
    }
}
