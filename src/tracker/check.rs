//! Whether a line still resembles its reference.
//!
//! The inner product alone cannot tell a moving surface from a hand in front of it. So now and then, and
//! whenever a line surprises, what the line leaves over after its shifted reference is taken off is
//! compared with the pixels' noise and with what an error of the shift would leave. A line that fails is
//! searched for over the whole range of motion; if it is not found either, it is occluded, and so are
//! the following ones until one fits again.

use super::{Stage, residual::Residual};

/// While tracking, one row in this many is checked even if it does not surprise; and where a line time is short.
const EVERY: usize = 32;
const EVERY_IN_A_HURRY: usize = 64;

/// Columns that a check reads, about: of a line that may be anywhere, of one among others that fitted, where a line time is
/// short, and where the line has moved by whole pixels then, which takes longer.
const COLUMNS: usize = 48;
const COLUMNS_AMONG_FITTING: usize = 24;
const COLUMNS_IN_A_HURRY: usize = 12;
const COLUMNS_IN_MORE_HURRY: usize = 10;

/// A line that leaves no more over than an error of this would, squared, is found, px².
const WELL_PX2: f32 = 0.02;

/// A scene that does not fit for so long is a new scene, ns.
const NEW_SCENE_NS: i64 = 1_500_000_000;

/// What checks remember, and their verdict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Check {
    /// The last line checked did not fit, or the frame has just begun: check every line.
    every_line: bool,
    /// Remainder of the rows that are checked in this frame.
    turn: usize,
    /// Lines to wait before the next search, while nothing fits.
    lines_to_search: u8,
    /// While nothing fits and a line has no time for a whole search: the number of starts tried since.
    start: Option<u16>,
    /// Starts of a search.
    starts: u16,
    /// Lines of this frame that fitted, and that did not.
    fitted: u32,
    unfit: u32,
    /// When the scene stopped to fit.
    since_ns: Option<i64>,
    /// What even a good line leaves over, as the square of an error of the shift, px²: a background that
    /// stands still, a lens that distorts.
    usual_px2: f32,
}

impl Check {
    /// Checks that know nothing yet, of a search of so many starts.
    pub(super) fn new(starts: u16) -> Self {
        Self {
            every_line: false,
            turn: 0,
            lines_to_search: 0,
            start: None,
            starts,
            fitted: 0,
            unfit: 0,
            since_ns: None,
            usual_px2: 0.0,
        }
    }

    /// A lost picture is searched for, one start a line.
    #[inline(always)]
    pub(super) fn is_searching(&self) -> bool {
        self.start.is_some()
    }

    /// Every line is to be checked, and not only because a frame has just begun.
    pub(super) fn checks_every_line(&self) -> bool {
        self.every_line && (self.unfit > 0 || self.is_searching())
    }

    /// The next row to be checked after `row`.
    pub(super) fn next_due(&self, row: usize, hurried: bool) -> usize {
        if self.every_line {
            return 0;
        }
        let every = if hurried { EVERY_IN_A_HURRY } else { EVERY };
        let next = row + 1;
        // Both are powers of two.
        next + (self.turn.wrapping_sub(next) & (every - 1))
    }

    pub(super) fn begin_frame(&mut self, frame: u32) {
        self.turn = frame as usize % EVERY_IN_A_HURRY;
        self.every_line = true;
        self.lines_to_search = 0;
        self.fitted = 0;
        self.unfit = 0;
    }

    /// Closes the frame that ended; the scene has changed for good when this returns true.
    pub(super) fn end_frame(&mut self, now_ns: i64) -> bool {
        if self.unfit > 3 * self.fitted && self.unfit > 0 {
            let since = *self.since_ns.get_or_insert(now_ns);
            return now_ns.saturating_sub(since) > NEW_SCENE_NS;
        }
        self.since_ns = None;
        false
    }

    /// Learns what a good line leaves over.
    fn learn(&mut self, excess_px2: f32) {
        self.usual_px2 += (excess_px2 - self.usual_px2) / 64.0;
    }

    /// The verdict: a line with this residual still shows its reference.
    pub(super) fn fits(&mut self, residual: &Residual, stage: Stage) -> bool {
        // While learning, the reference is still blurred and a still background not yet known.
        let allowed_px2 = match stage {
            Stage::Tracking => 0.2 + 4.0 * self.usual_px2,
            Stage::Rough | Stage::Refining => 2.0,
        };
        let mut fits = residual.power <= 5.0 + allowed_px2 * residual.slope_power;
        if fits && self.is_strict() {
            fits = residual.excess_px2() < self.well_px2();
        }
        if fits && stage == Stage::Refining && residual.slope_power > 0.0 {
            self.learn((residual.power - 2.0).max(0.0) / residual.slope_power);
        }
        fits
    }

    /// Remembers the verdict of a line. `hurried`: a line time is short.
    pub(super) fn note(&mut self, fits: bool, hurried: bool) {
        self.every_line = !fits;
        self.lines_to_search = self.lines_to_search.saturating_sub(1);
        if fits {
            self.fitted += 1;
            self.start = None;
        } else {
            self.unfit += 1;
            if hurried {
                self.start = Some(self.start.map_or(0, |s| s.wrapping_add(1)));
            }
        }
    }

    /// A whole search may begin; the next one waits for some lines.
    pub(super) fn begin_search(&mut self) -> bool {
        let begins = self.lines_to_search == 0;
        if begins {
            self.lines_to_search = 8;
            self.every_line = true;
        }
        begins
    }

    /// The number of the start to be tried with the next line, where a line has no time for a whole search.
    pub(super) fn next_start(&self) -> Option<u16> {
        Some(self.start?.checked_sub(1)? % self.starts)
    }

    /// Columns that a check for a shadow reads: it has more to tell.
    pub(super) fn columns_in_shade(&self, columns: usize) -> usize {
        columns.max(COLUMNS_AMONG_FITTING)
    }

    /// Columns that the next check reads. `hurried`: a line time is short; `moved`: the line has moved by whole pixels.
    pub(super) fn columns(&self, stage: Stage, hurried: bool, moved: bool) -> usize {
        match (hurried, moved) {
            (false, _) if self.every_line || stage != Stage::Tracking => COLUMNS,
            (false, _) => COLUMNS_AMONG_FITTING,
            (true, false) => COLUMNS_IN_A_HURRY,
            (true, true) => COLUMNS_IN_MORE_HURRY,
        }
    }

    /// A search goes the first time round: only a place that leaves next to nothing over will do.
    fn is_strict(&self) -> bool {
        matches!(self.start, Some(start) if start > 0 && start <= self.starts)
    }

    /// A line that leaves no more over is found for certain, px².
    pub(super) fn well_px2(&self) -> f32 {
        WELL_PX2 + 2.0 * self.usual_px2
    }
}
