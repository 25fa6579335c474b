//! Broad-band measures of a window: what ISO 20816-1 asks for of the motion, from all of it and not from its peaks.

/// One figure, with how sure it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// Its most likely value, 0 or greater; 0 where nothing stands out of the noise.
    pub value: f32,
    /// Standard deviation of the value, of what was taken into it.
    pub sd: f32,
    /// It is no more than this: the value, two standard deviations, and what may hide in the noise of the whole band.
    pub at_most: f32,
}

impl Figure {
    /// The camera's noise could hide as much as there is: only [`Figure::at_most`] is sure.
    pub fn is_limit(&self) -> bool {
        self.value < 0.5 * self.at_most
    }

    /// The same in another unit, so many of it a unit of this.
    #[must_use]
    pub fn scaled(&self, by: f32) -> Self {
        Self {
            value: self.value * by,
            sd: self.sd * by,
            at_most: self.at_most * by,
        }
    }
}

/// Broad-band measures along one axis, or of both as a vector. `None` where the camera cannot know.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Velocity from 10 Hz on, px/s RMS.
    pub velocity_px_s: Option<Figure>,
    /// Velocity from 2 Hz on, px/s RMS: of slow machines. `None` in windows shorter than 0.5 s.
    pub velocity_from_2_hz_px_s: Option<Figure>,
    /// Displacement from 10 Hz on, px RMS.
    pub displacement_px: Option<Figure>,
    /// Displacement from 10 Hz on, from its lowest to its highest value, px. Of both axes √(x² + y²) of theirs.
    pub peak_to_peak_px: Option<Figure>,
    /// Acceleration from 10 Hz on, px/s² RMS.
    pub acceleration_px_s2: Option<Figure>,
    /// Largest displacement over its RMS: √2 of a tone. Of both axes, of the distance.
    pub crest_factor: Option<Figure>,
    /// Fourth moment of the displacement over the square of its second: 3 of random vibration, 1.5 of a tone. `None` of
    /// a vector, which has none.
    pub kurtosis: Option<Figure>,
}

/// Broad-band measures of a window, up to 1000 Hz or as far as the camera knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BroadBand {
    /// Up to which frequency the figures are complete, Hz: 1000, or less where samples lie too far apart or the exposure is
    /// too long.
    pub known_to_hz: f32,
    /// Along the rows, or across the edges where all of them lean one way.
    pub x: Option<Measures>,
    /// Along the columns; `None` where it is not measured.
    pub y: Option<Measures>,
    /// Of all that is measured, as a vector.
    pub sum: Measures,
}

/// Where the band of these measures begins, Hz.
pub const FROM_HZ: f32 = 10.0;

/// Where the band of slow machines begins, Hz.
pub const SLOW_FROM_HZ: f32 = 2.0;

/// Where the band ends, Hz.
pub const TO_HZ: f32 = 1000.0;
