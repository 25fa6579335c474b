//! Displacements of rows become samples in time.
//!
//! Rows are far denser in time than any vibration needs. Neighbouring rows of one frame are combined
//! by their information: this is the vertical extent of the shearlet (its low-pass along y), and it is
//! where the sensitivity comes from.

mod binner;
mod group;
mod ladder;

pub use binner::Binner;
pub(crate) use binner::RowShift;
pub use group::{BinnerError, Group, rows_per_sample};

/// How far one row is shifted against its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// Frame number, as in [`crate::camera::Line`].
    pub frame: u32,
    /// Row, as in [`crate::camera::Line`].
    pub row: u16,
    /// Middle of the row's exposure, ns on the camera's clock.
    pub time_ns: i64,
    /// Shift to the right against the reference, px.
    pub shift_px: f32,
    /// What the row knows of its shift: 1/variance, 1/px². Greater than 0.
    pub information_per_px2: f32,
}

/// How the times of a sample's rows lie about their mean, weighted like the shift. Zero where it has but one row.
///
/// Averaging rows weakens a fast vibration, and turns its phase where they lie more to one side; a picture's
/// rows differ in texture, so each group of rows does so in its own way, and the same way in every frame. What
/// is not taken into account looks like ghosts a multiple of the frame rate from the vibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Variance, ns².
    pub variance_ns2: f32,
    /// Third central moment, ns³: above 0 with few rows far behind the mean.
    pub third_ns3: f32,
}

/// Some neighbouring rows of one frame, combined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Frame number, as in [`crate::camera::Line`].
    pub frame: u32,
    /// Which group of rows: row / rows a sample. Samples of one slot share one unknown offset (their
    /// reference's own position).
    pub slot: u16,
    /// Middle of the exposure, weighted like the shift, ns on the camera's clock.
    pub time_ns: i64,
    /// Shift to the right against the reference, px.
    pub shift_px: f32,
    /// 1/variance of the shift, 1/px². Greater than 0.
    pub information_per_px2: f32,
    /// The times of its rows about `time_ns`.
    pub spread: Spread,
}
