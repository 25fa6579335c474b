//! Rows of one frame, combined a few at a time.
//!
//! Contract: displacements come in the order of their rows; [`Binner::push`] gives the finished group
//! when the first row of the next one arrives, [`Binner::finish`] the last. Groups never reach over a
//! frame's end. A group of which less than half of the rows could be measured gives no sample: its
//! rows' own offsets would no longer be those of the other frames.

use super::{
    Curvature, Displacement, Group, Sample, Spread, Vertical,
    ladder::{Ladder, Moments},
    lateness::Lateness,
    open::{Begin, Open, RowShift},
    vertical::VerticalSums,
};

/// Rows of a sample are combined by their information, so none may be worth more than this, 1/px².
const MOST_INFORMATION: f32 = 1e18;

/// Nor may a row take more of a shift downwards for one to the right.
const MOST_COUPLING: f32 = 1e6;

/// Longest frame gap that is still counted as lost frames: beyond it the camera was restarted.
const LONGEST_LOSS: u32 = 100_000;

/// Combines rows to samples.
///
/// ```
/// use rowtone::camera::Timing;
/// use rowtone::timeline::{Binner, Displacement, Group};
/// let group = Group::new(Timing::new(20_000_000, 0, 4)?, 2)?;
/// let mut binner = Binner::new(group);
/// let row = |row, shift_px| Displacement {
///     frame: 0, row, time_ns: row as i64 * 20_000, shift_px, information_per_px2: 100.0,
///     vertical: None,
/// };
/// assert_eq!(binner.push(row(0, 0.1)), None);
/// assert_eq!(binner.push(row(1, 0.3)), None);
/// let sample = binner.push(row(2, 0.5)).unwrap();
/// assert_eq!((sample.slot, sample.time_ns, sample.information_per_px2), (0, 10_000, 200.0));
/// assert!((sample.shift_px - 0.2).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Binner {
    group: Group,
    open: Open,
    /// Line time, ns.
    line_ns: f32,
    last_frame: Option<u32>,
    lost_frames: u32,
    thin_groups: u32,
    /// Of the group being filled.
    curvature: Curvature,
    lateness: Lateness,
    /// How much later than their middles the rows of the group before were exposed, ns: so may this one's be.
    late_ns: f32,
}

impl Binner {
    /// A binner for these groups.
    pub fn new(group: Group) -> Self {
        Self {
            group,
            open: Open::default(),
            line_ns: group.timing().line_time_ps() as f32 * 1e-3,
            last_frame: None,
            lost_frames: 0,
            thin_groups: 0,
            curvature: Curvature::default(),
            lateness: Lateness::new(&group.timing()),
            late_ns: 0.0,
        }
    }

    /// What the tracker says of the rows to come ([`Tracker::curvature`](crate::tracker::Tracker::curvature)).
    /// Rows that come by [`Binner::push_row`] bring it along themselves.
    pub(crate) fn set_curvature(&mut self, curvature: Curvature) {
        self.curvature = curvature;
    }

    /// Takes one row; gives the group before it, if this row begins another.
    ///
    /// A row that knows nothing (information not greater than 0, or anything not finite) is skipped, and so is
    /// one that comes after a later one of its group.
    pub fn push(&mut self, d: Displacement) -> Option<Sample> {
        let (shift_px, information) = (d.shift_px, d.information_per_px2);
        let own = d.vertical.map_or(0.0, |v| v.information_per_px2);
        let more = d.vertical.unwrap_or_default();
        let known = (information > 0.0 || information == 0.0 && own > 0.0)
            && information.is_finite()
            && shift_px.is_finite()
            && (0.0..=MOST_INFORMATION).contains(&own)
            && more.shift_px.is_finite()
            && more.coupling.abs() < MOST_COUPLING;
        if !known || d.row >= self.group.timing().rows() {
            self.count_lost(d.frame);
            return if self.is_open_for(d.frame, d.row) {
                None
            } else {
                self.finish()
            };
        }
        if self.is_open_for(d.frame, d.row) && d.row < self.open.next_row {
            return None;
        }
        let row = RowShift {
            frame: d.frame,
            row: d.row,
            shift_px,
            information_per_px2: information.min(MOST_INFORMATION),
        };
        let begin = Begin {
            middle_ns: d.time_ns,
            curvature: self.curvature,
            // Its time tells how late it was.
            to_reference: 1.0,
            anchor_px: 0.0,
        };
        let mut done = None;
        self.push_row(row, || begin, &mut done);
        let place = self.group.timing().start_ns(d.row - self.open.first_row);
        let later_ns = d
            .time_ns
            .saturating_sub(self.open.first_ns.saturating_add(place));
        self.note_later(row.information_per_px2, later_ns as f32);
        if let Some(vertical) = &d.vertical {
            self.note_vertical(row, vertical);
        }
        done
    }

    /// [`Binner::push`] for a row of this timing that is exposed when its place says. `begin` is asked where a group
    /// begins. Says whether the group before is complete, which is in `done` then (written there, not moved about: that would
    /// take a microcontroller as long as a part of a line).
    #[inline(always)]
    pub(crate) fn push_row(
        &mut self,
        row: RowShift,
        begin: impl Fn() -> Begin,
        done: &mut Option<Sample>,
    ) -> bool {
        let open = &mut self.open;
        if row.row == open.next_row && row.row < open.end_row && row.frame == open.frame {
            open.add(row);
            return false;
        }
        let RowShift {
            frame,
            row,
            shift_px,
            information_per_px2,
        } = row;
        // One by one, in registers: as structs they would be written to memory for the sake of rows that come here.
        let Begin {
            middle_ns,
            curvature,
            to_reference,
            anchor_px,
        } = begin();
        let known = (shift_px, information_per_px2);
        let light = (to_reference, anchor_px);
        self.push_elsewhere((frame, row), known, middle_ns, curvature, light, done)
    }

    /// The row pushed last was exposed so much later than its place says, ns.
    fn note_later(&mut self, information_per_px2: f32, later_ns: f32) {
        self.open.weighted_later += information_per_px2 * later_ns;
    }

    /// The row pushed last knows so much of the motion along the columns.
    #[inline(always)]
    pub(crate) fn note_vertical(&mut self, row: RowShift, vertical: &Vertical) {
        let open = &mut self.open;
        // Not where it came too late for its group.
        if open.next_row == row.row.wrapping_add(1) && open.frame == row.frame {
            let after = row.row.wrapping_sub(open.first_row);
            let RowShift {
                shift_px,
                information_per_px2,
                ..
            } = row;
            open.vertical
                .add(after, shift_px, information_per_px2, vertical);
        }
    }

    fn is_open_for(&self, frame: u32, row: u16) -> bool {
        frame == self.open.frame && (self.open.first_row..self.open.end_row).contains(&row)
    }

    /// A row that is not the next of its group. `known`: its shift and information; `light`: its brightness
    /// ([`Begin::to_reference`]) and anchor.
    #[inline(never)]
    fn push_elsewhere(
        &mut self,
        (frame, row): (u32, u16),
        (shift_px, information_per_px2): (f32, f32),
        middle_ns: i64,
        curvature: Curvature,
        (to_reference, anchor_px): (f32, f32),
        done: &mut Option<Sample>,
    ) -> bool {
        // The next group's first row: most come so.
        let follows = frame == self.open.frame && row == self.open.end_row && row > 0;
        if !follows || !self.open.vertical.is_empty() {
            let (known, light) = ((shift_px, information_per_px2), (to_reference, anchor_px));
            return self.push_anyhow((frame, row), known, middle_ns, curvature, light, done);
        }
        let row = RowShift {
            frame,
            row,
            shift_px,
            information_per_px2,
        };
        let begin = Begin {
            middle_ns,
            curvature,
            to_reference,
            anchor_px,
        };
        self.push_next_group::<false>(row, &begin, done)
    }

    /// [`Binner::push_elsewhere`] of any row, and where rows know of the motion along the columns: apart from the others, or
    /// registers would be kept for it.
    #[inline(never)]
    fn push_anyhow(
        &mut self,
        (frame, row): (u32, u16),
        (shift_px, information_per_px2): (f32, f32),
        middle_ns: i64,
        curvature: Curvature,
        (to_reference, anchor_px): (f32, f32),
        done: &mut Option<Sample>,
    ) -> bool {
        let row = RowShift {
            frame,
            row,
            shift_px,
            information_per_px2,
        };
        let begin = Begin {
            middle_ns,
            curvature,
            to_reference,
            anchor_px,
        };
        let follows = frame == self.open.frame && row.row == self.open.end_row && row.row > 0;
        match follows {
            true => self.push_next_group::<true>(row, &begin, done),
            false => self.push_far(row, &begin, done),
        }
    }

    /// The first row of the next group.
    #[inline(always)]
    fn push_next_group<const PLANAR: bool>(
        &mut self,
        row: RowShift,
        begin: &Begin,
        done: &mut Option<Sample>,
    ) -> bool {
        self.settle_lateness(&row, begin.to_reference);
        let complete = self.close::<PLANAR>(done);
        let open = &mut self.open;
        open.slot += 1;
        open.first_row = row.row;
        open.missing = 0;
        open.first_ns = begin.middle_ns;
        self.open_with::<PLANAR>(row, begin);
        complete
    }

    /// A row that is neither the next of its group nor the first of the next group.
    #[inline(never)]
    fn push_far(&mut self, row: RowShift, begin: &Begin, done: &mut Option<Sample>) -> bool {
        if self.is_open_for(row.frame, row.row) {
            if row.row >= self.open.next_row {
                self.open.skip_to(row.row);
                self.open.add(row);
            }
            return false;
        }
        self.settle_lateness(&row, begin.to_reference);
        let complete = self.close::<true>(done);
        if self.open.frame != row.frame || self.last_frame.is_none() {
            self.count_lost(row.frame);
            self.late_ns = 0.0;
        }
        let rows_per_sample = self.group.rows_per_sample();
        let open = &mut self.open;
        open.frame = row.frame;
        open.slot = row.row / rows_per_sample;
        open.first_row = open.slot * rows_per_sample;
        open.missing = row.row - open.first_row;
        open.first_ns = begin.middle_ns;
        if open.missing > 0 {
            let before_ns = self.group.timing().start_ns(open.missing);
            open.first_ns = begin.middle_ns.saturating_sub(before_ns);
        }
        self.open_with::<true>(row, begin);
        complete
    }

    /// The rest of what begins a group.
    #[inline(always)]
    fn open_with<const PLANAR: bool>(&mut self, row: RowShift, begin: &Begin) {
        let open = &mut self.open;
        let end_row = open.first_row.saturating_add(self.group.rows_per_sample());
        open.end_row = end_row.min(self.group.timing().rows());
        open.information = Ladder::default();
        open.weighted_shift = 0.0;
        open.weighted_later = 0.0;
        if PLANAR && !open.vertical.is_empty() {
            open.vertical = VerticalSums::default();
        }
        (open.bright_row, open.to_reference) = (row.row, begin.to_reference);
        open.anchor_px = begin.anchor_px;
        open.add(row);
        self.curvature = begin.curvature;
    }

    /// How late the group being filled was, now that the first row behind it is known.
    #[inline(always)]
    fn settle_lateness(&mut self, next: &RowShift, to_reference: f32) {
        let open = &self.open;
        if next.frame == open.frame && next.row > open.bright_row {
            let rows = f32::from(next.row - open.bright_row);
            let late_ns = self.lateness.late_ns(open.to_reference, to_reference, rows);
            self.late_ns = late_ns.unwrap_or(self.late_ns);
        }
    }

    /// Gives the group being filled: at the end of the input.
    pub fn finish(&mut self) -> Option<Sample> {
        let mut done = None;
        self.close::<true>(&mut done);
        done
    }

    /// The group being filled has ended: whether it is complete, in `done` then. `PLANAR`: its rows may know of the motion
    /// along the columns.
    #[inline(always)]
    fn close<const PLANAR: bool>(&mut self, done: &mut Option<Sample>) -> bool {
        let open = &mut self.open;
        if open.end_row == 0 {
            return false;
        }
        let thick = open.is_thick();
        open.end_row = 0;
        if !thick {
            self.thin_groups = self.thin_groups.saturating_add(1);
            return false;
        }
        let information_per_px2 = open.information.weight();
        if PLANAR && information_per_px2 == 0.0 {
            *done = self.close_along_columns();
            return done.is_some();
        }
        let per_information = 1.0 / information_per_px2;
        let shift_px = open.weighted_shift * per_information + open.anchor_px;
        if !shift_px.is_finite() {
            return false;
        }
        let Moments {
            to_next,
            variance,
            third,
        } = open.information.moments(per_information);
        let rows = f32::from(open.next_row.wrapping_sub(open.first_row)) - to_next;
        let own_ns = self.late_ns + open.weighted_later * per_information;
        let later_ns = rows * self.line_ns + own_ns;
        let later_ns = rounded_ns(later_ns);
        let line_ns2 = self.line_ns * self.line_ns;
        // Written where it goes, and what few have apart from that: made elsewhere, all of it would be copied.
        let sample = done.insert(Sample {
            frame: open.frame,
            slot: open.slot,
            curvature: self.curvature,
            time_ns: open.first_ns.wrapping_add(later_ns),
            shift_px,
            information_per_px2,
            spread: Spread {
                variance_ns2: variance * line_ns2,
                third_ns3: third * line_ns2 * self.line_ns,
            },
            vertical: None,
        });
        if PLANAR && !open.vertical.is_empty() {
            let (weighted, sums) = (open.weighted_shift, &open.vertical);
            let vertical = sums.settle(weighted, information_per_px2, rows, self.line_ns);
            sample.vertical = Some(vertical);
        }
        true
    }

    /// [`Binner::close`] of a group whose rows know nothing of x: all their edges lie along them.
    #[cold]
    fn close_along_columns(&mut self) -> Option<Sample> {
        let open = &self.open;
        let mean_row = open.vertical.mean_row()?;
        let later_ns = mean_row * self.line_ns + self.late_ns;
        let vertical = open.vertical.settle(0.0, 0.0, mean_row, self.line_ns);
        let known = vertical.information_per_px2 > 0.0 && vertical.shift_px.is_finite();
        known.then_some(Sample {
            frame: open.frame,
            slot: open.slot,
            curvature: self.curvature,
            time_ns: open.first_ns.wrapping_add(rounded_ns(later_ns)),
            shift_px: 0.0,
            information_per_px2: 0.0,
            spread: self.group.even_spread(),
            vertical: Some(vertical),
        })
    }

    /// Frames missing so far, by their numbers.
    pub const fn lost_frames(&self) -> u32 {
        self.lost_frames
    }

    /// Groups given up so far because less than half of their rows could be measured.
    pub(crate) const fn thin_groups(&self) -> u32 {
        self.thin_groups
    }

    fn count_lost(&mut self, frame: u32) {
        let ahead = match self.last_frame {
            Some(last) => frame.wrapping_sub(last),
            None => 1,
        };
        if ahead > 1 && ahead < LONGEST_LOSS {
            self.lost_frames = self.lost_frames.saturating_add(ahead - 1);
        }
        self.last_frame = Some(frame);
    }
}

/// The nearest whole number of a time below a day, as fast as a cast of 32 bits; 0 for NaN.
#[inline(always)]
fn rounded_ns(ns: f32) -> i64 {
    if ns.abs() < 1e9 {
        i64::from((ns + 0.5f32.copysign(ns)) as i32)
    } else {
        // A number so large is a multiple of 64.
        const HIGH: f32 = 65_536.0;
        let high = (ns / HIGH) as i32;
        i64::from(high) * 65_536 + i64::from((ns - high as f32 * HIGH) as i32)
    }
}

#[cfg(test)]
mod tests;
