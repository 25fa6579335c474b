//! The group of rows that is being filled.

use super::{Curvature, ladder::Ladder, vertical::VerticalSums};

/// A row and what is known of it: information greater than 0, or 0 where its [`Vertical`] knows something; both finite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowShift {
    pub(crate) frame: u32,
    pub(crate) row: u16,
    pub(crate) shift_px: f32,
    pub(crate) information_per_px2: f32,
}

/// What is asked of the first row of a group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Begin {
    /// Middle of its exposure, ns on the camera's clock.
    pub(crate) middle_ns: i64,
    pub(crate) curvature: Curvature,
    /// The factor that brings the row to its reference's brightness. How it changes until the next group begins tells by
    /// how much this group's rows were exposed later than their middles ([`Lateness`]).
    pub(crate) to_reference: f32,
    /// What comes on top of the shifts of all rows of the group, px.
    pub(crate) anchor_px: f32,
}

/// The group being filled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Open {
    pub(super) frame: u32,
    pub(super) slot: u16,
    pub(super) first_row: u16,
    /// The row that comes next.
    pub(super) next_row: u16,
    /// The row behind the group's last; 0 while there is no group.
    pub(super) end_row: u16,
    /// Rows that did not come.
    pub(super) missing: u16,
    /// Middle of the exposure of the first row, ns; whether it came or not.
    pub(super) first_ns: i64,
    pub(super) information: Ladder,
    pub(super) weighted_shift: f32,
    /// Σ information·(how much later a row was exposed than its place says, ns).
    pub(super) weighted_later: f32,
    /// The row that came first, and its brightness ([`Begin::to_reference`]).
    pub(super) bright_row: u16,
    pub(super) to_reference: f32,
    pub(super) anchor_px: f32,
    pub(super) vertical: VerticalSums,
}

impl Open {
    /// Takes the row that comes next.
    #[inline(always)]
    pub(super) fn add(&mut self, row: RowShift) {
        self.next_row = row.row.wrapping_add(1);
        self.weighted_shift += row.information_per_px2 * row.shift_px;
        self.information.add(row.information_per_px2);
    }

    /// Rows up to `row` do not come.
    pub(super) fn skip_to(&mut self, row: u16) {
        let rows = row.saturating_sub(self.next_row);
        self.missing = self.missing.saturating_add(rows);
        self.information.skip(rows);
        self.next_row = row;
    }

    /// At least half of its rows came.
    #[inline(always)]
    pub(super) fn is_thick(&self) -> bool {
        let passed = self.next_row.wrapping_sub(self.first_row);
        let came = u32::from(passed.wrapping_sub(self.missing));
        2 * came >= u32::from(self.end_row.wrapping_sub(self.first_row))
    }
}
