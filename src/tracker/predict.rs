//! Where the next line is expected.
//!
//! Mostly the picture hardly moves from row to row, and the information-weighted mean of the last rows
//! says where the next one is: one that knows little is carried by its neighbours. Where the motion is
//! swift, its speed and how that changes count too (a fading-memory filter of second order, Morrison 1969),
//! and over the gap between two frames, in which nothing is seen, the frames before tell what usually
//! happens ([`Gap`]).

use super::gap::Gap;

/// See the [module](self).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prediction {
    shift_px: f32,
    information: f32,
    /// Shift from row to row, and its change from row to row, px; 0 where the motion is not swift.
    speed_px: f32,
    change_px: f32,
    /// Rows added since nothing was known, up to 3.
    known: u8,
    /// Σ information·shift² and Σ information of this round of learning: single rows that know little may
    /// be anywhere.
    extent: f32,
    extent_information: f32,
    /// The last round's motion went further than one inner product reaches.
    far: bool,
    /// Information of a row with texture, the mean over all, 1/px²; 0 until that is known.
    usual_information: f32,
    /// What the last rows came to, the last first, px, and how many of them follow each other without a gap.
    last_px: [f32; 3],
    run: u8,
    /// The row that was added last.
    row: u16,
    /// Frames for which the motion still counts as swift.
    swift_frames: u8,
    gap: Gap,
}

/// How the picture moves at a row, as the rows tell it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    /// Speed, px a row, and how it changes from row to row.
    pub(super) speed_px: f32,
    pub(super) change_px: f32,
    /// By how much of ω² a tone's speed comes out too large.
    excess: f32,
    /// Rows from here to the middle of those that told, where the change is that of.
    middle: f32,
}

impl Motion {
    /// Speed and change at the row itself of a tone of `omega2` squared rad a row: what parabolas make of it is known.
    pub(super) fn of_tone(&self, omega2: f32) -> (f32, f32) {
        let speed_px = self.speed_px * (1.0 - self.excess * omega2);
        let square = self.middle * self.middle;
        // −ω²d from −ω²d of the middle and the speed: sin and cos of middle·ω.
        let turned = self.middle * omega2 * (1.0 + square * omega2 / 3.0) * speed_px;
        (
            speed_px,
            self.change_px * (1.0 + 0.6 * square * omega2) - turned,
        )
    }
}

impl Prediction {
    /// Weight of what was known a row ago.
    const KEEP: f32 = 0.75;
    /// The same where the motion is swift: at 1 kHz a row's 34 µs are a fifth of a radian.
    const KEEP_SWIFT: f32 = 0.5;
    /// A row that is further from where it was expected makes the motion swift, px²: one inner product
    /// would not do any more.
    const SWIFT_PX2: f32 = 0.5;
    /// A motion of this root mean square is found from anywhere within it, px.
    const SMALL_PX: f32 = 0.7;
    /// No row's place is surer than this against its neighbour's, 1/px²: their references are not.
    const MOST_INFORMATION: f32 = 1e4;
    /// Information of a tenth of a pixel, 1/px².
    const SURE: f32 = 100.0;
    /// Least information of a row that tells of swift motion, as a share of the usual.
    const LEAST_SHARE: f32 = 1.0 / 64.0;
    /// For so many frames.
    const SWIFT_FRAMES: u8 = 64;
    /// Over more rows than this the speed tells nothing.
    const ROWS: u16 = 4;

    /// Shift expected for this row, px.
    #[inline]
    pub(super) fn at(&self, row: usize) -> f32 {
        if self.swift_frames == 0 {
            return self.shift_px;
        }
        let rows = f32::from((row as u16).saturating_sub(self.row).min(Self::ROWS));
        self.shift_px + rows * (self.speed_px + 0.5 * rows * self.change_px)
    }

    /// The motion is not swift, and this frame has had its first row: [`Prediction::at`] is the same for all
    /// rows.
    pub(super) fn is_at_rest(&self) -> bool {
        self.swift_frames == 0 && !self.gap.is_open()
    }

    /// [`Prediction::at`] of a motion that [`Prediction::is_at_rest`], px.
    #[inline(always)]
    pub(super) fn predicted_px(&self) -> f32 {
        self.shift_px
    }

    /// A row that is so far from where it was expected leaves the motion at rest.
    #[inline(always)]
    pub(super) fn is_small(surprise_px: f32) -> bool {
        surprise_px * surprise_px <= Self::SWIFT_PX2
    }

    /// [`Prediction::add`] of a row that leaves the motion at rest: so far from where it was expected.
    #[inline(always)]
    pub(super) fn add_at_rest(&mut self, surprise_px: f32, information: f32) {
        self.information = self.information * Self::KEEP + information;
        self.shift_px += surprise_px * (information / self.information);
    }

    /// The motion is large and swift.
    #[inline]
    pub(super) fn is_swift(&self) -> bool {
        self.swift_frames > 0 && self.far
    }

    /// Speed and its change at a row that is at `shift_px`. Good rows tell by a parabola through the last four, as the
    /// filter lags behind; where neither is sure of the speed it is 0. Through three, a row's own error would be in the
    /// speed 2.5 times, and smear goes by its square.
    pub(super) fn motion(&self, row: usize, shift_px: f32, information: f32) -> Motion {
        if self.known < 3 {
            return Motion::default();
        }
        let [last, before, first] = self.last_px;
        let run = match row == usize::from(self.row) + 1 {
            true => self.run,
            false => 0,
        };
        let motion = match run {
            0 | 1 => Motion::default(),
            2 => Motion {
                speed_px: 1.5 * shift_px - 2.0 * last + 0.5 * before,
                change_px: shift_px - 2.0 * last + before,
                excess: 1.0 / 3.0,
                middle: 1.0,
            },
            _ => Motion {
                speed_px: 1.05 * shift_px - 0.65 * last - 0.85 * before + 0.45 * first,
                change_px: 0.5 * (shift_px - last - before + first),
                excess: 47.0 / 60.0,
                middle: 1.5,
            },
        };
        // Power of the noise in the speed and in the change.
        let [speed_power, change_power] = if run == 2 { [6.5, 6.0] } else { [2.45, 1.0] };
        // Five standard deviations; the rows before may know less than this one.
        let information = information
            .min(0.5 * self.information)
            .min(Self::MOST_INFORMATION);
        let sure = |v: f32, power: f32| v * v * information > 25.0 * power;
        if sure(motion.speed_px, speed_power) || sure(motion.change_px, change_power) {
            motion
        } else if self.speed_px * self.speed_px * information > 160.0 {
            Motion {
                speed_px: self.speed_px,
                change_px: self.change_px,
                excess: 0.0,
                middle: 1.0,
            }
        } else {
            Motion::default()
        }
    }

    /// A swift picture must be found again after a gap, and a row that knows so little could take any place
    /// for it.
    pub(super) fn needs_more_than(&self, information: f32) -> bool {
        self.is_swift() && self.known == 0 && information < 0.25 * self.usual_information
    }

    /// A row that knows so much less than others tells nothing of the next: some tens of them, noise of an even wall that
    /// was taken for texture, would lead anywhere.
    pub(super) fn is_lost_on(&self, information: f32) -> bool {
        information < Self::LEAST_SHARE * self.usual_information
    }

    /// It is sure to about a tenth of a pixel.
    pub(super) fn is_sure(&self) -> bool {
        self.information > Self::SURE
    }

    /// Takes what a row came to.
    pub(super) fn add(&mut self, row: usize, shift_px: f32, information: f32) {
        if self.swift_frames > 0 && self.is_lost_on(information) {
            return;
        }
        let expected = self.at(row);
        let surprise = shift_px - expected;
        let square = surprise * surprise;
        // A row that knows little may be anywhere.
        let least = (0.25 * self.usual_information).max(Self::SURE);
        if square > Self::SWIFT_PX2 && information > least {
            self.swift_frames = Self::SWIFT_FRAMES;
        }
        if self.gap.is_open() {
            self.gap.close(shift_px);
            if self.swift_frames > 0 {
                self.forget();
            }
        }
        if self.swift_frames == 0 {
            self.add_at_rest(surprise, information);
        } else {
            self.information = self.information * Self::KEEP_SWIFT + information;
            let share = information / self.information;
            let rest = 1.0 - share;
            self.shift_px = expected + surprise * (1.0 - rest * rest * rest);
            // A first row tells where, a second how fast, a third how that changes.
            match self.known {
                0 => {}
                1 => self.speed_px = surprise,
                _ => {
                    self.speed_px += self.change_px + surprise * 1.5 * share * share * (1.0 + rest);
                    self.change_px += surprise * share * share * share;
                }
            }
            self.known = (self.known + 1).min(3);
        }
        let follows = self.run > 0 && row == usize::from(self.row) + 1;
        self.run = if follows { (self.run + 1).min(3) } else { 1 };
        self.last_px = [shift_px, self.last_px[0], self.last_px[1]];
        self.row = row as u16;
    }

    /// The picture jumped: what was expected before is worth nothing.
    pub(super) fn jump(&mut self, row: usize, shift_px: f32, information: f32) {
        if self.is_lost_on(information) {
            return;
        }
        self.forget();
        self.add(row, shift_px, information);
        self.shift_px = shift_px;
    }

    /// The picture may be here as well as anywhere: nothing else is known.
    pub(super) fn suppose(&mut self, shift_px: f32) {
        self.forget();
        self.shift_px = shift_px;
    }

    /// A frame begins. `anchored`: shifts are against the rows' common middle, so that the frames before
    /// tell something; else the reference's own position is the best guess.
    pub(super) fn begin_frame(&mut self, start_ns: i64, anchored: bool) {
        let swift = self.swift_frames > 0;
        self.swift_frames = self.swift_frames.saturating_sub(1);
        if anchored {
            self.gap.open(start_ns, self.shift_px, self.speed_px);
        }
        if swift {
            self.forget();
            self.shift_px = if anchored {
                self.gap.expected_px()
            } else {
                0.0
            };
        }
        self.row = 0;
        self.run = 0;
    }

    /// While learning: a row was at `shift_px`.
    pub(super) fn note_extent(&mut self, shift_px: f32, information: f32) {
        self.extent += information * shift_px * shift_px;
        self.extent_information += information;
    }

    /// A round of learning has ended: what is known of the motion stays, where the picture is does not.
    /// `usual_information`: of a row with texture, 1/px².
    pub(super) fn end_round(&mut self, usual_information: f32) {
        self.forget();
        self.gap.end_round();
        self.far = self.extent > Self::SMALL_PX * Self::SMALL_PX * self.extent_information;
        (self.extent, self.extent_information) = (0.0, 0.0);
        self.usual_information = usual_information;
        self.shift_px = self.gap.expected_px();
    }

    /// Rows have been built again: what one with texture knows, 1/px².
    pub(super) fn expect_information(&mut self, usual_information: f32) {
        self.usual_information = usual_information;
    }

    /// A swift picture will be here in the first row.
    #[cfg(feature = "long-exposure")]
    pub(super) fn foresee(&mut self, shift_px: f32) {
        if self.swift_frames > 0 {
            self.shift_px = shift_px;
        }
    }

    /// The motion smears lines, however far it goes.
    #[cfg(feature = "long-exposure")]
    pub(super) fn expect_far(&mut self) {
        self.far = true;
    }

    /// The rounds of learning have ended. Their frames, each against the first one's own motion, may have seemed swift: where it
    /// did not go far, it was not.
    pub(super) fn come_to_rest(&mut self) {
        if !self.far {
            self.swift_frames = 0;
        }
    }

    fn forget(&mut self) {
        self.information = 0.0;
        self.speed_px = 0.0;
        self.change_px = 0.0;
        self.known = 0;
        self.run = 0;
    }

    /// Where the picture is most of the time, px.
    pub(super) fn usual_px(&self) -> f32 {
        self.gap.usual_px()
    }

    /// Moves the expectation with the reference.
    pub(super) fn move_by(&mut self, px: f32) {
        self.shift_px += px;
        self.gap.move_by(px);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row's information, 1/px²: a standard deviation of 0.01 px.
    const GOOD: f32 = 1e4;

    /// Largest error of what was expected of rows 6 to 99 of a motion, px.
    fn worst_px(prediction: &mut Prediction, shift_px: impl Fn(usize) -> f32) -> f32 {
        let mut worst = 0.0f32;
        for row in 0..100 {
            if row > 5 {
                worst = worst.max((prediction.at(row) - shift_px(row)).abs());
            }
            prediction.add(row, shift_px(row), GOOD);
        }
        worst
    }

    #[test]
    fn weak_rows_are_carried_by_strong_ones() {
        let mut prediction = Prediction::default();
        for row in 0..20 {
            prediction.add(row, 0.1, GOOD);
            prediction.add(row, 0.4, 10.0);
        }
        assert!((prediction.at(40) - 0.1).abs() < 0.001);
        assert!(prediction.is_sure());
    }

    #[test]
    fn a_swift_motion_is_foreseen_by_its_speed() {
        // 0.8 px a row, as 4 px at 1 kHz with 34 µs a row; a mean of the rows before would lag by 2.4 px.
        let worst = worst_px(&mut Prediction::default(), |row| 0.8 * row as f32);
        assert!(worst < 0.1, "{worst}");
        // The tone itself, turning round every 15 rows.
        let tone = |row: usize| 4.0 * libm::sinf(0.212 * row as f32);
        let worst = worst_px(&mut Prediction::default(), tone);
        assert!(worst < 0.3, "{worst}");
    }

    #[test]
    fn a_row_left_out_is_stepped_over() {
        let mut prediction = Prediction::default();
        for row in (0..60).filter(|row| row % 10 != 7) {
            prediction.add(row, 0.8 * row as f32, GOOD);
        }
        for left_out in 0..4 {
            let row = 60 + left_out;
            assert!((prediction.at(row) - 0.8 * row as f32).abs() < 0.1);
        }
        // Nor further than that.
        assert_eq!(prediction.at(100), prediction.at(64));
    }

    #[test]
    fn a_slow_motion_is_expected_where_the_last_frame_ended_and_a_swift_one_in_its_middle() {
        let mut slow = Prediction::default();
        slow.begin_frame(0, true);
        worst_px(&mut slow, |_| 0.2);
        slow.begin_frame(1, true);
        assert!((slow.at(0) - 0.2).abs() < 1e-3);
        // ± 4 px against the first frame's own position, after which nothing else is known yet.
        let mut swift = Prediction::default();
        swift.begin_frame(0, false);
        worst_px(&mut swift, |row| 0.02 * row as f32);
        swift.begin_frame(1, false);
        assert!((swift.at(0) - 1.98).abs() < 0.1, "not swift yet");
        worst_px(&mut swift, |row| if row < 50 { 4.0 } else { -4.0 });
        swift.begin_frame(2, false);
        assert_eq!(swift.at(0), 0.0);
    }
}
