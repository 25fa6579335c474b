//! What the background job remembers from one line to the next.

use super::{Build, RowTable, VerticalBuild, VerticalTable, align::Averaging};

/// What following remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Background {
    /// What is under way; no more than one thing is.
    pub(super) work: Work,
    /// Where the picture is on average, px: a mean over some seconds.
    pub(super) drift_px: f32,
    /// By how much the reference was moved after a creeping picture, px.
    pub(super) anchor_px: f32,
}

/// What is under way.
#[derive(Clone, Copy, Debug, Default)]
#[expect(
    clippy::large_enum_variant,
    reason = "a tracker has one, and no heap to put a variant on"
)]
pub(super) enum Work {
    #[default]
    Nothing,
    /// A line is kept in the scratch: where it was, and the factor that brings it to its reference's brightness.
    Kept {
        row: usize,
        /// To the right and downwards.
        shift_px: [f32; 2],
        to_reference: f32,
    },
    /// It is averaged into its row; the next column.
    Average {
        row: usize,
        averaging: Averaging,
        down_px: f32,
        column: usize,
    },
    /// The row's coefficients are built again.
    Build { row: usize, build: Build },
    /// Those of its second product are.
    BuildVertical {
        row: usize,
        table: RowTable,
        build: VerticalBuild,
    },
    /// They are there, with their tables, and become what the kernel keeps; the next column.
    Keep {
        row: usize,
        table: RowTable,
        vertical: Option<VerticalTable>,
        column: usize,
    },
    /// All rows are moved to the right by `by_px`; those from `next` on are still where they were.
    Move {
        by_px: i32,
        next: usize,
        moving: Moving,
    },
}

/// How far a row is moved; nothing of it is seen before its end.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moving {
    /// Its coefficients are laid where they are to be, among the fresh ones; the next column, and what the kernel
    /// left of those before.
    Lay {
        column: usize,
        lanes: u32,
    },
    /// What went over the ends is made up for.
    Settle,
    /// They become what the kernel keeps; the next column.
    Keep {
        column: usize,
    },
    /// The same three of its second product.
    LayVertical {
        column: usize,
        lanes: u32,
    },
    SettleVertical,
    KeepVertical {
        column: usize,
    },
    /// Its mean is moved; columns that are, from the end that they are moved to.
    Mean {
        moved: usize,
    },
    /// The coefficients take the place of the row's own.
    Place,
}

impl Moving {
    pub(super) const BEGIN: Self = Self::Lay {
        column: 0,
        lanes: 0,
    };
}
