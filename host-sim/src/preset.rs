//! Sensors by name.

use std::fmt;
use std::str::FromStr;

use super::config::Sensor;

/// A sensor and mode that people have.
///
/// Sizes, line times and frame rates are those of the Linux drivers and of measurements (the table
/// in docs); full wells and read noises are typical of the pixel sizes, not from data sheets, and
/// stand for 8-bit luma with little processing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// OV5647 (Raspberry Pi Camera 1), 640x480, binned.
    Ov5647,
    /// IMX219 (Camera 2), 1920x1080.
    Imx219Hd,
    /// IMX219 (Camera 2), 640x480, binned.
    Imx219Vga,
    /// IMX477 (HQ Camera), 1332x990, binned.
    Imx477,
    /// IMX708 (Camera 3), 1536x864, binned.
    Imx708,
    /// HM01B0, 320x240, the microcontroller's camera.
    Hm01b0,
    /// The camera of the thesis: 1040x1048 at 120 frames a second.
    Thesis,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Ov5647,
        Self::Imx219Hd,
        Self::Imx219Vga,
        Self::Imx477,
        Self::Imx708,
        Self::Hm01b0,
        Self::Thesis,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ov5647 => "ov5647",
            Self::Imx219Hd => "imx219-1080p",
            Self::Imx219Vga => "imx219-480p",
            Self::Imx477 => "imx477",
            Self::Imx708 => "imx708",
            Self::Hm01b0 => "hm01b0",
            Self::Thesis => "thesis",
        }
    }

    /// Its sensor, at full frame rate, exposed for 0.5 ms (1 ms for the slow HM01B0).
    pub fn sensor(self) -> Sensor {
        let (cols, rows, fps, line_time_ps, exposure_ns, full_well_e, read_noise_e) = match self {
            Self::Ov5647 => (640, 480, 58.9, 33_670_000, 500_000, 8_000.0, 12.0),
            Self::Imx219Hd => (1920, 1080, 47.6, 18_900_000, 500_000, 4_500.0, 6.0),
            Self::Imx219Vga => (640, 480, 206.7, 9_450_000, 500_000, 9_000.0, 8.0),
            Self::Imx477 => (1332, 990, 120.1, 7_930_000, 500_000, 16_000.0, 8.0),
            Self::Imx708 => (1536, 864, 120.1, 9_210_000, 500_000, 12_000.0, 8.0),
            Self::Hm01b0 => (320, 240, 45.0, 75_000_000, 1_000_000, 8_000.0, 25.0),
            Self::Thesis => (1040, 1048, 120.0, 7_700_000, 500_000, 10_000.0, 15.0),
        };
        Sensor {
            cols,
            rows,
            fps,
            line_time_ps,
            exposure_ns,
            bits: 8,
            full_well_e,
            read_noise_e,
            bottom_up: false,
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|p| p.name() == s)
            .ok_or_else(|| {
                let names: Vec<&str> = Self::ALL.iter().map(|p| p.name()).collect();
                format!(
                    "no sensor preset is called that; there are {}",
                    names.join(", ")
                )
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn every_preset_is_a_possible_camera_and_is_found_by_its_name() {
        for preset in Preset::ALL {
            let config = Config {
                sensor: preset.sensor(),
                ..Config::default()
            };
            config.check().unwrap_or_else(|e| panic!("{preset}: {e}"));
            assert_eq!(preset.name().parse(), Ok(preset));
        }
        assert!("imx999".parse::<Preset>().is_err());
    }
}
