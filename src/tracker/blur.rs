//! A line that was exposed while the picture moved fast.
//!
//! It shows the reference smeared out by the path that the picture took during the exposure. The path's
//! mean is the displacement that is wanted; its variance weakens the response of the inner product
//! against that of the reference, which is smeared out by the mean of all paths, and its skewness, from
//! the acceleration, shifts the peak. Both follow from the speed v and the acceleration a in px a row and
//! the exposure of E rows: variance v²·E²/12 + a²·E⁴/720, third moment v²·a·E⁴/120, where the exposure is
//! short against the motion's period, and of a tone of ω rad a row by 1 + ω²·E²/30 more. How the row's
//! phase-correlation function answers to them, its own polynomial tells
//! ([`RowTable::shift_of_smeared_px`]). Left out, 4 px at 1 kHz with 0.2 ms of exposure get a third harmonic
//! of 1 %.
//!
//! This is for boards. With the feature `long-exposure`, where lines need not be short, the whole path is taken
//! (`path/`).

use super::{Stage, Tracker, correlate::nearest_product};
use crate::{camera::Timing, camera::pixel::Pixel, reference::RowTable};

/// Smears change a shift by less than this, px.
const MOST_PX: f32 = 0.5;

/// What is known of the smear.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blur {
    /// Exposure in rows; 0 with a global shutter, whose rows tell no speed.
    exposure_rows: f32,
    /// Mean variance of the paths that the reference was learned from, px².
    reference_px2: f32,
    /// Σ of the variances in this round, and their number.
    sum_px2: f32,
    n: f32,
    /// Mean squares of speed and acceleration over some thousand rows: their ratio is ω².
    speed2: f32,
    change2: f32,
}

/// The smear of a line, or what it has more than its reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smear {
    /// Variance, px².
    pub(super) variance_px2: f32,
    /// Third central moment, px³.
    pub(super) skew_px3: f32,
}

impl Blur {
    /// A smear of less than this changes nothing, px².
    const LEAST_PX2: f32 = 0.02;
    /// More than this leaves no texture to tell it from, px².
    const MOST_PX2: f32 = 6.0;
    const MEMORY_ROWS: f32 = 4096.0;
    /// Beyond this, a period of fifteen rows, parabolas tell little of it, squared rad a row.
    const MOST_OMEGA2: f32 = 0.15;

    pub(super) fn new(timing: &Timing) -> Self {
        let rows = if timing.is_global_shutter() {
            0.0
        } else {
            timing.exposure_ns() as f32 * 1000.0 / timing.line_time_ps() as f32
        };
        Self {
            exposure_rows: rows,
            ..Self::default()
        }
    }

    /// A round of learning has ended: the reference is smeared out like the lines of that round.
    pub(super) fn end_round(&mut self) {
        if self.n > 0.0 {
            self.reference_px2 = self.sum_px2 / self.n;
        }
        (self.sum_px2, self.n) = (0.0, 0.0);
    }

    pub(super) fn relearn(&mut self) {
        *self = Self {
            exposure_rows: self.exposure_rows,
            ..Self::default()
        };
    }

    /// Takes the speed and the acceleration of a row.
    fn add(&mut self, speed_px: f32, change_px: f32) {
        self.speed2 += (speed_px * speed_px - self.speed2) / Self::MEMORY_ROWS;
        self.change2 += (change_px * change_px - self.change2) / Self::MEMORY_ROWS;
    }

    /// ω², in squared rad a row, of the tone that the motion mostly is; 0 while that is not known. Through four rows the
    /// speed comes out too large by 47/60 ω² and the change too small by 5/24 ω².
    fn omega2(&self) -> f32 {
        if self.speed2 == 0.0 {
            return 0.0;
        }
        let seen = (self.change2 / self.speed2).min(Self::MOST_OMEGA2);
        seen * (1.0 + 2.0 * seen)
    }

    /// The path of a row.
    fn path(&self, speed_px: f32, change_px: f32) -> Smear {
        let exposure2 = self.exposure_rows * self.exposure_rows;
        let speed2 = speed_px * speed_px * exposure2 / 12.0;
        let change = change_px * exposure2;
        let turn = (self.omega2() * exposure2 / 30.0).min(0.3);
        let finite = 1.0 + turn * (1.0 + 2.0 * turn);
        let variance_px2 = speed2 * finite + change * change / 720.0;
        Smear {
            variance_px2: variance_px2.min(Self::MOST_PX2),
            skew_px3: 0.1 * speed2.min(Self::MOST_PX2) * change * finite,
        }
    }

    /// `None` where nothing is smeared.
    fn against_reference(&self, path: Smear) -> Option<Smear> {
        let smeared = path.variance_px2.max(self.reference_px2) > Self::LEAST_PX2;
        smeared.then_some(Smear {
            variance_px2: path.variance_px2 - self.reference_px2,
            ..path
        })
    }
}

impl Tracker<'_> {
    /// Measures a line once more that was smeared out, at `shift_px`, by the picture's motion.
    #[cold]
    pub(super) fn unsmear<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
    ) -> f32 {
        #[cfg(feature = "long-exposure")]
        if self.paths.are_of_use() {
            return self.follow_path(row, table, pixels, shift_px);
        }
        let information = table.information_per_px2();
        let motion = self.prediction.motion(row, shift_px, information);
        self.blur.add(motion.speed_px, motion.change_px);
        let (speed_px, change_px) = motion.of_tone(self.blur.omega2());
        let path = self.blur.path(speed_px, change_px);
        if self.stage == Stage::Refining {
            self.blur.sum_px2 += path.variance_px2;
            self.blur.n += 1.0;
        }
        self.blur
            .against_reference(path)
            .and_then(|smear| self.correlate_smeared(row, table, pixels, shift_px, smear))
            .unwrap_or(shift_px)
    }

    /// `None` for a result that is no number.
    fn correlate_smeared<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
        smear: Smear,
    ) -> Option<f32> {
        let (whole, product) = nearest_product(&self.store, row, pixels, shift_px)?;
        let lean = table.product_of_lean(self.correlator.lean_px);
        let product = product * self.light.to_reference - lean;
        let near = table.shift_of_smeared_px(product, smear.variance_px2, smear.skew_px3);
        let unsmeared_px = whole as f32 + near;
        // A correction beyond this is no correction: the expansion does not hold, or the speed is wrong.
        ((unsmeared_px - shift_px).abs() < MOST_PX).then_some(unsmeared_px)
    }
}

#[cfg(test)]
mod tests {
    use super::super::predict::Prediction;
    use super::*;

    /// Path of a tone of `omega` rad a row and 4 px over an exposure of 5.94 rows around `phase`: its mean,
    /// its variance and its third moment, by summation.
    fn exact(omega: f32, phase: f32) -> (f32, f32, f32) {
        let at = |k: usize| {
            let row = (k as f32 + 0.5) / 1000.0 - 0.5;
            4.0 * libm::sinf(phase + omega * 5.94 * row)
        };
        let mean = (0..1000).map(at).sum::<f32>() / 1000.0;
        let moment = |power: usize| {
            let powers = (0..1000).map(|k| (0..power).map(|_| at(k) - mean).product::<f32>());
            powers.sum::<f32>() / 1000.0
        };
        (mean, moment(2), moment(3))
    }

    #[test]
    fn a_tones_path_follows_from_the_rows_differences() {
        let timing = Timing::new(33_670_000, 200_000, 300).unwrap();
        let omega = core::f32::consts::TAU * 1003.0 * 33.67e-6;
        // The mean over the exposure is a sine, only weaker.
        let weaker = exact(omega, core::f32::consts::FRAC_PI_2).0;
        let tone = |row: f32| weaker * libm::sinf(omega * row);
        let motion = |row: f32| {
            let mut prediction = Prediction::default();
            // A jump, so that the motion counts as swift.
            prediction.add(0, 9.0, 1e6);
            for before in (1..8u8).rev() {
                prediction.add(8 - usize::from(before), tone(row - f32::from(before)), 1e6);
            }
            prediction.motion(8, tone(row), 1e6)
        };
        let mut blur = Blur::new(&timing);
        for row in 0..16_000u16 {
            let seen = motion(f32::from(row % 3000));
            blur.add(seen.speed_px, seen.change_px);
        }
        let off = blur.omega2() / (omega * omega) - 1.0;
        assert!(off.abs() < 0.03, "{off}");
        for row in (0..60u16).map(f32::from) {
            let (speed, change) = motion(row).of_tone(blur.omega2());
            let path = blur.path(speed, change);
            let (mean, variance, skew) = exact(omega, omega * row);
            assert!((mean - tone(row)).abs() < 1e-3);
            // Of 2 px² and 0.5 px³.
            let variance_off = path.variance_px2 - variance;
            assert!(variance_off.abs() < 0.1, "{row}: {variance_off} px²");
            let skew_off = path.skew_px3 - skew;
            assert!(skew_off.abs() < 0.06, "{row}: {skew_off} px³");
        }
    }

    #[test]
    fn a_slow_motion_and_a_global_shutter_smear_nothing() {
        let rolling = Blur::new(&Timing::new(33_670_000, 200_000, 300).unwrap());
        assert!(
            rolling
                .against_reference(rolling.path(0.04, 0.01))
                .is_none()
        );
        let global = Blur::new(&Timing::new(0, 200_000, 300).unwrap());
        assert!(global.against_reference(global.path(5.0, 1.0)).is_none());
    }
}
