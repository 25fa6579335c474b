//! Displacements of rows become samples in time.
//!
//! Rows are far denser in time than any vibration needs. Neighbouring rows of one frame are combined
//! by their information: this is the vertical extent of the shearlet (its low-pass along y), and it is
//! where the sensitivity comes from.

mod binner;
mod group;
mod ladder;
mod lateness;
mod open;
mod tally;
mod vertical;

pub use binner::Binner;
pub use group::{BinnerError, Group, rows_per_sample};
pub(crate) use lateness::Lateness;
pub(crate) use open::{Begin, RowShift};
pub use tally::Tally;

/// How far one row is shifted against its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// Frame number, as in [`crate::camera::Line`].
    pub frame: u32,
    /// Row, as in [`crate::camera::Line`].
    pub row: u16,
    /// Middle of the row's exposure, ns on the camera's clock.
    pub time_ns: i64,
    /// Shift against the reference, px: to the right, x, where the tracker measures along the rows alone; x +
    /// [`coupling`](Vertical::coupling)·y where it measures along both axes.
    pub shift_px: f32,
    /// What the row knows of that shift: 1/variance, 1/px². Greater than 0 where there is no `vertical`; with one it may
    /// be 0, of a row whose edges all lie along it.
    pub information_per_px2: f32,
    /// What it knows besides where the tracker measures along both axes.
    pub vertical: Option<Vertical>,
}

/// The second of two measurements of a motion (x, y) along the rows and the columns, y downwards, made of a row or a
/// group of rows.
///
/// Two measurements whose noise is independent say all that a row's score s and its information J, a 2x2 matrix, say
/// of the motion. They follow from the Cholesky factor of J:
///
/// ```text
/// shift_px          = s_x/J_xx            = x + κ·y    with information J_xx,             κ = J_xy/J_xx,
/// vertical.shift_px = (s_y − κ·s_x)/J_yy' = y          with information J_yy' = J_yy − J_xy²/J_xx.
/// ```
///
/// Where all edges of a row lean one way J is singular (the aperture problem): then the second measurement knows next to
/// nothing, and the first one tells the motion across the edges, whose direction is (1, κ). Rows complement each other, so
/// nothing is inverted before the J of many have been added up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertical {
    /// Shift downwards against the reference, px; 0 where the information is 0.
    pub shift_px: f32,
    /// 1/variance of that shift, 1/px²; 0 or greater.
    pub information_per_px2: f32,
    /// κ: how much of a shift downwards the first measurement takes for one to the right. A constant of the row while the
    /// picture moves by less than half a row; beyond, that of the row of the reference that is seen.
    pub coupling: f32,
    /// Of a group whose rows differ in κ: what the first measurement takes of the speed downwards, ns; it is
    /// x + κ·y + coupling_delay·ẏ at the time of the sample. 0 of a single row; the same in every frame, like κ.
    pub coupling_delay_ns: f32,
    /// The second measurement is y + delay·ẏ + J_xx/J_yy'·coupling_delay·ẋ at that time, ns.
    pub delay_ns: f32,
}

impl Vertical {
    /// The motion (x, y), px, and its covariance (var x, cov xy, var y), px², of both measurements together; `None` where
    /// one of them knows nothing.
    pub fn solve(&self, shift_px: f32, information_per_px2: f32) -> Option<Planar> {
        let known = information_per_px2 > 0.0 && self.information_per_px2 > 0.0;
        let (k, var_y) = (self.coupling, 1.0 / self.information_per_px2);
        let planar = Planar {
            px: [shift_px - k * self.shift_px, self.shift_px],
            covariance_px2: [1.0 / information_per_px2 + k * k * var_y, -k * var_y, var_y],
        };
        let mut all = planar.px.iter().chain(&planar.covariance_px2);
        (known && all.all(|v| v.is_finite())).then_some(planar)
    }
}

/// A motion along both axes and what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planar {
    /// To the right and downwards, px.
    pub px: [f32; 2],
    /// Variance of x, covariance, variance of y, px².
    pub covariance_px2: [f32; 3],
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
    pub(crate) fn per_px2(self) -> f32 {
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
    /// Shift against the reference, px: to the right, x, or x + [`coupling`](Vertical::coupling)·y where there is a
    /// `vertical`.
    pub shift_px: f32,
    /// 1/variance of that shift, 1/px². Greater than 0 where there is no `vertical`; with one it may be 0.
    pub information_per_px2: f32,
    /// What its rows know besides where the tracker measures along both axes.
    pub vertical: Option<Vertical>,
    /// The times of its rows about `time_ns`.
    pub spread: Spread,
}
