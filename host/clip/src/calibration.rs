//! What `rowtone calibrate` found out about a camera, as the camera options take it.

use std::path::Path;

use rowtone_calibrate::{Calibration, file::RollingName};

use super::ClipError;

/// What a calibration file says about the timing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Calibrated {
    /// Time from one row to the next, s.
    pub(super) line_time_s: f64,
    /// Exposure of a row, s, where it was measured.
    pub(super) exposure_s: Option<f64>,
    /// The last row is read first.
    pub(super) upward: bool,
}

/// Reads a calibration file.
///
/// # Errors
/// [`ClipError::Calibration`] when it cannot be read or used.
pub(super) fn read(path: &Path) -> Result<Calibrated, ClipError> {
    let calibration = Calibration::read(path).map_err(|why| ClipError::Calibration {
        path: path.display().to_string(),
        why,
    })?;
    Ok(Calibrated {
        line_time_s: calibration.line_time_s,
        exposure_s: calibration.exposure_s,
        upward: calibration.rolling == Some(RollingName::Up),
    })
}
