//! Calibration files: what `rowtone calibrate` found out about a camera, as TOML.

use std::path::Path;

use crate::failure::Failure;

/// Reads `line_time_s` from a calibration file; other keys are left to whom they concern.
///
/// # Errors
/// [`Failure::Input`] when the file cannot be read or has no usable `line_time_s`.
pub(super) fn line_time_s(path: &Path) -> Result<f64, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Failure::input(format!("{name}: cannot be read: {e}")))?;
    text.lines()
        .filter_map(|line| line.split('#').next())
        .filter_map(|line| line.split_once('='))
        .find(|(key, _)| key.trim() == "line_time_s")
        .and_then(|(_, value)| value.trim().parse().ok())
        .filter(|s: &f64| s.is_finite() && *s > 0.0)
        .ok_or_else(|| {
            Failure::input(format!(
                "{name}: no usable line_time_s in it: make it with `rowtone calibrate`"
            ))
        })
}
