//! `rowtone_calibrate`: any text as a calibration file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone_calibrate::Calibration;

/// What is accepted is a camera that can be, and is read as the same again.
fn read(text: &str) {
    let Ok(calibration) = Calibration::from_toml(text) else { return };
    assert!(calibration.line_time_s > 0.0 && calibration.line_time_s.is_finite());
    assert!(calibration.exposure_s.is_none_or(|s| s > -1e-9 && s.is_finite()));
    if let Ok(timing) = calibration.timing() {
        assert!(timing.line_time_ps() > 0 && timing.rows() > 0);
    }
    let again = Calibration::from_toml(&calibration.to_toml()).expect("what was written is read");
    // A figure that is none is unlike itself.
    assert_eq!(again.to_toml(), calibration.to_toml());
}

fuzz_target!(|data: &[u8]| {
    let Ok(text) = core::str::from_utf8(data) else { return };
    read(text);
    read(&format!("rows = 1080\nline_time_s = 1.89e-5\n{text}"));
});
