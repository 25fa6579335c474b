//! A camera as it is measured with: its options, checked against the recording.

use rowtone::camera::Timing;
use rowtone::report::Warnings;
use rowtone::tracker::Axes;

use super::{OptionError, Rect, Turn};

/// The camera of one recording: its options, checked against the file's header.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Times of the rows of a (turned) frame.
    pub timing: Timing,
    /// Usual frame rate, Hz.
    pub fps: f64,
    /// Bits of a pixel.
    pub bits: u8,
    /// Columns and rows of the turned picture.
    pub size: (usize, usize),
    /// The part to measure, in the turned picture; `None` leaves the choice to the program.
    pub part: Option<Rect>,
    /// The part that stands still, in the turned picture.
    pub background: Option<Rect>,
    /// How the picture is turned.
    pub turn: Turn,
    /// Along which axes of the turned picture motion is measured.
    pub axes: Axes,
    /// What every report on the recording warns of.
    pub warnings: Warnings,
    /// Scale, µm a pixel.
    pub um_per_px: Option<f64>,
    /// What is wrong with the options if the header is right about the picture's size, which shows only
    /// with the second frame.
    pub doubt: Option<OptionError>,
}

impl Camera {
    /// The part to measure. Where none was given, the whole picture, or with a background the largest
    /// part beside it.
    ///
    /// # Errors
    /// [`OptionError::AllBackground`] when the background leaves nothing to measure.
    pub fn part_or_rest(&self) -> Result<Rect, OptionError> {
        let (width, height) = self.size;
        match (self.part, self.background) {
            (Some(part), _) => Ok(part),
            (None, None) => Ok(Rect::whole(width, height)),
            (None, Some(background)) => background
                .largest_beside(width, height)
                .ok_or(OptionError::AllBackground),
        }
    }
}
