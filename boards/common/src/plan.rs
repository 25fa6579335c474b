//! What settings and a camera's timing mean for the core.

use rowtone::camera::Timing;
use rowtone::link::settings::{Region, Settings};
use rowtone::spectrum;
use rowtone::timeline::Group;
use rowtone::tracker;

use crate::cut::Cut;
use crate::memory::{COLUMNS_PER_LINE, MAX_PASSES, rows_per_sample};

/// How a camera is timed, as the board knows or measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraTiming {
    /// From the start of one row's exposure to the next, ps.
    pub line_time_ps: u32,
    /// How long a row is exposed, ns.
    pub exposure_ns: u32,
    /// From one frame to the next, ns, above 0.
    pub frame_ns: u64,
}

/// All that the core is configured by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// The part of the picture, and its timing.
    pub cut: Cut,
    /// Rows that make a sample.
    pub group: Group,
    /// What is looked for.
    pub spectrum: spectrum::Config,
}

impl Plan {
    /// From settings that were checked against the board's limits; `whole` is the whole picture. `None`
    /// when the timing is beyond what the core takes.
    pub fn new(settings: &Settings, whole: Region, camera: &CameraTiming) -> Option<Self> {
        let part = settings.roi.unwrap_or(whole);
        let timing = Timing::new(camera.line_time_ps, camera.exposure_ns, part.height).ok()?;
        let spectrum = spectrum_config(settings);
        let window_ns = u64::try_from(spectrum.window_ns).ok()?;
        let frames = u32::try_from(window_ns.checked_div(camera.frame_ns)? + 1).ok()?;
        let group = Group::new(timing, rows_per_sample(timing, frames)).ok()?;
        Some(Self {
            cut: Cut { part, timing },
            group,
            spectrum,
        })
    }

    /// For the tracker: what a line may cost is bounded.
    pub fn tracker(&self) -> tracker::Config {
        tracker::Config {
            columns_per_line: COLUMNS_PER_LINE,
            ..tracker::Config::new(self.cut.timing, self.cut.part.width)
        }
    }
}

/// The settings that concern the spectrum, with as many passes as a hop has time for.
pub fn spectrum_config(settings: &Settings) -> spectrum::Config {
    spectrum::Config {
        max_passes: MAX_PASSES,
        // All that the wires of version 1 carry of these is the velocity, where there is a scale.
        broad_band: settings.um_per_px.is_some(),
        ..settings.spectrum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: Region = Region {
        x: 0,
        y: 0,
        width: 320,
        height: 240,
    };

    #[test]
    fn a_part_of_the_picture_has_its_own_timing_and_tracker() {
        let part = Region {
            x: 10,
            y: 20,
            width: 64,
            height: 100,
        };
        let settings = Settings {
            roi: Some(part),
            ..Settings::DEFAULT
        };
        let camera = CameraTiming {
            line_time_ps: 67_200_000,
            exposure_ns: 500_000,
            frame_ns: 17_472_000,
        };
        let plan = Plan::new(&settings, WHOLE, &camera).unwrap();
        let tracker = plan.tracker();
        assert_eq!((tracker.rows, tracker.width), (100, 64));
        assert_eq!(plan.cut.timing.rows(), 100);
        assert_eq!(plan.spectrum.check(), Ok(()));
    }

    #[test]
    fn impossible_timing_is_no_plan() {
        let camera = CameraTiming {
            line_time_ps: 67_200_000,
            exposure_ns: 0,
            frame_ns: 0,
        };
        assert!(Plan::new(&Settings::DEFAULT, WHOLE, &camera).is_none());
        let no_rows = Region { height: 0, ..WHOLE };
        let camera = CameraTiming {
            frame_ns: 17_472_000,
            ..camera
        };
        assert!(Plan::new(&Settings::DEFAULT, no_rows, &camera).is_none());
    }
}
