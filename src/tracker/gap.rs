//! Where a swift picture will be after the gap between two frames, in which nothing is seen.
//!
//! For a vibration the shift after a gap of constant length is a linear function of the shift and the
//! speed before it (of one tone exactly: x·cos ωT + v/ω·sin ωT). Which one, the frames before tell: a
//! least-squares fit that forgets over some tens of frames and that falls back to the mean where it knows
//! nothing. It costs some tens of operations a frame, and with it the line after the gap is found at
//! once, and on a periodic texture at the right stripe.

/// See the [module](self).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gap {
    /// Start of the last frame, and the time from one to the next, ns.
    start_ns: Option<i64>,
    interval_ns: i64,
    /// Shift and speed before the gap, px and px a row.
    before: [f32; 2],
    open: bool,
    /// The time from the frame before is the usual one.
    regular: bool,
    /// Frames, and regular gaps before them, up to [`Gap::MEMORY`].
    frames: f32,
    gaps: f32,
    mean_before: [f32; 2],
    mean_after: f32,
    /// Second moments about the means: x², xv, v² before; xy, vy across; y² after.
    before2: [f32; 3],
    across: [f32; 2],
    after2: f32,
}

impl Gap {
    const MEMORY: f32 = 32.0;
    /// Learning puts 0 at the middle of the motion: that counts as so many frames.
    const MIDDLE: f32 = 8.0;
    /// Fewer gaps than this tell nothing of the next.
    const LEAST: f32 = 6.0;
    /// What is not known of the coefficients of the shift (1) and of the speed (100 rows), in a fit to
    /// 0.3 px: the ridge of the fit.
    const RIDGE: [f32; 2] = [0.1, 1e-5];

    /// A frame has ended with the picture at `shift_px`, moving by `speed_px` a row; the next begins.
    pub(super) fn open(&mut self, start_ns: i64, shift_px: f32, speed_px: f32) {
        self.regular = false;
        if let Some(before) = self.start_ns {
            let interval = start_ns.saturating_sub(before);
            let off = interval.saturating_sub(self.interval_ns).saturating_abs();
            self.regular = off <= self.interval_ns / 64;
            if !self.regular {
                // A lost frame; many in a row are another frame rate.
                self.gaps = (self.gaps - 4.0).max(0.0);
            }
            if self.gaps < 2.0 {
                self.interval_ns = interval;
            }
        }
        self.start_ns = Some(start_ns);
        self.before = [shift_px, speed_px];
        self.open = true;
    }

    #[inline]
    pub(super) fn is_open(&self) -> bool {
        self.open
    }

    /// Where the picture is most of the time at the start of a frame, px.
    pub(super) fn usual_px(&self) -> f32 {
        self.mean_after
    }

    /// Shift expected of the frame's first row, px.
    pub(super) fn expected_px(&self) -> f32 {
        if !self.regular || !self.open || self.gaps < Self::LEAST {
            return self.mean_after;
        }
        let [ridge_x, ridge_v] = Self::RIDGE.map(|r| r / self.gaps.max(1.0));
        let [xx, xv, vv] = self.before2;
        let (xx, vv) = (xx + ridge_x, vv + ridge_v);
        let [xy, vy] = self.across;
        let determinant = xx * vv - xv * xv;
        let x = self.before[0] - self.mean_before[0];
        let v = self.before[1] - self.mean_before[1];
        let away = ((xy * vv - vy * xv) * x + (vy * xx - xy * xv) * v) / determinant;
        // A tone goes no further than 1.4 of its standard deviations.
        let most = 2.0 * crate::math::sqrtf(self.after2);
        if away.is_finite() {
            // Not `clamp`: it panics where `most` is no number, and brings the printing of floats with it.
            self.mean_after + away.max(-most).min(most)
        } else {
            self.mean_after
        }
    }

    /// The frame's first row was found at `shift_px`.
    #[cold]
    pub(super) fn close(&mut self, shift_px: f32) {
        self.open = false;
        self.frames = (self.frames + 1.0).min(Self::MEMORY);
        let y = shift_px - self.mean_after;
        self.mean_after += y / (self.frames + Self::MIDDLE).min(Self::MEMORY);
        if !self.regular {
            return;
        }
        self.gaps = (self.gaps + 1.0).min(Self::MEMORY);
        let share = 1.0 / self.gaps;
        let x = self.before[0] - self.mean_before[0];
        let v = self.before[1] - self.mean_before[1];
        self.mean_before[0] += share * x;
        self.mean_before[1] += share * v;
        let mix = |moment: &mut f32, product: f32| {
            *moment = (1.0 - share) * (*moment + share * product);
        };
        let [xx, xv, vv] = &mut self.before2;
        mix(xx, x * x);
        mix(xv, x * v);
        mix(vv, v * v);
        let [xy, vy] = &mut self.across;
        mix(xy, x * y);
        mix(vy, v * y);
        mix(&mut self.after2, y * y);
    }

    /// What comes next may be another recording of the same motion.
    pub(super) fn end_round(&mut self) {
        self.start_ns = None;
        self.open = false;
        self.regular = false;
    }

    /// Moves everything with the reference.
    pub(super) fn move_by(&mut self, px: f32) {
        self.before[0] += px;
        self.mean_before[0] += px;
        self.mean_after += px;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW_NS: f32 = 33_670.0;
    const ROWS: f32 = 300.0;

    /// Shift and speed of a tone of 4 px about 1 px, at the first or last row of a frame.
    fn tone(hz: f32, start_ns: i64, row: f32) -> (f32, f32) {
        let omega = core::f32::consts::TAU * hz;
        let t = (start_ns as f32 + row * ROW_NS) * 1e-9;
        let turn = omega * t + 0.7;
        (
            1.0 + 4.0 * libm::sinf(turn),
            4.0 * omega * ROW_NS * 1e-9 * libm::cosf(turn),
        )
    }

    /// Largest error over frames 40 to 80 of where the frame was expected to begin, px. `lost`: how many
    /// frame intervals this frame comes late.
    fn worst_px(hz: f32, lost: impl Fn(u16) -> i64) -> f32 {
        let mut gap = Gap::default();
        let (mut start_ns, mut worst) = (0, 0.0f32);
        let mut before = (0.0, 0.0);
        for frame in 0..80 {
            gap.open(start_ns, before.0, before.1);
            let expected = gap.expected_px();
            let (here, _) = tone(hz, start_ns, 0.0);
            if frame >= 40 {
                worst = worst.max((expected - here).abs());
            }
            gap.close(here);
            before = tone(hz, start_ns, ROWS);
            start_ns += 16_666_667 * (1 + lost(frame));
        }
        worst
    }

    #[test]
    fn one_tone_is_foreseen_across_the_gap() {
        for hz in [5.3, 20.3, 50.3, 203.7, 1003.0] {
            let worst = worst_px(hz, |_| 0);
            assert!(worst < 0.4, "{hz} Hz: {worst} px");
        }
    }

    #[test]
    fn after_a_lost_frame_the_mean_is_expected() {
        // A frame is lost now and then: the next one begins anywhere within the motion, and is expected
        // in its middle, so that a stripe of 16 px can still not be mistaken.
        let worst = worst_px(50.3, |frame| i64::from(frame % 7 == 3));
        assert!(worst > 1.0 && worst < 6.0, "{worst} px");
    }
}
