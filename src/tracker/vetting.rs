//! Whether a frame may be learned from, and whether the first one was a good one to begin with.
//!
//! The first frame anchors the reference: later ones are aligned to it. A camera that has just started delivers
//! black, dark, stale or broken frames, and whatever frame is bad must cost itself alone. So in the first round the
//! frames are set against the reference that those before them made: a reference that is dark beside them, unlike
//! them, or far from where all of them are was begun with a bad frame, and the round begins again with the
//! next one. A single frame that is unlike the others is left out.

/// A line this many times darker than its reference is unlit: nothing of it is used. Nor is a reference that is
/// so much darker than its lines.
pub(super) const UNLIT: f32 = 8.0;

/// Lines of frames that show the same scene correlate better than this on average, lines of others worse.
const ALIKE: f32 = 0.35;

/// A first frame that is further than this from all others is not where the picture is, px, by so many times the
/// range of the others.
const FAR_PX: f32 = 4.0;
const FAR_RANGES: f32 = 3.0;
/// Frames that tell: as many as may be bad, and twice as many more.
const FAR_FRAMES: u16 = 4;

/// A shift that one frame alone has counts for the range of the motion only up to this, of what the others have.
const ALONE: f32 = 1.4;
const ALONE_PX: f32 = 0.5;

/// A round begins again at most so many times in a row: a scene that never agrees with itself is learned as it is.
const MOST_RESTARTS: u8 = 8;

/// See the [module](self).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vetting {
    frame: FrameVetting,
    /// Frames that agree with the reference since the round began.
    agreed: u16,
    /// Frames in succession that did not.
    disagreed: u16,
    /// Least and most of the agreeing frames' mean shifts but the first one's, px.
    least_px: f32,
    most_px: f32,
    /// Largest shifts that frames have met, of the two furthest, px.
    furthest_px: [f32; 2],
    /// How often the round was begun again in a row.
    restarts: u8,
}

/// What the rows of a frame say of it.
#[derive(Clone, Copy, Debug, Default)]
struct FrameVetting {
    rows: u16,
    unlit: u16,
    /// Rows whose reference is unlit beside them.
    bright: u16,
    /// Rows with texture, and Σ of their correlations with the reference.
    compared: u16,
    likeness: f32,
    /// Σ information·shift and Σ information.
    shift: f32,
    information: f32,
    /// Largest shift where the prediction was sure, px.
    furthest_px: f32,
}

impl Vetting {
    /// A row of the frame is this many times darker than its reference.
    pub(super) fn note_light(&mut self, to_reference: f32) {
        let frame = &mut self.frame;
        frame.rows = frame.rows.saturating_add(1);
        if to_reference > UNLIT {
            frame.unlit = frame.unlit.saturating_add(1);
        } else if to_reference < 1.0 / UNLIT {
            frame.bright = frame.bright.saturating_add(1);
        }
    }

    /// A row with texture was found, or at least looked for, at `shift_px`, where it correlates so with its reference.
    pub(super) fn note_row(&mut self, likeness: f32, shift_px: f32, information: f32) {
        let frame = &mut self.frame;
        frame.compared = frame.compared.saturating_add(1);
        frame.likeness += likeness;
        frame.shift += information * shift_px;
        frame.information += information;
    }

    /// The picture was surely so far from its reference in a row, px.
    pub(super) fn note_extent(&mut self, shift_px: f32) {
        self.frame.furthest_px = self.frame.furthest_px.max(shift_px.abs());
    }

    /// Largest shift of the round, px; what one frame alone has met counts little.
    pub(super) fn range_px(&self) -> f32 {
        let mut furthest = self.furthest_px;
        insert(&mut furthest, self.frame.furthest_px);
        let [first, second] = furthest;
        first.min(second * ALONE + ALONE_PX)
    }

    /// A frame of the first round has ended. The round must begin again where this is true.
    pub(super) fn end_frame(&mut self) -> bool {
        let frame = core::mem::take(&mut self.frame);
        insert(&mut self.furthest_px, frame.furthest_px);
        if frame.rows == 0 || 2 * frame.unlit > frame.rows {
            return false;
        }
        let first = self.agreed == 0;
        let bright = 2 * frame.bright > frame.rows;
        let unlike = frame.compared > 0 && frame.likeness < ALIKE * f32::from(frame.compared);
        if !first && (bright || unlike) {
            self.disagreed += 1;
            // A dark reference is a bad one. Of two frames that disagree either may be.
            return self.may_restart(bright || self.disagreed > 1 || self.agreed < 2);
        }
        self.agreed = self.agreed.saturating_add(1);
        self.disagreed = 0;
        if first || frame.information <= 0.0 {
            return false;
        }
        let mean_px = frame.shift / frame.information;
        if self.agreed == 2 {
            (self.least_px, self.most_px) = (mean_px, mean_px);
        }
        self.least_px = self.least_px.min(mean_px);
        self.most_px = self.most_px.max(mean_px);
        let range = self.most_px - self.least_px;
        let nearest = self.least_px.max(-self.most_px);
        let far = nearest > FAR_PX && nearest > FAR_RANGES * range;
        self.may_restart(self.agreed == FAR_FRAMES && far)
    }

    /// The second round, or tracking, begins: what is known of frames is forgotten.
    pub(super) fn end_round(&mut self) {
        *self = Self::default();
    }

    /// The first round begins again.
    pub(super) fn restart(&mut self) {
        *self = Self {
            restarts: self.restarts + 1,
            ..Self::default()
        };
    }

    fn may_restart(&self, wanted: bool) -> bool {
        wanted && self.restarts < MOST_RESTARTS
    }
}

/// Keeps the two largest, the larger one first.
fn insert([first, second]: &mut [f32; 2], new: f32) {
    if new > *first {
        (*first, *second) = (new, *first);
    } else if new > *second {
        *second = new;
    }
}
