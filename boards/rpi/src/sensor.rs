//! What is known about the Raspberry Pi's sensors: a table to fall back on.
//!
//! Line times are line length / pixel rate of each mode's register table in Linux' drivers
//! (drivers/media/i2c/{ov5647,imx219,imx477,imx708}.c). They have changed between kernel versions, so a
//! line time read from the driver or calibrated comes first; the program warns when it uses this table.

/// One way to read a sensor out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMode {
    /// Sensor, as the driver names it.
    pub sensor: &'static str,
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// From one row to the next, ps.
    pub line_time_ps: u32,
    /// Fastest, Hz.
    pub max_fps: f32,
}

const fn mode(
    sensor: &'static str,
    size: (u16, u16),
    line_time_ps: u32,
    max_fps: f32,
) -> SensorMode {
    SensorMode {
        sensor,
        width: size.0,
        height: size.1,
        line_time_ps,
        max_fps,
    }
}

/// The table.
pub const MODES: [SensorMode; 15] = [
    mode("ov5647", (640, 480), 33_673_000, 58.9),
    mode("ov5647", (1296, 972), 23_216_000, 43.3),
    mode("ov5647", (1920, 1080), 29_583_000, 30.6),
    mode("ov5647", (2592, 1944), 32_503_000, 15.6),
    mode("imx219", (640, 480), 9_452_000, 206.7),
    mode("imx219", (1640, 1232), 18_904_000, 41.8),
    mode("imx219", (1920, 1080), 18_904_000, 47.6),
    mode("imx219", (3280, 2464), 18_904_000, 21.2),
    mode("imx477", (1332, 990), 7_933_000, 120.1),
    mode("imx477", (2028, 1080), 15_167_000, 50.0),
    mode("imx477", (2028, 1520), 15_167_000, 40.0),
    mode("imx477", (4056, 3040), 28_571_000, 10.0),
    mode("imx708", (1536, 864), 9_209_000, 120.1),
    mode("imx708", (2304, 1296), 13_361_000, 56.0),
    mode("imx708", (4608, 2592), 26_290_000, 14.4),
];

/// What the table says about a mode of the camera with this id (libcamera's ids hold the driver's name).
///
/// ```
/// use rowtone_rpi::sensor::lookup;
/// let mode = lookup("/base/soc/i2c0mux/i2c@1/imx477@1a", 1332, 990).unwrap();
/// assert_eq!(mode.line_time_ps, 7_933_000);
/// assert_eq!(lookup("virtual", 640, 480), None);
/// ```
pub fn lookup(camera_id: &str, width: u16, height: u16) -> Option<&'static SensorMode> {
    let id = camera_id.to_ascii_lowercase();
    MODES
        .iter()
        .find(|m| id.contains(m.sensor) && (m.width, m.height) == (width, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_reads_its_rows_within_its_frame() {
        for m in MODES {
            let readout_s = f64::from(m.height) * f64::from(m.line_time_ps) * 1e-12;
            let blank = 1.0 - readout_s * f64::from(m.max_fps);
            assert!((0.0..0.2).contains(&blank), "{m:?}: blank {blank}");
        }
    }
}
