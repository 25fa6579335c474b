//! From one frame to the next: what is settled when a frame has ended.

use super::{Stage, Tracker};

impl Tracker<'_> {
    /// Once a frame: the reference follows a picture that creeps.
    fn follow_drift(&mut self) {
        if self.prediction.is_sure()
            && let Some(by_px) = self.store.follow_drift(self.prediction.at(0))
        {
            self.prediction.move_by(-by_px);
        }
    }

    /// Closes the frame before, which ended, and begins another.
    #[cold]
    pub(super) fn next_frame(&mut self, frame: u32, start_ns: i64) {
        if self.copies.end_frame() {
            self.counts.repeated_frames = self.counts.repeated_frames.saturating_add(1);
        }
        if self.stage == Stage::Tracking {
            if self.check.end_frame(start_ns) {
                self.counts.relearned = self.counts.relearned.saturating_add(1);
                self.relearn();
            } else {
                self.follow_drift();
            }
        } else if self.frame.is_some() && self.frames_in_stage >= self.config.learn_frames {
            self.end_round();
        } else if self.stage == Stage::Rough && self.frame.is_some() && self.vetting.end_frame() {
            let vetting = self.vetting;
            self.relearn();
            self.vetting = vetting;
            self.vetting.restart();
        } else if self.stage == Stage::Refining {
            self.vetting.end_frame();
        }
        if self.stage == Stage::Rough && self.frames_in_stage.is_power_of_two() {
            self.settle_noise();
        }
        // The rows beside a row must have been seen before its second product can be built.
        let seen = self.frames_in_stage;
        if self.store.is_planar() && self.stage == Stage::Rough && matches!(seen, 1 | 4 | 16) {
            self.store.build_all();
            self.planar.end_round(self.store.usual_curvatures_per_px2());
        }
        self.frames_in_stage = self.frames_in_stage.saturating_add(1);
        self.frame = Some(frame);
        self.schedule.turn = match self.stage {
            Stage::Tracking => self.store.turn_of(frame, self.is_hurried()),
            Stage::Rough | Stage::Refining => usize::MAX,
        };
        self.prediction
            .begin_frame(start_ns, self.stage != Stage::Rough);
        #[cfg(feature = "long-exposure")]
        self.paths
            .begin_frame(start_ns, self.stage == Stage::Refining);
        #[cfg(feature = "long-exposure")]
        self.look_ahead();
        self.check.begin_frame(frame);
        if self.store.is_planar() {
            self.planar.begin_frame();
        }
        self.schedule.next_check = 0;
        self.schedule.background = self.store.is_busy() || self.check.is_searching();
        self.light.begin_frame();
    }
}
