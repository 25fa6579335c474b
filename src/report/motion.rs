//! How a tone moves the object: along which axes, in which phase, and whether all rows alike.

use heapless::Vec;

/// Rows of a [`PeakShape`].
pub const SHAPE_ROWS: usize = 9;

/// Most shapes kept of one window.
pub const MAX_SHAPES: usize = 8;

/// What a [`super::Peak`] does along both axes, at the row where it moves most. Wires of version 1 do not carry it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Zero-to-peak amplitude along the rows, px; `None` where the texture cannot tell.
    pub x_px: Option<f32>,
    /// Standard deviation of `x_px`, px.
    pub x_px_sd: Option<f32>,
    /// Zero-to-peak amplitude along the columns, px; `None` where it was not measured or the texture cannot tell.
    pub y_px: Option<f32>,
    /// Standard deviation of `y_px`, px.
    pub y_px_sd: Option<f32>,
    /// Phase of x, −π to π rad: x is `x_px`·sin(2πf·t + phase), t from the start of the recording's first frame, x positive
    /// to the right. Where the texture tells the motion in one direction only, the phase of that.
    pub phase_rad: f32,
    /// Phase of y in the same way, y positive downwards.
    pub y_phase_rad: Option<f32>,
    /// Where all edges lean one way: the direction across them, along which the amplitude was measured, rad from the right
    /// downwards, −π/2 to π/2. Then there are neither x nor y.
    pub across_rad: Option<f32>,
    /// All rows move alike, as far as they tell.
    pub rigid: bool,
    /// It was struck within the window, and its amplitude, which is that at the stroke, falls to 1/e in so long, s.
    pub decay_s: Option<f32>,
    /// How fast its frequency rises, Hz/s, where it changes within the window; the peak's is that in the window's middle.
    pub hz_per_s: Option<f32>,
    /// Its amplitude or its phase swings faster than the window is long: what would be sidebands of it.
    pub modulation: Option<Modulation>,
    /// Its frequency wanders within the window: the peak's is the centroid of several lines, its amplitude the root of the
    /// sum of their squares, and this their root mean square distance from the centroid, Hz.
    pub spread_hz: Option<f32>,
}

impl Motion {
    /// A rigid motion of a steady tone, of which neither axis is known and the phase is 0 rad.
    pub const STEADY: Self = Self {
        x_px: None,
        x_px_sd: None,
        y_px: None,
        y_px_sd: None,
        phase_rad: 0.0,
        y_phase_rad: None,
        across_rad: None,
        rigid: true,
        decay_s: None,
        hz_per_s: None,
        modulation: None,
        spread_hz: None,
    };
}

/// How a tone's amplitude or phase swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modulation {
    /// How often a second, Hz.
    pub hz: f32,
    /// By which share of the mean amplitude either way, 0 to 1; of a phase, by how many rad.
    pub depth: f32,
    /// It is the phase that swings, not the amplitude.
    pub of_phase: bool,
}

/// How a peak's motion runs over the rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PeakShape {
    /// Frequency of the peak, Hz: equal to [`super::Peak::hz`].
    pub hz: f32,
    /// Amplitudes at rows from the first that knows something to the last.
    pub rows: Vec<ShapeRow, SHAPE_ROWS>,
}

/// A tone's motion at one row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShapeRow {
    /// Row, counted in the part that is measured.
    pub row: u16,
    /// Zero-to-peak amplitude along the rows, px.
    pub x_px: f32,
    /// Phase of x, as [`Motion::phase_rad`].
    pub x_phase_rad: f32,
    /// Zero-to-peak amplitude along the columns, px; 0 where nothing is known of it.
    pub y_px: f32,
    /// Phase of y, as [`Motion::phase_rad`].
    pub y_phase_rad: f32,
}
