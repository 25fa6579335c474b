//! What is known about the Raspberry Pi's sensors: a table to fall back on.
//!
//! A line takes line length / pixel rate, and a frame has at least so many lines. Both stand in each driver's mode
//! tables (Linux, also Raspberry Pi's: drivers/media/i2c/{ov5647,imx219,imx477,imx708}.c; all rows below were read
//! there). They differ between kernel versions, most of all where pixels are binned, so every mode lists what was
//! found, and the camera's own shortest frame tells which of them holds. A line time read from the driver or
//! calibrated comes first; the program warns when it uses this table.

/// One way in which a kernel sets a mode up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineClock {
    /// Pixel clocks from one row to the next.
    pub line_length: u32,
    /// Pixel clock, Hz.
    pub pixel_rate_hz: u32,
}

impl LineClock {
    /// From one row to the next, s.
    pub fn line_time_s(self) -> f64 {
        f64::from(self.line_length) / f64::from(self.pixel_rate_hz)
    }
}

const fn clock(line_length: u32, pixel_rate_hz: u32) -> LineClock {
    LineClock {
        line_length,
        pixel_rate_hz,
    }
}

/// One way to read a sensor out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorMode {
    /// Sensor, as the driver names it.
    pub sensor: &'static str,
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Lines of the shortest frame, blank ones counted.
    pub frame_lines: u16,
    /// As kernels have it; the first is taken where nothing tells them apart.
    pub clocks: &'static [LineClock],
}

const fn mode(
    sensor: &'static str,
    (width, height): (u16, u16),
    frame_lines: u16,
    clocks: &'static [LineClock],
) -> SensorMode {
    SensorMode {
        sensor,
        width,
        height,
        frame_lines,
        clocks,
    }
}

/// Every mode of the 840 MHz IMX477, its frame lines from the driver's shortest frame time.
const IMX477: u32 = 840_000_000;

/// The table.
pub const MODES: [SensorMode; 16] = [
    // 24 blank lines. The PLL makes 58.333 MHz; kernels before that was mended say 55 MHz, see `mended_pixel_rate`.
    mode("ov5647", (640, 480), 504, &[clock(1852, 58_333_000)]),
    // The PLL was raised late in 2025.
    mode(
        "ov5647",
        (1296, 972),
        996,
        &[clock(1896, 81_666_700), clock(1896, 87_500_000)],
    ),
    mode(
        "ov5647",
        (1920, 1080),
        1104,
        &[clock(2416, 81_666_700), clock(2416, 87_500_000)],
    ),
    mode("ov5647", (2592, 1944), 1968, &[clock(2844, 87_500_000)]),
    // 32 blank lines. Analogue binning reads two rows in one line time: drivers say so by twice the pixel rate. The
    // shortest line was 3448, then 3560 where that is binned; drivers without analogue binning read row by row.
    mode(
        "imx219",
        (640, 480),
        512,
        &[
            clock(3560, 364_800_000),
            clock(3448, 364_800_000),
            clock(3448, 182_400_000),
        ],
    ),
    mode(
        "imx219",
        (1640, 1232),
        1264,
        &[
            clock(3560, 364_800_000),
            clock(3448, 364_800_000),
            clock(3448, 182_400_000),
        ],
    ),
    mode("imx219", (1920, 1080), 1112, &[clock(3448, 182_400_000)]),
    mode("imx219", (3280, 2464), 2496, &[clock(3448, 182_400_000)]),
    mode("imx477", (1012, 760), 1342, &[clock(5216, IMX477)]), // older kernels, instead of the next
    mode("imx477", (1332, 990), 1050, &[clock(6664, IMX477)]),
    mode("imx477", (2028, 1080), 1318, &[clock(12_740, IMX477)]),
    mode("imx477", (2028, 1520), 1648, &[clock(12_740, IMX477)]),
    mode("imx477", (4056, 3040), 3500, &[clock(24_000, IMX477)]),
    // Without HDR, which this program never asks for.
    mode("imx708", (1536, 864), 904, &[clock(5216, 566_400_000)]),
    mode("imx708", (2304, 1296), 1336, &[clock(7824, 585_600_000)]),
    mode("imx708", (4608, 2592), 2650, &[clock(15_648, 595_200_000)]),
];

impl SensorMode {
    /// From one row to the next, s, and whether it is certain: the camera's shortest frame is exactly as long as the
    /// mode's lines then take, or every kernel has the same.
    pub fn line_time_s(&self, shortest_frame_s: Option<f64>) -> (f64, bool) {
        let fits = |clock: &&LineClock| {
            let frame_s = clock.line_time_s() * f64::from(self.frame_lines);
            shortest_frame_s.is_some_and(|s| (s / frame_s - 1.0).abs() < 1e-3)
        };
        let fitting = self.clocks.iter().find(fits);
        let first = self.clocks.first().copied().unwrap_or(clock(1, 1));
        (
            fitting.copied().unwrap_or(first).line_time_s(),
            fitting.is_some(),
        )
    }

    /// Fastest, Hz, with rows that far apart.
    pub fn max_fps(&self, line_time_s: f64) -> f64 {
        1.0 / (line_time_s * f64::from(self.frame_lines))
    }
}

/// What the table says about a mode of the camera with this id (libcamera's ids hold the driver's name).
///
/// ```
/// use rowtone_rpi::sensor::lookup;
/// let mode = lookup("/base/soc/i2c0mux/i2c@1/imx477@1a", 1332, 990).unwrap();
/// assert!((mode.line_time_s(None).0 - 7.9333e-6).abs() < 1e-10);
/// assert_eq!(lookup("virtual", 640, 480), None);
/// ```
pub fn lookup(camera_id: &str, width: u16, height: u16) -> Option<&'static SensorMode> {
    let id = camera_id.to_ascii_lowercase();
    MODES
        .iter()
        .find(|m| id.contains(m.sensor) && (m.width, m.height) == (width, height))
}

/// The pixel rate where the driver is known to state a wrong one, Hz.
///
/// The OV5647's 640x480 registers make 58.333 MHz (multiplier 70 where 105 makes 87.5 MHz), and drivers said 55 MHz
/// until Linux commit c063632b494b: their line time was 6 % too long.
pub fn mended_pixel_rate_hz(driver: &str, stated_hz: i64) -> Option<i64> {
    (driver == "ov5647" && stated_hz == 55_000_000).then_some(58_333_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_reads_its_rows_within_its_frame() {
        for m in MODES {
            assert!(m.frame_lines > m.height && !m.clocks.is_empty(), "{m:?}");
            for clock in m.clocks {
                assert!(clock.line_length > m.width.into(), "{m:?}");
                assert!((5e-6..40e-6).contains(&clock.line_time_s()), "{m:?}");
            }
        }
    }

    fn printed(fps: f64) -> f64 {
        1e6 / (1e6 / fps).floor()
    }

    /// Frame rates that `rpicam-hello --list-cameras` prints on Raspberry Pi OS (libcamera cuts frame times to whole us).
    #[test]
    fn the_fastest_frame_rates_are_those_that_are_advertised() {
        for (id, size, fps) in [
            ("ov5647", (1296, 972), 43.25),
            ("ov5647", (2592, 1944), 15.63),
            ("imx219", (1920, 1080), 47.57),
            ("imx219", (3280, 2464), 21.19),
            ("imx477", (1332, 990), 120.05),
            ("imx477", (2028, 1080), 50.03),
            ("imx477", (2028, 1520), 40.01),
            ("imx477", (4056, 3040), 10.00),
            ("imx708", (1536, 864), 120.13),
            ("imx708", (2304, 1296), 56.03),
            ("imx708", (4608, 2592), 14.35),
        ] {
            let mode = lookup(id, size.0, size.1).unwrap();
            let (line_time_s, _) = mode.line_time_s(None);
            let found = printed(mode.max_fps(line_time_s));
            assert!((found - fps).abs() < 0.006, "{id} {size:?}: {found}");
        }
        for (size, index, fps) in [
            ((640, 480), 1, 206.65),
            ((640, 480), 2, 103.33),
            ((1640, 1232), 1, 83.70),
            ((1640, 1232), 2, 41.85),
        ] {
            let mode = lookup("imx219", size.0, size.1).unwrap();
            let found = printed(mode.max_fps(mode.clocks[index].line_time_s()));
            assert!((found - fps).abs() < 0.006, "{size:?}: {found}");
        }
    }

    #[test]
    fn the_shortest_frame_tells_kernels_apart() {
        let mode = lookup("imx219", 640, 480).unwrap();
        for (frame_us, line_us, certain) in [
            (4997.0, 9.7588, true), // 512 lines of 3560 / 364.8 MHz, as libcamera states it in whole us
            (4839.0, 9.4518, true), // 3448 / 364.8 MHz
            (9679.0, 18.9035, true), // row by row
            (5100.0, 9.7588, false), // nothing of ours
        ] {
            let (line_time_s, sure) = mode.line_time_s(Some(frame_us * 1e-6));
            assert!((line_time_s * 1e6 - line_us).abs() < 1e-4, "{line_time_s}");
            assert_eq!(sure, certain, "{frame_us}");
        }
        assert!(!mode.line_time_s(None).1);
    }

    #[test]
    fn only_the_known_error_is_mended() {
        assert_eq!(mended_pixel_rate_hz("ov5647", 55_000_000), Some(58_333_000));
        assert_eq!(mended_pixel_rate_hz("ov5647", 58_333_000), None);
        assert_eq!(mended_pixel_rate_hz("imx219", 55_000_000), None);
    }
}
