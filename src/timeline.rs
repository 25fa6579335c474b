//! Displacements of rows become samples in time.
//!
//! Rows are far denser in time than any vibration needs. Neighbouring rows of one frame are combined
//! by their information: this is the vertical extent of the shearlet (its low-pass along y), and it is
//! where the sensitivity comes from.

mod binner;
mod group;
mod ladder;
mod lateness;

pub use binner::Binner;
pub(crate) use binner::{Begin, RowShift};
pub use group::{BinnerError, Group, rows_per_sample};
pub(crate) use lateness::Lateness;

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

/// How a row's response falls off as the picture moves away from its reference, −q‴/q' of its phase-correlation function:
/// the mean square of the texture's wave numbers. A row that moves while it is exposed is smeared out and responds less in
/// the same measure, so a fast tone's amplitude needs it. Kept in 16 bits, to 0.4 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Curvature(u16);

impl Curvature {
    /// A texture of two pixels a period, 1/px²: none bends more.
    const MOST_PER_PX2: f32 = 9.8;

    /// From 1/px². What is no number, or below 0, is 0: nothing known, nothing corrected.
    pub fn of_per_px2(per_px2: f32) -> Self {
        let known = if per_px2 > 0.0 { per_px2 } else { 0.0 };
        Self(
            (known
                .min(Self::MOST_PER_PX2)
                .to_bits()
                .saturating_add(0x8000)
                >> 16) as u16,
        )
    }

    /// In 1/px², 0 to 9.8.
    pub fn per_px2(self) -> f32 {
        f32::from_bits(u32::from(self.0) << 16)
    }
}

/// Some neighbouring rows of one frame, combined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Frame number, as in [`crate::camera::Line`].
    pub frame: u32,
    /// Which group of rows: row / rows a sample. Samples of one slot share one unknown offset (their
    /// reference's own position).
    pub slot: u16,
    /// Of its rows; 0 where it is not known.
    pub curvature: Curvature,
    /// Middle of the exposure, weighted like the shift, ns on the camera's clock.
    pub time_ns: i64,
    /// Shift to the right against the reference, px.
    pub shift_px: f32,
    /// 1/variance of the shift, 1/px². Greater than 0.
    pub information_per_px2: f32,
    /// The times of its rows about `time_ns`.
    pub spread: Spread,
}
