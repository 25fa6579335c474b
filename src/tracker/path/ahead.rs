//! Where a swift picture will be after the gap between two frames, told by the rows of the frame before alone.
//!
//! [`Gap`](super::super::gap::Gap) learns from the frames before what usually happens. On a periodic texture they may have been read at the wrong stripe, the first ones
//! always: against the first frame the motion reaches twice as far as about its middle. Which stripe is the first of all
//! does not matter (each row's mean is taken off), but all frames must agree. The rows of one frame follow each
//! other, so their frequency, place, speed and acceleration are right whatever the stripe, and lead across the gap.

use super::oscillation::Oscillation;

/// Rows that the state remembers: an acceleration must be told over the rows of a gap.
const MEMORY_ROWS: f32 = 128.0;
/// Fewer rows of the frame before tell nothing.
const LEAST_ROWS: u16 = 48;
/// What was foreseen so badly of late is not believed, px².
const MOST_MISS_PX2: f32 = 2.0;

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    oscillation: Oscillation,
    /// Rows of this frame, or of the one before while this one has had none.
    pub(super) rows: u16,
    foreseen_px: Option<f32>,
    /// The last row's place, px.
    last_px: f32,
    /// Mean square of what was foreseen less what came, px².
    miss_px2: f32,
}

impl Default for Ahead {
    fn default() -> Self {
        Self {
            oscillation: Oscillation::new(0.0, MEMORY_ROWS),
            rows: 0,
            foreseen_px: None,
            last_px: 0.0,
            miss_px2: 0.0,
        }
    }
}

impl Ahead {
    /// A frame begins so many rows after the last one did.
    pub(super) fn begin_frame(&mut self, rows: f32, other: &Oscillation) {
        self.oscillation.begin_frame_like(rows, other);
        let enough = self.rows >= LEAST_ROWS;
        self.foreseen_px = self.oscillation.foresee().filter(|_| enough);
        self.rows = 0;
    }

    /// Of the frame's first row, px; `None` where it could not be told, or not well of late.
    pub(super) fn foreseen_px(&self) -> Option<f32> {
        self.foreseen_px.filter(|_| self.miss_px2 < MOST_MISS_PX2)
    }

    /// Takes a row's place; by how much it is not where the rows before it led, px.
    pub(super) fn add(&mut self, row: f32, px: f32, information: f32) -> f32 {
        let mut off_px = if self.rows > 0 {
            px - self.last_px
        } else {
            0.0
        };
        if let Some(foreseen_px) = self.foreseen_px.take() {
            off_px = px - foreseen_px;
            self.miss_px2 += (off_px * off_px - self.miss_px2) / 8.0;
        }
        self.last_px = px;
        self.rows = self.rows.saturating_add(1);
        self.oscillation.add(row, px, information, false);
        off_px
    }
}
